"""Planning from nothing: how many problems supple solves, and FDDP of crocoddyl beside it.

    python -m venv .venv && .venv/bin/pip install example-robot-data crocoddyl==3.2.1 pin==4.0.0
    .venv/bin/python benches/python/globalisation.py [--only cartpole] [--limit 30] [--csv FILE] [--alone]

supple gets no first guess. crocoddyl starts from states at rest, with the controls that hold the robot there where
every joint has a drive, and otherwise 0. A problem is solved when the search converged and every goal of the problem is
met at the end, such as a pole within 0.1 rad of upright. Columns:

    error    the largest error at the end, relative to the goal's tolerance: at most 1 where all goals are met
    differs  how much the two problems differ along supple's plan: in its relative cost, or in a state after one step
    seconds  of the whole program for supple, with filter, information and files; of the solver for crocoddyl

crocoddyl's dynamics are in Python where the name of a problem is followed by `py`; it then gets four times the limit.
Contacts and bushings are for supple only. The exit code is 1 where supple leaves a problem unsolved.

The versions matter: crocoddyl 3.2.1 with pin 4.1 runs and computes wrong dynamics, which the column `differs` shows.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import json
import math
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from planning_problem import Problem
from planning_problems import problems
from supple_program import TIMED_OUT, Run, add_options, evaluate, find_program, number, wanted

# Up to where the two problems may differ along a plan.
AGREEMENT = 1e-6
# How much longer crocoddyl may take where it runs Python.
PATIENCE = 4
HEADER = ["problem", "dofs", "steps", "plan", "iterations", "cost", "seconds", "error", "solved"]
PEER_HEADER = ["FDDP", "iterations", "cost", "seconds", "error", "solved", "differs"]


@dataclass(frozen=True)
class Result:
    """How a search ended: by supple or by crocoddyl."""

    status: str
    iterations: int | None
    cost: float | None
    seconds: float
    error: float | None
    note: str = ""

    @property
    def solved(self) -> bool:
        """Whether it converged and met every goal."""
        return self.status == "converged" and self.error is not None and self.error <= 1.0

    def cells(self) -> list[str]:
        """Its part of a row."""
        numbers = [number(self.iterations), number(self.cost, 7), f"{self.seconds:.2f}", number(self.error, 2)]
        return [self.status, *numbers, "yes" if self.solved else "no"]


class Program:
    """The program supple, and the places of links that it computes."""

    def __init__(self, path: str) -> None:
        self.path = path

    def place(self, robot: Path, frame: str, at: dict[str, float]) -> list[float]:
        """Where a link's origin is, m."""
        joints = self.dynamics(robot)["joints"]
        q = ",".join(repr(at[joint]) for joint in joints)
        return self.dynamics(robot, f"--q={q}")["frames"][frame]["position"]

    def dynamics(self, robot: Path, *more: str) -> dict:
        command = [self.path, "robot", str(robot), "--json", *more]
        return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    def error(self, problem: Problem, robot: Path, end: dict[str, float]) -> float:
        """The largest error at the end, relative to what the goals tolerate."""
        if not all(map(math.isfinite, end.values())):
            return math.inf
        at = {joint: end[f"q.{joint}"] for joint in problem.joints}
        walls = {contact.name: contact for contact in problem.contacts}
        worst = 0.0
        for goal in problem.goals:
            errors = [abs(at[joint] - target) for joint, target in goal.joints.items()]
            if goal.at_rest:
                errors += [abs(end[f"v.{joint}"]) for joint in problem.joints]
            if goal.frame in walls:
                wall = walls[goal.frame]
                errors.append(abs(wall.force(tuple(self.place(robot, wall.frame, at))) - goal.point[0]))
            elif goal.frame:
                place = self.place(robot, goal.frame, at)
                errors.append(sum((a - b) ** 2 for a, b in zip(place, goal.point)) ** 0.5)
            worst = max(worst, *(error / goal.tolerance for error in errors))
        return worst


def by_supple(program: Program, problem: Problem, task: Path, limit: float) -> tuple[Result, dict | None]:
    """The result of supple, with its trajectory."""
    out = task.with_suffix("")
    run: Run = evaluate(program.path, task, limit, out)
    trajectory = (run.task or {}).get("trajectory")
    error = None
    if trajectory:
        end = dict(zip(trajectory["state_names"], trajectory["states"][-1]))
        error = program.error(problem, task.with_suffix(".urdf"), end)
    note = run.error.replace(f"{task.parent}/", "")
    return Result(run.status, run.iterations, run.cost, run.seconds, error, note), trajectory


def by_crocoddyl(
    program: Program, problem: Problem, task: Path, plan: tuple[dict | None, float | None], limit: float
) -> tuple[Result, float | None]:
    """The result of crocoddyl, and how much its problem differs from supple's along supple's plan."""
    command = [sys.executable, str(Path(__file__).with_name("planning_crocoddyl.py")), problem.name]
    trajectory, cost = plan
    if trajectory:
        file = task.with_suffix(".json")
        file.write_text(json.dumps({key: trajectory[key] for key in ("state_names", "states", "controls")}))
        command.append(str(file))
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired as late:
        printed = (late.stdout or b"").decode().splitlines()
        found = json.loads(printed[0]) if printed and trajectory else {}
        return Result(TIMED_OUT, None, None, limit, None), difference(found, cost)
    if run.returncode:
        return Result("error", None, None, 0.0, None, (run.stderr.strip().splitlines() or ["died"])[-1]), None
    found = json.loads(run.stdout.splitlines()[-1])
    error = program.error(problem, task.with_suffix(".urdf"), found["end"])
    result = Result(found["status"], found["iterations"], found["cost"], found["seconds"], error)
    return result, difference(found, cost)


def difference(found: dict[str, float], cost: float | None) -> float | None:
    """How much the two problems differ along supple's plan."""
    if cost is None or "gap" not in found:
        return None
    return max(abs(found["cost_there"] - cost) / max(abs(cost), 1e-12), found["gap"])


@dataclass(frozen=True)
class Row:
    """A problem, and how both ended."""

    problem: Problem
    supple: Result
    peer: Result | None
    difference: float | None

    def cells(self) -> list[str]:
        """The row of the table."""
        problem = self.problem
        py = " py" if problem.is_resisted else ""
        head = [problem.name + (py if self.peer else ""), str(len(problem.joints)), str(problem.steps)]
        peer = self.peer.cells() if self.peer else ["-"] * 6
        return [*head, *self.supple.cells(), *peer, number(self.difference, 1)]


def measured(program: Program, problem: Problem, folder: Path, options: argparse.Namespace) -> Row:
    """One problem, by both."""
    task = problem.write(folder)
    found, trajectory = by_supple(program, problem, task, options.limit)
    if options.alone or not problem.has_twin:
        return Row(problem, found, None, None)
    limit = options.limit * (PATIENCE if problem.is_resisted else 1)
    peer, apart = by_crocoddyl(program, problem, task, (trajectory, found.cost), limit)
    return Row(problem, found, peer, apart)


def summary(rows: list[Row]) -> list[str]:
    """Lines below the table."""
    both = [row for row in rows if row.peer]
    lines = [share("supple", [row.supple for row in rows])]
    if both:
        lines.append(share("supple, where both were asked", [row.supple for row in both]))
        lines.append(share("crocoddyl's FDDP", [row.peer for row in both]))
    unsolved = [row for row in rows if not row.supple.solved]
    for row in unsolved:
        why = f"error {row.supple.error:.2g}" if row.supple.error is not None else row.supple.note
        lines.append(f"unsolved by supple: {row.problem.name}: {row.supple.status} {why}".rstrip())
    lines += [
        f"unsolved by FDDP: {row.problem.name}: {row.peer.status} {row.peer.note}".rstrip()
        for row in both
        if not row.peer.solved
    ]
    return lines + comparison(both) if both else lines


def comparison(both: list[Row]) -> list[str]:
    """Lines about the problems that both were asked, below the table."""
    pairs = [
        (row.supple.cost, row.peer.cost, row.problem.name) for row in both if row.supple.solved and row.peer.solved
    ]
    worse = [name for ours, theirs, name in pairs if ours > 1.01 * theirs]
    better = [name for ours, theirs, name in pairs if theirs > 1.01 * ours]
    apart = [row.problem.name for row in both if row.difference is not None and row.difference > AGREEMENT]
    return [
        f"solved by both: {len(pairs)}",
        f"supple's cost is more than 1 % higher in {len(worse)} of these: {', '.join(worse)}",
        f"supple's cost is more than 1 % lower in {len(better)} of these: {', '.join(better)}",
        f"crocoddyl's problem differs from supple's in {len(apart)}: {', '.join(apart)}",
    ]


def share(who: str, results: list[Result]) -> str:
    """How many are solved, with iterations and seconds."""
    done = [result for result in results if result.solved]
    line = f"{who}: solved {len(done)} of {len(results)}"
    if not done:
        return line
    iterations, seconds = [result.iterations for result in done], [result.seconds for result in done]
    line += f"; iterations: median {statistics.median(iterations):g}, most {max(iterations)}"
    return line + f"; seconds: median {statistics.median(seconds):.2f}, most {max(seconds):.2f}"


def show(cells: list[str]) -> None:
    widths = (-23, 4, 5, -20, 10, 11, 7, 8, 6, -15, 10, 11, 7, 8, 6, 7)
    line = " ".join(f"{cell:<{-width}}" if width < 0 else f"{cell:>{width}}" for cell, width in zip(cells, widths))
    print(line.rstrip(), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser)
    parser.add_argument("--alone", action="store_true", help="supple only, without crocoddyl")
    options = parser.parse_args()
    if not options.alone and importlib.util.find_spec("crocoddyl") is None:
        sys.exit("crocoddyl is not installed here: pip install crocoddyl==3.2.1 pin==4.0.0, or leave it out by --alone")
    program = Program(find_program(options.supple))
    rows = []
    show([*HEADER, *PEER_HEADER])
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for problem in problems():
            if wanted(problem.name, options.only):
                rows.append(measured(program, problem, folder, options))
                show(rows[-1].cells())
    print("\n" + "\n".join(summary(rows)))
    if options.csv:
        with options.csv.open("w", newline="") as file:
            peer = [name if name == "FDDP" else f"FDDP {name}" for name in PEER_HEADER]
            csv.writer(file).writerows([[*HEADER, *peer], *(row.cells() for row in rows)])
    sys.exit(not all(row.supple.solved for row in rows))


if __name__ == "__main__":
    main()
