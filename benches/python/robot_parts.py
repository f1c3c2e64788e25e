"""Times an iteration of a reach under gravity here and in crocoddyl, alternately on one core, for any URDF files.

    python -m venv .venv && .venv/bin/pip install example-robot-data crocoddyl==3.2.1 pin==4.0.0 numpy
    .venv/bin/python benches/python/robot_parts.py [FILE.urdf ...] [--rounds 3] [--steps 200] [--core 0]

Without files: a double pendulum, UR5, the left arm of Talos, G1 and Talos, fixed in the world. Prints a table of
milliseconds for all steps, the least of all rounds, and the ratios of crocoddyl's to ours; at the end the same as
Markdown. `--before PROGRAM` also times the benchmark `parts` of another build, alternately with this one.
`--same-physics` leaves out damping and dry friction in joints, which crocoddyl does not have.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from public_robots import Joint, moving_joints, robot_files, task_text

ROOT = Path(__file__).resolve().parents[2]
DEFAULT = ("double_pendulum_simple", "ur5_robot", "talos_left_arm", "g1_29dof", "talos_full_v2")
OURS = ("linearise", "riccati", "rollout", "iteration", "kalman_and_information", "information_gradient")
PEER = {"linearise": "calcDiff", "riccati": "backwardPass", "rollout": "forwardPass", "iteration": "iteration"}


@dataclass
class Timed:
    """Least times of all rounds, ms, by part; and how many states and controls there are."""

    sizes: str
    ours: dict[str, float]
    before: dict[str, float]
    peer: dict[str, float]


def built() -> str:
    """The benchmark `parts` of this build."""
    command = ["cargo", "bench", "--workspace", "--bench", "parts", "--no-run", "--message-format=json"]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    messages = [json.loads(line) for line in lines]
    return next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "parts")


def lines_of(command: list[str], core: int) -> list[dict]:
    """What a program prints, on one core."""
    environment = os.environ | {"SECONDS_EACH": "1", "OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}
    command = ["taskset", "-c", str(core), *command]
    run = subprocess.run(command, capture_output=True, text=True, env=environment)
    if run.returncode:
        sys.exit(f"{' '.join(command)}:\n{run.stderr}")
    return [json.loads(line) for line in run.stdout.splitlines()]


def keep_least(times: dict[str, float], name: str, found: float) -> None:
    times[name] = min(found, times.get(name, found))


def measured(file: Path, task: Path, programs: list[str], options: argparse.Namespace) -> Timed:
    """All rounds of one robot."""
    timed = Timed("", {}, {}, {})
    for _ in range(options.rounds):
        for times, program in zip((timed.ours, timed.before), programs, strict=False):
            for line in lines_of([program, str(task)], options.core):
                if "file" in line:
                    timed.sizes = f"{line['states']}, {line['controls']}"
                else:
                    keep_least(times, line["name"], line["least_ms"])
        peer = [sys.executable, str(ROOT / "benches/peers/crocoddyl_robot.py"), str(file)]
        for line in lines_of([*peer, "--steps", str(options.steps), "--dt", repr(options.time_step)], options.core):
            keep_least(timed.peer, line["name"], line["min_us"] / 1e3)
    return timed


def without_resistance(text: str, joints: list[Joint]) -> str:
    """The task with no damping and no dry friction in its joints."""
    tables = [f"\n[model.joints.{json.dumps(joint.name)}]\ndamping = 0.0\nfriction = 0.0\n" for joint in joints]
    return text + "".join(tables)


def chosen(files: list[Path]) -> list[Path]:
    """The files given, or those of the robots that are compared by default."""
    if files:
        return [file.resolve() for file in files]
    known = robot_files()
    found = [next((file for file in known if file.stem.startswith(stem)), None) for stem in DEFAULT]
    return [file for file in found if file is not None]


def rows(name: str, timed: Timed) -> list[list[str]]:
    """A row for each part."""
    table = []
    for part in OURS:
        peer = timed.peer.get(PEER.get(part, ""))
        ratio = f"{peer / timed.ours[part]:.1f}" if peer else "-"
        before = f"{timed.before[part]:.3f}" if timed.before else "-"
        peer_text = f"{peer:.3f}" if peer else "-"
        table.append([name, timed.sizes, part, f"{timed.ours[part]:.3f}", before, peer_text, ratio])
    return table


HEADER = ["robot", "states, controls", "part", "ms", "before", "crocoddyl", "times"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--time-step", type=float, default=1e-3)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--before", help="the benchmark `parts` of another build")
    parser.add_argument("--same-physics", action="store_true", help="no damping and friction in joints")
    options = parser.parse_args()
    options.target, options.weights = 0.2, "standard"
    programs = [built(), *([options.before] if options.before else [])]
    table = []
    with tempfile.TemporaryDirectory() as folder:
        for file in chosen(options.files):
            task = Path(folder) / f"{file.stem}.toml"
            joints = moving_joints(file) or []
            text = task_text(file, joints, options)
            task.write_text(without_resistance(text, joints) if options.same_physics else text)
            for row in rows(file.stem, measured(file, task, programs, options)):
                table.append(row)
                name, sizes, part, *numbers = row
                print(f"{name:32} {sizes:>8}  {part:24} " + " ".join(f"{n:>10}" for n in numbers), flush=True)
    print("\n| " + " | ".join(HEADER) + " |\n|" + "---|" * len(HEADER))
    for row in table:
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
