"""What a validation means, in words: whether the design holds on MuJoCo, and where it does not, why and what to do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .._records import Array
from .._supple import NativeTask
from ..checks import Linearisation
from ..reports import LimitShare
from ..validation import SampledLoop

__all__ = ["Conclusion", "Moves", "conclude", "enlarged", "furthest_left", "sampled"]

#: Consistency of a filter on MuJoCo from which it is worth a word, as in `supple evaluate`, and from which the design is
#: broken there.
DOUBTFUL, BROKEN = 1.2, 10.0
#: Consistency on supple's own model from which the plan itself explains what happens on MuJoCo.
ASTRAY = 1.5
#: Share of the predicted cost by which the cost on MuJoCo may exceed it without a word, and how many times it makes it broken.
DEARER, MUCH_DEARER = 0.1, 10.0
#: How many times the predicted cost is broken if it is surely exceeded, as by roll-outs on supple's own model.
SURELY_DEARER = 2.0
#: Share by which a cost may exceed its limit and still count as kept, as in `[design] feasibility`.
AT_LIMIT = 1e-3
#: Share of a limit by which a plan may exceed it without a word.
AT_RANGE = 1e-3
#: Share of a limit that a plan keeps by which half of the roll-outs may exceed it without a word, and share of the roll-outs
#: that may exceed it by less.
LEFT, MOST_LEAVE = 0.1, 0.8
#: Times of the predicted information that is a doubt, and share by which it may differ without a word.
MORE_BITS, OTHER_BITS = 2.0, 0.2
#: Share of supple's own roll-outs that end well of which MuJoCo's may fall short without a word.
FEWER_END_WELL = 0.1
#: Fewer roll-outs that end elsewhere are chance.
TOO_FEW = 5
#: Sub-steps are enough where the errors of steps make innovations so little larger, relative to what the filter expects.
SMALL = 0.05
#: How many times the closed loop may amplify these errors in choosing sub-steps; beyond that it is another loop.
AMPLIFIED = 10.0
#: Sub-steps are looked for up to this factor, and up to this number, which is supple's limit.
MOST, MOST_SUBSTEPS = 64, 1000


@dataclass(frozen=True)
class Conclusion:
    """What a validation says in words, and whether the design is broken on MuJoCo."""

    words: str
    broken: bool


def sampled(plan: Linearisation, seed: int = 0) -> tuple[Array, Array]:
    """States and controls, (N, n) and (N, m), of a roll-out of the linear closed loop about a plan."""
    rng = np.random.default_rng(seed)

    def noise(covariance: Array) -> Array:
        values, axes = np.linalg.eigh(covariance)
        return np.asarray(axes @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(values))))

    x, P = noise(plan.initial_covariance), plan.initial_covariance
    estimate = np.zeros(len(x))
    states, controls = [], []
    for t, (A, B, K) in enumerate(zip(plan.A, plan.B, plan.feedback)):
        C, V = plan.C[t], plan.measurement_covariance[t]
        innovation = C @ (x - estimate) + noise(V)
        estimate = estimate + P @ C.T @ np.linalg.solve(C @ P @ C.T + V, innovation)
        u = K @ estimate
        states.append(plan.states[t] + x)
        controls.append(plan.controls[t] + u)
        x = A @ x + B @ u + noise(plan.process_covariance[t])
        estimate = A @ estimate + B @ u
        P = A @ plan.belief_covariance[t] @ A.T + plan.process_covariance[t]
    return np.array(states), np.array(controls)


def enlarged(plan: Linearisation, points: Array, errors: Array) -> float:
    """How much errors of single steps at points of a plan enlarge innovations beyond what the filter expects, as a mean over
    the plan: of the normalised innovation squared (I.12), in the linear system."""
    if not np.isfinite(errors).all():
        return float("inf")
    steps = len(plan.controls)
    each = np.array([np.interp(np.arange(steps), points, column) for column in errors.T]).T
    error, total = np.zeros(errors.shape[1]), 0.0
    for t, (A, C) in enumerate(zip(plan.A, plan.C[1:])):
        P = A @ plan.belief_covariance[t] @ A.T + plan.process_covariance[t]
        S = C @ P @ C.T + plan.measurement_covariance[t + 1]
        error = A @ error + each[t]
        innovation = C @ error
        weighed = np.linalg.solve(S, innovation)
        error = error - P @ C.T @ weighed
        total += float(innovation @ weighed) / len(innovation)
    return total / steps


@dataclass(frozen=True)
class Moves:
    """Single steps from states of a roll-out under its controls, at points of the plan.

    Attributes:
        plan: The plan.
        points: Numbers of the steps.
        mujoco: States after the steps by MuJoCo, of the robot from states (R, n) under controls (R, m).
        unvaried: The same of the robot as it is in the task.
        supple: Makes supple's model of that robot with so many sub-steps.
        substeps: The sub-steps of the task.
        task: Its name.
        is_settled: Whether MuJoCo's own steps are short enough.
        asked: How MuJoCo's robot was asked to differ, in words; empty where it was not.
        contacts: Whether it has MuJoCo's contacts.
    """

    plan: Linearisation
    points: Array
    mujoco: Callable[[Array, Array], Array]
    unvaried: Callable[[Array, Array], Array]
    supple: Callable[[int], NativeTask]
    substeps: int
    task: str
    is_settled: bool
    asked: str
    contacts: bool

    def _by_supple(self, substeps: int, at: tuple[Array, Array]) -> Array:
        task = self.supple(substeps)
        ends = [task.simulate(self.task, u[None], list(x))[1] for x, u in zip(*at)]
        return np.asarray(ends)

    def _size(self, errors: Array) -> float:
        return enlarged(self.plan, self.points, errors)

    def cause(self, excess: float) -> str:
        """The largest cause of the differences, and what to do; ``excess`` is how much innovations in closed loop are
        larger than the filter expects."""
        states, controls = sampled(self.plan)
        at = states[self.points], controls[self.points]
        by_mujoco, coarse = self.unvaried(*at), self._by_supple(self.substeps, at)
        varied = self.mujoco(*at) - by_mujoco if self.asked else np.zeros_like(coarse)
        # Double the sub-steps until they have no further effect, or until they reproduce MuJoCo's motion.
        counts = [self.substeps]
        while 2 * counts[-1] <= min(MOST * self.substeps, MOST_SUBSTEPS):
            counts.append(2 * counts[-1])
        whole = self._size(by_mujoco - coarse + varied)
        small = SMALL / min(max(excess / max(whole, 1e-12), 1.0), AMPLIFIED)
        finer, fine, is_enough = coarse, self.substeps, False
        for fine in counts[1:]:
            finer = self._by_supple(fine, at)
            if self._size(by_mujoco - finer) <= small:
                is_enough = True
                break
        shares = {
            "varied": self._size(varied),
            "coarse": self._size(finer - coarse),
            "other": 0.0 if is_enough else self._size(by_mujoco - finer),
        }
        most = max(shares, key=lambda name: shares[name])
        dt = self.plan.time_step
        if whole <= small:
            return (
                "single steps are those of MuJoCo up to what the filter notices, so the model is not at fault: the closed loop "
                "amplifies small differences, or a contact is stiff for the time step; if roll-outs of `supple evaluate` on finer "
                "steps cost more too, use the `substeps` that it advises"
            )
        if most == "varied":
            return f"the robot differs from supple's model as requested ({self.asked}), which has the largest effect"
        if not self.is_settled and not (most == "coarse" and is_enough):
            return (
                "MuJoCo's own steps are not short enough for the stiffest forces on this robot, such as friction on a light "
                "link, so that its numbers are rough: choose softer ones, such as a larger `slip` or `smoothing` of contacts"
            )
        if most == "coarse":
            moved = "moves as MuJoCo does" if is_enough else "comes nearer to MuJoCo's motion"
            shown = f"with {fine} sub-steps supple {moved}, with {self.substeps} it does not"
            shorter = f"a shorter `time_step`, such as {dt * self.substeps / fine:.2g} s"
            more = "" if is_enough else "; more may be needed"
            return f"the discretisation of the plan is too coarse ({shown}): use `substeps = {fine}` or {shorter}{more}"
        if self.contacts:
            return (
                "MuJoCo's own contacts differ from supple's law of contact, which has the largest effect: compare with "
                "contact = same, and try a smaller `slip` and `smoothing`"
            )
        return (
            f"MuJoCo moves the robot differently from supple even with {fine} sub-steps: check the robot file for "
            "elements that one of them ignores (`supple robot FILE` lists those that supple ignores)"
        )


def conclude(
    predicted: tuple[float, float],
    limit: float | None,
    own: SampledLoop,
    on_mujoco: Sequence[tuple[SampledLoop, str]],
    moves: Moves,
    left: LimitShare | None,
    rollouts: int,
) -> Conclusion:
    """The findings and, if they differ from the prediction, their cause.

    Args:
        predicted: Cost and bits.
        limit: Cost limit of the task.
        own: Roll-outs on supple's own model.
        on_mujoco: Roll-outs on MuJoCo, and the state that ends furthest from the plan there; then, if any of them reaches a
            stop or a range of the robot, those where these hold.
        moves: Single steps of both.
        left: The limit that the plan keeps and MuJoCo's roll-outs are furthest beyond, if any is.
        rollouts: Number of roll-outs on each.
    """
    (plant, furthest), *with_stops = on_mujoco
    cost = predicted[0]
    dearer = plant.cost_mean - cost
    doubts, broken = _findings(predicted, limit, own, plant, ("on MuJoCo", furthest))
    ranges, breaks = _ranges(plant), False
    if with_stops:
        stopped, furthest = with_stops[0]
        held, breaks = _findings(predicted, limit, own, stopped, ("on MuJoCo with its stops and ranges", furthest))
        ranges = "; ".join([*([ranges] if ranges else []), *held])
    verdict = f"the design is {'broken' if broken or breaks else 'in doubt'} on MuJoCo"
    if not doubts and ranges:
        return Conclusion(f"{verdict}: {ranges}{_beyond(left)}", breaks)
    if not doubts:
        exceeds = limit is not None and _exceeds(limit, cost, plant)
        bits = plant.realised_bits
        others = bits is not None and abs(bits - predicted[1]) > max(OTHER_BITS * predicted[1], 1.0)
        words = f"the design {'moves' if exceeds or others or left else 'holds'} on MuJoCo as predicted"
        if others:
            words += f"; but roll-outs there measure {bits:.4g} bits instead of the predicted {predicted[1]:.4g}"
        if with_stops:
            words += ", also with the robot's stops and ranges, which roll-outs reach"
        if plant.ends_well < 1.0 - FEWER_END_WELL and (1.0 - plant.ends_well) * rollouts >= TOO_FEW:
            words += (
                f"; but only {plant.ends_well:.0%} of the roll-outs there, and {own.ends_well:.0%} on supple's own model, end within "
                f"the spread that is predicted (furthest: `{furthest}`): the linearisation misses what noise does to it"
            )
        if limit is not None and exceeds:
            low, high = plant.cost_interval_95
            share = plant.cost_mean / limit - 1.0
            words += f"; but its cost there, {low:.4g} to {high:.4g}, is above the limit of {limit:.4g}, by {share:.1%}"
        return Conclusion(words + _beyond(left), False)
    alike = own.diverged > 0 or (own.consistency is not None and own.consistency.mean > ASTRAY)
    alike = alike or own.cost_mean - cost > max(DEARER * abs(cost), DEARER * dearer)
    if alike:
        why = "supple's own roll-outs are not as predicted either: the plan does not hold for these noises; see `supple evaluate`"
    else:
        excess = float("inf") if plant.consistency is None else plant.consistency.mean - 1.0
        why = moves.cause(excess)
    words = "; ".join([*doubts, why, *([ranges] if ranges else [])])
    return Conclusion(f"{verdict}: {words}{_beyond(left)}", broken or breaks)


def _findings(
    predicted: tuple[float, float], limit: float | None, own: SampledLoop, loop: SampledLoop, at: tuple[str, str]
) -> tuple[list[str], bool]:
    """What differs from the prediction in roll-outs on MuJoCo, and whether the design is broken there; ``at`` is where that is,
    in words, and the state that ends furthest from the plan."""
    cost, bits = predicted
    where, furthest = at
    doubts = []
    broken = loop.diverged > 0
    if loop.diverged:
        doubts.append(f"{loop.diverged} roll-outs {where} diverge")
    if loop.consistency is not None and loop.consistency.mean > DOUBTFUL:
        many = loop.consistency.mean
        broken = broken or many > BROKEN
        doubts.append(f"the filter's consistency {where} is {many:.3g} instead of 1")
    if loop.realised_bits is not None and loop.realised_bits > MORE_BITS * max(bits, 1.0):
        doubts.append(f"roll-outs {where} measure {loop.realised_bits:.4g} bits instead of the predicted {bits:.4g}")
    dearer = loop.cost_mean - cost
    many_times = dearer > MUCH_DEARER * abs(cost) or loop.cost_interval_95[0] > SURELY_DEARER * abs(cost)
    exceeds = _exceeds(limit, cost, loop)
    if np.isfinite(dearer) and (many_times or dearer > DEARER * abs(cost) and loop.cost_interval_95[0] > cost):
        broken = broken or many_times or exceeds
        above = f", above the limit of {limit:.4g}" if exceeds else ""
        doubts.append(f"the cost {where} is {loop.cost_mean:.4g} instead of the predicted {cost:.4g}{above}")
    if loop.ends_well < (1.0 - FEWER_END_WELL) * own.ends_well:
        doubts.append(
            f"only {loop.ends_well:.0%} of the roll-outs {where} end where the plan does (furthest: `{furthest}`)"
        )
    return doubts, broken


def _exceeds(limit: float | None, cost: float, loop: SampledLoop) -> bool:
    """Whether roll-outs exceed a cost limit that the predicted cost keeps: by what is significant, as designs are at their
    limits, so that half of their roll-outs are above it."""
    return limit is not None and cost <= limit * (1.0 + AT_LIMIT) and bool(loop.cost_interval_95[0] > limit)


def _ranges(plant: SampledLoop) -> str:
    """What leaves its limits in the plan and on MuJoCo where nothing stops it; empty if nothing does."""
    left = [limit for limit in plant.limits if limit.share > 0.5 and _excess(limit, limit.planned) > AT_RANGE]
    if not left:
        return ""
    worst = max(left, key=lambda limit: _excess(limit, np.array([limit.median])))
    unit = f" {worst.unit}" if worst.unit else ""
    others = {0: "", 1: ", and one limit more is exceeded"}.get(
        len(left) - 1, f", and {len(left) - 1} limits more are exceeded"
    )
    return (
        f"the plan exceeds limits, which may stop the real robot: {worst.name} reaches "
        f"{worst.median:.4g}{unit} in half of the roll-outs, with a limit of {worst.limit:.4g}{unit}{others}; let the plan keep "
        "them (`enforce_effort_limits`, limits with `enforce = true`), or give it more time"
    )


def furthest_left(limits: Sequence[LimitShare]) -> LimitShare | None:
    """Of the limits that the plan keeps, the one that half of the roll-outs are furthest beyond by much, or most of them at
    all, if there is one."""

    def beyond(limit: LimitShare) -> float:
        return _excess(limit, np.array([limit.median]))

    def is_left(limit: LimitShare) -> bool:
        return beyond(limit) > LEFT or limit.share > MOST_LEAVE and beyond(limit) > AT_RANGE

    kept = [limit for limit in limits if _excess(limit, limit.planned) <= AT_RANGE and is_left(limit)]
    return max(kept, key=beyond, default=None)


def _excess(limit: LimitShare, values: Array) -> float:
    """How far values are beyond a limit, relative to it or to the plan's values."""
    excess = values.max() - limit.limit if limit.upper else limit.limit - values.min()
    return float(excess) / max(abs(limit.limit), float(np.abs(limit.planned).max()), 1e-300)


def _beyond(left: LimitShare | None) -> str:
    if left is None:
        return ""
    unit = f" {left.unit}" if left.unit else ""
    return (
        f"; {left.name} reaches {left.median:.4g}{unit} in half of the roll-outs there, and {left.worst:.4g}{unit} in the worst, "
        f"although the plan keeps its limit of {left.limit:.4g}{unit}"
    )
