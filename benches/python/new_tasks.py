"""Tasks that `supple new` writes for public robots: each is written, evaluated and designed as a user would.

    python -m venv .venv && .venv/bin/pip install example-robot-data
    .venv/bin/python benches/python/new_tasks.py [--template press --template wipe] [--no-design] [--csv FILE]

The table lists by robot and template seconds of `supple new`, of `supple evaluate` and of `supple design` (of the whole
program, all threads), how the plan ended, whether it touches every contact, how the design ended, and the measured
information at its start and optimum. The exit code is 1 where a plan does not converge or touch, or takes more than 10 s, or
a design takes more than 60 s.
"""

from __future__ import annotations

import argparse
import csv
import importlib.metadata
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from supple_program import error_line, find_program, wanted

PACKAGE = "example-robot-data"
#: File of each robot in the package, and the frame that its tool is mounted on.
ROBOTS = {
    "UR5": ("ur5_robot.urdf", "ee_link"),
    "Panda": ("panda.urdf", "panda_link8"),
    "Kinova": ("kinova.urdf", "j2s6s200_end_effector"),
    "Talos arm": ("talos_left_arm.urdf", "wrist_left_ft_tool_link"),
    "xArm7": ("xarm7.urdf", "link_eef"),
    "SO-100": ("so100.urdf", "gripper"),
    "Z1": ("z1.urdf", "link06"),
    "Allegro finger": ("allegro_right_hand.urdf", "link_3.0_tip"),
}
TEMPLATES = ("press", "wipe", "insert", "reach", "hold", "handle")
#: Seconds that an evaluation and a design may take.
LIMITS = {"evaluate": 10.0, "design": 60.0}
HEADER = ["robot", "template", "new, s", "evaluate, s", "plan", "touches", "design, s", "design", "bits", "error"]


@dataclass(frozen=True)
class Step:
    """How one command ended."""

    seconds: float
    found: dict[str, Any] | None
    error: str


def run(program: str, words: list[str], limit: float) -> Step:
    """Runs the program; its JSON, where it printed one."""
    clock = time.perf_counter()
    try:
        done = subprocess.run(
            [program, *words], capture_output=True, text=True, timeout=limit, stdin=subprocess.DEVNULL
        )
    except subprocess.TimeoutExpired:
        return Step(time.perf_counter() - clock, None, "time limit")
    seconds = time.perf_counter() - clock
    if done.returncode not in (0, 1):
        return Step(seconds, None, error_line(done))
    return Step(seconds, json.loads(done.stdout) if done.stdout.startswith("{") else {}, "")


def robot_files() -> dict[str, Path]:
    """The robots that are asked for, by name."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        sys.exit(f"the package {PACKAGE} is not installed here: pip install {PACKAGE}")
    paths = {file.name: Path(file.locate()).resolve() for file in files if file.suffix == ".urdf"}
    return {name: paths[file] for name, (file, _) in ROBOTS.items()}


def row(program: str, name: str, file: Path, template: str, folder: Path, design: bool) -> tuple[list[str], bool]:
    """The row of a robot and a template, and whether all went as it should."""
    task = folder / f"{name.replace(' ', '_')}_{template}.toml"
    task.unlink(missing_ok=True)
    frame = ROBOTS[name][1]
    words = ["new", str(task), "--robot", str(file), "--template", template, "--frame", frame]
    new = run(program, words, 300.0)
    cells = [name, template, f"{new.seconds:.1f}"]
    if new.error:
        return [*cells, *["-"] * 6, new.error], False
    evaluated = run(program, ["evaluate", str(task), "--json"], 4 * LIMITS["evaluate"])
    if evaluated.found is None:
        return [*cells, f"{evaluated.seconds:.1f}", "error", *["-"] * 4, evaluated.error], False
    found = evaluated.found["tasks"][0]
    touches = all(contact["touches"] for contact in found["contacts"])
    cells += [f"{evaluated.seconds:.1f}", found["status"], "yes" if touches else "no"]
    good = found["status"] == "converged" and touches and evaluated.seconds <= LIMITS["evaluate"]
    if not design:
        return [*cells, "-", "-", "-", ""], good
    designed = run(program, ["design", str(task), "--json"], 4 * LIMITS["design"])
    if designed.found is None:
        return [*cells, f"{designed.seconds:.1f}", "error", "-", designed.error], False
    start, end = (designed.found[key]["objective"]["information_bits"] for key in ("start", "optimum"))
    cells += [f"{designed.seconds:.1f}", designed.found["status"], f"{start:.1f} -> {end:.1f}", ""]
    return cells, good and designed.seconds <= LIMITS["design"]


def show(cells: list[str]) -> None:
    """Prints a row."""
    widths = (15, 9, 7, 12, 22, 8, 10, 15, 18, 0)
    print(" ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip(), flush=True)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--supple", metavar="PROGRAM", help="the program; default: $SUPPLE, target/release, or PATH")
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="only robots whose name contains NAME; repeatable"
    )
    parser.add_argument("--template", action="append", choices=TEMPLATES, help="only these templates; repeatable")
    parser.add_argument("--no-design", action="store_true", help="evaluate only")
    parser.add_argument("--keep", metavar="DIR", type=Path, help="keep the task files in DIR")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="also write the table to FILE")
    options = parser.parse_args()
    program = find_program(options.supple)
    rows, all_good = [], True
    show(HEADER)
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for name, file in robot_files().items():
            if wanted(name, options.only):
                for template in options.template or TEMPLATES:
                    cells, good = row(program, name, file, template, folder, not options.no_design)
                    show(cells)
                    rows.append(cells)
                    all_good &= good
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows([HEADER, *rows])
    sys.exit(not all_good)


if __name__ == "__main__":
    main()
