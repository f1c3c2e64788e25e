"""How well sweeps scale out: Dask's workers against the threads of one process, and what limits them.

    python benches/python/scaling.py [--side 100] [--rounds 3] [--workers 2] [--million]

Prints, for a sweep of ``tasks/two_mass.toml`` over side x side designs: seconds in the threads of this process and on
Dask's worker processes, one after the other and several times since other programs may use the cores; the same with one
worker killed midway; whether all tables are the same; and what a future, a row in the journal and a design cost.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor, wait
from typing import Any

import supple
from supple import _units
from supple._supple import SweepCollector, Units


class Killer:
    """Progress that kills a worker midway, and counts what it is told."""

    def __init__(self, kill: Callable[[], None] | None) -> None:
        self.kill, self.done, self.total, self.told = kill, 0, 0, 0

    def begin(self, what: str, done: int, total: int) -> None:
        self.done, self.total = done, total

    def advance(self, parts: int) -> None:
        self.done, self.told = self.done + parts, self.told + 1
        if self.kill is not None and 2 * self.done >= self.total:
            kill, self.kill = self.kill, None
            kill()

    def say(self, message: str) -> None:
        pass


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds, and what came of it."""
    clock = time.perf_counter()
    result = work()
    return time.perf_counter() - clock, result


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--side", type=int, default=100)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--million", action="store_true", help="also keep a million rows")
    chosen = options.parse_args()
    import distributed

    task = supple.load("tasks/two_mass.toml")
    grid = {"k1": f"log:50:600:{chosen.side}", "k2": f"log:100:600:{chosen.side}"}
    designs = chosen.side**2
    with (
        distributed.LocalCluster(n_workers=chosen.workers, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as pool,
    ):
        future(pool)
        compare(task, grid, chosen.rounds, chosen.workers, pool)
        victim = min(client.run(os.getpid).values())
        killer = Killer(lambda: os.kill(victim, signal.SIGKILL))
        seconds, found = timed(lambda: task.sweep(grid, executor=pool, progress=killer))
        same = found.to_json() == task.sweep(grid).to_json()
        print(f"one worker killed midway: {seconds:.2f} s, {killer.done} of {designs} designs, ", end="")
        print(f"progress told {killer.told} times, {'the same table' if same else 'ANOTHER TABLE'}")
    rows(task, grid)
    rates()
    if chosen.million:
        million(task)


def compare(task: supple.Task, grid: dict[str, str], rounds: int, workers: int, pool: Executor) -> None:
    """Threads and workers, one after the other."""
    ratios = []
    for number in range(rounds):
        before = cores()
        threads, here = timed(lambda: task.sweep(grid, jobs=workers))
        between = cores()
        dask, there = timed(lambda: task.sweep(grid, executor=pool))
        used = [between - before, cores() - between]
        ratios.append(threads / dask)
        same = "the same table" if here.to_json() == there.to_json() else "ANOTHER TABLE"
        print(f"round {number}: {workers} threads {threads:.2f} s, {workers} workers {dask:.2f} s, ", end="")
        print(f"throughput {100 * ratios[-1]:.1f} %, by time of cores {100 * used[0] / used[1]:.1f} %, {same}")
    print(f"throughput of workers, median: {100 * statistics.median(ratios):.1f} % of the threads'")


def cores() -> float:
    """Seconds that cores worked for this process and its children, which other programs hardly change."""
    import psutil

    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    return float(sum(sum(process.cpu_times()[:2]) for process in processes))


def future(pool: Executor, count: int = 1000) -> None:
    """What a future costs that does next to nothing."""
    wait([pool.submit(_units.hello, "", str(number)) for number in range(20)])
    seconds, _ = timed(lambda: wait([pool.submit(_units.hello, "", str(number)) for number in range(count)]))
    print(f"a future: {1e3 * seconds / count:.2f} ms with all workers")


def rows(task: supple.Task, grid: dict[str, str]) -> None:
    """How fast the process that asks keeps rows, in memory and in a journal."""
    axes = list(grid.items())
    with tempfile.TemporaryDirectory(dir=".") as folder:
        for where, out in [("memory", None), ("a journal", folder)]:
            collector = SweepCollector(task._native, axes, sizes=(0, 0, 0), out=out)  # type: ignore[arg-type]
            units = Units(task._native, collector.shared())
            given = [unit[0] for unit in iter(lambda: collector.next_unit(1), None) if unit is not None]
            done = list(zip(given[:200], units.work(given[:200])))
            parts = [done[first : first + 20] for first in range(0, len(done), 20)]
            seconds, kept = timed(lambda: sum(collector.keep(part) for part in parts))
            print(f"rows kept in {where}: {kept / seconds:.0f} per second")
            collector.close()


def million(task: supple.Task) -> None:
    """What a sweep of a million designs costs the process that asks, the designs themselves not counted."""
    axes = [("k1", "log:50:600:1000"), ("k2", "log:100:600:1000")]
    with tempfile.TemporaryDirectory(dir=".") as folder:
        collector = SweepCollector(task._native, axes, sizes=(0, 0, 0), out=folder)  # type: ignore[arg-type]
        units = Units(task._native, collector.shared())
        rows: dict[int, bytes] = {}
        clock, kept = time.perf_counter(), 0
        while given := [unit for unit in (collector.next_unit(1) for _ in range(200)) if unit is not None]:
            # All segments of a length get the rows of the first one.
            for unit, _, words in given:
                first, last = (int(word) for word in words.split(",")[0].replace("points ", "").split(" to "))
                if last - first not in rows:
                    rows[last - first] = units.work([unit])[0]
            lengths = [words.split(",")[0].replace("points ", "").split(" to ") for _, _, words in given]
            done = [(unit[0], rows[int(last) - int(first)]) for unit, (first, last) in zip(given, lengths)]
            kept += collector.keep(done)
        seconds = time.perf_counter() - clock
        size = os.path.getsize(os.path.join(folder, "journal.redb")) / 1e6
        finished, result = timed(lambda: collector.finish([]))
        saved, _ = timed(lambda: result.save(folder))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{kept} rows: kept in {seconds:.0f} s, a journal of {size:.0f} MB; ", end="")
        print(f"the table read in {finished:.1f} s and saved in {saved:.1f} s; {peak:.2f} GB of memory at most")


def rates() -> None:
    """Designs per second of one core, by its own time, which other programs do not change."""
    for name, grid in [
        ("two_mass", {"k1": "log:60:600:8", "k2": "log:100:600:40"}),
        ("iiwa_door", {"k1": "log:1e4:1e6:8"}),
    ]:
        task = supple.load(f"tasks/{name}.toml")
        clock = time.process_time()
        found = task.sweep(grid, jobs=1)
        seconds = time.process_time() - clock
        print(f"{name}: {len(found.table) / seconds:.2f} designs per second and core")


if __name__ == "__main__":
    main()
