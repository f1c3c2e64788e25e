"""What another simulator says of a design: records of :func:`supple.mujoco.validate`."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _html
from ._records import Array, Record

__all__ = ["ConsistencyReport", "SampledLoop", "TaskValidation", "Validation"]


@dataclass(frozen=True, eq=False, repr=False)
class ConsistencyReport(Record):
    """The normalised innovation squared, mean over measurements and roll-outs (theory, equation I.12).

    Attributes:
        mean: 1 where the filter's covariance is that of its errors; more where the filter is too sure.
        lower: Where 95 % of the means of a consistent filter begin.
        upper: Where they end.
    """

    mean: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False, repr=False)
class SampledLoop(Record):
    """Roll-outs of a plan with gains and extended Kalman filter.

    Attributes:
        cost_mean: Mean cost; infinite where a roll-out diverged.
        cost_interval_95: Where the expected cost is with 95 %, by the standard error, (2,).
        cost_median: Median cost.
        realised_bits: Mean information that the measurements gave, bits; ``None`` where a roll-out diverged, or where noise of
            measurements varies with the state.
        realised_bits_interval_95: Where its expectation is with 95 %, (2,); empty where there is none.
        consistency: Whether the filter's covariance is that of its errors; ``None`` where a roll-out diverged.
        touched: Share of the roll-outs in which each contact touched, by name.
        diverged: How many roll-outs diverged.
        ends_well: Share of the roll-outs whose last state is that of the plan, each entry within
            :data:`supple.mujoco.ENDS_WELL` of the standard deviations that the plan predicts.
    """

    cost_mean: float
    cost_interval_95: Array
    cost_median: float
    realised_bits: float | None
    realised_bits_interval_95: Array
    consistency: ConsistencyReport | None
    touched: dict[str, float]
    diverged: int
    ends_well: float


@dataclass(frozen=True, eq=False, repr=False)
class TaskValidation(Record):
    """One task of a design, on supple's own model and on MuJoCo, under the same noise.

    Attributes:
        name: Its name.
        status: How its plan ended; numbers of a plan that is not ``converged`` say little.
        predicted_cost: The expected cost that supple predicts.
        predicted_bits: The information that supple predicts, bits.
        predicted_contacts: Whether the plan touches each contact, by name.
        supple: Roll-outs on supple's own model.
        mujoco: Roll-outs on MuJoCo.
        cost_difference: Mean cost on MuJoCo less that on supple's model, roll-out by roll-out.
        cost_difference_interval_95: Where its expectation is with 95 %, (2,).
        mujoco_steps: Steps of MuJoCo's in each time step of the task.
    """

    name: str
    status: str
    predicted_cost: float
    predicted_bits: float
    predicted_contacts: dict[str, bool]
    supple: SampledLoop
    mujoco: SampledLoop
    cost_difference: float
    cost_difference_interval_95: Array
    mujoco_steps: int


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """A design in closed loop on MuJoCo.

    Attributes:
        title: What the task file is about.
        at: ``start`` or ``optimum``.
        parameters: The design.
        contact: ``same``, supple's law of contact, or ``mujoco``, MuJoCo's.
        vary: Factors on MuJoCo's robot, by name.
        rollouts: Roll-outs of each task.
        seed: Seed of their noise.
        mujoco_version: Version of MuJoCo.
        tasks: Each task by name.
    """

    title: str
    at: str
    parameters: dict[str, float]
    contact: str
    vary: dict[str, float]
    rollouts: int
    seed: int
    mujoco_version: str
    tasks: dict[str, TaskValidation]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes all of it as JSON; numbers that are not finite are ``null``. The path."""
        Path(path).write_text(json.dumps(_finite(self.to_dict()), indent=2) + "\n", encoding="utf-8")
        return Path(path)

    def _summary(self) -> list[tuple[str, str]]:
        vary = "".join(f", {name} x {factor:g}" for name, factor in self.vary.items())
        rows = [(self.at, f"{self.rollouts} roll-outs on MuJoCo, contact: {self.contact}{vary}")]
        for name, task in self.tasks.items():
            if task.status != "converged":
                rows.append((name, f"its plan ended as {task.status}: the numbers below say little"))
            cost = [f"predicted {task.predicted_cost:.4g}"]
            cost += [
                f"{where} {loop.cost_mean:.4g} ({_span(loop.cost_interval_95)})" for where, loop in _loops(task).items()
            ]
            rows.append((f"{name}: cost", ", ".join(cost)))
            bits = [f"predicted {task.predicted_bits:.4g}"]
            bits += [
                f"{where} {loop.realised_bits:.4g} ({_span(loop.realised_bits_interval_95)})"
                for where, loop in _loops(task).items()
                if loop.realised_bits is not None
            ]
            rows.append((f"{name}: bits", ", ".join(bits)))
            for where, loop in _loops(task).items():
                words = [f"ends well {loop.ends_well:.0%}"]
                if loop.consistency is not None:
                    band = f"{loop.consistency.lower:.3f} to {loop.consistency.upper:.3f}"
                    words.append(f"consistency {loop.consistency.mean:.3f} (consistent: {band})")
                words += [f"{contact} touched in {share:.0%}" for contact, share in loop.touched.items()]
                if loop.diverged:
                    words.append(f"{loop.diverged} diverged")
                rows.append((f"{name}: on {where}", ", ".join(words)))
        return rows

    def __repr__(self) -> str:
        rows = self._summary()
        width = max(len(name) for name, _ in rows)
        return "\n".join([f"Validation {self.title}".rstrip(), *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def _repr_html_(self) -> str:
        return _html.table(f"Validation {self.title}".rstrip(), self._summary())


def _loops(task: TaskValidation) -> dict[str, SampledLoop]:
    return {"supple": task.supple, "MuJoCo": task.mujoco}


def _span(interval: Array) -> str:
    return f"{interval[0]:.4g} to {interval[1]:.4g}"


def _finite(value: Any) -> Any:
    """A value of JSON without NaN and infinity, which JSON has not."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not abs(value) < float("inf") else value
