"""Arrays with labels, such as those of pandas: rows and columns go where their labels belong, not where they stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .errors import UsageError

__all__ = ["by_label"]

#: What the axes of arrays are, by their letters.
AXES = {"n": "states", "m": "controls", "p": "measurements"}


def by_label(
    arrays: Mapping[str, tuple[Any, str]], names: Mapping[str, Sequence[str] | Mapping[str, str] | None]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays in the order of the names of states, controls and measurements, and these names.

    Args:
        arrays: Arrays by name, each with the letters of its axes: of one matrix or vector.
        names: Names of ``states``, ``controls`` and ``measurements``; those that are ``None`` are the labels of the first array
            that has some, if any has.

    Raises:
        UsageError: Where labels of an array are not these names.
    """
    known = dict(names)
    ordered: dict[str, Any] = {}
    for name, (value, axes) in arrays.items():
        for axis, labels in enumerate(_labels(value)):
            what = AXES[axes[min(axis, len(axes) - 1)]]
            if labels is None:
                continue
            if known[what] is None:
                known[what] = labels
            wanted = list(known[what] or ())
            if sorted(labels) != sorted(wanted):
                place = "labels" if len(axes) == 1 else ("rows", "columns")[axis]
                raise UsageError(
                    f"{name}: its {place} are labelled {_listed(labels)}, but the {what} are {_listed(wanted)}: use the same "
                    "labels, or give the array without them (`to_numpy()`)"
                )
            value = value.reindex(wanted) if axis == 0 else value[wanted]
        ordered[name] = value
    return ordered, known


def _labels(value: Any) -> list[list[str] | None]:
    """The labels of the axes of a pandas object, ``None`` where they are numbers; empty for other arrays."""
    index, columns = getattr(value, "index", None), getattr(value, "columns", None)
    if index is None or callable(index):
        return []
    axes = [list(axis) for axis in (index, columns) if axis is not None]
    return [axis if all(isinstance(label, str) for label in axis) else None for axis in axes]


def _listed(labels: Sequence[str]) -> str:
    return ", ".join(f"`{label}`" for label in labels)
