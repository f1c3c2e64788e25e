"""The controller of a design: run one step at a time here, or exported as C, JSON or arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import numbers
from ._asked import check_counts
from ._records import Array, Record, build
from ._supple import NativeController
from .errors import UsageError
from .reports import MonteCarlo

if TYPE_CHECKING:
    from typing_extensions import Self

    from .results import _OfDesign

__all__ = ["Controller"]


@dataclass(frozen=True, eq=False, repr=False)
class Controller(Record):
    """A Kalman filter and control law along a plan; ``n`` states, ``m`` controls, ``p`` measurements, ``N`` steps.

    A copy, also one by pickling, begins the plan anew.

    ``d`` is the estimated deviation from the plan, 0 before the first measurement. Step ``t`` is
    ``d += L[t] @ (y - expected_measurements[t] - C[t] @ d)``, then the controls
    ``u = clip(controls[t] + feedforward[t] + K[t] @ d)``, then ``d = A[t] @ d + B[t] @ (u - controls[t])``.

    States, controls and measurements have the units of ``state_units``, ``control_units`` and ``measurement_units``; entries
    of matrices have the unit of their row divided by that of their column, and covariances products of units.

    Attributes:
        task: Name of the task.
        status: How its plan ended; use the controller only if it is ``converged``.
        parameters: All parameters of the design.
        time_step: Length of a step, s.
        steps: ``N``.
        time: Time of each state, s, (N+1,).
        state_names: Names of the states.
        state_units: Their units; empty if they are not known.
        control_names: Names of the controls.
        control_units: Their units.
        measurement_names: Names of the measurements.
        measurement_units: Their units.
        states: States of the plan, (N+1, n).
        controls: Its controls, (N, m).
        expected_measurements: Measurements predicted from its states, (N+1, p).
        feedforward: ``k``, (N, m).
        feedback: ``K``, (N, m, n).
        filter_gain: ``L``, (N+1, n, p).
        dynamics: ``A``, (N, n, n).
        input: ``B``, (N, n, m).
        measurement: ``C``, (N+1, p, n).
        initial_covariance: ``X_0``, (n, n).
        process_covariance: ``W``, (N, n, n).
        measurement_covariance: ``V``, (N+1, p, p).
        predicted_covariance: ``P``, before each measurement, (N+1, n, n).
        belief_covariance: ``Sigma``, after each measurement, (N+1, n, n).
        control_lower: Lower limits of the controls, ``-inf`` if there is none, (m,).
        control_upper: Upper limits of the controls, ``inf`` if there is none, (m,).
    """

    task: str
    status: str
    parameters: dict[str, float]
    time_step: float
    steps: int
    time: Array
    state_names: list[str]
    state_units: list[str]
    control_names: list[str]
    control_units: list[str]
    measurement_names: list[str]
    measurement_units: list[str]
    states: Array
    controls: Array
    expected_measurements: Array
    feedforward: Array
    feedback: Array
    filter_gain: Array
    dynamics: Array
    input: Array
    measurement: Array
    initial_covariance: Array
    process_covariance: Array
    measurement_covariance: Array
    predicted_covariance: Array
    belief_covariance: Array
    control_lower: Array
    control_upper: Array

    @classmethod
    def _of(cls, native: NativeController, origin: tuple[_OfDesign, str, str | None]) -> Self:
        """From the native one, and the result, task and design that it is of."""
        made = build(cls, native.data())
        made.__dict__["native"] = native
        made.__dict__["origin"] = origin
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return _made_again, self.__dict__["origin"]

    @property
    def _native(self) -> NativeController:
        native: NativeController = self.__dict__["native"]
        return native

    @property
    def K(self) -> Array:
        """Feedback, (N, m, n)."""
        return self.feedback

    @property
    def L(self) -> Array:
        """Kalman gains, (N+1, n, p)."""
        return self.filter_gain

    @property
    def A(self) -> Array:
        """Dynamics, (N, n, n)."""
        return self.dynamics

    @property
    def B(self) -> Array:
        """Input, (N, n, m)."""
        return self.input

    @property
    def C(self) -> Array:
        """Measurement, (N+1, p, n)."""
        return self.measurement

    @property
    def position(self) -> int:
        """The step of the next measurement, from 0; ``N`` once the plan has ended."""
        return self._native.position

    @property
    def estimate(self) -> Array:
        """The state estimate after the last measurement, (n,); before the first measurement, the plan's initial state."""
        return self._native.estimate

    def step(self, y: ArrayLike) -> Array:
        """Processes the measurement of the next step and returns its controls.

        Args:
            y: Measurement, (p,), in ``measurement_units``.

        Returns:
            Controls to apply until the next measurement, (m,), in ``control_units``.

        Raises:
            UsageError: ``y`` is not an array of ``p`` numbers, or the plan has ended.
            ComputeError: ``y`` has an entry that is not finite. The state of the controller is then unchanged.
        """
        if type(y) is not np.ndarray or y.dtype != np.float64 or y.ndim != 1:
            y = _vector(y)
        u = self.__dict__["native"].step(y)
        if u is None:
            raise UsageError(f"the plan has ended after {self.steps} steps: reset() restarts it")
        found: Array = u
        return found

    def reset(self) -> None:
        """Restarts the plan."""
        self._native.reset()

    def monte_carlo(self, rollouts: int = 256, *, seed: int = 0) -> MonteCarlo:
        """Its cost in closed loop with the task's own model and noise, independent of the current step.

        Results report the cost of roll-outs with an *extended* Kalman filter instead, whose noise is the same for a seed.

        Args:
            rollouts: Number of roll-outs.
            seed: Seed of their noise.
        """
        check_counts(rollouts=rollouts, seed=seed)
        if not rollouts:
            raise UsageError("rollouts=0: at least 1")
        return build(MonteCarlo, self._native.monte_carlo(int(rollouts), int(seed)))

    def to_c(self, path: str | os.PathLike[str]) -> list[Path]:
        """Writes ``NAME.c`` and ``NAME.h``, C99 without dynamic allocation; returns both paths.

        Args:
            path: The path of ``NAME.c``.
        """
        return self._native.write("c", path)

    def to_json(self, path: str | os.PathLike[str]) -> Path:
        """Writes one JSON object with the attributes as keys and returns the path. Missing limits are ``null``."""
        return self._native.write("json", path)[0]

    def to_npz(self, path: str | os.PathLike[str]) -> Path:
        """Writes the attributes as arrays for ``numpy.load`` and returns the path.

        Parameters are stored as ``parameter_names`` and ``parameter_values``.
        """
        return self._native.write("npz", path)[0]


def _vector(y: ArrayLike) -> Array:
    found = numbers("the measurement", y)
    if found.ndim != 1:
        raise UsageError(f"the measurement has the shape {found.shape}: it must be a vector")
    return found


def _made_again(result: _OfDesign, task: str, at: str | None) -> Controller:
    return result._controller(task, at)
