"""Loading of task files."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping

from ._asked import pairs
from ._supple import NativeTask
from .task import Task

__all__ = ["load", "loads"]

LOGGER = logging.getLogger("supple")


def load(path: str | os.PathLike[str], /, **parameters: float) -> Task:
    """Loads a task file (TOML) and sets some of its parameters.

    Raises:
        FileError: If the file, or the robot file that it names, is invalid or cannot be read.
        UsageError: If a parameter is unknown or out of bounds.
    """
    return _read(NativeTask.load(path, pairs(parameters)), ("load", os.fspath(path)), parameters)


def loads(text: str, /, path: str | os.PathLike[str] = "task.toml", **parameters: float) -> Task:
    """Loads a task file from its text and sets some of its parameters.

    Args:
        text: The text of a task file (TOML).
        path: The assumed location of the file: paths in it, such as that of the robot file, are relative to its folder.
        **parameters: Values of parameters.

    Raises:
        FileError: If the text, or the robot file that it names, is invalid.
        UsageError: If a parameter is unknown or out of bounds.
    """
    native = NativeTask.restore([(os.fspath(path), text)], pairs(parameters))
    return _read(native, ("loads", os.fspath(path)), parameters)


def _read(native: NativeTask, recipe: tuple[str, str], parameters: Mapping[str, float]) -> Task:
    for warning in native.warnings():
        LOGGER.warning("%s: %s", recipe[1], warning)
    return Task(native, recipe, changed=parameters)
