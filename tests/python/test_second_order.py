"""The expected cost to second order, with the curvature of the dynamics: one plant in two sets of states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import supple

jnp = pytest.importorskip("jax.numpy")
jax = pytest.importorskip("jax")

STEPS, DT = 20, 0.1
A = np.eye(4) + DT * np.eye(4, k=2)
B = np.vstack([np.zeros((2, 2)), DT * np.eye(2)])
START = np.array([2.0, 0.0, 0.0, 0.0])


def to_plane(s: Any) -> Any:
    r, angle, out, turn = s
    sine, cosine = jnp.sin(angle), jnp.cos(angle)
    return jnp.array([r * cosine, r * sine, out * cosine - r * turn * sine, out * sine + r * turn * cosine])


def to_polar(c: Any) -> Any:
    x, y, vx, vy = c
    r = jnp.sqrt(x * x + y * y)
    return jnp.array([r, jnp.arctan2(y, x), (x * vx + y * vy) / r, (x * vy - y * vx) / r**2])


def point_mass(polar: bool, goal: tuple[float, float], scale: float) -> supple.Task:
    """A mass that goes to a goal, whose start is uncertain."""
    aim = jnp.array([*goal, 0.0, 0.0])
    plane, states = (to_plane, to_polar) if polar else (lambda s: s, lambda c: c)

    def final_cost(x: Any, p: Any) -> Any:
        c = plane(x) - aim
        return 4.0 * c[:2] @ c[:2] + c[2:] @ c[2:]

    model = supple.Model(
        step=lambda x, u, p: states(jnp.asarray(A) @ plane(x) + jnp.asarray(B) @ u),
        observe=lambda x, p: plane(x)[:2],
        cost=lambda x, u, p: u @ u,
        final_cost=final_cost,
        states=4,
        controls=2,
        measurements=2,
    )
    spread = scale * np.diag([0.02, 0.02, 0.05, 0.05])
    start = START
    if polar:
        slope = np.asarray(jax.jacobian(to_polar)(jnp.asarray(START)))
        spread, start = slope @ spread @ slope.T, np.asarray(to_polar(jnp.asarray(START)))
    noise = supple.Noise(initial=spread, process=[0.0] * 4, measurement=[1e-2 * scale] * 2)
    return model.task(
        name="go", steps=STEPS, time_step=DT, initial_state=list(start), initial_control=[0.0, 0.0], noise=noise
    )


@pytest.mark.parametrize(
    ("goal", "plane", "polar"),
    [((0.0, 3.0), 1.2626, 1.4702), ((6.0, 0.0), None, 1.282), ((0.3, 0.0), None, 1.311)],
)
def test_the_expected_cost_to_second_order_is_that_of_the_law(
    goal: tuple[float, float], plane: float | None, polar: float
) -> None:
    """Costs of noise of the polar law, found by another program; the expectation of LQG is off by 15 to 30 %."""
    scale = 1e-4
    if plane is not None:
        cost = point_mass(False, goal, scale).evaluate(rollouts=2).tasks["go"].cost
        assert cost.second_order == pytest.approx(cost.expected, rel=1e-12)
        assert (cost.expected - cost.nominal) / scale == pytest.approx(plane, rel=1e-4)
    cost = point_mass(True, goal, scale).evaluate(rollouts=2).tasks["go"].cost
    assert cost.second_order is not None
    found = (cost.second_order - cost.nominal) / scale
    assert found == pytest.approx(polar, rel=1e-3)
    assert abs((cost.expected - cost.nominal) / scale / found - 1.0) > 0.1
