"""Makes ``crates/supple-lqg/tests/golden/filter.json``: filters of sensors of very different precision, in 120 digits.

    python benches/python/filter_oracle.py crates/supple-lqg/tests/golden/filter.json

Needs mpmath. Every number of a case is a float64, and what is computed from them is exact to the last digit of one.
"""

from __future__ import annotations

import itertools
import json
import random
import sys
from typing import Any

from mpmath import mp, mpf

mp.dps = 120

#: Step of the central differences of gradients, relative.
STEP = mpf(10) ** -30

Rows = list[list[float]]


def rows_of(matrix: mp.matrix) -> Rows:
    """The matrix as rounded rows."""
    return [[float(matrix[i, j]) for j in range(matrix.cols)] for i in range(matrix.rows)]


def run(case: dict[str, Any], v: mp.matrix) -> tuple[list[mpf], list[mp.matrix]]:
    """Nats at every step, and the covariance after each measurement."""
    a, c = mp.matrix(case["A"]), mp.matrix(case["C"])
    w, p = mp.matrix(case["W"]), mp.matrix(case["X0"])
    nats, after = [], []
    for step in range(case["steps"] + 1):
        if step > 0:
            p = a * after[-1] * a.T + w
        s = c * p * c.T + v
        nats.append(mp.log(mp.det(s) / mp.det(v)) / 2)
        after.append(p - p * c.T * mp.inverse(s) * c * p)
    return nats, after


def solve(case: dict[str, Any]) -> dict[str, Any]:
    """The case with its answers."""
    v = mp.matrix(case["V"])
    nats, after = run(case, v)

    def total(i: int, factor: mpf) -> mpf:
        changed = v.copy()
        changed[i, i] *= factor
        return mp.fsum(run(case, changed)[0])

    # By the logarithm of each variance.
    slopes = [(total(i, 1 + STEP) - total(i, 1 - STEP)) / (2 * STEP) for i in range(v.rows)]
    return case | {
        "nats": [float(value) for value in nats],
        "total": float(mp.fsum(nats)),
        "corrected": rows_of(after[-1]),
        "by_log_variance": [float(slope) for slope in slopes],
    }


def diagonal(values: list[float]) -> Rows:
    """A diagonal matrix."""
    return [[value if i == j else 0.0 for j in range(len(values))] for i, value in enumerate(values)]


def covariance(draw: random.Random, n: int) -> Rows:
    """A random covariance, positive definite."""
    g = [[draw.gauss(0, 1) for _ in range(n)] for _ in range(n)]
    return [
        [sum(x * y for x, y in zip(r, s, strict=True)) + 0.1 * (i == j) for j, s in enumerate(g)]
        for i, r in enumerate(g)
    ]


def cases() -> list[dict[str, Any]]:
    """All cases."""
    found: list[dict[str, Any]] = []

    def add(name: str, a: Rows, c: Rows, w: Rows, v: Rows, x0: Rows, steps: int) -> None:
        found.append({"name": name, "A": a, "C": c, "W": w, "V": v, "X0": x0, "steps": steps})

    tiny = diagonal([1e-12, 1e-12])
    add("one state, thousandfold", [[1.0]], [[1e3], [1.0]], [[0.0]], tiny, [[1e2]], 0)
    add("one state, thousandfold, wide", [[1.0]], [[1e3], [1.0]], [[0.0]], tiny, [[1e4]], 0)
    add("one state, twice", [[1.0]], [[1.0], [1.0]], [[0.0]], tiny, [[1e6]], 0)
    for decade in range(0, 17):
        draw = random.Random(decade)
        small = 10.0**-decade
        one = [[0.9]]
        add(f"one state, 1e-{decade}", one, [[1.0], [2.0]], [[0.1]], diagonal([1.0, small]), [[1.0]], 6)
        n = 3
        a = [[(1.0 if i == j else 0.0) + 0.2 * draw.gauss(0, 1) for j in range(n)] for i in range(n)]
        c = [[draw.gauss(0, 1) for _ in range(n)] for _ in range(4)]
        v = diagonal([1.0, small, 0.1, 3.0 * small])
        w = [[0.01 * x for x in row] for row in covariance(draw, n)]
        add(f"three states, 1e-{decade}", a, c, w, v, covariance(draw, n), 8)
        # Every measurement is a state; one is measured three times.
        picks = [[float(i == s) for i in range(n)] for s in (1, 0, 1, 1)]
        add(f"states alone, 1e-{decade}", a, picks, w, v, covariance(draw, n), 8)
        # The prior is wide, and nothing disturbs the motion.
        wide = [[x / small for x in row] for row in covariance(draw, n)]
        add(f"wide prior, 1e{decade}", a, c, diagonal([0.0] * n), diagonal([1.0] * 4), wide, 4)
        # Sensors that share noise.
        shared = [
            [(small + 1.0 * (i == j and i > 1)) if i != j or i > 1 else 2.0 * small for j in range(4)] for i in range(4)
        ]
        add(f"shared noise, 1e-{decade}", a, c, w, shared, covariance(draw, n), 8)
    still = [[1.0]]
    fine = [[[1e2], [1e-12]], [[1e6], [1e-8]], [[1e8], [1e-12]], [[1e3], [1e-16]], [[1e8], [1e-20]]]
    for (scale, variance), coarse in itertools.product(((c[0], v[0]) for c, v in fine), (1e-6, 1.0, 1e4)):
        name = f"one state, {scale:.0e} with {variance:.0e} and 1 with {coarse:.0e}"
        for order in ((0, 1), (1, 0)):
            c, v = [[scale], [1.0]], [variance, coarse]
            add(name, still, [c[i] for i in order], [[0.0]], diagonal([v[i] for i in order]), [[1e6]], 1)
    for number in range(60):
        draw = random.Random(1000 + number)
        found.append(far_apart(draw, 16.0 + 0.2 * number) | {"name": f"far apart, {number}"})
    return found


def far_apart(draw: random.Random, decades: float) -> dict[str, Any]:
    """Random sensors, several of them of the same, whose ranges of precision and of what is known before span decades."""

    def size(share: float) -> float:
        return float(f"{10.0 ** (share * draw.uniform(-0.5, 0.5) * decades):.3g}")

    n, p = draw.choice([1, 1, 2, 3]), draw.choice([2, 2, 3])
    a = [[draw.uniform(0.3, 1.2) if i == j else draw.gauss(0, 0.5) for j in range(n)] for i in range(n)]
    if draw.random() < 0.3:
        c = [[float(j == s) for j in range(n)] for s in (draw.randrange(n) for _ in range(p))]
    else:
        c = [[draw.gauss(0, 1) * size(0.25) for _ in range(n)] for _ in range(p)]
        if draw.random() < 0.6:
            c[1] = [x * size(0.25) for x in c[0]]
    x0 = diagonal([size(0.5) for _ in range(n)])
    if draw.random() < 0.4:
        scale = size(0.5)
        x0 = [[scale * x for x in row] for row in covariance(draw, n)]
    w = diagonal([0.0 if draw.random() < 0.4 else 1e-3 * size(0.5) for _ in range(n)])
    v = diagonal([size(0.5) for _ in range(p)])
    return {"A": a, "C": c, "W": w, "V": v, "X0": x0, "steps": draw.choice([1, 2, 5])}


def main() -> None:
    """Writes the file."""
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        lines = ",\n".join(json.dumps(solve(case)) for case in cases())
        file.write(f"[\n{lines}\n]\n")


main()
