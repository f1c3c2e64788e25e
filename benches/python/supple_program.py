"""Runs the program supple on a task file as a user does: within a time limit, on one thread. Shared by the benchmarks
of plans, `public_robots.py` and `globalisation.py`.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
TIMED_OUT = "time limit"


@dataclass(frozen=True)
class Run:
    """How `supple evaluate` of a task with one plan ended.

    Attributes:
        status: The status of the plan, or ``time limit``, or ``error``.
        error: The first line of the error message, where there is one.
        seconds: Seconds of the whole process by the wall clock.
        task: The JSON of the task, where there is one.
    """

    status: str
    error: str
    seconds: float
    task: dict[str, Any] | None

    @property
    def converged(self) -> bool:
        """Whether the plan converged."""
        return self.status == "converged"

    @property
    def iterations(self) -> int | None:
        """Iterations of the plan."""
        return self.task["iterations"] if self.task else None

    @property
    def cost(self) -> float | None:
        """Cost of the trajectory without noise."""
        return self.task["cost"]["nominal"] if self.task else None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options that every benchmark of the program has."""
    parser.add_argument("--supple", metavar="PROGRAM", help="the program; default: $SUPPLE, target/release, or PATH")
    parser.add_argument("--limit", type=float, default=30.0, metavar="S", help="time limit of a plan, s (30)")
    parser.add_argument("--only", action="append", metavar="NAME", help="only names that contain NAME; repeatable")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="also write the table to FILE")
    parser.add_argument("--keep", metavar="DIR", type=Path, help="keep the task files in DIR")


def wanted(name: str, only: list[str] | None) -> bool:
    """Whether `--only` lets a name through."""
    return not only or any(part in name for part in only)


def find_program(given: str | None) -> str:
    """The program to run: the one given, $SUPPLE, that of the repository, or the one on the PATH."""
    built = ROOT / "target" / "release" / "supple"
    program = given or os.environ.get("SUPPLE") or (str(built) if built.is_file() else shutil.which("supple"))
    if program is None:
        sys.exit("no program supple: build it with `cargo build --release`, or name it with --supple or $SUPPLE")
    if shutil.which(program) is None:
        sys.exit(f"{program}: there is no such program; name it with --supple or $SUPPLE")
    return str(Path(shutil.which(program)).resolve())


def evaluate(program: str, task: Path, limit: float, out: Path | None = None) -> Run:
    """Runs `supple evaluate` without roll-outs; with `out`, the trajectory is kept in that folder and is part of the result."""
    command = [program, "evaluate", str(task), "--json", "--threads", "1", "--rollouts", "0"]
    if out is not None:
        command += ["--out", str(out)]
    clock = time.perf_counter()
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return Run(TIMED_OUT, "", time.perf_counter() - clock, None)
    seconds = time.perf_counter() - clock
    # 0: as asked; 1: computed, but not converged; 2: wrong input.
    if run.returncode not in (0, 1) or not run.stdout.strip():
        return Run("error", error_line(run), seconds, None)
    found = json.loads(run.stdout)["tasks"][0]
    return Run(found["status"], "", seconds, found)


def error_line(run: subprocess.CompletedProcess[str]) -> str:
    """The error message's first line, without warnings and the place of the task file."""
    lines = run.stderr.strip().splitlines()
    errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return (errors or lines[-1:] or [f"exit code {run.returncode}"])[0]


def number(value: float | None, digits: int = 5) -> str:
    """A number of a table; a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}g}"
