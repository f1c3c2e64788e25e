"""Checks of the arrays that users pass: shapes, numbers and covariances."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ._records import Array
from ._supple import check_covariance, most_steps
from .errors import UsageError

__all__ = ["ROUNDING", "Sizes", "array", "check_unmasked", "covariance", "finite_array", "symmetric"]

#: Asymmetry up to this, relative to the largest entry, is rounding; task files allow as much.
ROUNDING = 1e-12


@dataclass
class Sizes:
    """Lengths of state, control and measurement, and the number of steps, with the array that determines it."""

    states: int
    controls: int
    measurements: int
    _steps: dict[int, str] = field(default_factory=dict)

    @staticmethod
    def of(A: ArrayLike, B: ArrayLike, C: ArrayLike, N: int | None) -> Sizes:
        """From the shapes of ``A``, ``B`` and ``C``, and from the number of steps if it is given."""
        valid = {"A": "(n, n) or (N, n, n)", "B": "(n, m) or (N, n, m)", "C": "(p, n) or (N+1, p, n)"}
        shapes = {name: numbers(name, given).shape for name, given in (("A", A), ("B", B), ("C", C))}
        for name, shape in shapes.items():
            if len(shape) not in (2, 3) or 0 in shape:
                raise UsageError(f"{name} has the shape {_text(shape)}: it must be {valid[name]}")
        sizes = Sizes(shapes["A"][-1], shapes["B"][-1], shapes["C"][-2])
        if N is not None:
            if isinstance(N, bool) or not isinstance(N, (int, np.integer)) or N < 1:
                raise UsageError(f"N={N!r}: a whole number of at least 1")
            sizes._set(int(N), "the argument N")
        return sizes

    def _set(self, steps: int, source: str) -> None:
        """Records N, which must not be too large for so many states: before anything is computed from the arrays."""
        most = most_steps(self.states, self.controls)
        if steps > most:
            raise UsageError(f"N = {steps} by {source}: it must be at most {most} with {self.states} states")
        self._steps[steps] = source

    def length(self, axis: str) -> int:
        """The length of the axis ``n``, ``m`` or ``p``."""
        return {"n": self.states, "m": self.controls, "p": self.measurements}[axis]

    def see(self, name: str, count: int, measured: bool) -> None:
        """Records how many matrices an array has: one per step, and one more for measurements."""
        steps = count - 1 if measured else count
        valid = "N+1" if measured else "N"
        if steps < 1:
            raise UsageError(f"{name} has the length {count} along the time: it must be {valid}, and N is at least 1")
        if self._steps and steps not in self._steps:
            ((known, source),) = self._steps.items()
            expected = known + 1 if measured else known
            raise UsageError(
                f"{name} has the length {count} along the time: it must be {valid} = {expected}, as N = {known} by "
                f"{source}; or leave that axis out where it is the same at all steps"
            )
        if not self._steps:
            self._set(steps, f"the shape of {name}")

    @property
    def steps(self) -> int:
        """N, once all arrays have been recorded."""
        if not self._steps:
            raise UsageError("N is missing: say how many steps there are, as no array has a time axis")
        return next(iter(self._steps))


def _text(shape: tuple[int, ...]) -> str:
    """A shape as Python writes it, without the types of NumPy's numbers."""
    return str(tuple(int(length) for length in shape))


def check_unmasked(name: str, given: object) -> None:
    """Rejects masked arrays: NumPy would use the masked values."""
    if isinstance(given, (list, tuple)):
        for index, entry in enumerate(given):
            if isinstance(entry, (list, tuple, np.ma.MaskedArray)):
                check_unmasked(f"{name}[{index}]", entry)
    elif isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        place = ", ".join(str(index) for index in np.argwhere(np.ma.getmaskarray(given))[0])
        raise UsageError(
            f"{name}{f'[{place}]' if place else ''} is masked: every number is needed; fill masked entries first, such as by `.filled(0.0)`"
        )


def numbers(name: str, given: ArrayLike) -> Array:
    """A private copy as float64; anything other than real numbers is an error."""
    check_unmasked(name, given)
    try:
        found = np.asarray(given)
    except ValueError:
        raise UsageError(f"{name} is no array: its rows have different lengths") from None
    if hasattr(given, "toarray") and found.dtype.kind == "O":
        raise UsageError(f"{name} is a {type(given).__name__}: make it dense, by `.toarray()`")
    if found.dtype.kind not in "biuf":
        raise UsageError(f"{name} holds {found.dtype}: it must hold real numbers")
    return np.array(found, dtype=np.float64, order="C")


def finite_array(name: str, given: ArrayLike, axes: tuple[str, ...]) -> Array:
    """A non-empty array with as many axes as are named; their lengths are checked elsewhere."""
    found = numbers(name, given)
    if found.ndim != len(axes) or not found.size:
        letters = ", ".join(axes) + ("," if len(axes) == 1 else "")
        raise UsageError(f"{name} has the shape {_text(found.shape)}: it must be ({letters})")
    _check_finite(name, found)
    return found


def _check_finite(name: str, found: Array) -> None:
    bad = np.argwhere(~np.isfinite(found))
    if bad.size:
        place = ", ".join(str(index) for index in bad[0])
        raise UsageError(f"{name}[{place}] is {found[tuple(bad[0])]}: it must be finite")


def array(name: str, given: ArrayLike, sizes: Sizes, axes: str, *, measured: bool = False, once: bool = False) -> Array:
    """An array with the given axes, or with an additional time axis before them.

    Args:
        name: Its name in messages.
        given: The array.
        sizes: Lengths of the axes; learns how many steps there are.
        axes: Its axes without time: ``nm`` for (n, m).
        measured: Whether it also exists at the last state: N + 1 times.
        once: Whether it has no time axis.
    """
    found = numbers(name, given)
    shape = tuple(sizes.length(axis) for axis in axes)
    if found.shape != shape and (once or found.ndim != len(shape) + 1 or found.shape[1:] != shape):
        raise UsageError(f"{name} has the shape {_text(found.shape)}: it must be {_valid(axes, shape, measured, once)}")
    if found.ndim > len(shape):
        sizes.see(name, found.shape[0], measured)
    _check_finite(name, found)
    return found


def _valid(axes: str, shape: tuple[int, ...], measured: bool, once: bool) -> str:
    """The valid shapes, in letters and in numbers."""
    letters = ", ".join(axes) + ("," if len(axes) == 1 else "")
    if once:
        return f"({letters}) = {_text(shape)}"
    time = "N+1" if measured else "N"
    each = ", ".join([time, *map(str, shape)])
    return f"({letters}) = {_text(shape)}, or ({time}, {letters.rstrip(',')}) = ({each}) for N steps"


def symmetric(
    name: str,
    given: ArrayLike,
    sizes: Sizes,
    axes: str,
    *,
    measured: bool = False,
    once: bool = False,
    semidefinite: bool = False,
) -> Array:
    """Like :func:`array`, for symmetric matrices; differences due to rounding are removed."""
    found = array(name, given, sizes, axes, measured=measured, once=once)
    _check_symmetric(name, found)
    found = _even(found)
    if semidefinite:
        _check_semidefinite(name, found)
    return found


def covariance(
    name: str,
    given: ArrayLike,
    sizes: Sizes,
    axes: str,
    *,
    measured: bool = False,
    once: bool = False,
    definite: bool = False,
) -> Array:
    """Like :func:`symmetric`, for covariances; a list of variances stands for the matrix with these on its diagonal."""
    found = numbers(name, given)
    order = sizes.length(axes[0])
    if found.ndim == 1:
        if found.shape != (order,):
            raise UsageError(f"{name} has {found.size} variances: it must have {order}")
        found = np.diag(found)
    return _checked(name, array(name, found, sizes, axes, measured=measured, once=once), definite)


def _checked(name: str, found: Array, definite: bool) -> Array:
    """Covariances that the rules of task files hold for, without asymmetry from rounding."""
    check_covariance(name, found, definite)
    return _even(found)


def _even(found: Array) -> Array:
    return np.ascontiguousarray(0.5 * found + 0.5 * np.swapaxes(found, -1, -2))


def _check_symmetric(name: str, found: Array) -> None:
    mirror = np.swapaxes(found, -1, -2)
    bad = np.argwhere(np.tril(np.abs(found - mirror)) > ROUNDING * np.abs(found).max(initial=0.0))
    if bad.size:
        here = tuple(int(index) for index in bad[0])
        there = (*here[:-2], here[-1], here[-2])
        place = "".join(f"[{index}]" for index in here)
        raise UsageError(
            f"{name}{place}: must be symmetric; found {found[here]:.6g}, and {found[there]:.6g} across the diagonal"
        )


def _check_semidefinite(name: str, found: Array) -> None:
    """Checks that a weight makes no cost negative, up to rounding."""
    least, scale = np.linalg.eigvalsh(found)[0], np.abs(found).max()
    if least < -1e-10 * scale:
        raise UsageError(f"{name} has the eigenvalue {least:.3g}: it must be positive semidefinite")
