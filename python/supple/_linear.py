"""Linear problems from arrays, which may vary from step to step."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _description as describe
from ._arrays import Sizes, array, covariance, symmetric
from ._labels import by_label
from ._records import Array
from .errors import UsageError
from .task import Task

__all__ = ["linear"]

#: Names of the entries of a vector, with their units if any.
Names = Sequence[str] | Mapping[str, str]

#: What the axes of the arrays are, without time: states, controls or measurements.
_AXES = {"A": "nn", "B": "nm", "C": "pn", "W": "nn", "V": "pp", "X0": "nn", "Q": "nn", "R": "mm"} | {
    "QN": "nn",
    "S": "nm",
    "c": "n",
    "d": "p",
    "q": "n",
    "r": "m",
    "qN": "n",
    "x0": "n",
}


def linear(
    A: ArrayLike,
    B: ArrayLike,
    C: ArrayLike,
    W: ArrayLike,
    V: ArrayLike,
    X0: ArrayLike,
    Q: ArrayLike,
    R: ArrayLike,
    *,
    QN: ArrayLike | None = None,
    S: ArrayLike | None = None,
    c: ArrayLike | None = None,
    d: ArrayLike | None = None,
    q: ArrayLike | None = None,
    r: ArrayLike | None = None,
    qN: ArrayLike | None = None,
    x0: ArrayLike | None = None,
    N: int | None = None,
    time_step: float = 1.0,
    bound: float | None = None,
    control_bounds: Sequence[tuple[float, float]] | None = None,
    states: Names | None = None,
    controls: Names | None = None,
    measurements: Names | None = None,
    varying: Sequence[describe.VaryingVariance] = (),
    name: str = "linear",
    title: str = "",
    planning: Mapping[str, Any] | None = None,
) -> Task:
    """A linear problem with quadratic costs and Gaussian noise, from arrays::

        x[t+1] = A[t] x[t] + B[t] u[t] + c[t] + w[t]        w[t] ~ N(0, W[t])     x[0] ~ N(x0, X0)
        y[t]   = C[t] x[t] + d[t] + v[t]                    v[t] ~ N(0, V[t])
        J = sum over t < N of (x'Q[t]x + 2x'S[t]u + u'R[t]u + q[t]'x + r[t]'u)  +  x[N]'QN x[N] + qN'x[N]

    There are no factors 1/2 in the cost, as in task files. Each array may be one matrix for all steps, or one per step
    with time as its first axis: N matrices, or N + 1 for ``C``, ``d`` and ``V``, as the last state is measured too. The task
    has no parameters: it can be evaluated and simulated, but not designed. Arrays with labels, of pandas, are put in the order of
    the names of states, controls and measurements, which are the labels where they are not given.

    Args:
        A: Dynamics, (n, n) or (N, n, n).
        B: Input, (n, m) or (N, n, m).
        C: Measurement, (p, n) or (N+1, p, n).
        W: Covariance of the process noise of a step, (n, n) or (N, n, n), or variances (n,); may be singular.
        V: Covariance of the measurement noise, (p, p) or (N+1, p, p), or variances (p,); positive definite.
        X0: Covariance of the initial state, (n, n), or variances (n,); may be singular.
        Q: Weight of the state, (n, n) or (N, n, n). ``[[Q, S], [S', R]]`` must be positive semidefinite.
        R: Weight of the control, (m, m) or (N, m, m).
        QN: Weight of the last state, (n, n); default: the last of ``Q``.
        S: Cross weight of state and control, (n, m) or (N, n, m); default: 0.
        c: Constant added to the next state, (n,) or (N, n).
        d: Constant added to the measurement, (p,) or (N+1, p).
        q: Linear cost of the state, (n,) or (N, n).
        r: Linear cost of the control, (m,) or (N, m).
        qN: Linear cost of the last state, (n,); default: the last of ``q``.
        x0: Mean of the initial state, (n,); default: 0.
        N: Number of steps; required if no array has a time axis.
        time_step: Time step, s; it converts bits per step to bits per second.
        bound: Cost limit: the greatest expected cost allowed.
        control_bounds: Lower and upper limit of each control; plus or minus infinity for none.
        states: Names of the states, or names with units; default: ``x1``, ``x2``...
        controls: The same for the controls; default: ``u1``, ``u2``...
        measurements: The same for the measurements; default: ``y1``, ``y2``...
        varying: State-dependent terms added to measurement variances, by these names.
        name: Name of the task.
        title: Description, for people.
        planning: Settings of the planner, by the names in the task file's ``[planning]``.

    Raises:
        UsageError: If an array has a wrong shape, is not finite, or is not a valid covariance or weight; the message names the
            array, what was found and what is valid.
    """
    describe.check_printable("name of the task", name)
    values: tuple[Any, ...] = (A, B, C, W, V, X0, Q, R, QN, S, c, d, q, r, qN, x0)
    given = {name: (value, axes) for (name, axes), value in zip(_AXES.items(), values)}
    arrays, names = by_label(given, {"states": states, "controls": controls, "measurements": measurements})
    A, B, C, W, V, X0, Q, R, QN, S, c, d, q, r, qN, x0 = arrays.values()
    states, controls, measurements = names.values()
    sizes = Sizes.of(A, B, C, N)
    n, m, p = sizes.states, sizes.controls, sizes.measurements
    system: dict[str, Any] = {
        "kind": "linear",
        "A": array("A", A, sizes, "nn"),
        "B": array("B", B, sizes, "nm"),
        "C": array("C", C, sizes, "pn", measured=True),
        "c": _optional("c", c, sizes, "n"),
        "d": _optional("d", d, sizes, "p", measured=True),
        "Q": symmetric("Q", Q, sizes, "nn"),
        "S": _optional("S", S, sizes, "nm"),
        "R": symmetric("R", R, sizes, "mm"),
        "q": _optional("q", q, sizes, "n"),
        "r": _optional("r", r, sizes, "m"),
        "QN": None if QN is None else symmetric("QN", QN, sizes, "nn", once=True, semidefinite=True),
        "qN": _optional("qN", qN, sizes, "n", once=True),
        "states": _channels("states", states, "x", n),
        "controls": _channels("controls", controls, "u", m),
        "measurements": _channels("measurements", measurements, "y", p),
    }
    _check_convex(system["Q"], system["S"], system["R"])
    start = np.zeros(n) if x0 is None else array("x0", x0, sizes, "n", once=True)
    noise = {
        "initial": covariance("X0", X0, sizes, "nn", once=True).tolist(),
        "process": covariance("W", W, sizes, "nn").tolist(),
        "measurement": covariance("V", V, sizes, "pp", measured=True, definite=True).tolist(),
    }
    task = {
        "name": name,
        "steps": sizes.steps,
        "time_step": _positive("time_step", time_step),
        "bound": None if bound is None else _number("bound", bound),
        "information_weight": 1.0,
        "initial_state": start.tolist(),
        "initial_control": [[0.0] * m],
        "control_bounds": _bounds(control_bounds, m),
        **noise,
        **({"varying": describe.varying(varying)} if len(varying) else {}),
    }
    plain = {"title": title, "parameters": [], "tasks": [task], "planning": dict(planning or {}), "design": {}}
    return describe.made({"plain": json.dumps(plain), "systems": [system]})


def _optional(name: str, given: ArrayLike | None, sizes: Sizes, axes: str, **how: bool) -> Array | None:
    return None if given is None else array(name, given, sizes, axes, **how)


def _check_convex(Q: Array, S: Array | None, R: Array) -> None:
    """Checks that no stage cost ``x'Qx + 2x'Su + u'Ru`` is negative: (n, n), (n, m), (m, m), with or without time."""
    count = max((part.shape[0] for part in (Q, S, R) if part is not None and part.ndim == 3), default=1)
    n, m = Q.shape[-1], R.shape[-1]
    cross = np.zeros((n, m)) if S is None else S
    joint = np.zeros((count, n + m, n + m))
    joint[:, :n, :n], joint[:, n:, n:], joint[:, :n, n:] = Q, R, cross
    joint[:, n:, :n] = np.swapaxes(cross, -1, -2)
    least, scale = np.linalg.eigvalsh(joint)[:, 0], np.abs(joint).max(axis=(1, 2))
    bad = np.flatnonzero(least < -1e-10 * scale)
    if bad.size:
        step = f" of step {bad[0]}" if count > 1 else ""
        what = "[[Q, S], [S', R]]" if S is not None else "Q and R"
        verb = "is" if S is not None else "are"
        raise UsageError(
            f"{what}{step} {verb} not positive semidefinite: the least eigenvalue is {least[bad[0]]:.3g}; weights must "
            "not make a cost negative"
        )


def _channels(what: str, given: Names | None, letter: str, count: int) -> list[tuple[str, str]]:
    """Names with units; there must be ``count`` of them."""
    found = describe.names(what, count if given is None else given, letter)
    if len(found) != count:
        raise UsageError(f"{what} has {len(found)} names: there are {count} {what}")
    return list(found.items())


def _number(name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name}={value!r}: a number") from None
    if not math.isfinite(number):
        raise UsageError(f"{name}={number}: a finite number")
    return number


def _positive(name: str, value: float) -> float:
    number = _number(name, value)
    if number <= 0.0:
        raise UsageError(f"{name}={number}: a number above 0")
    return number


def _bounds(given: Sequence[tuple[float, float]] | None, count: int) -> list[list[float | None]] | None:
    """Lower and upper limits of the controls, (m,) each, with ``None`` for infinite ones."""
    if given is not None and len(given) != count:
        raise UsageError(f"control_bounds has {len(given)} pairs: there are {count} controls")
    return describe.bounds(given)
