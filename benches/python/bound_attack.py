"""Attacks proved bounds: random plants of kinds that are hard on rounding, against sensors that achieve less.

    python benches/python/bound_attack.py [--stationary] [--first 0] [--count 40] [--kinds unit_circle,delay,..]

Needs supple and mpmath. The law of least cost is computed here in 200 digits, and each random sensor's information and cost
by its Kalman filter: over a horizon, or per step in the steady state. At that cost the bound must not be above that
information, the least cost must be that of the law here, and the virtual sensor of a stationary bound must achieve what is
reported. Bounds that are refused or not proved are counted, which is honest; the others are wrong, and end the program
with 1.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field

import mpmath
import numpy as np
from bound_digits import (
    DIGITS,
    Filtered,
    Law,
    NoLaw,
    Seen,
    Wide,
    eliminated,
    in_rows,
    largest,
    narrow,
    stationary_law,
    steady_filter,
    wide,
    with_weak,
)
from bound_plants import KINDS, Array, Plant

import supple
from supple.bounds import BoundReport

#: Sensors tried for each system.
SENSORS = 4


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
        form = stage + f.T.dot(s).dot(f)
        found = eliminated(form, np.abs(stage) + np.abs(f.T).dot(np.abs(s)).dot(np.abs(f)), n)
        if found is None:
            return None
        s = found.left
        prices.append(narrow(found.rows.T.dot(found.rows)))
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

    def bound(self, name: str, task: supple.Task, cost: float, *, stationary: bool = False) -> BoundReport | None:
        """The proved bound at a cost; counts it, or why there is none."""
        try:
            bound = task.bound(cost=cost, stationary=stationary).tasks["linear"]
        except supple.SuppleError as error:
            self.refused += 1
            self.reasons[f"{name}: {error}"] += 1
            return None
        if not bound.proved:
            self.unproved += 1
            self.reasons[f"{name}: {bound.not_proved}"] += 1
            return None
        self.proved += 1
        return bound


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
    try:
        task = linear(plant, steps, initial)
    except supple.SuppleError as error:
        count.refused += len(tried)
        count.reasons[f"{kind} {seed}: {error}"] += len(tried)
        return
    for bits, paid in tried:
        bound = count.bound(f"{kind} {seed}", task, least + paid)
        if bound is None:
            continue
        lower = bound.minimum_lower_bits_per_step * steps
        if lower > bits * (1.0 + 1e-7) + 1e-9:
            count.wrong.append(f"{kind} {seed}: at least {lower} bits, and a sensor has {bits}")
        if abs(bound.minimum_cost - least) > 1e-9 * abs(least):
            count.wrong.append(f"{kind} {seed}: costs at least {bound.minimum_cost}, and {least} in {DIGITS} digits")


def random_sensor(seen: Seen, draw: np.random.Generator) -> tuple[Array, Array]:
    """``C``, of what may cost something, and the variances of its noise."""
    rank, scale = 1 + int(draw.integers(2)), 10.0 ** draw.uniform(-2.0, 2.0)
    of = narrow(seen.U) if draw.integers(2) else np.eye(len(seen.A))
    c = draw.normal(size=(rank, len(of))) @ of
    w = narrow(seen.W)
    w = w + np.eye(len(w)) * (0.1 * np.trace(w) / len(w) if w.any() else 1.0)
    return c, np.full(rank, scale * max(np.trace(c @ w @ c.T), 1e-12))


def virtual_sensor(plant: Plant, seen: Seen, bound: BoundReport) -> tuple[Seen, Wide, Wide, Array] | None:
    """The virtual sensor as printed: the states that matter to it, what it measures of them, its variances and its gain.

    What it measures of states that never cost anything is left out where it is rounding.
    """
    rank, n = bound.virtual_sensor.rank, len(plant.A)
    variances = wide(bound.virtual_sensor.variances[0].reshape(1, rank))[0]
    c = wide(bound.virtual_sensor.measurement[0].reshape(rank, n)).dot(seen.D)
    read, units = c.dot(seen.T.T), np.diag(narrow(seen.D))
    if any(largest(row) > 1e-9 * largest(of) for row, of in zip(c - read.dot(seen.T), c)):
        inverse = wide(np.diag(1.0 / units))
        priced = seen.U.dot(seen.T).dot(inverse)
        other = in_rows(plant, np.vstack([priced, c.dot(inverse)]), priced)
        if other is None:
            return None
        seen, read = other, c.dot(other.T.T)
    gain = seen.T.dot(wide(bound.virtual_sensor.gain[0].reshape(n, rank) / units[:, None]))
    return seen, read, variances, narrow(gain)


def wrong_sensor(of: Filtered, gain: Array, least: float, paid: float, bound: BoundReport) -> list[str]:
    """What a virtual sensor does not achieve."""
    found, achieved, costs = [], float(of.bits), float(of.paid)
    says, at = bound.achieved_bits_per_step, bound.achieved_cost
    if abs(achieved - says) > 1e-7 * achieved + 1e-9:
        found.append(f"the virtual sensor achieves {says} bits, and {achieved} in {DIGITS} digits")
    if abs(costs + least - at) > 1e-6 * paid + 1e-9 * least:
        found.append(f"the virtual sensor costs {at}, and {costs + least} in {DIGITS} digits")
    sizes = np.sqrt(np.abs(np.diag(narrow(of.covariance))))
    kept, best = sizes > 1e-6 * sizes.max(initial=0.0), narrow(of.gain)[:, : gain.shape[1]]
    size, off = (np.abs(x[kept] / sizes[kept, None]) for x in (best, gain - best))
    if np.any(off > 1e-5 * size.max(axis=0, initial=0.0)):
        found.append(f"the gain of the virtual sensor is {gain.tolist()}, and {best.tolist()}")
    return found


def wrongs(plant: Plant, known: Law, bound: BoundReport, bits: float, paid: float) -> list[str]:
    """What is wrong with a proved stationary bound at the cost of a sensor."""
    least, found = float(known.least), []
    # It is proved for a plant that differs by this: the least cost may be off by as much.
    off = 1e-14 + 10.0 * (bound.proof_distance or 0.0)
    above = bits * (1.0 + 1e-7) + 1e-9 + bound.price_bits_per_cost * off * least
    for what in ("minimum_lower", "closed_form"):
        lower = getattr(bound, f"{what}_bits_per_step")
        if lower > above:
            found.append(f"{what}: at least {lower} bits, and a sensor has {bits}")
    if abs(bound.minimum_cost - least) > 1e-9 * least + 1e-9 * paid:
        found.append(f"costs at least {bound.minimum_cost}, and {least} in {DIGITS} digits")
    if bound.achieved_bits_per_step is None or bound.achieved_cost is None:
        return found
    sensor = virtual_sensor(plant, known.seen, bound)
    if sensor is None:
        return found
    *sensor, gain = sensor
    missed = []
    for steady in (steady_filter, with_weak):
        of = steady(*sensor)
        missed = (
            ["the virtual sensor has no steady state"] if of is None else wrong_sensor(of, gain, least, paid, bound)
        )
        if not missed:
            break
    return found + missed


def attack_stationary(kind: str, seed: int, count: Count) -> None:
    """One plant in the steady state, and its sensors."""
    draw = np.random.default_rng([list(KINDS).index(kind), seed, 1])
    plant = KINDS[kind](draw)
    n = len(plant.A)
    name = f"{kind} {seed}"
    try:
        known = stationary_law(plant)
    except NoLaw:
        task = linear(plant, 2, np.eye(n))
        try:
            bound = task.bound(cost=1.0, stationary=True).tasks["linear"]
        except supple.SuppleError:
            return
        if bound.proved and bound.minimum_cost < np.inf:
            count.wrong.append(f"{name}: no law has a finite cost, and a bound is proved")
        return
    if known is None or not len(known.seen.U):
        return
    least, tried = float(known.least), []
    for _ in range(SENSORS):
        c, variances = random_sensor(known.seen, draw)
        filtered = steady_filter(known.seen, wide(c), wide(variances[None])[0])
        if filtered is not None and filtered.paid > max(1e-6 * least, 1e-9 * known.seen.cost(known.seen.unknown())):
            tried.append((float(filtered.bits), float(filtered.paid)))
    if not tried:
        return
    count.systems += 1
    task = linear(plant, 2, np.eye(n))
    for bits, paid in tried:
        bound = count.bound(name, task, least + paid, stationary=True)
        if bound is None:
            continue
        count.wrong += [f"{name}: {what}" for what in wrongs(plant, known, bound, bits, paid)]


def linear(plant: Plant, steps: int, initial: Array) -> supple.Task:
    """A task with sensors of all states."""
    n = len(plant.A)
    return supple.linear(plant.A, plant.B, np.eye(n), plant.W, np.ones(n), initial, plant.Q, plant.R, N=steps)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stationary", action="store_true", help="bounds per step of the steady state")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--kinds", default=",".join(KINDS))
    options = parser.parse_args()
    one = attack_stationary if options.stationary else attack
    print(f"{'kind':16}{'systems':>8}{'proved':>8}{'unproved':>9}{'refused':>8}{'wrong':>7}")
    wrong, reasons = [], Counter()
    for kind in options.kinds.split(","):
        count = Count()
        for seed in range(options.first, options.first + options.count):
            one(kind, seed, count)
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
