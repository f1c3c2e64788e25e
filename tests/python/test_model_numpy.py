"""Own models in NumPy by finite differences, and derivatives that users give: against JAX."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

import supple

pytest.importorskip("jax")

from own_functions import (
    BALANCE,
    Counting,
    backend_of,
    batch_cost,
    batch_final_cost,
    batch_observe,
    batch_step,
    cart_pole,
    cart_pole_model,
    with_backend,
)

pytestmark = pytest.mark.timeout(300)


def relative(found: Any, expected: Any) -> float:
    """The largest difference, relative to the largest entry."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def gradients(task: supple.Task) -> tuple[Any, dict[str, list[float]]]:
    report = task.evaluate(gradient="total", rollouts=10).tasks["balance"]
    assert report.gradient is not None and report.gradient.total is not None and report.gradient.total.valid
    total = report.gradient.total
    return report, {name: list(getattr(total, name).values()) for name in ("information_nats", "expected_cost")}


@pytest.fixture(scope="module")
def exact() -> tuple[Any, dict[str, list[float]]]:
    return gradients(cart_pole("jax"))


def test_differences_give_what_jax_gives(exact: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "supple")
    task = cart_pole("numpy")
    assert "derivatives by finite differences: relative errors" in caplog.text
    report, found = gradients(task)
    error = task.derivative_error
    assert error is not None and 0.0 < error.first < 1e-9 and 0.0 < error.second < 1e-7 and 0.0 < error.third < 1e-5
    largest = max(error.first, error.second, error.third)
    assert report.status == "converged"
    assert report.information.total_nats == pytest.approx(exact[0].information.total_nats, rel=1e-8)
    assert report.cost.expected == pytest.approx(exact[0].cost.expected, rel=1e-8)
    assert report.monte_carlo.cost_mean == pytest.approx(exact[0].monte_carlo.cost_mean, rel=1e-6)
    for name, expected in exact[1].items():
        # What the documentation of DerivativeError says.
        assert relative(found[name], expected) < 100.0 * largest, name


def test_the_estimate_is_no_less_than_a_tenth_of_the_error() -> None:
    task, other = cart_pole("numpy"), cart_pole("jax")
    backend, jax = backend_of(task), backend_of(other)
    random = np.random.default_rng(0)
    x, u = random.normal(scale=0.3, size=(50, 4)), random.normal(size=(50, 1))
    phi = np.array([0.1, 1e-4])
    costates, square = random.normal(size=(50, 4)), random.normal(size=(50, 5, 5))
    square = square + np.swapaxes(square, 1, 2)
    error = task.derivative_error
    assert error is not None

    def worst(name: str, *arguments: Any) -> float:
        found, expected = getattr(backend, name)(*arguments, phi), getattr(jax, name)(*arguments, phi)
        return relative(found[0], expected[0]) if isinstance(found, tuple) else relative(found, expected)

    assert worst("dynamics_jacobians", x, u) < max(10.0 * error.first, 1e-11)
    assert worst("stage_quadratics", x, u) < 10.0 * error.second
    assert worst("dynamics_curvature", x, u, costates) < 10.0 * error.second
    assert worst("contract_stage_costs", x, u, square) < 10.0 * error.third


def test_designs_are_found() -> None:
    best = cart_pole("numpy").design(starts=1)
    expected = cart_pole("recorded").design(starts=1)
    assert best.status == "converged" and best.feasible
    assert best.parameters["stiffness"] == pytest.approx(expected.parameters["stiffness"], rel=1e-3)
    assert best.information.bits == pytest.approx(expected.information.bits, rel=1e-6)


def test_a_batch_is_one_call_of_the_backend_and_few_of_the_functions() -> None:
    calls: list[int] = []

    def step(x: Any, u: Any, p: Any) -> Any:
        calls.append(len(x))
        return batch_step(x, u, p)

    task = cart_pole_model("numpy", step=step).task(**BALANCE)
    counting = Counting(backend_of(task))
    x, u = np.zeros((500, 4)), np.zeros((500, 1))
    calls.clear()
    counting.dynamics_jacobians(x, u, np.array([0.1, 1e-4]))
    # Four points for each of five variables.
    assert calls == [500 * 20]
    counted = with_backend(task, counting)
    counting.calls.clear()
    counted.evaluate(trajectories=False)
    assert all(size == 60 for name, size in counting.calls if name == "stage_quadratics")


def jacobians(x: Any, u: Any, p: Any) -> Any:
    """``[f_x f_u]`` of the cart-pole by hand."""
    sin, cos, rate = np.sin(x[..., 1]), np.cos(x[..., 1]), x[..., 3]
    torque = p.stiffness * x[..., 1]
    force = u[..., 0] + 0.1 * sin * (0.5 * rate**2 - 9.81 * cos) + 2.0 * torque * cos
    mass = 1.0 + 0.1 * sin**2
    push = force / mass
    by_angle = 0.1 * cos * (0.5 * rate**2 - 9.81 * cos) + 0.981 * sin**2 + 2.0 * (p.stiffness * cos - torque * sin)
    push_angle = (by_angle - push * 0.2 * sin * cos) / mass
    push_rate, push_force = 0.1 * sin * rate / mass, 1.0 / mass
    found = np.zeros((len(x), 4, 5))
    found[:, range(4), range(4)] = 1.0
    found[:, 0, 2] = found[:, 1, 3] = 0.02
    found[:, 2, 1], found[:, 2, 3], found[:, 2, 4] = 0.02 * push_angle, 0.02 * push_rate, 0.02 * push_force
    turn_angle = (9.81 * cos - push_angle * cos + push * sin) / 0.5 - 40.0 * p.stiffness
    found[:, 3, 1] = 0.02 * turn_angle
    found[:, 3, 3] += -0.04 * push_rate * cos
    found[:, 3, 4] = -0.04 * push_force * cos
    return found


def measured(x: Any, p: Any) -> Any:
    return np.broadcast_to(np.eye(2, 4), (len(x), 2, 4))


def quadratics(x: Any, u: Any, p: Any) -> Any:
    z = np.concatenate([x, u], axis=1)
    weights = np.array([1.0, 1.0, 0.1, 0.1, 0.01])
    second, first = np.tile(np.diag(2.0 * weights), (len(x), 1, 1)), 2.0 * weights * z
    second[:, 1, 1] += 12.0 * p.stiffness * x[:, 1] ** 2
    first[:, 1] += 4.0 * p.stiffness * x[:, 1] ** 3
    return second, first


GIVEN = supple.Derivatives(dynamics_jacobians=jacobians, measurement_jacobians=measured, stage_quadratics=quadratics)


def test_given_derivatives_are_used_and_differentiated(exact: Any) -> None:
    task = cart_pole_model("numpy", derivatives=GIVEN).task(**BALANCE)
    report, found = gradients(task)
    assert task.derivative_error is not None and task.derivative_error.third < 1e-5
    assert report.information.total_nats == pytest.approx(exact[0].information.total_nats, rel=1e-11)
    for name, expected in exact[1].items():
        assert relative(found[name], expected) < 1e-7, name


def test_given_derivatives_go_with_jax(exact: Any) -> None:
    task = cart_pole_model("jax", derivatives=supple.Derivatives(dynamics_jacobians=jacobians)).task(**BALANCE)
    report, found = gradients(task)
    assert report.information.total_nats == pytest.approx(exact[0].information.total_nats, rel=1e-11)
    for name, expected in exact[1].items():
        assert relative(found[name], expected) < 1e-9, name


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"dynamics_jacobians": lambda x, u, p: 1.001 * jacobians(x, u, p)},
            r"`dynamics_jacobians` gives .* differences",
        ),
        ({"dynamics_jacobians": lambda x, u, p: jacobians(x, u, p)[:, :3]}, r"shape \(3, 3, 5\): .* \(3, 4, 5\)"),
        ({"stage_quadratics": lambda x, u, p: quadratics(x, u, p)[0]}, "must return a tuple of 2 arrays"),
        ({"dynamics_jacobians": 3}, "`dynamics_jacobians` is int, which is not a function"),
    ],
)
def test_wrong_derivatives_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(supple.UsageError, match=message):
        cart_pole_model("numpy", derivatives=supple.Derivatives(**given)).task(**BALANCE)


def test_models_may_have_no_final_cost_and_numbered_names() -> None:
    model = supple.Model(
        step=batch_step,
        observe=batch_observe,
        cost=batch_cost,
        parameters={"stiffness": supple.Parameter(0.1, (0.01, 0.4))},
        states=4,
        controls=1,
        measurements=2,
        backend="numpy",
    )
    task = model.task(**{**BALANCE, "noise": supple.Noise([1e-3] * 4, np.diag([1e-4] * 4), [1e-4, 1e-4])})
    report = task.evaluate(gradient="total").tasks["balance"]
    assert report.status == "converged"
    assert report.trajectory is not None and report.trajectory.state_names == ["x1", "x2", "x3", "x4"]
    costs = batch_cost(report.trajectory.x[:-1], report.trajectory.u, task_values())
    assert report.cost.nominal == pytest.approx(costs.sum(), rel=1e-12)
    assert (batch_final_cost(report.trajectory.x, None) > 0.0).all()


def task_values() -> Any:
    from supple._backends.functions import Values

    return Values(("stiffness",), np.array([0.1]))


def test_steps_are_not_so_short_that_nothing_seems_to_change() -> None:
    """Once a cost far from its target got steps over which it was constant to the last digit, and no curvature."""
    task = supple.Model(
        step=lambda x, u, p: x + 0.02 * np.stack([x[..., 1], u[..., 0] - 5.0 * x[..., 0]], axis=-1),
        observe=lambda x, p: x[..., :1],
        cost=lambda x, u, p: 5.0 * (x[..., 0] - 1.0) ** 2 + 0.1 * x[..., 1] ** 2 + 0.01 * u[..., 0] ** 2,
        final_cost=lambda x, p: 50.0 * (x[..., 0] - 1.0) ** 2 + x[..., 1] ** 2,
        states=2,
        controls=1,
        measurements=1,
        parameters={},
        backend="numpy",
    ).task(
        steps=50,
        time_step=0.02,
        initial_state=[0.0, 0.0],
        initial_control=[0.0],
        noise=supple.Noise(initial=[1e-4, 1e-3], process=[0.0, 1e-4], measurement=[1e-4]),
    )
    x, u, phi = np.zeros((3, 2)), np.zeros((3, 1)), np.zeros(0)
    second, first = task._recipe[1]["systems"][0]["backend"].stage_quadratics(x, u, phi)
    assert np.allclose(second, np.diag([10.0, 0.2, 0.02]), atol=1e-6)
    assert np.allclose(first, [-10.0, 0.0, 0.0], atol=1e-8)
    assert task.evaluate().tasks["task"].status == "converged"


def test_errors_of_differences_do_not_keep_plans_within_bounds_from_converging() -> None:
    """A planar rotor whose torque is at its bounds: differences hide residuals below some 1e-6, of a cost exact to 1e-12."""

    def step(x: Any, u: Any, p: Any) -> Any:
        _, _, angle, across, up, turn = np.moveaxis(x, -1, 0)
        thrust = 9.81 * p.m + u[..., 0]
        sides = [-thrust * np.sin(angle) / p.m, thrust * np.cos(angle) / p.m - 9.81, u[..., 1] / 0.05]
        return x + 0.02 * np.stack([across, up, turn, *sides], -1)

    def cost(x: Any, u: Any, p: Any) -> Any:
        away = (x[..., 0] - 3.0) ** 2 + (x[..., 1] - 1.0) ** 2
        return 0.002 * u[..., 0] ** 2 + 0.2 * u[..., 1] ** 2 + 0.02 * away

    def final_cost(x: Any, p: Any) -> Any:
        away = (x[..., 0] - 3.0) ** 2 + (x[..., 1] - 1.0) ** 2
        return 100.0 * (away + x[..., 2] ** 2) + 10.0 * (x[..., 3:] ** 2).sum(-1)

    model = supple.Model(
        step=step,
        observe=lambda x, p: x[..., :3],
        cost=cost,
        final_cost=final_cost,
        parameters={"m": supple.Parameter(1.0, bounds=(0.5, 2.0))},
        states=6,
        controls=2,
        measurements=3,
        backend="numpy",
    )
    for share, expected in [(2.0, 10.155469356505), (0.5, 34.199146329840)]:
        task = model.task(
            name="fly",
            steps=100,
            time_step=0.02,
            initial_state=[0.0] * 6,
            initial_control=[0.0, 0.0],
            control_bounds=[(-9.81, 5.0 * share), (-0.2 * share, 0.2 * share)],
            noise=supple.Noise(initial=[1e-6] * 6, process=[0, 0, 0, 1e-6, 1e-6, 1e-6], measurement=[1e-4] * 3),
        )
        found = task.evaluate().tasks["fly"]
        assert found.status == "converged"
        # That of exact derivatives.
        assert abs(found.cost.nominal / expected - 1.0) < 1e-10
