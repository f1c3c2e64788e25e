"""Linear systems in many digits: elimination, the stationary law of least cost, and steady Kalman filters.

For ``bound_attack.py``. Needs mpmath. Matrices are arrays of mpmath's numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpmath
import numpy as np
from bound_plants import Array, Plant
from numpy.typing import NDArray

Wide = NDArray[np.object_]

DIGITS = 200
mpmath.mp.dps = DIGITS
ZERO, ONE = mpmath.mpf(0), mpmath.mpf(1)
#: Pivots below this share of what they are summed from are 0. Between this and the other, what is 0 is decided by how the
#: plant was rounded: the least cost means nothing. Lengths are roots of pivots.
NOTHING, ROUNDED = mpmath.mpf(10) ** (-60), mpmath.mpf(10) ** (-24)
#: Doublings of the number of steps, and changes of the last one below which a solution is steady.
DOUBLINGS, STEADY = 40, mpmath.mpf(10) ** (-11)
#: Beyond this growth as many digits are lost as there are.
MOST_GROWTH = mpmath.mpf(10) ** 60


class NoLaw(ValueError):
    """No law keeps the cost finite."""


def wide(a: Array) -> Wide:
    """In as many digits as mpmath has."""
    return np.array([[mpmath.mpf(float(x)) for x in row] for row in a], dtype=object).reshape(np.shape(a))


def narrow(a: Wide) -> Array:
    return a.astype(np.float64)


def identity(n: int) -> Wide:
    return wide(np.eye(n))


def symmetric(a: Wide) -> Wide:
    return (a + a.T) / 2


def largest(a: Wide) -> mpmath.mpf:
    return max((abs(x) for x in a.flat), default=ZERO)


def solved(a: Wide, b: Wide) -> Wide:
    """``a^-1 b``, by elimination with pivots."""
    n = len(a)
    work = np.hstack([a, b])
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(work[i, k]))
        work[[k, pivot]] = work[[pivot, k]]
        work[k, k:] = work[k, k:] / work[k, k]
        for i in range(n):
            if i != k and work[i, k]:
                work[i, k:] = work[i, k:] - work[i, k] * work[k, k:]
    return work[:, n:]


@dataclass
class Eliminated:
    """What is left without the controls, and the controls that have a price with the rows of what they are worth."""

    left: Wide
    controls: list[int]
    rows: Wide


def eliminated(form: Wide, size: Wide, n: int) -> Eliminated | None:
    """A quadratic form of states and controls at the best controls; none where rounding decides which have a price."""
    left, free, used, rows = form, list(range(n, len(form))), [], []
    while free:
        k = max(free, key=lambda k: left[k, k] / size[k, k] if size[k, k] else ZERO)
        if not size[k, k] or left[k, k] / size[k, k] < NOTHING:
            break
        if left[k, k] / size[k, k] < ROUNDED:
            return None
        free.remove(k)
        used.append(k)
        row = left[k] / mpmath.sqrt(left[k, k])
        rows.append(row[:n])
        left = left - np.outer(row, row)
    return Eliminated(symmetric(left[:n, :n]), used, np.array(rows, dtype=object).reshape(len(rows), n))


def doubled(a: Wide, g: Wide, q: Wide, start: Wide, doublings: tuple[int, int] = (0, DOUBLINGS)) -> Wide | None:
    """Where ``X <- q + a'X (I + gX)^-1 a`` leads to from 0, by doubling the number of steps; none where it is not known.

    What changes little beside ``start`` or ``start + X`` is steady: modes that persist without noise are known in the end, but
    only as the inverse of the number of steps. ``doublings`` is how many are tried at least and at most.

    Raises:
        NoLaw: It grows without limit.
    """
    n, h = len(a), q
    first = largest(start + q)
    for count in range(doublings[1]):
        both = solved(identity(n) + g.dot(h), np.hstack([a, g]))
        more = symmetric(a.T.dot(h).dot(both[:, :n]))
        g = symmetric(g + a.dot(both[:, n:]).dot(a.T))
        a = a.dot(both[:, :n])
        h = h + more
        total = start + h
        if largest(total) > MOST_GROWTH * (1 + first):
            raise NoLaw
        if largest(a) > MOST_GROWTH:
            return None
        diagonal = [mpmath.sqrt(max(abs(total[i, i]), abs(start[i, i]))) for i in range(n)]
        if count >= doublings[0] and all(
            abs(more[i, j]) <= STEADY * diagonal[i] * diagonal[j] + NOTHING for i in range(n) for j in range(n)
        ):
            return h
    return None


@dataclass
class Seen:
    """A plant without the states that never cost anything: what is left is ``z = T D^-1 x``, ``D`` its units.

    ``U z`` costs ``|U z|^2`` where it is not known.
    """

    T: Wide
    D: Wide
    A: Wide
    W: Wide
    U: Wide

    def unknown(self) -> Wide:
        """A covariance of states of which little is known."""
        n, noise = len(self.A), np.trace(self.W)
        return self.W + identity(n) * (noise / n if noise else ONE)

    def cost(self, covariance: Wide) -> mpmath.mpf:
        return (self.U.dot(covariance) * self.U).sum()


@dataclass
class Law:
    """The stationary law of least cost, the state known: its cost per step, and what costs where the state is not known."""

    least: mpmath.mpf
    seen: Seen


def hull(rows: Wide, a: Wide) -> Wide | None:
    """Orthonormal rows that span ``rows a^k`` for all ``k``; none where rounding decides how many there are."""
    n, kept, waiting = len(a), [], list(rows)
    while waiting:
        row = waiting.pop(0)
        length = mpmath.sqrt((row * row).sum())
        if not length:
            continue
        rest = row / length
        for _ in range(2):
            for other in kept:
                rest = rest - (other * rest).sum() * other
        left = mpmath.sqrt((rest * rest).sum())
        if left < NOTHING:
            continue
        if left < mpmath.sqrt(ROUNDED):
            return None
        kept.append(rest / left)
        waiting.append(kept[-1].dot(a))
    return np.array(kept, dtype=object).reshape(len(kept), n)


def in_rows(plant: Plant, rows: Wide, priced: Wide) -> Seen | None:
    """A plant in coordinates of rows that cost something, or are measured, now or later."""
    scales = np.ones(len(plant.A)) if plant.units is None else plant.units
    # In these units, of powers of 2, the same numbers are exact.
    d, inverse = wide(np.diag(1.0 / scales)), wide(np.diag(scales))
    a, w = inverse.dot(wide(plant.A)).dot(d), inverse.dot(wide(plant.W)).dot(inverse)
    t = hull(rows.dot(d), a)
    return None if t is None else Seen(t, d, t.dot(a).dot(t.T), t.dot(w).dot(t.T), priced.dot(d).dot(t.T))


def stationary_law(plant: Plant) -> Law | None:
    """The least cost per step; none where rounding decides it, or it takes too many steps to settle.

    Steps of the Riccati equation from 0 until every control has its price, and from there doublings.

    Raises:
        NoLaw: No law keeps the cost finite.
    """
    n, m = plant.B.shape
    f = wide(np.hstack([plant.A, plant.B]))
    stage = np.full((n + m, n + m), ZERO, dtype=object)
    stage[:n, :n], stage[n:, n:] = wide(plant.Q), wide(plant.R)

    def form(s: Wide) -> tuple[Wide, Eliminated | None]:
        h = stage + f.T.dot(s).dot(f)
        size = np.abs(stage) + np.abs(f.T).dot(np.abs(s)).dot(np.abs(f))
        return h, eliminated(h, size, n)

    s = stage[:n, :n].copy()
    for _ in range(n):
        h, found = form(s)
        if found is None:
            return None
        s = found.left
    h, found = form(s)
    if found is None:
        return None
    a, g = f[:, :n], np.full((n, n), ZERO, dtype=object)
    if found.controls:
        b, prices = f[:, found.controls], h[np.ix_(found.controls, found.controls)]
        both = solved(prices, np.hstack([h[found.controls][:, :n], b.T]))
        a, g = a - b.dot(both[:, :n]), symmetric(b.dot(both[:, n:]))
    more = doubled(a, g, found.left - s, s)
    if more is None:
        return None
    s = s + more
    h, found = form(s)
    if found is None:
        return None
    seen = in_rows(plant, found.rows, found.rows)
    return None if seen is None else Law((s * wide(plant.W)).sum(), seen)


@dataclass
class Filtered:
    """A sensor's steady Kalman filter: its information per step, the cost of its errors, and its gain."""

    bits: mpmath.mpf
    paid: mpmath.mpf
    gain: Wide
    covariance: Wide


def steady_filter(seen: Seen, c: Wide, variances: Wide, doublings: tuple[int, int] = (0, DOUBLINGS)) -> Filtered | None:
    """That of a sensor ``c z + v`` whose state was once quite unknown; none where it has no steady state.

    Some steps of the filter, and then doublings of the number of its steps from there.
    """
    n, rank = len(seen.A), len(c)
    noise = np.full((rank, rank), ZERO, dtype=object)
    noise[range(rank), range(rank)] = variances

    def corrected(p: Wide) -> tuple[Wide, Wide, Wide, Wide]:
        innovation = c.dot(p).dot(c.T) + noise
        both = solved(innovation, np.hstack([c.dot(p), c]))
        gain = both[:, :n].T
        return innovation, gain, symmetric(p - gain.dot(c).dot(p)), symmetric(c.T.dot(both[:, n:]))

    def predicted(p: Wide) -> Wide:
        return symmetric(seen.A.dot(p).dot(seen.A.T) + seen.W)

    p = seen.unknown()
    for _ in range(50 + n):
        p = predicted(corrected(p)[2])
        if largest(p) > MOST_GROWTH:
            return None
    _, gain, posterior, precision = corrected(p)
    closed = seen.A - seen.A.dot(gain).dot(c)
    try:
        more = doubled(closed.T, precision, predicted(posterior) - p, p, doublings)
    except NoLaw:
        return None
    if more is None:
        return None
    p = symmetric(p + more)
    innovation, gain, posterior, _ = corrected(p)
    bits = ZERO
    for k in range(rank):
        # `log |innovation|` by elimination.
        bits += mpmath.log(innovation[k, k] / variances[k], 2) / 2
        row = innovation[k].copy()
        innovation = innovation - np.outer(row, row) / row[k]
    return Filtered(bits, seen.cost(posterior), gain, p)


def with_weak(seen: Seen, c: Wide, variances: Wide) -> Filtered | None:
    """The filter of a sensor beside others of all states that measure next to nothing: what persists without noise becomes
    known in the end. The first columns of its gain are those of the sensor.
    """
    n = len(seen.A)
    weak = np.full(n, mpmath.mpf(10) ** 30 * largest(seen.unknown()), dtype=object)
    return steady_filter(seen, np.vstack([c, identity(n)]), np.concatenate([variances, weak]), (140, 160))
