"""How time and memory grow with the size of a task: joints, steps, parameters and tasks.

    python benches/python/growth.py [--only joints] [--million] [--csv FILE] [--markdown FILE] [--limit 900]

Each size is one run of `supple evaluate` on one thread, without roll-outs: plan, information, cost and the gradients of
both. Time is that of the processor; memory is the most that the process held. An exponent of 2 means that twice the size
takes four times as much. Exponents are slopes of least squares through the larger half of the sizes, in logarithms. The
exit code is 1 where a plan does not converge.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from planning_robots import chain
from supple_program import add_options, find_program, wanted

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Kind:
    """What grows: its sizes, and the files of a task of a size, by name; `task.toml` is the task."""

    name: str
    sizes: tuple[int, ...]
    files: Callable[[int], dict[str, str]]
    about: str


@dataclass(frozen=True)
class Run:
    """A task of a size: seconds of the processor, iterations of its plans, and bytes of memory at most."""

    size: int
    seconds: float
    iterations: int
    memory: int


def joints(count: int) -> dict[str, str]:
    """Rods of 4 m and 8 kg in all hang in a chain with a drive on each; every joint turns a little."""
    robot = chain(count, mass=8.0 / count, length=4.0 / count)
    names = json.dumps(robot.joints)
    target = json.dumps([0.4 / count] * count)
    task = f"""
[model]
kind = "robot"
file = "robot.urdf"
actuated = {names}
{
        "".join(
            f'''
[[model.compliance]]
kind = "spring"
name = "spring_{name}"
joint = "{name}"
stiffness = "k"
damping = "d"
'''
            for name in robot.joints
        )
    }
[[model.sensors]]
kind = "joint_position"
select = {names}
variance = 1e-6

[parameters.k]
initial = 5.0
bounds = [1.0, 50.0]

[parameters.d]
initial = 1.0
bounds = [0.1, 10.0]

[[tasks]]
name = "reach"
steps = 50
time_step = 0.01

[tasks.noise]
initial = {{ "q.*" = 1e-6, "v.*" = 1e-6 }}
process = {{ "v.*" = 1e-6 }}

[[tasks.costs]]
kind = "joint_position"
target = {target}
weight = 1.0
final_weight = 100.0

[[tasks.costs]]
kind = "joint_velocity"
weight = 0.01

[[tasks.costs]]
kind = "control"
weight = 1e-3
"""
    return {"task.toml": task, "robot.urdf": robot.urdf}


def steps(count: int) -> dict[str, str]:
    """A cart with a brake, whose position is measured."""
    task = f"""
[model]
kind = "linear"
A = [[1.0, 0.1], [0.0, "slide"]]
B = [[0.0], ["gain"]]
C = [[1.0, 0.0]]

[parameters.slide]
initial = 0.9
bounds = [0.5, 0.99]

[parameters.gain]
initial = 0.2
bounds = [0.1, 0.5]

[[tasks]]
name = "hold"
steps = {count}
time_step = 0.1
initial_state = [1.0, 0.0]

[tasks.noise]
initial = [1e-2, 1e-2]
process = [0.0, 1e-3]
measurement = [1e-3]

[[tasks.costs]]
kind = "quadratic"
Q = [[0.1, 0.0], [0.0, 0.01]]
R = [[0.01]]
final = [[5.0, 0.0], [0.0, 1.0]]
"""
    return {"task.toml": task}


def parameters(count: int) -> dict[str, str]:
    """Eight states in a ring, each fed by the next one; the parameters are spread over the couplings."""
    order = 8
    names = [f"p{number}" for number in range(count)]
    feeds: list[list[str]] = [names[place :: order * 2] for place in range(order * 2)]

    def entry(row: int, column: int) -> str:
        which = {(row + 1) % order: row, (row + 2) % order: row + order}.get(column)
        if row == column:
            return "0.6"
        if which is None or not feeds[which]:
            return "0.0"
        return json.dumps(f"0.2 * ({' + '.join(feeds[which])}) / {len(feeds[which])}")

    dynamics = ",\n".join(
        "    [" + ", ".join(entry(row, column) for column in range(order)) + "]" for row in range(order)
    )
    unit = [[1.0 if row == column else 0.0 for column in range(order)] for row in range(order)]
    declared = "\n".join(f"[parameters.{name}]\ninitial = 1.0\nbounds = [0.5, 1.5]\n" for name in names)
    task = f"""
[model]
kind = "linear"
A = [
{dynamics}
]
B = {json.dumps([[1.0 if row == column else 0.0 for column in range(2)] for row in range(order)])}
C = {json.dumps(unit[:4])}

{declared}
[[tasks]]
name = "hold"
steps = 200
time_step = 0.1
initial_state = {json.dumps([1.0] * order)}

[tasks.noise]
initial = {json.dumps([1e-2] * order)}
process = {json.dumps([1e-3] * order)}
measurement = {json.dumps([1e-3] * 4)}

[[tasks.costs]]
kind = "quadratic"
Q = {json.dumps(unit)}
R = [[0.1, 0.0], [0.0, 0.1]]
"""
    return {"task.toml": task}


def tasks(count: int) -> dict[str, str]:
    """The shipped small task, with as many targets of its force."""
    shipped = (ROOT / "tasks" / "two_mass_small.toml").read_text()
    shared, _, task = shipped.partition("[[tasks]]\n")
    # Nothing limits the cost: evaluations do not depend on it.
    lines = [line for line in task.splitlines() if not line.startswith("bound = ")]

    def posed(number: int) -> str:
        text = "\n".join(lines).replace('name = "press"', f'name = "press_{number}"')
        return "[[tasks]]\n" + text.replace("target = 3.0", f"target = {3.0 + 0.05 * number}") + "\n\n"

    return {"task.toml": shared + "".join(posed(number) for number in range(count))}


KINDS = (
    Kind("joints", (2, 4, 8, 16, 32, 64), joints, "a chain with a drive on every joint, 50 steps"),
    Kind("steps", (100, 1_000, 10_000, 100_000), steps, "a cart: 2 states, 1 control"),
    Kind("parameters", (1, 3, 10, 30, 100, 300), parameters, "a linear system of 8 states, 200 steps"),
    Kind("tasks", (1, 2, 4, 8, 16), tasks, "two masses at a wall, 125 steps each"),
)


def measured(program: str, kind: Kind, size: int, limit: float, folder: Path) -> Run:
    """Runs one task. Exits where it fails."""
    place = folder / f"{kind.name}_{size}"
    place.mkdir(parents=True, exist_ok=True)
    for name, text in kind.files(size).items():
        (place / name).write_text(text)
    command = [program, "evaluate", str(place / "task.toml"), "--json", "--threads", "1", "--rollouts", "0"]
    with (place / "result.json").open("w") as out, (place / "messages.txt").open("w") as messages:
        process = subprocess.Popen(["timeout", str(limit), *command], stdout=out, stderr=messages)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{kind.name} {size}: exit code {process.returncode}\n{(place / 'messages.txt').read_text()}")
    found = json.loads((place / "result.json").read_text())["tasks"]
    # Kilobytes on Linux, bytes on macOS.
    unit = 1 if sys.platform == "darwin" else 1024
    seconds = usage.ru_utime + usage.ru_stime
    return Run(size, seconds, sum(task["iterations"] for task in found), usage.ru_maxrss * unit)


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """The slope of logarithms through the larger half of the sizes."""
    half = len(sizes) // 2 if len(sizes) > 3 else 0
    points = [(math.log(size), math.log(value)) for size, value in zip(sizes[half:], values[half:])]
    mean = [sum(point[side] for point in points) / len(points) for side in (0, 1)]
    above = sum((x - mean[0]) * (y - mean[1]) for x, y in points)
    return above / sum((x - mean[0]) ** 2 for x, _ in points)


def exponents(runs: Sequence[Run]) -> dict[str, float]:
    """The exponents of seconds and memory."""
    sizes = [run.size for run in runs]
    return {
        "seconds": exponent(sizes, [run.seconds for run in runs]),
        "memory": exponent(sizes, [run.memory for run in runs]),
    }


def grown(program: str, kind: Kind, sizes: Sequence[int], limit: float, folder: Path) -> list[Run]:
    """Runs of all sizes, in their order."""
    return [measured(program, kind, size, limit, folder) for size in sizes]


HEADER = ["what grows", "size", "seconds", "iterations", "memory, MB"]


def cells(kind: Kind, run: Run) -> list[str]:
    """A row of the table."""
    numbers = [f"{run.seconds:.3g}", str(run.iterations), f"{run.memory / 1e6:.0f}"]
    return [kind.name, str(run.size), *numbers]


def markdown(results: dict[str, list[Run]]) -> str:
    """The tables as they stand in the documentation."""
    lines = ["| What grows | Sizes | Time | Memory |", "|---|---|---|---|"]
    for kind in KINDS:
        if runs := results.get(kind.name):
            first, last = runs[0], runs[-1]
            powers = [f"size^{power:.1f}" for power in exponents(runs).values()]
            lines.append(
                f"| {kind.name}: {kind.about} | {first.size} to {last.size} | "
                f"{first.seconds:.2g} to {last.seconds:.2g} s, {powers[0]} | "
                f"{first.memory / 1e6:.0f} to {last.memory / 1e6:.0f} MB, {powers[1]} |"
            )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser)
    parser.set_defaults(limit=900.0)
    parser.add_argument("--million", action="store_true", help="also a million steps: ten minutes and 7 GB")
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="also write the summary as Markdown to FILE")
    options = parser.parse_args()
    program = find_program(options.supple)
    rows, results = [], {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        print("  ".join(f"{name:>16}" for name in HEADER))
        for kind in KINDS:
            if not wanted(kind.name, options.only):
                continue
            results[kind.name] = []
            more = (1_000_000,) if options.million and kind.name == "steps" else ()
            for size in kind.sizes + more:
                run = measured(program, kind, size, options.limit, folder)
                results[kind.name].append(run)
                rows.append(cells(kind, run))
                print("  ".join(f"{cell:>16}" for cell in rows[-1]), flush=True)
            powers = exponents(results[kind.name])
            print(f"  {kind.name}: " + ", ".join(f"{name} ~ size^{power:.2f}" for name, power in powers.items()))
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows([HEADER, *rows])
    if options.markdown:
        options.markdown.write_text(markdown(results))


if __name__ == "__main__":
    main()
