"""Progress of long work: a bar of tqdm where that is installed."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import Any, Protocol

from .errors import UsageError

__all__ = ["Bar", "Progress", "watching"]

LOGGER = logging.getLogger("supple")


class Progress(Protocol):
    """Sees how far long work is. Any object with these methods may be given as ``progress``."""

    def begin(self, what: str, done: int, total: int) -> None:
        """Work of ``total`` parts began; ``done`` of them were done before."""

    def advance(self, parts: int) -> None:
        """``parts`` more are done."""

    def say(self, message: str) -> None:
        """Something to say beside it, such as the best design until now."""


class Bar:
    """A bar of tqdm's."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError as error:
            raise UsageError("progress=True needs tqdm: pip install tqdm, or give an object of your own") from error
        self._tqdm: Any = tqdm
        self._bar: Any = None

    def begin(self, what: str, done: int, total: int) -> None:
        self.close()
        self._bar = self._tqdm(desc=what, initial=done, total=total)

    def advance(self, parts: int) -> None:
        if self._bar is not None:
            self._bar.update(parts)

    def say(self, message: str) -> None:
        if self._bar is not None:
            self._bar.set_postfix_str(message)

    def close(self) -> None:
        """Ends the bar that is there."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class watching:
    """Makes an object that sees progress out of ``progress=``, and ends its bar at the end."""

    def __init__(self, progress: bool | Progress | None) -> None:
        if progress is True:
            self._seer: Progress | None = Bar()
        elif progress is False or progress is None:
            self._seer = None
        else:
            self._seer = progress

    def __enter__(self) -> Progress | None:
        return self._seer

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if isinstance(self._seer, Bar):
            self._seer.close()
