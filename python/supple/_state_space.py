"""Linear problems from the state-space objects of python-control and SciPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import numbers
from ._linear import Names, linear
from ._records import Array
from .errors import UsageError
from .task import Task

__all__ = ["from_state_space"]


def from_state_space(
    sys: Any,
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
    time_step: float | None = None,
    bound: float | None = None,
    control_bounds: Sequence[tuple[float, float]] | None = None,
    states: Names | None = None,
    controls: Names | None = None,
    measurements: Names | None = None,
    name: str = "linear",
    title: str = "",
    planning: Mapping[str, Any] | None = None,
) -> Task:
    """A linear problem with ``A``, ``B`` and ``C`` from a state-space object.

    Takes ``control.StateSpace`` of python-control, and ``StateSpace``, ``lti`` and ``dlti`` of ``scipy.signal``. Continuous-time
    systems are discretised with a zero-order hold: the control is constant over a time step.
    ``W`` is the covariance of the noise that a time step adds, not per second, and ``Q`` and ``R`` are the weights of each step.

    Args:
        sys: The system. Its ``D`` must be 0: measurements depend on the state alone.
        W: As in :func:`supple.linear`, like all other arguments except the following:
        time_step: Time step, s: required for continuous-time systems, and for discrete-time systems that do not specify
            theirs.
        states: Names of the states; default: those of the python-control object, otherwise ``x1``, ``x2``...
        controls: Names of the controls, likewise.
        measurements: Names of the measurements, likewise.

    Raises:
        UsageError: If the system is of another type, has a ``D``, or its time step is not known.
    """
    found = _read(sys)
    if np.any(found.D):
        place = tuple(int(index) for index in np.argwhere(found.D)[0])
        raise UsageError(
            f"D{list(place)} of the system is {found.D[place]:.6g}: it must be 0, as measurements may depend on the state only; "
            "subtract D u from the measurements"
        )
    A, B, time_step = _discrete(found, time_step)
    return linear(
        A,
        B,
        found.C,
        W,
        V,
        X0,
        Q,
        R,
        QN=QN,
        S=S,
        c=c,
        d=d,
        q=q,
        r=r,
        qN=qN,
        x0=x0,
        N=N,
        time_step=time_step,
        bound=bound,
        control_bounds=control_bounds,
        states=found.names.get("states") if states is None else states,
        controls=found.names.get("controls") if controls is None else controls,
        measurements=found.names.get("measurements") if measurements is None else measurements,
        name=name,
        title=title,
        planning=planning,
    )


@dataclass(frozen=True)
class _Found:
    """Contents of a state-space object.

    Attributes:
        A: (n, n), and so on: ``B`` (n, m), ``C`` (p, n), ``D`` (p, m).
        time_step: s; 0 in continuous time; ``None`` in discrete time with an unspecified time step.
        names: Names of states, controls and measurements, if any.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    time_step: float | None
    names: Mapping[str, list[str]]


def _read(sys: Any) -> _Found:
    family = type(sys).__module__.partition(".")[0]
    if family == "scipy" and hasattr(sys, "to_ss"):
        space = sys.to_ss()
        step = 0.0 if space.dt is None else space.dt
        return _Found(*_matrices(space), time_step=None if step is True else float(step), names={})
    if family == "control" and hasattr(sys, "A") and hasattr(sys, "dt"):
        if sys.dt is None:
            raise UsageError(
                "the system does not say whether its time is continuous: make it with dt=0, or with its time step"
            )
        labels = {"states": sys.state_labels, "controls": sys.input_labels, "measurements": sys.output_labels}
        step = None if sys.dt is True else float(sys.dt)
        return _Found(*_matrices(sys), time_step=step, names={key: list(value) for key, value in labels.items()})
    kind = f"{type(sys).__module__}.{type(sys).__qualname__}"
    raise UsageError(
        f"sys is a {kind}: it must be a control.StateSpace, or a StateSpace, lti or dlti of scipy.signal; other kinds "
        "of python-control become one by control.ss(sys), and arrays go into supple.linear"
    )


def _matrices(space: Any) -> tuple[Array, Array, Array, Array]:
    A, B, C, D = (np.atleast_2d(numbers(name, getattr(space, name))) for name in "ABCD")
    if A.size == 0 or B.size == 0 or C.size == 0:
        shapes = f"{A.shape}, {B.shape} and {C.shape}"
        raise UsageError(
            f"A, B and C of the system have the shapes {shapes}: it needs a state, a control and a measurement"
        )
    return A, B, C, D


def _discrete(found: _Found, time_step: float | None) -> tuple[Array, Array, float]:
    """``A`` (n, n) and ``B`` (n, m) over a time step, and the time step, s."""
    own = found.time_step
    if time_step is not None and not (isinstance(time_step, (int, float, np.number)) and 0.0 < time_step < np.inf):
        raise UsageError(f"time_step={time_step!r}: a number above 0, s")
    if own is None or own == 0.0:
        if time_step is None:
            kind = "is in continuous time" if own == 0.0 else "does not say its time step"
            raise UsageError(f"the system {kind}: give time_step, s")
        if own is None:
            return found.A, found.B, float(time_step)
        A, B = _held(found.A, found.B, float(time_step))
        return A, B, float(time_step)
    if time_step is not None and abs(time_step - own) > 1e-12 * own:
        raise UsageError(f"time_step={time_step}, but that of the system is {own}: leave time_step out")
    return found.A, found.B, own


def _held(A: Array, B: Array, time_step: float) -> tuple[Array, Array]:
    """``A`` (n, n) and ``B`` (n, m) over a time step with the control held: ``expm([[A, B], [0, 0]] time_step)``."""
    from scipy.linalg import expm

    n, m = B.shape
    joint = np.zeros((n + m, n + m))
    joint[:n, :n], joint[:n, n:] = A, B
    with np.errstate(all="ignore"):
        moved = np.asarray(expm(joint * time_step), dtype=np.float64)
    if not np.isfinite(moved).all():
        raise UsageError(f"time_step={time_step}: the discretised system overflows; use a shorter one")
    return moved[:n, :n].copy(), moved[:n, n:].copy()
