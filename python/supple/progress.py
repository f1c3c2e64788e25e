"""Progress of long computations: a tqdm bar if tqdm is installed."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any, Protocol

__all__ = ["Bar", "Progress", "watching"]


class Progress(Protocol):
    """Observes the progress of a computation. Any object with these methods can be passed as ``progress``."""

    def begin(self, what: str, done: int, total: int) -> None:
        """A computation of ``total`` parts began; ``done`` of them were done before."""

    def advance(self, parts: int) -> None:
        """``parts`` more parts are done."""

    def say(self, message: str) -> None:
        """A message to show, such as the best design so far."""


class Bar:
    """A tqdm bar; a line on standard error if tqdm is not installed."""

    def __init__(self) -> None:
        self._bar: Any = None
        try:
            from tqdm.auto import tqdm

            self._make: Any = tqdm
        except ImportError:
            self._make = Line

    def begin(self, what: str, done: int, total: int) -> None:
        self.close()
        self._bar = self._make(desc=what, initial=done, total=total)

    def advance(self, parts: int) -> None:
        if self._bar is not None:
            self._bar.update(parts)

    def say(self, message: str) -> None:
        if self._bar is not None:
            self._bar.set_postfix_str(message)

    def close(self) -> None:
        """Closes the current bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class Line:
    """The part of tqdm that :class:`Bar` uses, on one line of standard error."""

    def __init__(self, desc: str, initial: int, total: int) -> None:
        self._what, self._done, self._total, self._message = desc, initial, total, ""
        self._length = 0
        self._show()

    def update(self, parts: int) -> None:
        self._done += parts
        self._show()

    def set_postfix_str(self, message: str) -> None:
        self._message = message
        self._show()

    def close(self) -> None:
        if sys.stderr.isatty():
            print(file=sys.stderr)

    def _show(self) -> None:
        if not sys.stderr.isatty():
            return
        text = f"{self._what}: {self._done} of {self._total} {self._message}"
        print("\r" + text.ljust(self._length), end="", file=sys.stderr, flush=True)
        self._length = len(text)


class watching:
    """Makes a progress observer from the argument ``progress=``, and closes its bar at the end."""

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
