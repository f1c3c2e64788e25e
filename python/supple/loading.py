"""Task files, read."""

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
    """Reads a task file (TOML), and sets some of its parameters.

    Raises:
        FileError: Where the file, or the robot's file that it names, is wrong or cannot be read.
        UsageError: Where a parameter is unknown or out of bounds.
    """
    return _read(NativeTask.load(path, pairs(parameters)), ("load", os.fspath(path)), parameters)


def loads(text: str, /, path: str | os.PathLike[str] = "task.toml", **parameters: float) -> Task:
    """Reads a task file from its text, and sets some of its parameters.

    Args:
        text: The text of a task file (TOML).
        path: Where the file would be: files that it names, such as that of the robot, are looked for beside it.
        **parameters: Values of parameters.

    Raises:
        FileError: Where the text, or the robot's file that it names, is wrong.
        UsageError: Where a parameter is unknown or out of bounds.
    """
    native = NativeTask.restore([(os.fspath(path), text)], pairs(parameters))
    return _read(native, ("loads", os.fspath(path)), parameters)


def _read(native: NativeTask, recipe: tuple[str, str], parameters: Mapping[str, float]) -> Task:
    for warning in native.warnings():
        LOGGER.warning("%s: %s", recipe[1], warning)
    return Task(native, recipe, changed=parameters)
