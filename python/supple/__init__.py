"""Design compliant robots that need little information to be controlled."""

from __future__ import annotations

from ._supple import __version__
from .errors import ComputeError, FileError, Interrupted, KeptError, StorageError, SuppleError, UsageError, WorkerError
from .plots import Figure
from .progress import Progress
from .results import Design, Evaluation, Pareto, Result, Robustness, Sweep, Trace, load_result
from .table import Table
from .task import Grid, Parameter, Task, load

__all__ = [
    "ComputeError",
    "Design",
    "Evaluation",
    "Figure",
    "FileError",
    "Grid",
    "Interrupted",
    "KeptError",
    "Parameter",
    "Pareto",
    "Progress",
    "Result",
    "Robustness",
    "StorageError",
    "SuppleError",
    "Sweep",
    "Table",
    "Task",
    "Trace",
    "UsageError",
    "WorkerError",
    "__version__",
    "load",
    "load_result",
]
