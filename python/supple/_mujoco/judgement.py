"""What a validation means, in words: whether the design holds on MuJoCo, and where it does not, why and what to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._records import Array
from .._supple import NativeTask
from ..checks import Linearisation
from ..validation import SampledLoop

__all__ = ["Conclusion", "Moves", "conclude"]

#: Consistency of a filter on MuJoCo from which it is worth a word, and from which the design is broken there.
DOUBTFUL, BROKEN = 1.5, 10.0
#: Share of the predicted cost by which the cost on MuJoCo may exceed it without a word, and how many times it makes it broken.
DEARER, MUCH_DEARER = 0.25, 10.0
#: Times of the predicted information that is worth a word.
MORE_BITS = 2.0
#: The error of a step that is small, relative to what a step of the plan does to velocities.
SMALL = 0.05
#: Sub-steps are looked for up to this factor, and up to this product with the cube of the positions, which is supple's limit.
MOST, COSTLIEST = 64, 150_000


@dataclass(frozen=True)
class Conclusion:
    """What a validation says in words, and whether the design is broken on MuJoCo."""

    words: str
    broken: bool


@dataclass(frozen=True)
class Moves:
    """Single steps from points of the plan, each under the plan's control there.

    Attributes:
        plan: The plan, at ``points`` of it.
        mujoco: The states after the steps by MuJoCo.
        supple: Makes supple's model of MuJoCo's robot with so many sub-steps.
        substeps: The sub-steps of the task.
        task: Its name.
        positions: How many of the states are positions; as many velocities follow.
        asked: How MuJoCo's robot was asked to differ, in words; empty where it was not.
        contacts: Whether it has MuJoCo's contacts.
    """

    plan: Linearisation
    points: Array
    mujoco: Array
    supple: Callable[[int], NativeTask]
    substeps: int
    task: str
    positions: int
    asked: str
    contacts: bool

    def _by_supple(self, substeps: int) -> Array:
        task, plan = self.supple(substeps), self.plan
        ends = [task.simulate(self.task, plan.controls[[t]], list(plan.states[t]))[1] for t in self.points]
        return np.asarray(ends)

    def _size(self, difference: Array) -> float:
        """Of a difference between states after steps: of rates, relative to what a step of the plan does to each, with its
        noise."""
        count = self.positions
        rates = slice(count, 2 * count)
        change = (self.plan.states[self.points + 1] - self.plan.states[self.points])[:, rates]
        noise = np.mean([np.diag(self.plan.process_covariance[t])[rates] for t in self.points], axis=0)
        scale = np.sqrt(np.mean(change**2, axis=0) + noise)
        found = difference[:, rates]
        found = found[np.isfinite(found).all(axis=1)]
        if not len(found):
            return float("inf")
        return float(np.sqrt(np.mean((found / np.maximum(scale, 1e-12)) ** 2)))

    def cause(self) -> str:
        """Which of what may differ does, by most, and what to do."""
        planned = self.plan.states[self.points + 1]
        coarse = self._by_supple(self.substeps)
        # Twice as many sub-steps until they change nothing more, or MuJoCo's motion is that of them.
        counts, count = [self.substeps], self.positions
        while 2 * counts[-1] <= MOST * self.substeps and 2 * counts[-1] * count**3 <= COSTLIEST:
            counts.append(2 * counts[-1])
        finer, fine, is_enough = coarse, self.substeps, False
        for fine in counts[1:]:
            finer = self._by_supple(fine)
            left = self._size(self.mujoco - finer)
            if left <= SMALL:
                is_enough = True
                break
        shares = {
            "varied": self._size(coarse - planned) if self.asked else 0.0,
            "coarse": self._size(finer - coarse),
            "other": self._size(self.mujoco - finer),
        }
        most = max(shares, key=lambda name: shares[name])
        dt = self.plan.time_step
        if shares[most] < SMALL:
            return (
                f"single steps are those of MuJoCo to {shares[most]:.1%}, so neither the time step nor the model is at fault: "
                "in closed loop the design amplifies small differences; look at `supple check` for its gains and at the noise "
                "of the process"
            )
        if most == "varied":
            return f"the robot differs from supple's model as was asked for ({self.asked}), which changes most of a step"
        if most == "coarse":
            error = shares[most]
            said = f"{error:.0%} of" if error < 2.0 else f"{error:.3g} times"
            size = f"the error of velocities in a step of {dt:g} s is {said} their change, as {fine} sub-steps show"
            shorter = f"a shorter `time_step`, such as {dt * self.substeps / fine:.2g} s"
            more = "" if is_enough else "; more may be needed"
            return f"the discretisation of the plan is too coarse: {size}: use `substeps = {fine}` or {shorter}{more}"
        if self.contacts:
            return (
                "MuJoCo's own contacts differ from supple's law of contact, which changes most of a step: compare with "
                "contact = same, and try a smaller `slip` and `smoothing`"
            )
        return (
            f"MuJoCo moves the robot otherwise than supple does also with {fine} sub-steps: look at the robot's file for what "
            "one of both ignores (`supple robot FILE` lists what supple does)"
        )


def conclude(predicted: tuple[float, float], own: SampledLoop, plant: SampledLoop, moves: Moves) -> Conclusion:
    """What was found, and where it is not as predicted, why.

    Args:
        predicted: Cost and bits.
        own: Roll-outs on supple's own model.
        plant: Roll-outs on MuJoCo.
        moves: Single steps of both.
    """
    cost, bits = predicted
    doubts = []
    broken = plant.diverged > 0
    if plant.diverged:
        doubts.append(f"{plant.diverged} roll-outs on MuJoCo diverge")
    if plant.consistency is not None and plant.consistency.mean > DOUBTFUL:
        many = plant.consistency.mean
        broken = broken or many > BROKEN
        doubts.append(f"innovations on MuJoCo are {many:.3g} times what the filter expects, so its bits are none to rely on")
    elif plant.realised_bits is not None and plant.realised_bits > MORE_BITS * max(bits, 1.0):
        doubts.append(f"MuJoCo's roll-outs measure {plant.realised_bits:.4g} bits where {bits:.4g} are predicted")
    dearer = plant.cost_mean - cost
    if np.isfinite(dearer) and dearer > DEARER * abs(cost) and plant.cost_interval_95[0] > cost:
        broken = broken or dearer > MUCH_DEARER * abs(cost)
        doubts.append(f"the cost on MuJoCo is {plant.cost_mean:.4g} where {cost:.4g} is predicted")
    if not doubts:
        return Conclusion("the design holds on MuJoCo as predicted", False)
    alike = own.diverged > 0 or (own.consistency is not None and own.consistency.mean > DOUBTFUL)
    if alike:
        why = (
            "supple's own roll-outs are not as predicted either: the plan does not hold for these noises; see `supple evaluate`"
        )
    else:
        why = moves.cause()
    verdict = "the design is broken on MuJoCo" if broken else "the design is in doubt on MuJoCo"
    return Conclusion(f"{verdict}: {'; '.join(doubts)}; {why}", broken)
