"""Checks of user-supplied functions before anything is computed with them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._records import Array
from ..errors import UsageError
from .functions import Functions
from .given import Given

__all__ = ["check_batches", "check_given", "check_guess", "check_single"]

#: How far results for a batch may be from those for its points, relative to the largest: rounding.
ALIKE = 1e-10

#: How far given derivatives may be from finite differences, relative to the largest.
CLOSE = 1e-4


def points_near(x: Array, u: Array, count: int) -> tuple[Array, Array]:
    """A point and others near it, the same at every call: (count, n), (count, m)."""
    random = np.random.default_rng(0)
    near = [part + 1e-3 * (np.abs(part) + 1e-3) * random.normal(size=(count, len(part))) for part in (x, u)]
    near[0][0], near[1][0] = x, u
    return near[0], near[1]


def check_single(functions: Functions, x: Array, u: Array, phi: Array) -> None:
    """Functions of JAX at one point: finite, and the same twice.

    Raises:
        UsageError: Where they are not.
    """
    from .jax import double_precision

    with double_precision():
        for name in functions.shapes:
            once, again = (np.asarray(functions.call(name, x, u, phi), dtype=np.float64) for _ in range(2))
            _check_values(name, (once, again), x, u)


def check_batches(functions: Functions, x: Array, u: Array, phi: Array) -> None:
    """Functions of NumPy near a point: their shapes, finite, the same twice, and for a batch what they are for its points.

    Raises:
        UsageError: Where they are not.
    """
    for count in sorted({1, 3, len(x)}):
        states, controls = points_near(x, u, count)
        for name in functions.shapes:
            # The functions get copies, so that writing into arguments is detected.
            x_given, u_given = states.copy(), controls.copy()
            once = functions.batch(name, x_given, u_given, phi)
            if not (np.array_equal(x_given, states) and np.array_equal(u_given, controls)):
                raise UsageError(f"`{name}` writes into its arguments: work on a copy, x = x.copy()")
            again = functions.batch(name, states, controls, phi)
            _check_values(name, (once[0], again[0]), x, u)
            _check_values(name, (once, again), states, controls)
            single = [functions.batch(name, states[i : i + 1], controls[i : i + 1], phi)[0] for i in range(count)]
            _check_alike(name, once, np.array(single))


def check_guess(backend: Any, x: Array, controls: Array, phi: Array) -> None:
    """Rolls out the initial guess: no function may return NaN while the state still has a reasonable magnitude.

    Raises:
        UsageError: Where one does, with the step.
    """
    states, controls, cost = backend.roll_out(x, controls, None, None, None, phi)
    if np.isfinite(cost):
        return
    with np.errstate(all="ignore"):
        sensible = np.abs(states).max(axis=1) <= 1e3 * (1.0 + np.abs(x).max())
    steps = int(np.argmin(np.append(sensible, False)))
    tried = min(steps, len(controls))
    found = {"step": backend.steps(states[:tried], controls[:tried], phi)} if tried else {}
    if tried:
        found["cost"] = backend.stage_costs(states[:tried], controls[:tried], phi)
    if steps == len(states):
        found["final_cost"] = backend.final_costs(states[-1:], phi)
    for name, values in found.items():
        bad = np.isnan(values).reshape(len(values), -1).any(axis=1)
        if bad.any():
            t = int(np.argmax(bad)) if name != "final_cost" else len(controls)
            at = f"x = {_short(states[t])}" + ("" if name == "final_cost" else f", u = {_short(controls[t])}")
            raise UsageError(
                f"`{name}` returned {_short(values[np.argmax(bad)])} at step {t} under the first guess of the controls, where "
                f"{at}: it must return finite numbers. Correct it there, or start from another initial_control"
            )


def _check_values(name: str, found: tuple[Array, Array], x: Array, u: Array) -> None:
    once, again = found
    if not np.isfinite(once).all():
        raise UsageError(
            f"`{name}` returned {_short(once)} at x = {_short(x)}, u = {_short(u)}: it must return finite numbers at and near "
            "the initial state. Correct it there, or choose another initial_state or initial_control"
        )
    if not np.array_equal(once, again):
        raise UsageError(
            f"`{name}` is not deterministic: called twice at x = {_short(x)}, u = {_short(u)} it returned {_short(once)} and "
            f"{_short(again)}. It must depend on its arguments only: keep random numbers, clocks and counters out of it, and "
            "state that changes; noise belongs into supple.Noise"
        )


def _check_alike(name: str, batch: Array, single: Array) -> None:
    scale = float(np.abs(single).max(initial=0.0))
    off = np.abs(batch - single) > ALIKE * scale
    if off.any():
        point = int(np.argwhere(off)[0][0])
        raise UsageError(
            f"`{name}` returned {_short(batch[point])} for point {point} of a batch of {len(batch)}, and "
            f"{_short(single[point])} for that point alone: it must work along the last axis, each point by itself. Write "
            "x[..., 0] for the first state, and sums over axis=-1"
        )


def check_given(given: Given, plain: Any, x: Array, u: Array, phi: Array) -> None:
    """Derivatives that the user gives against those of another backend, near a point.

    Raises:
        UsageError: Where they disagree.
    """
    states, controls = points_near(x, u, 3)
    random = np.random.default_rng(1)
    n, z, p = len(x), len(x) + len(u), plain.measurements

    def symmetric(size: int) -> Array:
        square = random.normal(size=(3, size, size))
        matrix: Array = square + np.swapaxes(square, 1, 2)
        return matrix

    extra: dict[str, list[Array]] = {
        "dynamics_curvature": [random.normal(size=(3, n))],
        "contract_dynamics": [random.normal(size=(3, n, z))],
        "contract_measurements": [random.normal(size=(3, p, n))],
        "contract_stage_costs": [symmetric(z)],
        "contract_final_costs": [symmetric(n)],
        "stage_parameters": [random.normal(size=(3, n))],
        "stage_parameters_along": [random.normal(size=shape) for shape in ((3, n), (3, z), (3, n))],
        "final_parameters_along": [random.normal(size=(3, n))],
    }
    for name in given.names:
        without = name.startswith(("final", "measurement")) or name in ("contract_measurements", "contract_final_costs")
        arguments = [states, *([] if without else [controls]), *extra.get(name, []), phi]
        found, expected = getattr(given, name)(*arguments), getattr(plain, name)(*arguments)
        pairs = zip(found, expected) if isinstance(found, tuple) else [(found, expected)]
        for one, other in pairs:
            scale = 1e-9 + float(np.abs(other).max(initial=0.0))
            off = np.argwhere(~(np.abs(one - other) <= CLOSE * scale))
            if len(off):
                place = tuple(int(index) for index in off[0])
                raise UsageError(
                    f"derivatives: `{name}` gives {one[place]:.6g} in its entry {list(place)} near the initial state, where "
                    f"differences of the functions give {other[place]:.6g}: correct it, or leave it out"
                )


def _short(array: Array) -> str:
    return np.array2string(np.asarray(array), precision=6, threshold=12, separator=", ")
