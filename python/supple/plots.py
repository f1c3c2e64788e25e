"""Figures for papers and notebooks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._files import written
from ._supple import Kept
from .errors import UsageError

if TYPE_CHECKING:
    from .results import Result
    from .studies import Sweep

__all__ = ["Figure", "Plots"]


class Figure:
    """A figure of results; notebooks show it."""

    def __init__(self, kept: Kept, others: Sequence[Kept], figure: str, task: str | None, wide: bool) -> None:
        self._kept = kept
        self._others = list(others)
        self._figure = figure
        self._task = task
        self._wide = wide
        # Drawn at once, so that errors are raised at the call.
        self._svg = self.render("svg").decode()

    def render(self, format: str) -> bytes:
        """The contents of a file: ``svg``, ``pdf`` or ``png``."""
        return self._kept.plot(self._figure, format, others=self._others, task=self._task, wide=self._wide)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes a file in the format of its extension and returns the path.

        Raises:
            StorageError: If it cannot be written.
        """
        return written(path, self.render(Path(path).suffix.lstrip(".").lower()))

    def _repr_svg_(self) -> str:
        return self._svg

    def __repr__(self) -> str:
        return f"Figure `{self._figure}`: save it, or show it in a notebook"


class Plots:
    """The figures of a result. ``others`` are results to draw into the same figure, ``task`` selects one of several.

    ``ax`` also draws the figure on matplotlib axes: one axes object for each panel.
    """

    def __init__(self, result: Result) -> None:
        self._result = result

    def _figure(self, figure: str, others: Sequence[Result], task: str | None, wide: bool, ax: Any) -> Figure:
        kept = [other._kept for other in others]
        if ax is not None:
            from ._axes import draw

            draw(self._result._kept.figure(figure, others=kept, task=task), ax)
        return Figure(self._result._kept, kept, figure, task, wide)

    def landscape(
        self,
        *others: Result,
        sweep: Sweep | None = None,
        points: int = 21,
        task: str | None = None,
        wide: bool = True,
        ax: Any = None,
    ) -> Figure:
        """Information and cost against one or two parameters, with this result marked.

        Without a sweep among the results, it runs one over the first two design parameters between their bounds, with
        ``points`` values each; the other parameters are held at the values of this result.
        """
        results = [self._result, *others]
        if sweep is None and not any(result.kind == "sweep" for result in results):
            others = (*others, self._swept(points))
        elif sweep is not None:
            others = (*others, sweep)
        return self._figure("landscape", others, task, wide, ax)

    def _swept(self, points: int) -> Sweep:
        task = self._result.task
        if task is None:
            raise UsageError("the landscape needs a sweep: give one as sweep=, made by task.sweep")
        names = [name for name, parameter in task.parameters.items() if parameter.role == "design"][:2]
        if not names:
            raise UsageError("the landscape needs a sweep: give one as sweep=; the task has no design parameters")
        grid = {}
        for name in names:
            parameter = task.parameters[name]
            lower, upper = parameter.bounds
            grid[name] = f"{'log' if parameter.scale == 'log' else 'lin'}:{lower!r}:{upper!r}:{points}"
        values = getattr(self._result, "parameters", {})
        return task.sweep(grid, at={name: value for name, value in values.items() if name not in names})

    def belief(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """States over time: plan, truth, estimate."""
        return self._figure("belief", others, task, wide, ax)

    def gains(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """Feedback gains and feedforward over time."""
        return self._figure("gains", others, task, wide, ax)

    def information(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """Information over time, by measurement."""
        return self._figure("information", others, task, wide, ax)

    def robustness(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """Costs as a noise grows."""
        return self._figure("robustness", others, task, wide, ax)

    def pareto(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """Information against cost."""
        return self._figure("pareto", others, task, wide, ax)

    def bound(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """The minimum information against the cost limit; requires ``curve=True``."""
        return self._figure("bound", others, task, wide, ax)

    def motion(self, *others: Result, task: str | None = None, wide: bool = True, ax: Any = None) -> Figure:
        """The robot at six times of its motion, with contact forces."""
        return self._figure("motion", others, task, wide, ax)
