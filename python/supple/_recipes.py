"""Tasks rebuilt in other processes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ._supple import NativeTask
from .errors import UsageError
from .task import Task

__all__ = ["make"]


def make(kind: str, what: Any, changed: Mapping[str, float]) -> Task:
    """The task of a recipe, with these parameter values."""
    if kind in ("load", "loads"):
        path, sources = what
        return Task(NativeTask.restore(sources, list(changed.items())), (kind, path), changed)
    if kind == "own":
        return Task(NativeTask.own(what), (kind, what)).at(changed)
    raise UsageError(f"no recipe `{kind}`")
