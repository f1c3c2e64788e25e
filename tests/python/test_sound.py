"""What once made the interpreter hang, abort or wait: each test is named for it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

import supple

TASK = "tasks/two_mass_small.toml"

#: Far more than is needed on an idle machine, and far less than the work would take.
SOON = 5.0


def run(program: str, timeout: float = 120.0) -> str:
    """What a program in a Python of its own prints."""
    words = [sys.executable, "-c", textwrap.dedent(program)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=timeout, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_forked_child_never_returned() -> None:
    found = run(f"""
        import os, signal, supple
        task = supple.load({TASK!r})
        task.sweep({{"k1": [60.0, 70.0]}})
        child = os.fork()
        if child == 0:
            signal.alarm(60)
            sweep = task.sweep({{"k1": [60.0, 70.0, 80.0]}})
            design = task.design(starts=2, rollouts=0)
            os._exit(0 if len(sweep.table["k1"]) == 3 and design.parameters["k1"] > 0 else 1)
        _, status = os.waitpid(child, 0)
        task.sweep({{"k1": [60.0, 70.0]}})
        print(os.waitstatus_to_exitcode(status))
    """)
    assert found == "0"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            lambda task: supple.linear([[1.0]], [[1.0]], [[1.0]], [1.0], [1.0], [1.0], [[1.0]], [[1.0]], N=10**12),
            "N = 1000000000000",
        ),
        (lambda task: supple.linear([[1.0]], [[1.0]], [[1.0]], [1.0], [1.0], [1.0], [[1.0]], [[1.0]], N=10**30), ""),
        (lambda task: task.pareto(points=10**18), "10000"),
        (lambda task: task.evaluate(branches=10**18), "10000"),
        (lambda task: task.evaluate(rollouts=10**18), "10000000"),
        (lambda task: task.sweep({"k1": [60.0]}, rollouts=10**18), "10000000"),
        (lambda task: task.trace(starts=10**18), "10000"),
        (lambda task: task.evaluate(rollouts=10**30), ""),
    ],
)
def test_sizes_beyond_all_memory_are_refused(asked: Callable[[supple.Task], Any], message: str) -> None:
    task = supple.load(TASK)
    with pytest.raises((supple.UsageError, OverflowError), match=message):
        asked(task)


@pytest.mark.parametrize(
    "asked",
    [
        lambda task: task.evaluate(rollouts=1_000_000),
        lambda task: task.robustness({"start": {}}, vary={"wall_variance": [1e-5, 1e-4]}, rollouts=1_000_000),
        lambda task: task.pareto(points=5_000),
    ],
    ids=["evaluate", "robustness", "pareto"],
)
def test_an_interrupt_was_waited_for(asked: Callable[[supple.Task], Any]) -> None:
    task = supple.load("tasks/two_mass.toml")
    sent: list[float] = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(1.0, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        asked(task)
    assert time.monotonic() - sent[0] < SOON
    # What was stopped leaves nothing behind that stops what comes next.
    assert task.evaluate(rollouts=2).tasks["press"].information.total_bits > 0
