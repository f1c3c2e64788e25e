"""Attacks the bounds over a horizon: random systems of kinds that are hard on rounding, against sensors that achieve less.

    python benches/python/bound_attack.py [--first 0] [--count 40] [--kinds unit_circle,delay,..]

Needs supple and mpmath. The law of least cost is computed here in 200 digits, and each random sensor's information and cost
by its Kalman filter. At that cost the bound must not be above that information, and the least cost must be that of the law
here. Bounds that are refused or not proved are counted, which is honest; the others are wrong, and end the program with 1.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field

import mpmath
import numpy as np
from numpy.typing import NDArray

import supple

Array = NDArray[np.float64]
DIGITS = 200
#: Pivots below this share of what they are summed from are 0. Between this and the other, what is 0 is decided by how the
#: plant was rounded: the least cost means nothing.
NOTHING, ROUNDED = mpmath.mpf(10) ** (-60), mpmath.mpf(10) ** (-24)
#: Sensors tried for each system.
SENSORS = 4


@dataclass
class Plant:
    """``x+ = A x + B u + w`` with the cost ``x'Qx + u'Ru``."""

    A: Array
    B: Array
    W: Array
    Q: Array
    R: Array

    def in_units(self, scales: Array) -> Plant:
        """The same with states in other units."""
        inverse = 1.0 / scales
        a = inverse[:, None] * self.A * scales
        w = inverse[:, None] * self.W * inverse
        return Plant(a, inverse[:, None] * self.B, w, scales[:, None] * self.Q * scales, self.R)


def dyadic(a: Array) -> Array:
    """Numbers of few digits: squares and sums of these are exact, so that a cost made of them is semidefinite exactly."""
    return np.round(8.0 * a) / 8.0


def unit_circle(draw: np.random.Generator) -> Plant:
    """Modes on the unit circle, single and double, of which few directions cost something."""
    n, m = int(draw.integers(2, 6)), int(draw.integers(1, 3))
    blocks, i = np.zeros((n, n)), 0
    while i < n:
        kind = int(draw.integers(5))
        if kind == 0 and i + 1 < n:
            angle = draw.uniform(0.1, 3.0)
            blocks[i : i + 2, i : i + 2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            i += 2
        elif kind == 1 and i + 1 < n:
            blocks[i : i + 2, i : i + 2] = [[1.0, 1.0], [0.0, 1.0]]
            i += 2
        else:
            blocks[i, i] = [draw.choice([-1.0, 1.0]), draw.uniform(1.05, 2.0), draw.uniform(-0.95, 0.95)][kind % 3]
            i += 1
    turn = np.linalg.qr(draw.normal(size=(n, n)))[0]
    g, q = draw.normal(size=(n, n)), dyadic(draw.normal(size=(int(draw.integers(1, n)), n)))
    prices = np.eye(m) * draw.choice([0.0, 0.5])
    plant = Plant(turn @ blocks @ turn.T, draw.normal(size=(n, m)), 0.3 * g @ g.T, q.T @ q, prices)
    return plant.in_units(2.0 ** draw.integers(-10, 11, size=n))


def free_controls(draw: np.random.Generator) -> Plant:
    """Round numbers, controls without a price."""
    n = int(draw.integers(2, 5))
    a, c = np.round(1.2 * draw.normal(size=(n, n)), 1), dyadic(draw.normal(size=(1, n)))
    g = np.round(draw.normal(size=(n, n)), 1)
    return Plant(a, np.round(draw.normal(size=(n, 1)), 1), g @ g.T + 0.1 * np.eye(n), c.T @ c, np.zeros((1, 1)))


def zeros_outside(draw: np.random.Generator) -> Plant:
    """Controls without a price, of plants with zeros inside, on and outside of the unit circle."""
    n = int(draw.integers(2, 6))
    a = np.zeros((n, n))
    a[1:, :-1] = np.eye(n - 1)
    a[0] = 0.5 * draw.normal(size=n)
    c = np.poly(draw.choice([0.5, -0.5, 1.5, 2.0, -3.0, 1.0625, 1.0], size=n - 1))
    b, g = np.eye(n)[:, :1], draw.normal(size=(n, n))
    w = b @ b.T if draw.integers(2) else 0.2 * g @ g.T + 0.05 * np.eye(n)
    return Plant(a, b, w, np.outer(c, c), np.zeros((1, 1)))


def singular(draw: np.random.Generator) -> Plant:
    """Round and sparse numbers; everything may be singular, and controls may do the same."""
    n, m = int(draw.integers(2, 6)), int(draw.integers(1, 4))
    a = np.round(draw.normal(size=(n, n)) * draw.choice([0.5, 1.0, 2.0]), 1) * (draw.uniform(size=(n, n)) < 0.6)
    b = np.round(draw.normal(size=(n, m)), 1) * (draw.uniform(size=(n, m)) < 0.6)
    g = np.round(draw.normal(size=(n, int(draw.integers(n + 1)))), 1)
    q = dyadic(draw.normal(size=(int(draw.integers(1, n + 1)), n)))
    r = dyadic(draw.normal(size=(int(draw.integers(m + 1)), m)))
    return Plant(a, b, g @ g.T, q.T @ q, r.T @ r)


def growth(draw: np.random.Generator) -> Plant:
    """Unstable plants with little or no process noise."""
    n, m = int(draw.integers(1, 5)), int(draw.integers(1, 3))
    w = np.zeros((n, n))
    w[0, 0] = draw.choice([0.0, 0.5])
    q = dyadic(draw.normal(size=(int(draw.integers(1, n + 1)), n)))
    return Plant(
        1.5 * draw.normal(size=(n, n)), draw.normal(size=(n, m)), w, q.T @ q, np.eye(m) * draw.choice([0, 1.0])
    )


def delay(draw: np.random.Generator) -> Plant:
    """Delay lines that a state sums up, in unequal units."""
    n, fall = int(draw.integers(3, 13)), draw.uniform(0.2, 0.95)
    a, w, q = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    a[np.arange(1, n - 1), np.arange(n - 2)] = 1.0
    a[n - 1, : n - 1] = fall ** np.arange(n - 1)
    a[n - 1, n - 1] = draw.choice([0.0, 0.5, 1.0, 1.2])
    w[0, 0] = q[n - 1, n - 1] = 1.0
    plant = Plant(a, -np.eye(n)[:, n - 1 :], w, q, np.full((1, 1), draw.choice([0.0, 0.125])))
    return plant.in_units(2.0 ** draw.integers(-10, 11, size=n))


KINDS = {kind.__name__: kind for kind in (unit_circle, free_controls, zeros_outside, singular, growth, delay)}


def wide(a: Array) -> NDArray[np.object_]:
    """In as many digits as mpmath has."""
    return np.array([[mpmath.mpf(float(x)) for x in row] for row in a], dtype=object)


def law(plant: Plant, steps: int, initial: Array) -> tuple[float, list[Array]] | None:
    """The least expected cost with the state known, and the prices of not knowing it; none where rounding decides them."""
    n, m = plant.B.shape
    f = wide(np.hstack([plant.A, plant.B]))
    stage = np.zeros((n + m, n + m), dtype=object)
    stage[:n, :n], stage[n:, n:] = wide(plant.Q), wide(plant.R)
    s, prices = stage[:n, :n].copy(), []
    least = mpmath.mpf(0)
    for _ in range(steps):
        least += (s * wide(plant.W)).sum()
        left = stage + f.T.dot(s).dot(f)
        size = np.abs(stage) + np.abs(f.T).dot(np.abs(s)).dot(np.abs(f))
        price, controls = np.zeros((n, n), dtype=object), list(range(n, n + m))
        while controls:
            k = max(controls, key=lambda k: left[k, k] / size[k, k] if size[k, k] else mpmath.mpf(0))
            if not size[k, k] or left[k, k] / size[k, k] < NOTHING:
                break
            if left[k, k] / size[k, k] < ROUNDED:
                return None
            controls.remove(k)
            row = left[k].copy()
            price = price + np.outer(row[:n], row[:n]) / row[k]
            left = left - np.outer(row, row) / row[k]
        s = (left[:n, :n] + left[:n, :n].T) / 2
        prices.append(price.astype(np.float64))
    return float(least + (s * wide(initial)).sum()), prices[::-1]


def sensor(plant: Plant, prices: list[Array], initial: Array, draw: np.random.Generator) -> tuple[float, float]:
    """Bits of a random sensor over the horizon, and the expected cost of its errors."""
    n, rank, scale = len(plant.A), 1 + int(draw.integers(2)), 10.0 ** draw.uniform(-2.0, 2.0)
    is_aligned = bool(draw.integers(2))
    covariance, bits, paid = initial.copy(), 0.0, 0.0
    for price in prices:
        c = draw.normal(size=(rank, n))
        if is_aligned and price.any():
            values, vectors = np.linalg.eigh(price)
            c = c @ (vectors * np.sqrt(np.clip(values, 0.0, None))).T
        noise = np.eye(rank) * scale * max(np.trace(c @ (plant.W + initial) @ c.T), 1e-12)
        innovation = c @ covariance @ c.T + noise
        gain = np.linalg.solve(innovation, c @ covariance).T
        rest = np.eye(n) - gain @ c
        covariance = rest @ covariance @ rest.T + gain @ noise @ gain.T
        covariance = (covariance + covariance.T) / 2
        bits += 0.5 * float(np.linalg.slogdet(innovation)[1] - np.linalg.slogdet(noise)[1]) / np.log(2.0)
        paid += float(np.sum(price * covariance))
        covariance = plant.A @ covariance @ plant.A.T + plant.W
    return bits, paid


@dataclass
class Count:
    """What came of the systems of a kind."""

    systems: int = 0
    proved: int = 0
    unproved: int = 0
    refused: int = 0
    wrong: list[str] = field(default_factory=list)
    reasons: Counter[str] = field(default_factory=Counter)


def attack(kind: str, seed: int, count: Count) -> None:
    """One system and its sensors."""
    draw = np.random.default_rng([list(KINDS).index(kind), seed])
    plant = KINDS[kind](draw)
    n = len(plant.A)
    steps = int(draw.integers(2, 40 if n < 5 else 15))
    g = draw.normal(size=(n, int(draw.integers(1, n + 1))))
    initial = g @ g.T if draw.integers(3) else np.zeros((n, n))
    known = law(plant, steps, initial)
    if known is None:
        return
    least, prices = known
    tried = [sensor(plant, prices, initial, draw) for _ in range(SENSORS)]
    tried = [(bits, paid) for bits, paid in tried if np.isfinite(bits + paid) and paid > 1e-10 * abs(least)]
    if not tried:
        return
    count.systems += 1
    variance = np.ones(n)
    try:
        task = supple.linear(plant.A, plant.B, np.eye(n), plant.W, variance, initial, plant.Q, plant.R, N=steps)
    except supple.SuppleError as error:
        count.refused += len(tried)
        count.reasons[f"{kind} {seed}: {error}"] += len(tried)
        return
    for bits, paid in tried:
        try:
            bound = task.bound(cost=least + paid).tasks["linear"]
        except supple.SuppleError as error:
            count.refused += 1
            count.reasons[f"{kind} {seed}: {error}"] += 1
            continue
        if not bound.proved:
            count.unproved += 1
            continue
        count.proved += 1
        lower = bound.minimum_lower_bits_per_step * steps
        if lower > bits * (1.0 + 1e-7) + 1e-9:
            count.wrong.append(f"{kind} {seed}: at least {lower} bits, and a sensor has {bits}")
        if abs(bound.minimum_cost - least) > 1e-9 * abs(least):
            count.wrong.append(f"{kind} {seed}: costs at least {bound.minimum_cost}, and {least} in {DIGITS} digits")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--kinds", default=",".join(KINDS))
    options = parser.parse_args()
    mpmath.mp.dps = DIGITS
    print(f"{'kind':16}{'systems':>8}{'proved':>8}{'unproved':>9}{'refused':>8}{'wrong':>7}")
    wrong, reasons = [], Counter()
    for kind in options.kinds.split(","):
        count = Count()
        for seed in range(options.first, options.first + options.count):
            attack(kind, seed, count)
        numbers = (count.systems, count.proved, count.unproved, count.refused, len(count.wrong))
        print(
            f"{kind:16}" + "".join(f"{number:>{width}}" for number, width in zip(numbers, (8, 8, 9, 8, 7))), flush=True
        )
        wrong += count.wrong
        reasons += count.reasons
    print("\n".join([*wrong, *(f"{times} x {reason}" for reason, times in reasons.items())]))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
