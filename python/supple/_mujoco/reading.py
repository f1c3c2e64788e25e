"""Validation and parsing of user input."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from .._description import Number
from .._records import Array
from ..errors import FileError, UsageError
from ..task import Parameter
from . import names

__all__ = ["changed", "check", "keyframe", "move", "ranges", "read"]


def read(model: mujoco.MjModel | str | os.PathLike[str]) -> mujoco.MjModel:
    """A copy of a model, or that of a file."""
    if isinstance(model, mujoco.MjModel):
        return copy.copy(model)
    if not isinstance(model, (str, os.PathLike)):
        raise UsageError(f"model is a {type(model).__name__}: it must be an MjModel, or the path of a file")
    path = os.fspath(model)
    if path.lstrip().startswith("<"):
        raise UsageError("model is a text: read it with mujoco.MjModel.from_xml_string")
    try:
        binary = path.endswith(".mjb")
        return mujoco.MjModel.from_binary_path(path) if binary else mujoco.MjModel.from_xml_path(path)
    except ValueError as error:
        raise FileError(str(error), file=path) from error


def check(
    *, substeps: int, eps: float, order: int, curvature_eps: float, tolerance: float, threads: int | None
) -> None:
    for name, count in (("substeps", substeps), ("threads", threads)):
        if count is not None and (isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1):
            raise UsageError(f"{name}={count!r}: a whole number of at least 1")
    for name, step in (("eps", eps), ("curvature_eps", curvature_eps)):
        if not 1e-9 < step < 1.0:
            raise UsageError(f"{name}={step!r}: a number between 1e-9 and 1")
    if order not in (2, 4):
        raise UsageError(f"order={order!r}: 2 or 4")
    if not 0.0 <= tolerance < 1.0:
        raise UsageError(f"tolerance={tolerance!r}: a number from 0 to 1")


def keyframe(model: mujoco.MjModel, chosen: str | int | None) -> mujoco.MjData:
    """Data at a keyframe."""
    data = mujoco.MjData(model)
    if chosen is None:
        mujoco.mj_resetData(model, data)
        return data
    valid = [names.name_of(model, mujoco.mjtObj.mjOBJ_KEY, i) for i in range(model.nkey)]
    index = names.find("keyframe", chosen, valid) if isinstance(chosen, str) else int(chosen)
    if not 0 <= index < model.nkey:
        raise UsageError(f"keyframe={chosen!r}: the model has {model.nkey}, counted from 0")
    mujoco.mj_resetDataKeyframe(model, data, index)
    return data


def ranges(model: mujoco.MjModel, places: Array | Any) -> list[tuple[float, float]] | None:
    """Ranges of controls by their places; none where none is limited."""
    limited = np.asarray(model.actuator_ctrllimited, dtype=bool)[places]
    if not limited.any():
        return None
    ranges = np.asarray(model.actuator_ctrlrange)[places]
    return [(float(a), float(b)) if on else (-np.inf, np.inf) for (a, b), on in zip(ranges, limited, strict=True)]


def move(parameter: Parameter) -> float:
    """Step size of a parameter for finite differences: a thousandth of its range, or, as a negative number, relative
    to its value."""
    span = float(parameter.bounds[1]) - float(parameter.bounds[0])
    return -1e-3 if parameter.scale == "log" else 1e-3 * span


def changed(what: str, values: list[Number], valid: list[str], changes: Mapping[str, Number]) -> list[Number]:
    """Values with those changed that match names or patterns; full names and longer patterns take precedence."""
    out = list(values)
    for pattern in sorted(changes, key=lambda pattern: (pattern in valid, len(pattern))):
        for i in names.select(f"name, as {what} wants,", pattern, valid):
            out[i] = changes[pattern]
    return out
