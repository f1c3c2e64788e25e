"""The controller of a design as something that runs: a step at a time here, or as C, JSON and arrays elsewhere."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import check_unmasked
from ._asked import check_counts
from ._records import Array, Record, build
from ._supple import NativeController
from .errors import UsageError
from .reports import MonteCarlo

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Controller"]


@dataclass(frozen=True, eq=False, repr=False)
class Controller(Record):
    """A Kalman filter and control law along a plan; ``n`` states, ``m`` controls, ``p`` measurements, ``N`` steps.

    With ``d``, the estimated deviation from the plan, which is 0 before the first measurement, step ``t`` is
    ``d += L[t] @ (y - expected_measurements[t] - C[t] @ d)``, then the controls
    ``u = clip(controls[t] + feedforward[t] + K[t] @ d)``, then ``d = A[t] @ d + B[t] @ (u - controls[t])``.

    States, controls and measurements have the units of ``state_units``, ``control_units`` and ``measurement_units``; entries
    of matrices have those of their row over those of their column, and covariances products of units.

    Attributes:
        task: Name of the task.
        status: How its plan ended; only of a ``converged`` one the controller is of use.
        parameters: All parameters of the design.
        time_step: Length of a step, s.
        steps: ``N``.
        time: Time of each state, s, (N+1,).
        state_names: Names of the states.
        state_units: Their units; empty where they are not known.
        control_names: Names of the controls.
        control_units: Their units.
        measurement_names: Names of the measurements.
        measurement_units: Their units.
        states: States of the plan, (N+1, n).
        controls: Its controls, (N, m).
        expected_measurements: What its states measure, (N+1, p).
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
        control_lower: Least controls, ``-inf`` where there is no bound, (m,).
        control_upper: Greatest controls, ``inf`` where there is no bound, (m,).
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
    def _of(cls, native: NativeController) -> Self:
        made = build(cls, native.data())
        made.__dict__["native"] = native
        return made

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
        """The step whose measurement comes next, from 0; ``N`` once the plan is over."""
        return self._native.position

    @property
    def estimate(self) -> Array:
        """The state at the last measurement as estimated with it, (n,); before the first one, the plan's first state."""
        return self._native.estimate

    def step(self, y: ArrayLike) -> Array:
        """Takes in the measurement of the next step and returns its controls.

        Args:
            y: Measurement, (p,), in ``measurement_units``.

        Returns:
            Controls to apply until the next measurement, (m,), in ``control_units``.

        Raises:
            UsageError: ``y`` is no array of ``p`` numbers, or the plan is over.
            ComputeError: ``y`` has an entry that is not finite. The controller is then as it was before.
        """
        if type(y) is not np.ndarray or y.dtype != np.float64 or y.ndim != 1:
            y = _vector(y)
        u = self.__dict__["native"].step(y)
        if u is None:
            raise UsageError(f"the plan is over after {self.steps} steps: reset() begins it anew")
        found: Array = u
        return found

    def reset(self) -> None:
        """Begins the plan anew."""
        self._native.reset()

    def monte_carlo(self, rollouts: int = 256, *, seed: int = 0) -> MonteCarlo:
        """What it costs in closed loop with the task's own model, noise included; where this run is does not matter.

        Results report the cost of roll-outs with an *extended* Kalman filter instead, whose noise is the same for a seed.

        Args:
            rollouts: How many runs.
            seed: Seed of their noise.
        """
        check_counts(rollouts=rollouts, seed=seed)
        if not rollouts:
            raise UsageError("rollouts=0: at least 1")
        return build(MonteCarlo, self._native.monte_carlo(int(rollouts), int(seed)))

    def to_c(self, path: str | os.PathLike[str]) -> list[Path]:
        """Writes ``NAME.c`` and ``NAME.h``, C99 that allocates nothing; both paths.

        Args:
            path: The path of ``NAME.c``.
        """
        return self._native.write("c", path)

    def to_json(self, path: str | os.PathLike[str]) -> Path:
        """Writes one JSON object with the attributes as keys; the path. Bounds that are not there are ``null``."""
        return self._native.write("json", path)[0]

    def to_npz(self, path: str | os.PathLike[str]) -> Path:
        """Writes the attributes as arrays for ``numpy.load``; the path.

        Parameters are ``parameter_names`` and ``parameter_values``.
        """
        return self._native.write("npz", path)[0]


def _vector(y: ArrayLike) -> Array:
    check_unmasked("the measurement", y)
    try:
        found = np.asarray(y, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"the measurement is {y!r}: it must be numbers") from error
    if found.ndim != 1:
        raise UsageError(f"the measurement has the shape {found.shape}: it must be a vector")
    return found
