"""Workers of an executor: units of work are sent in a bounded number of batches, and their results are collected."""

from __future__ import annotations

import logging
import math
import multiprocessing
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass
from itertools import islice
from types import TracebackType
from typing import TYPE_CHECKING, Any, Union

from . import _units
from ._asked import MOST_WORKERS
from ._supple import __version__, instructions
from .errors import UsageError, WorkerError

if TYPE_CHECKING:
    from .task import Task

__all__ = ["Crew", "Unit", "Workers"]

LOGGER = logging.getLogger("supple")

#: An executor, a number of processes, or a function that makes an executor.
Workers = Union[Executor, int, Callable[[], Executor]]

#: Target computation time of a batch on one core, s, and its limit if the core has other work:
#: much longer than sending it takes, and short enough to balance the load.
BATCH, LONGEST = 0.5, 2.0

#: Maximum number of batches per second: schedulers take about a millisecond for each.
FUTURES = 400

#: Number of batches in flight: initially, and at most.
FEWEST, MOST = 8, 4096

#: Studies larger than this, in bytes, are sent only to workers that do not have them yet.
SMALL = 4096

#: How often a unit is sent to other workers after a worker died with it.
DEATHS = 3

#: Seconds between checks for signals.
WAKE = 0.2


@dataclass
class Unit:
    """A unit of work.

    Attributes:
        number: Its index among all units.
        content: The work to do.
        words: Its description, for people.
        deaths: Number of executors that broke while it was in flight.
    """

    number: int
    content: bytes
    words: str
    deaths: int = 0


#: Completed units, each with the bytes of its result.
Done = list[tuple[Unit, bytes]]
Keep = Callable[[Done], None]
Shown = Callable[[int], None]


class Crew:
    """The workers of an executor, for the duration of one study; recreates executors if possible."""

    def __init__(self, workers: Workers, kept: str) -> None:
        """``kept`` describes, in errors, what happens to completed work."""
        self._executor: Executor
        self._make: Callable[[], Executor] | None = None
        self._kept = kept
        if isinstance(workers, Executor):
            self._executor = workers
            return
        if isinstance(workers, int) and not isinstance(workers, bool) and 1 <= workers <= MOST_WORKERS:
            count = workers
            # Forked processes would inherit locks and open files of this process.
            spawn = multiprocessing.get_context("spawn")
            self._make = lambda: ProcessPoolExecutor(count, mp_context=spawn, initializer=_units.deaf)
        elif callable(workers):
            self._make = workers
        else:
            valid = f"an executor, a number of processes from 1 to {MOST_WORKERS}, or a function that makes an executor"
            raise UsageError(f"executor={workers!r}: {valid}")
        self._executor = self._make()

    def __enter__(self) -> Crew:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._make is not None:
            _end(self._executor, at_once=kind is not None)

    def hello(self, task: Task) -> None:
        """Waits for a worker and asks whether it can work for this process.

        Raises:
            UsageError: If the workers are forked, and would wait forever for the threads of JAX.
            WorkerError: If the worker refuses.
        """
        self._check_forks(task)
        LOGGER.info("waiting for a worker")
        for attempt in range(DEATHS):
            try:
                asked = self._executor.submit(_units.hello, __version__, instructions())
                while not wait([asked], WAKE).done:
                    pass
                refusal = asked.result()
                break
            except (BrokenExecutor, ImportError) as error:
                if isinstance(error, ImportError) or self._make is None or attempt + 1 == DEATHS:
                    raise self._broken(error, "") from error
                self._renew()
        if refusal:
            raise WorkerError(refusal)

    def _check_forks(self, task: Task) -> None:
        method = getattr(getattr(self._executor, "_mp_context", None), "get_start_method", None)
        if method is not None and method() == "fork" and task._calls_jax():
            raise UsageError(
                "executor: its processes are forked, in which functions of JAX never return; give the number of processes, or "
                'ProcessPoolExecutor(..., mp_context=multiprocessing.get_context("spawn"))'
            )

    def run(self, context: _units.Context, units: Iterable[Unit], total: int, keep: Keep, shown: Shown) -> None:
        """Runs all units, at most ``total``, in any order.

        If it ends early, pending work is cancelled and completed work is kept.

        Args:
            context: Data that the units share.
            units: The units.
            total: Maximum number of units.
            keep: Called on this thread with completed units; it either keeps all of them or raises.
            shown: Called with the number of units kept.
        """
        run = _Run(self, context, iter(units), total, keep, shown)
        try:
            run.loop()
        except BaseException:
            run.abandon()
            raise

    def _renew(self) -> None:
        assert self._make is not None
        _end(self._executor, at_once=True)
        self._executor = self._make()

    def _broken(self, error: BaseException, what: str) -> WorkerError:
        if isinstance(error, ImportError):
            return WorkerError(f"a worker cannot do this work: {error}; install supple {__version__} there")
        told = f"{what} killed its worker {DEATHS} times" if what else f"a worker process ended: {error}"
        advice = "" if self._make else "; pass executor=N or a function that makes an executor to recover automatically"
        return WorkerError(f"{told}; {self._kept}{advice}")


class _Run:
    """The units of one study that are in flight."""

    def __init__(
        self,
        crew: Crew,
        context: _units.Context,
        units: Iterator[Unit],
        total: int,
        keep: Keep,
        shown: Shown,
    ) -> None:
        self.crew = crew
        self.context = context
        self.units = units
        self.keep, self.shown = keep, shown
        self.left = total
        self.nonce = uuid.uuid4().hex
        self.flying: dict[Future[Any], list[Unit]] = {}
        # Batches to repeat, and whether the study has to be sent with each.
        self.again: deque[tuple[list[Unit], bool]] = deque()
        # Units that may have killed workers, to run one at a time.
        self.suspects: deque[Unit] = deque()
        self.pace = _Pace()
        # Number of broken executors since a unit was last completed.
        self.breaks = 0

    def loop(self) -> None:
        while True:
            try:
                self.fill()
                if not self.flying:
                    return
                done = wait(self.flying, WAKE, return_when=FIRST_COMPLETED).done
                self.take(done)
            except BrokenExecutor as error:
                self.mend(error)

    def fill(self) -> None:
        """Sends batches until enough of them are in flight."""
        if self.suspects and not self.again:
            # Alone, so that the failing unit can be identified.
            if not self.flying:
                self.submit([self.suspects.popleft()], True)
            return
        while len(self.flying) < self.pace.window:
            if self.again:
                batch, whole = self.again.popleft()
            else:
                batch, whole = list(islice(self.units, self.pace.batch(self.left))), False
                self.left -= len(batch)
            if not batch:
                return
            self.submit(batch, whole)

    def submit(self, batch: list[Unit], whole: bool) -> None:
        payload = self.context.payload if whole or len(self.context.payload) <= SMALL else None
        about = (self.context.version, self.context.instructions, self.context.key, payload)
        nonce = f"{self.nonce}-{batch[0].number}-{len(batch)}-{batch[0].deaths}"
        try:
            future = self.crew._executor.submit(_units.work, *about, [unit.content for unit in batch], nonce)
        except BaseException:
            self.again.appendleft((batch, whole))
            raise
        self.flying[future] = batch

    def take(self, futures: Iterable[Future[Any]]) -> None:
        """Delivers completed units, and raises errors that workers raised or reported."""
        done: Done = []
        landed = []
        raised: BaseException | None = None
        for future in futures:
            try:
                answer: _units.Answer = future.result()
            except BaseException as error:
                # Units of broken executors still count as in flight: all of them have to be repeated.
                raised = raised or self.reason(future, error)
                continue
            batch = self.flying[future]
            landed.append(future)
            if answer.refusal:
                raised = raised or WorkerError(answer.refusal)
            elif answer.missing:
                self.again.append((batch, True))
            else:
                done += zip(batch, answer.found)
                self.pace.note(len(batch), answer.seconds, answer.busy)
        if done:
            self.keep(done)
            self.breaks = 0
        for future in landed:
            del self.flying[future]
        self.shown(len(done))
        if raised is not None:
            raise raised

    def reason(self, future: Future[Any], error: BaseException) -> BaseException:
        """The exception to raise for the exception of a future."""
        if isinstance(error, ImportError):
            told = self.crew._broken(error, "")
        elif isinstance(error, CancelledError) or type(error).__name__ == "KilledWorker":
            told = self.lost(future, error)
        else:
            return error
        told.__cause__ = error
        return told

    def lost(self, future: Future[Any], error: BaseException) -> WorkerError:
        batch = self.flying[future]
        what = batch[0].words if len(batch) == 1 else f"{batch[0].words}, and {len(batch) - 1} units after it,"
        return WorkerError(f"{what} got lost: {type(error).__name__}: {error}; {self.crew._kept}")

    def mend(self, error: BrokenExecutor) -> None:
        """Makes a new executor and repeats the units that were in flight."""
        arrived = [future for future in self.flying if future.done() and not future.cancelled()]
        self.take([future for future in arrived if future.exception() is None])
        self.breaks += 1
        if self.crew._make is None or self.breaks > DEATHS + 1:
            raise self.crew._broken(error, "") from error
        alone = len(self.flying) == 1 and sum(len(batch) for batch in self.flying.values()) == 1
        for batch in self.flying.values():
            for unit in batch:
                unit.deaths += 1
                if alone and unit.deaths >= DEATHS:
                    raise self.crew._broken(error, unit.words) from error
            if any(unit.deaths > 1 for unit in batch):
                self.suspects.extend(batch)
            else:
                self.again.append((batch, True))
        LOGGER.warning("a worker process ended; %d batches are done again", len(self.flying))
        self.flying.clear()
        self.crew._renew()

    def abandon(self) -> None:
        """Cancels pending units and delivers completed ones."""
        # A process pool that is about to end fails on cancelled futures.
        if self.crew._make is None or not isinstance(self.crew._executor, ProcessPoolExecutor):
            for future in self.flying:
                future.cancel()
        arrived = [future for future in self.flying if future.done() and not future.cancelled()]
        for future in arrived:
            if future.exception() is None:
                try:
                    self.take([future])
                except Exception as error:
                    LOGGER.warning("a unit that was done is lost: %s", error)


class _Pace:
    """Controls the number of units per batch and of batches in flight; results do not depend on either."""

    def __init__(self) -> None:
        self.window = FEWEST
        # Recent seconds per unit, and recent core seconds per unit.
        self.by_unit = math.inf
        self.core = math.inf
        # Number of busy workers.
        self.busy = 1.0
        self.seconds = 0.0
        self.longest = 0.0
        self.since = time.perf_counter()

    def batch(self, left: int) -> int:
        """Number of units in the next batch, given the number of units left."""
        # More futures per second than this would overload a scheduler.
        factor = max(1.0, self.busy / FUTURES / BATCH)
        wanted = factor * min(BATCH / self.core, LONGEST / self.by_unit)
        # The last batches are small, so that all workers end at about the same time.
        share = left / (3 * self.busy)
        return max(1, int(min(wanted, share)))

    def note(self, units: int, seconds: float, core: float) -> None:
        """Records the seconds and core seconds that a number of units took."""
        self.by_unit = _of_late(self.by_unit, seconds / units)
        self.core = _of_late(self.core, core / units)
        self.seconds += seconds
        self.longest = max(self.longest, seconds)
        elapsed = time.perf_counter() - self.since
        # Batches that began earlier count in full: as long ones, so that they have little weight.
        if elapsed < max(2 * BATCH, 4 * self.longest):
            return
        self.busy = max(1.0, self.seconds / elapsed)
        # If more than half of the sent batches are running, some workers have nothing waiting.
        if self.busy > self.window / 2:
            self.window = min(2 * self.window, MOST)
        self.seconds, self.longest, self.since = 0.0, 0.0, time.perf_counter()


def _of_late(before: float, now: float) -> float:
    """A mean of the last few values."""
    now = max(now, 1e-6)
    return now if math.isinf(before) else 0.8 * before + 0.2 * now


def _end(executor: Executor, at_once: bool) -> None:
    """Shuts an executor down immediately, ending its processes if possible."""
    if not (at_once and isinstance(executor, ProcessPoolExecutor)):
        executor.shutdown(wait=not at_once)
        return
    for process in list((getattr(executor, "_processes", None) or {}).values()):
        process.terminate()
    executor.shutdown(wait=True)
