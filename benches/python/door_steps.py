"""How much of the door task depends on the time step and the integrator.

    python benches/python/door_steps.py [--supple PROGRAM]

tasks/iiwa_door.toml is evaluated over the same 0.125 s with other time steps, at four stiffnesses of its gripper. What the
file gives by step is scaled to stay the same by time: stage weights and process noise grow with the time step, the
variance of a measurement falls with it. The reference is the semi-implicit integrator at a quarter of the file's time
step. `sum` is what the rectangle rule of the longer step alone adds to the cost: half of its first stage less half of
that of the reference.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
from pathlib import Path

from supple_program import ROOT, find_program

STEPS, TIME_STEP = 500, 2.5e-4
STIFFNESSES = (1e6, 1e5, 1e4, 1e3)
# Integrators with factors of the time step; the first is the reference.
VARIANTS = (("semi_implicit", 0.25), ("semi_implicit", 1.0), ("implicit", 0.25), ("implicit", 1.0), ("implicit", 10.0))
# Weight of the door's angle in a stage, 1/rad^2, and how far from its target it starts, rad.
DOOR = 15.0 * 0.33**2


def variant(text: str, integrator: str, factor: float) -> str:
    """The task file with another integrator and another time step."""

    def scaled(pattern: str, power: int) -> None:
        nonlocal text
        text, count = re.subn(pattern, lambda found: f"{found[1]}{float(found[2]) * factor**power!r}", text)
        assert count > 0, pattern

    text = text.replace("../models", str(ROOT / "models")).replace('"semi_implicit"', f'"{integrator}"')
    text = text.replace(f"steps = {STEPS}", f"steps = {round(STEPS / factor)}")
    scaled(r"(time_step = )([\d.e-]+)", 1)
    scaled(r"(\nweight = )([\d.e-]+)", 1)
    scaled(r"(\nvariance = )([\d.e-]+)", -1)
    scaled(r"(process = \{ \"q\.\*\" = )([\d.e-]+)", 1)
    scaled(r"(process = .*\"v\.\*\" = )([\d.e-]+)", 1)
    return text


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--supple", metavar="PROGRAM", help="the program; default: $SUPPLE, target/release, or PATH")
    program = find_program(parser.parse_args().supple)
    text = (ROOT / "tasks" / "iiwa_door.toml").read_text()
    print(f"{'N/m':>8} {'integrator':14} {'step, s':>9}   task    cost            of it sum   bits")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "door.toml"
        for stiffness in STIFFNESSES:
            reference: dict[str, tuple[float, float]] = {}
            for integrator, factor in VARIANTS:
                file.write_text(variant(text, integrator, factor))
                given = [f"--set=k{i}={stiffness!r}" for i in (1, 2, 3)]
                run = subprocess.run([program, "evaluate", file, "--json", *given], capture_output=True, text=True)
                if not run.stdout:
                    raise SystemExit(run.stderr)
                for task in json.loads(run.stdout)["tasks"]:
                    cost, bits = task["cost"]["expected"], task["information"]["total_bits"]
                    cost_0, bits_0 = reference.setdefault(task["name"], (cost, bits))
                    summed = 0.5 * (factor - VARIANTS[0][1]) * DOOR
                    print(
                        f"{stiffness:8.0e} {integrator:14} {factor * TIME_STEP:9.3g}   {task['name']:6}"
                        f" {cost:8.3f} {100 * (cost / cost_0 - 1):+6.2f} % {100 * summed / cost_0:+7.2f} %"
                        f" {bits:10.2f} {100 * (bits / bits_0 - 1):+6.2f} %"
                    )


if __name__ == "__main__":
    main()
