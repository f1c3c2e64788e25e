"""The text that identifies the task of a custom model, in place of a task file.

Results store it, and journals of sweeps use it to check whether they belong to a task: it has to change when the task
changes.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import types
from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["of_function", "source"]


def source(description: dict[str, Any]) -> str:
    """The text of a description for the native part."""
    parts = [json.dumps(json.loads(description["plain"]), indent=2)]
    parts += [_of_value(system) for system in description["systems"]]
    return "\n\n".join(parts) + "\n"


def of_function(function: Callable[..., Any]) -> str:
    """The code of a function and of everything to which it refers."""
    return _of_callable(function, set())


def _of_value(value: Any) -> str:
    """A part of a description: arrays and long texts by their fingerprints."""
    if isinstance(value, dict):
        return "\n".join(f"{key}: {_of_value(entry)}" for key, entry in value.items())
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {_fingerprint(np.ascontiguousarray(value).tobytes())}"
    if isinstance(value, str):
        return value if len(value) < 200 else f"text of {len(value)} characters, {_fingerprint(value.encode())}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_of_value(entry) for entry in value) + "]"
    if value is None or isinstance(value, (int, float)):
        return repr(value)
    about = getattr(value, "source", None)
    return str(about()) if callable(about) else type(value).__qualname__


def _fingerprint(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _of_callable(function: Any, seen: set[int]) -> str:
    inner = inspect.unwrap(function)
    if id(inner) in seen:
        return ""
    seen.add(id(inner))
    if isinstance(inner, functools.partial):
        return f"{_of_callable(inner.func, seen)}\nwith {_as_json([inner.args, inner.keywords])}\n"
    if not isinstance(inner, types.FunctionType):
        # A method or an object: its class and what it holds.
        bound = getattr(inner, "__func__", None) or vars(type(inner)).get("__call__")
        held = getattr(inner, "__self__", inner)
        own = _of_values(dict(sorted(getattr(held, "__dict__", {}).items())), seen)
        code = _of_callable(bound, seen) if isinstance(bound, types.FunctionType) else type(inner).__qualname__
        return f"{code}\n{own}"
    try:
        text = inspect.getsource(inner)
    except (OSError, TypeError):
        compiled = inner.__code__
        text = f"{inner.__qualname__} {_fingerprint(compiled.co_code + repr(compiled.co_consts).encode())}\n"
    try:
        variables = inspect.getclosurevars(inner)
    except ValueError:
        return text
    used = {**variables.globals, **variables.nonlocals}
    if inner.__defaults__:
        used["defaults"] = inner.__defaults__
    return text + _of_values(dict(sorted(used.items())), seen)


def _as_json(value: Any) -> str:
    try:
        return json.dumps(value, default=_of_value)
    except (TypeError, ValueError, RecursionError):
        return type(value).__qualname__


def _of_values(values: dict[str, Any], seen: set[int]) -> str:
    lines = []
    for name, value in values.items():
        if isinstance(value, (types.ModuleType, type)):
            continue
        if callable(value):
            if str(getattr(value, "__module__", "")).split(".")[0] not in ("jax", "numpy", "scipy", "builtins"):
                lines.append(_of_callable(value, seen))
        elif hasattr(value, "__array__"):
            lines.append(f"{name} = {_of_value(np.asarray(value))}\n")
        elif value is None or isinstance(value, (bool, int, float, complex, str, list, tuple, dict)):
            # Values inside lists have no address in their text.
            lines.append(f"{name} = {value!r}\n" if isinstance(value, complex) else f"{name} = {_as_json(value)}\n")
    return "".join(lines)
