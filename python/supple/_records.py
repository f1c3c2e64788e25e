"""Plain objects built from nested dicts according to their annotations."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Flags", "Record", "build", "plain"]

#: An array of float64.
Array = NDArray[np.float64]

#: An array of booleans.
Flags = NDArray[np.bool_]

T = TypeVar("T")
R = TypeVar("R", bound="Record")

_HINTS: dict[type, dict[str, Any]] = {}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Record:
    """Base class of reports: named numbers, strings, arrays and other records."""

    def to_dict(self) -> dict[str, Any]:
        """The record as dicts, lists, numbers and strings for ``json.dumps``, including NaN and infinity."""
        return {field.name: plain(getattr(self, field.name)) for field in dataclasses.fields(self)}

    def __repr__(self) -> str:
        fields = ", ".join(f"{field.name}={_short(getattr(self, field.name))}" for field in dataclasses.fields(self))
        return f"{type(self).__name__}({fields})"


def _short(value: object) -> str:
    """A short form of a value: arrays by their shape."""
    if isinstance(value, np.ndarray):
        return f"<array {'x'.join(map(str, value.shape))}>" if value.size > 4 else str(value.tolist())
    if isinstance(value, (list, dict)) and len(value) > 4:
        return f"<{len(value)} entries>"
    return repr(value)


def plain(value: object) -> Any:
    """A value as dicts, lists, numbers and strings."""
    if isinstance(value, Record):
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    return value


def build(kind: type[R], data: Mapping[str, Any]) -> R:
    """A record of a kind from a dict; unknown keys are ignored."""
    hints = _HINTS.get(kind)
    if hints is None:
        hints = _HINTS[kind] = get_type_hints(kind)
    fields = dataclasses.fields(kind)
    return kind(**{field.name: _convert(hints[field.name], data.get(field.name)) for field in fields})


def _convert(hint: Any, value: Any) -> Any:
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        inner = [kind for kind in get_args(hint) if kind is not type(None)]
        return _convert(inner[0], value) if len(inner) == 1 else value
    if origin is np.ndarray:
        dtype = np.bool_ if hint == Flags else np.float64
        return np.asarray(value if value is not None else [], dtype=dtype)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return build(typing.cast("type[Record]", hint), value if value is not None else {})
    if origin is list:
        (inner,) = get_args(hint)
        return [_convert(inner, entry) for entry in (value if value is not None else [])]
    if origin is dict:
        _, inner = get_args(hint)
        if isinstance(value, list):
            return {entry["name"]: _convert(inner, entry) for entry in value}
        return {key: _convert(inner, entry) for key, entry in (value or {}).items()}
    if hint is float:
        return float("nan") if value is None else float(value)
    return value
