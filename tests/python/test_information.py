"""The information needed, used and measured, and roll-outs by default."""

from __future__ import annotations

from typing import Any

import numpy as np
import own_functions
import pytest

import supple

TASKS = "tasks/two_mass_unsure.toml"


@pytest.fixture(scope="module")
def task() -> supple.Task:
    return supple.load(TASKS)


def bits(evaluation: Any) -> dict[str, float]:
    at = evaluation.tasks["press"].information
    return {"needed": at.needed.total_bits, "used": at.used.total_bits, "measured": at.total_bits}


def test_evaluations_have_all_three_and_roll_outs(task: supple.Task) -> None:
    found = task.evaluate()
    values = bits(found)
    assert values["needed"] < values["used"] < values["measured"]
    at = found.tasks["press"]
    assert at.information.needed.lower_bits <= values["needed"] and at.information.needed.cost == 240.0
    sampled = at.monte_carlo
    assert sampled.rollouts == 256 and sampled.diverged == 0 and at.trust.verdict == "holds"
    assert sampled.consistency.lower_95 < 1.0 < sampled.consistency.upper_95
    assert abs(sampled.realised_bits.mean - values["measured"]) < 0.1 * values["measured"]
    low, high = sampled.cost_interval_95
    # Student's t of 255 degrees of freedom.
    half = 1.9693 * sampled.cost_standard_error
    assert [low, high] == pytest.approx(sampled.cost_mean + half * np.array([-1.0, 1.0]))
    low, high = sampled.realised_bits.interval_95
    assert low < sampled.realised_bits.mean < high
    assert high - low == pytest.approx(2 * 1.9693 * sampled.realised_bits.standard_error, rel=1e-5)
    alone = task.evaluate(rollouts=1).tasks["press"].monte_carlo
    assert (
        alone.cost_interval_95 is None and alone.realised_bits is None and alone.to_dict()["cost_interval_95"] is None
    )
    assert sampled.touched["wall"].share > 0.9
    without = supple.load("tasks/two_mass.toml").evaluate(needed=False, rollouts=0).tasks["press"]
    assert without.information.needed is None and without.monte_carlo is None and without.trust is None


def test_a_limit_out_of_reach_is_told_with_the_needed_information(task: supple.Task) -> None:
    text = open(TASKS, encoding="utf-8").read().replace("bound = 240.0", "bound = 40.0")
    found = supple.loads(text, TASKS).evaluate(rollouts=0).tasks["press"]
    needed = found.information.needed
    assert needed is not None and needed.limit_out_of_reach and needed.cost == found.cost.expected > 40.0
    assert not task.evaluate(rollouts=0).tasks["press"].information.needed.limit_out_of_reach
    assert "limit_out_of_reach" in needed.to_dict()


def test_rates_are_of_what_is_minimised(task: supple.Task) -> None:
    measured = task.design(starts=1, rollouts=0, information="measured")
    needed = task.design(starts=1, rollouts=0, information="needed")
    press = needed.tasks["press"].information
    seconds = press.total_bits / press.bits_per_second
    assert needed.information.bits_per_second == pytest.approx(press.needed.total_bits / seconds)
    assert measured.information.bits_per_second == measured.tasks["press"].information.bits_per_second


def test_values_are_given_once(task: supple.Task) -> None:
    name = next(iter(task.parameters))
    with pytest.raises(supple.UsageError, match=f"`{name}` is given twice, in a dict and as a keyword"):
        task.evaluate(at={name: 1.0}, **{name: 2.0})


def test_designs_minimise_what_is_asked_for(task: supple.Task) -> None:
    kinds: list[Any] = ["needed", "used", "measured"]
    found = {kind: task.design(information=kind, rollouts=0) for kind in kinds}
    for kind, design in found.items():
        assert all(bits(design)[kind] <= bits(other)[kind] + 1e-6 for other in found.values())
    weighted = task.design(information={"needed": 100.0, "measured": 1.0}, starts=1, rollouts=0)
    assert bits(weighted)["needed"] < bits(found["measured"])["needed"]
    with pytest.raises(supple.UsageError, match="needed"):
        task.design(information="wanted")  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="information"):
        task.design(information={"needed": -1.0})


def test_models_in_python_are_not_rolled_out_unasked() -> None:
    for backend, rolled in [("auto", True), ("jax", False)]:
        (at,) = own_functions.two_mass(backend).evaluate(needed=False).tasks.values()
        assert (at.monte_carlo is not None) == rolled, backend
