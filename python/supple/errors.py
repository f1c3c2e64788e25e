"""Exceptions, with the words of the command line."""

from __future__ import annotations

__all__ = ["ComputeError", "FileError", "Interrupted", "KeptError", "StorageError", "SuppleError", "UsageError"]
__all__ += ["WorkerError"]


class SuppleError(Exception):
    """What all exceptions of supple have in common."""


class UsageError(SuppleError, ValueError):
    """Something that was asked for cannot be: an unknown name, a value out of bounds, a wrong shape."""


class ComputeError(SuppleError, ArithmeticError):
    """Something could not be computed: a number that is not finite, a covariance that is indefinite."""


class StorageError(SuppleError, OSError):
    """A file could not be read or written."""


class KeptError(SuppleError):
    """A journal or a kept result that does not fit: from another task or version, or damaged."""


class Interrupted(SuppleError):
    """Work was told to stop before it was done."""


class WorkerError(SuppleError, RuntimeError):
    """A worker of an executor ended, cannot be used, or has another version."""


class FileError(SuppleError, ValueError):
    """Something is wrong in a file, or it cannot be read.

    Attributes:
        file: The file's name.
        line: Line, from 1; 0 where the file could not be read.
        column: Column, from 1.
        key: What it is about, such as ``tasks[0].noise.initial``.
        help: What to do about it, where that is known.
        picture: The lines that are meant, with marks.
    """

    def __init__(
        self,
        message: str,
        file: str = "",
        line: int = 0,
        column: int = 0,
        key: str = "",
        help: str | None = None,
        picture: str = "",
    ) -> None:
        super().__init__(message, file, line, column, key, help, picture)
        self.file = file
        self.line = line
        self.column = column
        self.key = key
        self.help = help
        self.picture = picture

    def __str__(self) -> str:
        message = str(self.args[0])
        return f"{message}\n{self.picture}" if self.picture else message
