"""Results of running a design on another simulator: records of :func:`supple.mujoco.validate`."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _html
from ._records import Array, Record
from .reports import Consistency, LimitShare

__all__ = ["SampledLoop", "TaskValidation", "Validation"]


@dataclass(frozen=True, eq=False, repr=False)
class SampledLoop(Record):
    """Roll-outs of a plan with its gains and an extended Kalman filter.

    Attributes:
        cost_mean: Mean cost; infinite if a roll-out diverged.
        cost_interval_95: 95 % confidence interval of the expected cost, from the standard error, (2,).
        cost_median: Median cost.
        realised_bits: Mean measured information, bits: on MuJoCo, by a filter that takes finer steps than the one that
            controls; ``None`` if a roll-out diverged, or if measurement noise depends on the state.
        realised_bits_interval_95: 95 % confidence interval of its expectation, (2,); empty if there is none.
        consistency: Whether the filter's covariance matches its errors; ``None`` if a roll-out diverged.
        touched: Share of the roll-outs in which each contact touched, by name.
        limits: The limits of the robot and the task, at the steps of the task; empty if a roll-out diverged.
        diverged: Number of roll-outs that diverged.
        ends_well: Share of the roll-outs whose final state agrees with the plan's, each entry within
            :data:`supple.mujoco.ENDS_WELL` times the standard deviation that the plan predicts and a tenth of the range that
            the entry has in the plan.
    """

    cost_mean: float
    cost_interval_95: Array
    cost_median: float
    realised_bits: float | None
    realised_bits_interval_95: Array
    consistency: Consistency | None
    touched: dict[str, float]
    limits: list[LimitShare]
    diverged: int
    ends_well: float


@dataclass(frozen=True, eq=False, repr=False)
class TaskValidation(Record):
    """One task of a design, on supple's own model and on MuJoCo, under the same noise.

    Attributes:
        name: Its name.
        status: How its plan ended; do not rely on the numbers of a plan that is not ``converged``.
        predicted_cost: The expected cost that supple predicts.
        limit: The cost limit; ``None`` if there is none.
        predicted_bits: The information that supple predicts, bits.
        predicted_contacts: Whether the plan touches each contact, by name.
        supple: Roll-outs on supple's own model.
        mujoco: Roll-outs on MuJoCo, where stops and ranges of the robot stop nothing, as in supple.
        stopped: The same with the robot's stops of joints, and its ranges of controls and efforts; ``None`` if no roll-out
            on MuJoCo reaches any of them.
        cost_difference: Mean cost on MuJoCo minus mean cost on supple's model, roll-out by roll-out.
        cost_difference_interval_95: 95 % confidence interval of its expectation, (2,).
        mujoco_steps: MuJoCo steps in each time step of the task.
        conclusion: Whether the design holds on MuJoCo, in words; if not, why and what to do.
        broken: Whether it does not: a roll-out diverged, the filter or the cost is nowhere near the prediction, or the cost
            exceeds the limit that the prediction keeps.
    """

    name: str
    status: str
    predicted_cost: float
    limit: float | None
    predicted_bits: float
    predicted_contacts: dict[str, bool]
    supple: SampledLoop
    mujoco: SampledLoop
    stopped: SampledLoop | None
    cost_difference: float
    cost_difference_interval_95: Array
    mujoco_steps: int
    conclusion: str
    broken: bool


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """A design in closed loop on MuJoCo.

    Attributes:
        title: Title of the task file.
        at: ``start`` or ``optimum``.
        parameters: The design.
        contact: ``same``, supple's contact law, or ``mujoco``, MuJoCo's.
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
        """Writes the validation as JSON, with ``null`` for non-finite numbers, and returns the path."""
        Path(path).write_text(json.dumps(_finite(self.to_dict()), indent=2) + "\n", encoding="utf-8")
        return Path(path)

    def _summary(self) -> list[tuple[str, str]]:
        vary = "".join(f", {name} x {factor:g}" for name, factor in self.vary.items())
        rows = [(self.at, f"{self.rollouts} roll-outs on MuJoCo, contact: {self.contact}{vary}")]
        for name, task in self.tasks.items():
            if task.status != "converged":
                rows.append((name, f"its plan ended as {task.status}: the numbers below say little"))
            limit = "" if task.limit is None else f" of at most {task.limit:.4g}"
            cost = [f"predicted {task.predicted_cost:.4g}{limit}"]
            cost += [f"{where} {_cost(loop, self.rollouts)}" for where, loop in _loops(task).items()]
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
                    band = f"{loop.consistency.lower_95:.3f} to {loop.consistency.upper_95:.3f}"
                    words.append(f"consistency {loop.consistency.mean:.3f} (95 % band of a consistent filter: {band})")
                words += [f"{contact} touched in {share:.0%}" for contact, share in loop.touched.items()]
                words += [_beyond(limit) for limit in loop.limits if limit.share > 0.0]
                if loop.diverged:
                    words.append(f"{loop.diverged} diverged")
                rows.append((f"{name}: on {where}", ", ".join(words)))
            rows.append((f"{name}: conclusion", task.conclusion))
        return rows

    def __repr__(self) -> str:
        rows = self._summary()
        width = max(len(name) for name, _ in rows)
        return "\n".join([f"Validation {self.title}".rstrip(), *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def _repr_html_(self) -> str:
        return _html.table(f"Validation {self.title}".rstrip(), self._summary())


def _beyond(limit: LimitShare) -> str:
    side = "above" if limit.upper else "below"
    bound = f"{limit.limit:.4g} {limit.unit}".rstrip()
    return f"{limit.name} {side} {bound} in {limit.share:.0%} (median {limit.median:.4g}, worst {limit.worst:.4g})"


def _loops(task: TaskValidation) -> dict[str, SampledLoop]:
    loops = {"supple": task.supple, "MuJoCo": task.mujoco}
    return loops if task.stopped is None else {**loops, "MuJoCo with stops and ranges": task.stopped}


def _cost(loop: SampledLoop, rollouts: int) -> str:
    if loop.diverged:
        return f"diverges in {loop.diverged} of {rollouts} roll-outs"
    return f"{loop.cost_mean:.4g} ({_span(loop.cost_interval_95)})"


def _span(interval: Array) -> str:
    return f"{interval[0]:.4g} to {interval[1]:.4g}"


def _finite(value: Any) -> Any:
    """A JSON value without NaN and infinity, which JSON does not support."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not abs(value) < float("inf") else value
