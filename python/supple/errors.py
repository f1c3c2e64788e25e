"""Exceptions, with the messages of the command line."""

from __future__ import annotations

__all__ = ["ComputeError", "FileError", "Interrupted", "KeptError", "StorageError", "SuppleError", "UsageError"]
__all__ += ["WorkerError"]


class SuppleError(Exception):
    """Base class of all exceptions of supple."""


class UsageError(SuppleError, ValueError):
    """An argument is invalid: an unknown name, a value out of bounds, a wrong shape."""


class ComputeError(SuppleError, ArithmeticError):
    """A result could not be computed: a number is not finite, or a covariance is indefinite."""


class StorageError(SuppleError, OSError):
    """A file could not be read or written."""


class KeptError(SuppleError):
    """A journal or a stored result does not match: it is from another task or version, or damaged."""


class Interrupted(SuppleError):
    """The computation was stopped before it was complete."""


class WorkerError(SuppleError, RuntimeError):
    """A worker of an executor ended, cannot be used, or has another version."""


class FileError(SuppleError, ValueError):
    """A file is invalid or cannot be read.

    Attributes:
        file: The file's name.
        line: Line, from 1; 0 if the file could not be read.
        column: Column, from 1.
        key: The key concerned, such as ``tasks[0].noise.initial``.
        help: How to fix it, if that is known.
        picture: The lines concerned, with marks.
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
