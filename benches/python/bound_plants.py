"""Random plants of kinds that are hard on rounding, for ``bound_attack.py``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Plant:
    """``x+ = A x + B u + w`` with the cost ``x'Qx + u'Ru``."""

    A: Array
    B: Array
    W: Array
    Q: Array
    R: Array
    #: How large the units of the states are, powers of 2: none where they are 1.
    units: Array | None = None

    def in_units(self, scales: Array) -> Plant:
        """The same with states in other units."""
        inverse = 1.0 / scales
        a = inverse[:, None] * self.A * scales
        w = inverse[:, None] * self.W * inverse
        return Plant(a, inverse[:, None] * self.B, w, scales[:, None] * self.Q * scales, self.R, scales)


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


def unexcited(draw: np.random.Generator) -> Plant:
    """Modes that grow, or persist, without noise, beside others that noise drives; each may act on the next."""
    n, m = int(draw.integers(1, 6)), int(draw.integers(1, 3))
    modes = draw.choice([1.0, -1.0, 1.25, -1.5, 2.0, 3.0, 1.0078125, 0.5, 0.9375], size=n)
    a = np.diag(modes) + np.triu(dyadic(draw.normal(size=(n, n))), 1) * draw.integers(2)
    w = np.diag(np.where(draw.uniform(size=n) < 0.5, 0.0, draw.uniform(0.1, 1.0, size=n)))
    q = dyadic(draw.normal(size=(int(draw.integers(1, n + 1)), n)))
    plant = Plant(a, dyadic(draw.normal(size=(n, m))), w, q.T @ q, np.eye(m) * draw.choice([0.0, 1.0]))
    return plant.in_units(2.0 ** draw.integers(-10, 11, size=n))


def costless(draw: np.random.Generator) -> Plant:
    """States that never cost anything beside others that drive them, in other coordinates and in unequal units."""
    n, rest, m = int(draw.integers(1, 4)), int(draw.integers(1, 4)), int(draw.integers(1, 3))
    size = n + rest
    a = dyadic(draw.normal(size=(size, size)) * draw.choice([0.5, 1.0, 2.0]))
    a[:n, n:] = 0.0
    q = np.zeros((size, size))
    c = dyadic(draw.normal(size=(int(draw.integers(1, n + 1)), n)))
    q[:n, :n] = c.T @ c
    g = dyadic(draw.normal(size=(size, int(draw.integers(1, size + 1)))))
    plant = Plant(a, dyadic(draw.normal(size=(size, m))), g @ g.T, q, np.eye(m) * draw.choice([0.0, 0.25]))
    # Unimodular: its inverse has few digits too.
    turn = np.eye(size) + np.triu(np.round(draw.normal(size=(size, size))), 1) * draw.integers(2)
    back = np.round(np.linalg.inv(turn))
    turned = Plant(turn @ a @ back, turn @ plant.B, turn @ plant.W @ turn.T, back.T @ q @ back, plant.R)
    return turned.in_units(2.0 ** draw.integers(-10, 11, size=size))


KINDS = {
    kind.__name__: kind
    for kind in (unit_circle, free_controls, zeros_outside, singular, growth, delay, unexcited, costless)
}
