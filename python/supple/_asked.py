"""Checks of arguments, and their form in the native part."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import check_unmasked, numbers
from .errors import UsageError

__all__ = ["Axes", "Chosen", "Vary", "axis_values", "bound_points", "check_choice", "check_counts", "check_name"]
__all__ += ["changed", "check_out", "designs_of", "finite", "logged", "pairs", "real"]

LOGGER = logging.getLogger("supple")
# The largest whole number of the native part.
MOST_COUNT = 2**64 - 1
# Threads or processes of a study on this machine, at most.
MOST_WORKERS = 1024

# Arguments of the native part: axes, one axis, and designs by name with values.
Vary = tuple[str, str | list[float]]
Axes = list[Vary]
Chosen = list[str | tuple[str, list[tuple[str, float]]]]


class logged:
    """Logs the duration of a study."""

    def __init__(self, what: str) -> None:
        self._what = what

    def __enter__(self) -> None:
        LOGGER.info("%s begins", self._what)
        self._clock = time.perf_counter()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        how = "done" if kind is None else f"ended by {kind.__name__}"
        LOGGER.info("%s %s after %.3f s", self._what, how, time.perf_counter() - self._clock)


def real(value: Any) -> float:
    """A real number as Python's.

    Raises:
        TypeError: If it is text, a truth value or complex, which ``float`` would convert or cut.
    """
    if isinstance(value, (str, bytes, bool, np.bool_)) or np.iscomplexobj(value):
        raise TypeError(f"{value!r} is not a real number")
    return float(value)


def pairs(values: Mapping[str, float]) -> list[tuple[str, float]]:
    found = []
    for name, value in values.items():
        check_unmasked(name, value)
        try:
            found.append((name, real(value)))
        except (TypeError, ValueError):
            raise UsageError(f"parameter `{name}` = {value!r} is not a number") from None
    return found


def check_counts(**counts: int) -> None:
    for name, count in counts.items():
        if not isinstance(count, (int, np.integer)) or isinstance(count, bool) or count < 0:
            raise UsageError(f"{name}={count!r}: a whole number of at least 0")
        if count > MOST_COUNT:
            raise UsageError(f"{name}={count!r}: at most {MOST_COUNT}")


def check_choice(name: str, values: Iterable[str | None], valid: Iterable[str | None]) -> None:
    """Checks that all values are valid; ``None`` is reported as such."""
    known = list(valid)
    for value in values:
        if value not in known:
            words = ", ".join("None" if one is None else f'"{one}"' for one in known)
            raise UsageError(f"{name}={value!r}: valid: {words}")


def check_name(name: str, value: str | None) -> None:
    if not (value is None or isinstance(value, str)):
        raise UsageError(f"{name}={value!r}: a name, as text")


def changed(values: Mapping[str, float] | None, parameters: Mapping[str, float]) -> dict[str, float]:
    """Parameter values from a mapping and from keywords.

    Raises:
        UsageError: If one is given twice.
    """
    twice = next((name for name in values or {} if name in parameters), None)
    if twice is not None:
        raise UsageError(f"`{twice}` is given twice, in a dict and as a keyword: leave one out")
    return {**(values or {}), **parameters}


def check_out(out: object, executor: object) -> None:
    if out is not None and executor is not None:
        raise UsageError(
            "out keeps what threads of this process found: leave out executor, or save the result at the end"
        )


def finite(name: str, value: float | None) -> float | None:
    """A finite number, or ``None`` if it is not given."""
    if value is None:
        return None
    try:
        found = real(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name}={value!r} is not a number") from None
    if not math.isfinite(found):
        raise UsageError(f"{name}={value!r}: a finite number")
    return found


def bound_points(curve: bool | int) -> int | None:
    """Number of points of a curve of bounds: 20 for ``True``."""
    if isinstance(curve, bool):
        return 20 if curve else None
    check_counts(curve=curve)
    return int(curve) or None


def axis_values(name: str, values: ArrayLike) -> str | list[float]:
    if isinstance(values, str):
        return values
    array = numbers(name, values)
    if array.ndim != 1:
        raise UsageError(f"axis `{name}` has the shape {array.shape}; valid: a list of numbers")
    return [float(value) for value in array]


def designs_of(designs: Mapping[str, Mapping[str, float]] | Iterable[str]) -> Chosen:
    if isinstance(designs, str):
        return [designs]
    standing = ("start", "optimum")
    chosen: Chosen
    if isinstance(designs, Mapping):
        chosen = [
            name if name in standing and not values else (name, pairs(values)) for name, values in designs.items()
        ]
    else:
        chosen = list(designs)
    if not chosen:
        raise UsageError("designs is empty: name at least one, such as 'start' or 'optimum'")
    return chosen
