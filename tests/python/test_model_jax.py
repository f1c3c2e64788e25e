"""Own models through JAX, called for batches: against golden numbers and built-in models."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

jax = pytest.importorskip("jax")

from own_functions import BALANCE, Counting, backend_of, cart_pole, cart_pole_model, two_mass, with_backend

pytestmark = pytest.mark.timeout(300)

GOLDEN = Path(__file__).parents[2] / "crates/supple/tests/golden/two_mass.json"


def relative(found: Any, expected: Any) -> float:
    """The largest difference, relative to the largest entry."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def gradients(report: Any) -> dict[str, list[float]]:
    total = report.gradient.total
    names = ("information_nats", "nominal_cost", "belief_cost", "process_cost", "initial_cost")
    return {name: list(getattr(total, name).values()) for name in names}


@pytest.fixture(scope="module")
def press() -> supple.Task:
    return two_mass("jax")


@pytest.mark.parametrize("point", json.loads(GOLDEN.read_text())["two_mass"], ids=lambda point: str(point["phi"]))
def test_two_masses_give_the_golden_numbers(point: dict[str, Any]) -> None:
    k1, k2 = point["phi"]
    task = two_mass("jax", initial_control=[[u] for u in point["controls"]])
    found = task.evaluate(gradient="total", k1=k1, k2=k2).tasks["press"]
    assert found.status == "converged"
    parts = {
        "nominal_cost": found.cost.nominal,
        "belief_cost": found.cost.belief,
        "process_cost": found.cost.process,
        "initial_cost": found.cost.initial,
        "expected_cost": found.cost.expected,
        "directed_information_nat": found.information.total_nats,
    }
    for name, value in parts.items():
        assert value == pytest.approx(point[name], rel=1e-6), name
    ours = gradients(found)
    assert found.gradient is not None and found.gradient.total is not None and found.gradient.total.valid
    for name, expected in point["total_gradient"].items():
        key = {"directed_information": "information_nats"}.get(name, name)
        assert relative(ours[key][:2], expected) <= 2e-4, name


def test_two_masses_are_the_built_in_ones(press: supple.Task) -> None:
    found, expected = (
        task.evaluate(gradient="total", rollouts=40, seed=3).tasks["press"]
        for task in (press, supple.load("tasks/two_mass.toml"))
    )
    assert found.information.total_nats == pytest.approx(expected.information.total_nats, rel=1e-10)
    assert found.cost.expected == pytest.approx(expected.cost.expected, rel=1e-10)
    for (name, ours), theirs in zip(gradients(found).items(), gradients(expected).values()):
        assert relative(ours, theirs) < 1e-8, name
    assert found.monte_carlo is not None and expected.monte_carlo is not None
    assert found.monte_carlo.cost_mean == pytest.approx(expected.monte_carlo.cost_mean, rel=1e-8)
    assert found.trajectory is not None and found.trajectory.state_units == ["m", "m/s", "m", "m/s", "m"]
    assert list(found.trajectory.measurements) == ["position of m1", "force in the spring"]


def test_the_cart_pole_called_is_the_one_recorded() -> None:
    called, recorded = cart_pole("jax"), cart_pole("recorded")
    ours, theirs = (task.evaluate(gradient="total").tasks["balance"] for task in (called, recorded))
    assert ours.information.total_nats == pytest.approx(theirs.information.total_nats, rel=1e-10)
    for (name, found), expected in zip(gradients(ours).items(), gradients(theirs).values()):
        assert relative(found, expected) < 1e-8, name


def test_designs_are_found() -> None:
    best, recorded = (cart_pole(backend).design(starts=2, seed=1) for backend in ("jax", "recorded"))
    assert best.status == recorded.status == "converged" and best.feasible
    assert best.information.bits == pytest.approx(recorded.information.bits, rel=1e-5)
    assert best.information.bits < best.start_information.bits


def test_a_batch_of_500_knots_is_one_call() -> None:
    task = two_mass("jax", steps=500)
    counting = Counting(backend_of(task))
    counted = with_backend(task, counting)
    report = counted.evaluate(trajectories=False).tasks["press"]
    names = [name for name, _ in counting.calls]
    assert report.status == "converged"
    # Every function is called once for all knots, and not again for each.
    sizes = {name: {size for other, size in counting.calls if other == name} for name in names}
    assert sizes["dynamics_jacobians"] == sizes["stage_quadratics"] == sizes["dynamics_curvature"] == {500}
    assert sizes["measurement_jacobians"] == {501} and sizes["final_quadratics"] == {1}
    assert not {"steps", "observations", "stage_costs", "final_costs"} & set(names)
    guesses = names.count("measurement_jacobians")
    # Each iteration linearises once and rolls out at least once.
    assert names.count("dynamics_jacobians") <= names.count("roll_out") + 3 * guesses
    counting.calls.clear()
    counted.evaluate(gradient="total", trajectories=False)
    contractions = [(name, size) for name, size in counting.calls if name.startswith("contract_dynamics")]
    # Measured, used and needed information, and the three parts of the cost that are no envelope's.
    assert contractions == [("contract_dynamics", 500)] * 6


def test_little_is_compiled_and_nothing_twice() -> None:
    task = cart_pole_model("jax").task(**BALANCE)
    backend = backend_of(task)

    def everything() -> None:
        task.evaluate(gradient="total", rollouts=70)
        task.at(stiffness=0.2).evaluate(gradient="both", rollouts=100)

    everything()
    # 17 programs; those that samples need are there for 32 points too.
    compiled = backend.compilations
    assert compiled <= 22
    traced = sum(program._cache_size() for program in backend._compiled.values())
    assert traced == compiled
    everything()
    assert backend.compilations == compiled
    assert sum(program._cache_size() for program in backend._compiled.values()) == traced


def test_precision_is_double_whatever_the_setting_and_the_setting_stays() -> None:
    assert not jax.config.jax_enable_x64
    coarse = cart_pole("jax").evaluate(gradient="total", rollouts=8)
    assert not jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        fine = cart_pole_model("jax").task(**BALANCE).evaluate(gradient="total", rollouts=8)
    finally:
        jax.config.update("jax_enable_x64", False)
    ours, theirs = (result.tasks["balance"].to_dict() for result in (coarse, fine))
    assert ours == theirs


def test_sweeps_on_threads_are_the_same_to_the_last_bit() -> None:
    task = cart_pole("jax")
    grid = {"stiffness": np.geomspace(0.05, 0.3, 6)}
    one, several = (task.sweep(grid, rollouts=2, jobs=jobs).table for jobs in (1, 4))
    for name in one.columns:
        assert repr(list(one[name])) == repr(list(several[name])), name


def test_tasks_share_parameters() -> None:
    model_task = cart_pole("jax")
    far = cart_pole("jax", name="far", initial_state=[-1.0, 0.0, 0.0, 0.0])
    both = supple.combine(model_task, far, title="Two starts")
    assert both.tasks == ["balance", "far"] and both.title == "Two starts"
    found = both.evaluate(stiffness=0.2)
    alone = [task.evaluate(stiffness=0.2) for task in (model_task, far)]
    assert found.information.nats == pytest.approx(sum(one.information.nats for one in alone), rel=1e-12)
    with pytest.raises(supple.UsageError, match="two tasks are called `balance`"):
        supple.combine(model_task, model_task)
    with pytest.raises(supple.UsageError, match="do not have the same parameters"):
        supple.combine(model_task, two_mass("jax"))
