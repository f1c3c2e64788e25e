"""The explorer, served from this process."""

from __future__ import annotations

import atexit
import os
import sys
import time
import webbrowser
from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import _html
from ._supple import NativeExplorer
from .errors import UsageError

if TYPE_CHECKING:
    from typing_extensions import Self

    from .task import Task

__all__ = ["Explorer"]

#: Height of the page in a notebook, pixels.
HEIGHT = 900

#: Explorers that are open. They stay open until they are closed or the interpreter ends, whoever holds them.
_OPEN: set[Explorer] = set()


class Explorer:
    """A page with sliders for a task, served to browsers of this machine from threads of this process.

    Made by :meth:`supple.Task.explore`. A context manager: the page ends with the block. Otherwise it ends with ``close()``
    or the interpreter. Attributes refer to the page that was used last.

    Attributes:
        url: The address of the page. Anyone on this machine who knows it can use the page: it contains a token.
    """

    def __init__(self, native: NativeExplorer, task: Task) -> None:
        self._native = native
        self._task = task
        self.url = native.address()
        _OPEN.add(self)

    @property
    def design(self) -> dict[str, float]:
        """All parameters on screen by name, for :meth:`supple.Task.at`."""
        parameters: dict[str, float] = self._native.screen()["parameters"]
        return parameters

    @property
    def limits(self) -> dict[str, float]:
        """Cost limits that were changed, by the name of their slider."""
        limits: dict[str, float] = self._native.screen()["limits"]
        return limits

    @property
    def noise(self) -> dict[str, float]:
        """Factors on standard deviations of noise that was changed, by the name of the slider."""
        noise: dict[str, float] = self._native.screen()["noise"]
        return noise

    @property
    def closed(self) -> bool:
        """Whether the page has ended."""
        return self._native.is_closed()

    def task(self) -> Task:
        """A task whose initial values are the parameters on screen; changed limits and noise are included.

        Raises:
            UsageError: If limits or noise are changed and the task file gives them in a form that cannot be rewritten, or the
                task has no file.
        """
        screen = self._native.screen()
        if not (screen["limits"] or screen["noise"] or screen["reread"]):
            return self._task.at(screen["parameters"])
        from .task import Task

        kind, what = self._task._recipe
        if kind == "own":
            # Limits and noise of such a task are refused here.
            self._native.task()
            return self._task.at(screen["parameters"])
        return Task(self._native.task(), ("loads", what))

    def wait(self) -> None:
        """Blocks until the page is closed, or until Ctrl-C, which closes it and returns: for scripts."""
        try:
            while not self.closed:
                time.sleep(0.1)
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Ends the page and its computations. ``design``, ``limits``, ``noise`` and ``task()`` keep their last values."""
        self._native.close()
        _OPEN.discard(self)

    def show(self, height: int = HEIGHT) -> None:
        """Shows the page in the output of a notebook cell, ``height`` pixels high.

        Raises:
            UsageError: Outside of a notebook.
        """
        if not _in_notebook():
            raise UsageError("there is no notebook to show the page in: open url in a browser")
        shown: Any = import_module("IPython.display")
        shown.display(shown.IFrame(self.url, "100%", int(height), extras=['title="The explorer"']))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _summary(self) -> list[tuple[str, str]]:
        rows = [("url", self.url if not self.closed else "closed")]
        rows += [(name, f"{value:.6g}") for name, value in {**self.design, **self.limits}.items()]
        return rows + [(name, f"× {factor:.6g}") for name, factor in self.noise.items()]

    def __repr__(self) -> str:
        rows = self._summary()
        width = max(len(name) for name, _ in rows)
        return "\n".join(["Explorer", *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def _repr_html_(self) -> str:
        return _html.table("Explorer", self._summary())


def explore(task: Task, port: int | None, browser: bool) -> Explorer:
    """Opens a page for a task: in the cell of a notebook, or in a browser of this machine."""
    if port is not None and not (isinstance(port, int) and 1 <= port <= 65535):
        raise UsageError(f"port={port!r}: a number from 1 to 65535; default: any port that is free")
    kind, what = task._recipe
    # The file of a task that has other values than its file is not read again: it would lose them.
    file = what if kind == "load" and not task._changed else None
    explorer = Explorer(NativeExplorer.open(task._native, file, port), task)
    if not browser:
        return explorer
    if _in_notebook():
        explorer.show()
    else:
        _open(explorer.url)
    return explorer


def _open(url: str) -> None:
    """Opens an address in a browser and prints it."""
    print(url)
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        # Browsers for terminals would take this one over.
        why = "there is no display"
    else:
        try:
            why = "" if webbrowser.open(url) else "none was found"
        except webbrowser.Error as error:
            why = str(error)
    if why:
        print(f"No browser was started ({why}): open this address in a browser of this machine.", file=sys.stderr)


def _in_notebook() -> bool:
    """Whether outputs are cells of a notebook."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    return running is not None and running.__class__.__name__ == "ZMQInteractiveShell"


@atexit.register
def _close_all() -> None:
    for explorer in list(_OPEN):
        explorer.close()
