"""Design compliant robots that need little information to be controlled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._citation import cite
from ._linear import linear
from ._state_space import from_state_space
from ._supple import __version__
from .bounds import Bounds
from .checks import CheckReport, Linearisation
from .closed_loop import Rollouts
from .controller import Controller
from .errors import ComputeError, FileError, Interrupted, KeptError, StorageError, SuppleError, UsageError, WorkerError
from .explorer import Explorer
from .loading import load, loads
from .model import DerivativeError, Derivatives, Model, Noise, VaryingVariance, combine
from .plots import Figure
from .progress import Progress
from .results import Design, Evaluation, Result
from .sensors import Sensors, SensorsCertificate, SensorSet, SensorValue
from .studies import Pareto, Robustness, Sweep, Trace, load_result
from .table import Table
from .task import CatalogueEntry, Grid, Parameter, Task

if TYPE_CHECKING:
    from . import executors as executors
    from . import mujoco as mujoco

__all__ = [
    "Bounds",
    "CatalogueEntry",
    "CheckReport",
    "ComputeError",
    "Controller",
    "DerivativeError",
    "Derivatives",
    "Design",
    "Evaluation",
    "Explorer",
    "Figure",
    "FileError",
    "Grid",
    "Interrupted",
    "KeptError",
    "Linearisation",
    "Model",
    "Noise",
    "Parameter",
    "Pareto",
    "Progress",
    "Result",
    "Robustness",
    "Rollouts",
    "StorageError",
    "SuppleError",
    "SensorSet",
    "SensorValue",
    "Sensors",
    "SensorsCertificate",
    "Sweep",
    "Table",
    "Task",
    "Trace",
    "UsageError",
    "VaryingVariance",
    "WorkerError",
    "__version__",
    "cite",
    "combine",
    "from_state_space",
    "linear",
    "load",
    "load_result",
    "loads",
]


def __getattr__(name: str) -> Any:
    """Imports modules on first use: ``supple.executors``, and ``supple.mujoco``, which requires MuJoCo."""
    if name in ("executors", "mujoco"):
        from importlib import import_module

        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
