"""Tables of docs/validation.md: every shipped robot in closed loop on MuJoCo, at the start and at the optimum.

    pip install . mujoco && python benches/python/validation.py [--rollouts 200] [--only NAME,..] \
        [--tables robots|errors|both] [--json FILE]

The first table has the robots as they are, with supple's law of contact and with MuJoCo's. The second one has robots whose
numbers are others than supple believes: how much more they cost than the same design on the robot as it is, and which
share of the roll-outs ends well.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import supple
from supple.validation import SampledLoop, TaskValidation, Validation

ROOT = Path(__file__).parents[2]
ROBOTS = ("elastic_elbow", "iiwa_door", "peg_on_wall", "soft_gripper", "wiping_arm")
#: Numbers of MuJoCo's robot that are others than supple believes.
ERRORS: tuple[dict[str, float], ...] = (
    {"contact.stiffness": 0.5},
    {"contact.stiffness": 2.0},
    {"mass": 1.2},
    {"friction": 2.0},
    {"damping": 0.5},
    {"stiffness": 0.8},
)


def interval(mean: float | None, span: Any) -> str:
    """A mean with half the width of its interval."""
    if mean is None or not np.isfinite(mean):
        return "diverged"
    half = 0.5 * (span[1] - span[0])
    digits = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0.0 else 3
    return f"{mean:.{digits}f} ± {half:.{digits}f}"


def shares(loop: SampledLoop) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in loop.touched.items()) or "none"


def consistency(loop: SampledLoop) -> str:
    found = loop.consistency
    return "diverged" if found is None else f"{found.mean:.3f} ± {found.upper_95 - 1.0:.3f}"


def row(file: str, at: str, where: str, task: TaskValidation, loop: SampledLoop) -> str:
    cells = [f"{file}: {task.name}", at, where, f"{task.predicted_cost:.4g}"]
    cells += [interval(loop.cost_mean, loop.cost_interval_95), f"{task.predicted_bits:.4g}"]
    cells += [interval(loop.realised_bits, loop.realised_bits_interval_95), consistency(loop), shares(loop)]
    cells += [f"{loop.ends_well:.1%}", str(loop.diverged)]
    return "| " + " | ".join(cells) + " |"


def as_they_are(file: str, found: dict[tuple[str, str], Validation]) -> list[str]:
    rows = []
    for at in ("start", "optimum"):
        same = found[at, "same"]
        for name, task in same.tasks.items():
            rows.append(row(file, at, "supple", task, task.supple))
            rows.append(row(file, at, f"MuJoCo, {task.mujoco_steps} steps", task, task.mujoco))
            if task.mujoco.touched:
                other = found[at, "mujoco"].tasks[name]
                rows.append(row(file, at, "MuJoCo and its contacts", other, other.mujoco))
    return rows


def with_errors(file: str, plain: Validation, found: list[Validation]) -> list[str]:
    rows = []
    for one in found:
        (error,) = one.vary.items()
        for name, task in one.tasks.items():
            base, loop = plain.tasks[name].mujoco, task.mujoco
            more = loop.cost_mean / base.cost_mean - 1.0
            cells = [f"{file}: {name}", f"{error[0]} x {error[1]:g}", one.at]
            cells += [f"{more:+.1%}" if np.isfinite(more) else f"{loop.diverged} of {one.rollouts} diverged"]
            cells += [f"{base.ends_well:.1%}", f"{loop.ends_well:.1%}", consistency(loop)]
            rows.append("| " + " | ".join(cells) + " |")
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rollouts", type=int, default=200)
    parser.add_argument("--only", default=",".join(ROBOTS))
    parser.add_argument("--tables", choices=["robots", "errors", "both"], default="both")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    first = [
        "| Task | Design | Plant | Predicted cost | Cost | Predicted bits | Bits | Consistency | Touched | Ends well | Diverged |"
    ]
    first.append("|" + "---|" * 11)
    second = ["| Task | Error | Design | Cost | Ends well without | with | Consistency |", "|" + "---|" * 7]
    kept = []
    for file in given.only.split(","):
        began = time.perf_counter()
        task = supple.load(ROOT / "tasks" / f"{file}.toml")
        design = task.design()
        presses = any(report.contacts for report in design.tasks.values())
        rubs = "\nfriction = " in (ROOT / "tasks" / f"{file}.toml").read_text(encoding="utf-8")
        found: dict[tuple[str, str], Validation] = {}
        errors = []
        for at in ("start", "optimum"):
            for contact in ("same", "mujoco") if presses and given.tables != "errors" else ("same",):
                found[at, contact] = supple.mujoco.validate(design, given.rollouts, contact, at=at)
            for vary in ERRORS if given.tables != "robots" else ():
                of_contacts = any(name.startswith("contact") for name in vary)
                if (presses or not of_contacts) and (rubs or "friction" not in vary):
                    errors.append(supple.mujoco.validate(design, given.rollouts, vary=vary, at=at))
        if given.tables != "errors":
            first += as_they_are(file, found)
        second += [
            line
            for at in ("start", "optimum")
            for line in with_errors(file, found[at, "same"], [one for one in errors if one.at == at])
        ]
        kept += [one.to_dict() for one in [*found.values(), *errors]]
        if given.json:
            given.json.write_text(json.dumps(kept, indent=1))
        print(f"{file}: {time.perf_counter() - began:.0f} s", file=sys.stderr)
    print("\n".join(first), "\n".join(second), sep="\n\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
