"""Shared by the peer benchmarks: one thread, timer, JSON lines."""
import os

for _k in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_k, "1")

import json
import statistics
import time


def timeit(fn, reps=200, inner=1, warmup=3):
    """Times `fn()` (which does `inner` units of work) `reps` times; microseconds per unit, by the wall
    clock and by the CPU time of the process (which leaves out what other processes took from the core)."""
    for _ in range(warmup):
        fn()
    wall, cpu = [], []
    clock, used = time.perf_counter, time.process_time
    for _ in range(reps):
        c0 = used()
        t0 = clock()
        fn()
        wall.append(clock() - t0)
        cpu.append(used() - c0)
    us = 1e6 / inner
    return {"n": reps, "inner": inner, "min_us": min(wall) * us, "median_us": statistics.median(wall) * us,
            "cpu_min_us": min(cpu) * us, "cpu_median_us": statistics.median(cpu) * us}


def emit(peer, name, stats, **size):
    rec = {"peer": peer, "name": name, **stats, **size}
    rec["load1"] = round(os.getloadavg()[0], 2)
    rec["cpus"] = sorted(os.sched_getaffinity(0))
    rec["t"] = round(time.time(), 1)
    print(json.dumps(rec), flush=True)
    return rec


