"""Plans a reach with every URDF file of the package example-robot-data, as a user of the program supple would.

    python -m venv .venv && .venv/bin/pip install example-robot-data
    .venv/bin/python benches/python/public_robots.py [--target 0.2] [--weights standard] [--limit 30] [--csv FILE]

Every robot is fixed in the world, starts at rest with all joints at 0, has gravity and a drive on every joint that
moves, and gets no first guess of its controls. The target of every joint is 0.2 rad or m, or what its limits allow of
that. The table lists by file the degrees of freedom, how the plan ended, iterations, cost and seconds of the whole
program. It counts separately the robots that supple refuses for a reason that lies in the file: it is not valid URDF,
no joint moves, or a joint moves no inertia. The exit code is 1 where any other robot has no converged plan.
"""

from __future__ import annotations

import argparse
import csv
import importlib.metadata
import json
import statistics
import sys
import tempfile
import xml.etree.ElementTree as xml
from dataclasses import dataclass
from pathlib import Path

from supple_program import Run, add_options, evaluate, find_program, number, wanted

PACKAGE = "example-robot-data"
# Weights in every stage and at the end; stages are not multiplied by the time step.
WEIGHTS = {
    # A usual reach: the end counts most, and controls are cheap.
    "standard": {"position": (1.0, 1000.0), "velocity": (0.1, 10.0), "control": 1e-4},
    # A gentle reach: the end counts little.
    "soft": {"position": (1.0, 10.0), "velocity": (0.01, 0.1), "control": 1e-3},
    # The end counts 1e6 times as much as a stage.
    "terminal": {"position": (0.1, 1e5), "velocity": (1e-3, 1e3), "control": 1e-4},
    # Controls are almost free.
    "cheap": {"position": (1.0, 1000.0), "velocity": (0.1, 10.0), "control": 1e-8},
    # Controls are expensive: holding a robot against gravity may cost more than a missed target.
    "expensive": {"position": (1.0, 1000.0), "velocity": (0.1, 10.0), "control": 1e-1},
}
MOVING = {"revolute", "continuous", "prismatic"}
# Words of the messages with which the program rightly refuses a robot, by class.
NOT_URDF = "not valid URDF"
REFUSED = {
    NOT_URDF: ("no links", "there is no joint", "is missing", "has at least one link"),
    "massless joints": ("moves no inertia", "without moving anything that has inertia"),
    "nothing moves": ("no joint that moves", "no joint moves", "nothing moves"),
}


@dataclass(frozen=True)
class Joint:
    """A joint that moves and follows no other: its name and limits of position, rad or m."""

    name: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Row:
    """A robot, and how its plan ended."""

    name: str
    dofs: int
    run: Run
    refused: str

    def cells(self) -> list[str]:
        """The row of the table."""
        status = f"refused: {self.refused}" if self.refused else self.run.status
        return [
            self.name,
            str(self.dofs),
            status,
            number(self.run.iterations),
            number(self.run.cost, 8),
            f"{self.run.seconds:.2f}",
            self.run.error,
        ]


HEADER = ["robot", "dofs", "plan", "iterations", "cost", "seconds", "error"]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser)
    parser.add_argument("--target", type=float, default=0.2, help="how far every joint moves, rad or m (0.2)")
    parser.add_argument("--steps", type=int, default=200, help="time steps (200)")
    parser.add_argument("--time-step", type=float, default=1e-3, metavar="S", help="time step, s (0.001)")
    parser.add_argument("--weights", choices=WEIGHTS, default="standard", help="weights of the costs (standard)")
    return parser.parse_args()


def robot_files() -> list[Path]:
    """The URDF files of the installed package."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        sys.exit(f"the package {PACKAGE} is not installed here: pip install {PACKAGE}")
    return sorted(Path(file.locate()).resolve() for file in files if file.suffix == ".urdf")


def moving_joints(file: Path) -> list[Joint] | None:
    """The joints that move and follow no other; `None` where the file is not valid XML."""
    try:
        root = xml.parse(file).getroot()
    except xml.ParseError:
        return None
    joints = []
    for joint in root.findall("joint"):
        if joint.get("type") not in MOVING or joint.find("mimic") is not None:
            continue
        limit = joint.find("limit") if joint.get("type") != "continuous" else None
        keys = () if limit is None else (limit.get("lower"), limit.get("upper"))
        # URDF says 0 where one of them is missing; a joint with neither has no limits.
        lower, upper = (float(key or 0) for key in keys) if any(keys) else (float("-inf"), float("inf"))
        joints.append(Joint(joint.get("name", ""), lower, upper))
    return joints


def within_limits(joint: Joint, target: float) -> float:
    """The target, or the limit before it; on the other side of 0 where that is farther. Limits that leave no room, such
    as 0 and 0, are ignored."""
    if joint.lower >= joint.upper:
        return target
    sides = [min(max(side, joint.lower), joint.upper) for side in (target, -target)]
    return max(sides, key=abs)


def task_text(file: Path, joints: list[Joint], options: argparse.Namespace) -> str:
    """The task file of a reach."""
    weights = WEIGHTS[options.weights]
    names = json.dumps([joint.name for joint in joints], ensure_ascii=False)
    target = json.dumps([within_limits(joint, options.target) for joint in joints])
    (position, position_end), (velocity, velocity_end) = weights["position"], weights["velocity"]
    share = next((parent for parent in file.parents if parent.name == PACKAGE), file.parent)
    roots = json.dumps([str(share.parent), str(share / "robots")], ensure_ascii=False)
    return f"""title = "A reach"

[model]
kind = "robot"
file = {json.dumps(str(file), ensure_ascii=False)}
package_roots = {roots}
gravity = [0.0, 0.0, -9.81]

[[model.sensors]]
kind = "joint_position"
select = {names}
variance = 1e-6

[[model.sensors]]
kind = "joint_velocity"
select = {names}
variance = 1e-4

[[tasks]]
name = "reach"
steps = {options.steps}
time_step = {options.time_step!r}
initial_state = {{}}

[tasks.noise]
initial = {{ "q.*" = 1e-6, "v.*" = 1e-6 }}
process = {{ "q.*" = 1e-9, "v.*" = 1e-6 }}

[[tasks.costs]]
kind = "joint_position"
select = {names}
target = {target}
weight = {position!r}
final_weight = {position_end!r}

[[tasks.costs]]
kind = "joint_velocity"
weight = {velocity!r}
final_weight = {velocity_end!r}

[[tasks.costs]]
kind = "control"
weight = {weights["control"]!r}
"""


def refusal(run: Run, valid: bool) -> str:
    """The class of robots that the program rightly refuses; empty for all others."""
    if run.status != "error":
        return ""
    if not valid:
        return NOT_URDF
    return next((why for why, words in REFUSED.items() if any(word in run.error for word in words)), "")


def shortened(run: Run, folder: Path, file: Path) -> Run:
    """The run, without the folders of this machine in its error message."""
    error = run.error.replace(str(file), file.name).replace(f"{folder}/", "")
    return Run(run.status, error, run.seconds, run.task)


def measured(program: str, file: Path, folder: Path, options: argparse.Namespace) -> Row:
    """One robot, planned."""
    joints = moving_joints(file)
    task = folder / f"{file.stem}_{file.parents[1].name}.toml"
    task.write_text(task_text(file, joints or [], options))
    run = shortened(evaluate(program, task, options.limit), folder, file)
    name = f"{file.parents[1].name.removesuffix('_description')}/{file.stem}"
    return Row(name, len(joints or []), run, refusal(run, joints is not None))


def summary(rows: list[Row]) -> list[str]:
    """Lines below the table."""
    asked = [row for row in rows if not row.refused]
    planned = [row for row in asked if row.run.converged]
    refused = [row for row in rows if row.refused]
    lines = [f"planned {len(planned)} of {len(asked)}; {len(refused)} refused for their files; {len(rows)} files"]
    if planned:
        iterations = [row.run.iterations for row in planned]
        lines.append(f"iterations of plans: median {statistics.median(iterations):g}, most {max(iterations)}")
        lines.append(f"seconds of plans: most {max(row.run.seconds for row in planned):.2f}")
    for status in sorted({row.run.status for row in asked if not row.run.converged}):
        names = [row.name for row in asked if row.run.status == status]
        lines.append(f"{status} ({len(names)}): {', '.join(names)}")
    for why in sorted({row.refused for row in refused}):
        names = [row.name for row in refused if row.refused == why]
        lines.append(f"refused, {why} ({len(names)}): {', '.join(names)}")
    return lines


def show(cells: list[str]) -> None:
    name, dofs, status, iterations, cost, seconds, error = cells
    line = f"{name:50} {dofs:>4}  {status:24} {iterations:>10} {cost:>14} {seconds:>8}  {error}"
    print(line.rstrip(), flush=True)


def main() -> None:
    options = arguments()
    program = find_program(options.supple)
    rows = []
    print(f"{options.steps} steps of {options.time_step:g} s, target {options.target:g}, weights {options.weights}")
    show(HEADER)
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        named = sorted((f"{file.parents[1].name}/{file.stem}", file) for file in robot_files())
        for name, file in named:
            if wanted(name, options.only):
                rows.append(measured(program, file, folder, options))
                show(rows[-1].cells())
    print("\n" + "\n".join(summary(rows)))
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows([HEADER, *(row.cells() for row in rows)])
    sys.exit(any(not row.refused and not row.run.converged for row in rows))


if __name__ == "__main__":
    main()
