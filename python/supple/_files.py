"""Files that results are written to."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import StorageError

__all__ = ["written"]


def written(path: str | os.PathLike[str], contents: bytes) -> Path:
    """Writes a file and returns its path.

    Raises:
        StorageError: If it cannot be written.
    """
    try:
        Path(path).write_bytes(contents)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from error
    return Path(path)
