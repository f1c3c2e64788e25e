"""The expected cost to second order, with the curvature of the dynamics: one plant in two sets of states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import supple

jnp = pytest.importorskip("jax.numpy")

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


def point_mass(polar: bool, goal: tuple[float, float], scale: float, ahead: float = 0.0) -> supple.Task:
    """A mass that goes to a goal, whose start is uncertain."""
    aim = np.array([*goal, 0.0, 0.0])
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
        parameters={},
    )
    spread = scale * np.diag([0.02, 0.02, 0.05, 0.05])
    if polar:
        # Polar states have the same numbers there, and these slopes.
        slope = np.diag([1.0, 0.5, 1.0, 0.5])
        spread = slope @ spread @ slope.T
    noise = supple.Noise(initial=spread, process=[0.0] * 4, measurement=[1e-2 * scale] * 2)
    return model.task(
        name="go",
        steps=STEPS,
        time_step=DT,
        initial_state=[START[0] + ahead, *START[1:]],
        initial_control=[0.0, 0.0],
        noise=noise,
    )


@pytest.mark.parametrize(
    ("goal", "plane", "polar"),
    [((0.0, 3.0), 1.2626, 1.4702), ((6.0, 0.0), None, 1.282), ((0.3, 0.0), None, 1.311)],
)
def test_the_expected_cost_to_second_order_is_that_of_the_law(
    goal: tuple[float, float], plane: float | None, polar: float
) -> None:
    """Costs of noise of the polar law, found by another program with a start that is normal in the plane.

    A start that is normal in polar states lies nearer on average, by half of 2 m times the variance of the angle, which costs that
    times the slope of the cost by the start.
    """
    scale = 1e-4
    if plane is not None:
        cost = point_mass(False, goal, scale).evaluate(rollouts=2).tasks["go"].cost
        assert cost.second_order == pytest.approx(cost.expected, rel=1e-12)
        assert (cost.expected - cost.nominal) / scale == pytest.approx(plane, rel=1e-4)
    cost = point_mass(True, goal, scale).evaluate(rollouts=2).tasks["go"].cost
    assert cost.second_order is not None
    found = (cost.second_order - cost.nominal) / scale
    after, before = (
        point_mass(False, goal, scale, ahead).evaluate(rollouts=2).tasks["go"].cost.nominal for ahead in (1e-3, -1e-3)
    )
    assert found + 0.005 * (after - before) / 2e-3 == pytest.approx(polar, rel=1e-3)
    # That of LQG is far off.
    assert abs((cost.expected - cost.nominal) / scale / found - 1.0) > 0.07
