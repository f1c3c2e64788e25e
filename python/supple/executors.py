"""Studies on the workers of an executor: a process pool, a Dask cluster, MPI, or any other.

Any ``concurrent.futures.Executor`` works. Results are bit-identical to those of the threads of one process: units of work
are independent of one another, and each depends only on the task and its seeds.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

from . import _units
from ._asked import Axes, Chosen, Vary
from ._crew import Crew, Done, Unit, Workers
from ._supple import DesignCollector, Kept, RobustnessCollector, SweepCollector
from ._supple import use_instructions as _use_instructions
from .errors import UsageError
from .progress import Progress
from .task import Task

__all__ = ["Workers", "use_instructions"]

#: What happens to completed work if a study ends early.
LOST = "nothing is kept: call again"


def use_instructions(name: str) -> None:
    """Selects the instructions for all further computations: ``baseline``, ``avx2`` or ``avx512``.

    Instructions differ by rounding. Workers use those of the calling process; if some of them lack these, choose
    instructions that all of them have.

    Raises:
        UsageError: If this machine does not have these instructions.
    """
    if not _use_instructions(name):
        raise UsageError(
            f'use_instructions("{name}"): not available on this machine; valid: "baseline", "avx2" and "avx512"'
        )


class _Shown:
    """Progress that may have no observer."""

    def __init__(self, seer: Progress | None) -> None:
        self._seer = seer

    def begin(self, what: str, done: int, total: int) -> None:
        if self._seer is not None:
            self._seer.begin(what, done, total)

    def advance(self, parts: int) -> None:
        if self._seer is not None and parts:
            self._seer.advance(parts)


def sweep(
    task: Task,
    axes: Axes,
    sizes: tuple[int, int, int, int],
    workers: Workers,
    out: str | os.PathLike[str] | None,
    seer: Progress | None,
) -> Kept:
    """Evaluates every point of a grid; ``sizes`` are roll-outs, starts, attempts on other
    branches and seed."""
    shown = _Shown(seer)
    kept = LOST if out is None else f"finished work is kept in {os.fspath(out)}: the same call resumes"
    with Crew(workers, kept) as crew:
        # Before the journal is open, so that forked workers do not inherit its lock.
        crew.hello(task)
        collector = SweepCollector(task._native, axes, sizes=sizes, out=out)
        try:
            shown.begin("points", *collector.points())

            def units() -> Iterator[Unit]:
                number = 0
                while (unit := collector.next_unit(1)) is not None:
                    yield Unit(number, unit[0], unit[2])
                    number += 1

            points = 0

            def keep(done: Done) -> None:
                nonlocal points
                points = collector.keep([(unit.content, found) for unit, found in done])

            context = _units.context(task, collector.shared())
            crew.run(context, units(), collector.segments_left(), keep, lambda units: shown.advance(units and points))
            return collector.finish()
        finally:
            collector.close()


def design(task: Task, settings: str, workers: Workers, seer: Progress | None) -> Kept:
    """Searches for a design from every start; ``settings`` are all settings as JSON."""
    shown = _Shown(seer)
    collector = DesignCollector(task._native, settings)
    clock = time.perf_counter()
    with Crew(workers, LOST) as crew:
        crew.hello(task)
        found = _starts(task, crew, collector, shown, "starts")
    return collector.finish(found, time.perf_counter() - clock)


def robustness(
    task: Task,
    designs: Chosen,
    vary: Vary,
    sizes: tuple[int, int],
    workers: Workers,
    seer: Progress | None,
) -> Kept:
    """Costs of designs as a noise grows; ``sizes`` are roll-outs and seed."""
    shown = _Shown(seer)
    collector = RobustnessCollector(task._native, designs, vary, sizes)
    with Crew(workers, LOST) as crew:
        crew.hello(task)
        optimum = collector.optimum()
        starts = [] if optimum is None else _starts(task, crew, optimum, shown, "starts of the optimum")
        context = _units.context(task, collector.shared(starts))
        planned, cells = collector.designs(), collector.cells()
        shown.begin("designs and levels", 0, len(planned) + len(cells))
        designed = _all(crew, context, planned, shown)
        sampled = _all(crew, context, cells, shown)
    return collector.finish(designed, sampled)


def _starts(task: Task, crew: Crew, collector: DesignCollector, shown: _Shown, what: str) -> list[bytes]:
    units = collector.units()
    shown.begin(what, 0, len(units))
    return _all(crew, _units.context(task, collector.shared()), units, shown)


def _all(crew: Crew, context: _units.Context, units: list[tuple[bytes, int, str]], shown: _Shown) -> list[bytes]:
    """The results of all units, in their order."""
    found = [b""] * len(units)

    def keep(done: Done) -> None:
        for unit, result in done:
            found[unit.number] = result

    given = (Unit(number, content, words) for number, (content, _, words) in enumerate(units))
    crew.run(context, given, len(units), keep, shown.advance)
    return found
