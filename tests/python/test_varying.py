"""Measurement noise whose variance depends on the state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import supple

FILE = """
[model]
kind = "linear"
A = [[1.0, 0.1], [0.0, 0.9]]
B = [[0.5], [1.0]]
C = [[1.0, 0.0], [0.3, 1.0]]
[[tasks]]
name = "home"
steps = 15
time_step = 0.1
initial_state = [2.0, -1.0]
noise.initial = [0.1, 0.2]
noise.process = [0.02, 0.01]
noise.measurement = [0.05, 0.1]
[[tasks.noise.varying]]
measurement = ["y1", "y2"]
state = "x1"
center = 5.0
coefficient = 0.5
[[tasks.costs]]
kind = "quadratic"
Q = [[1.0, 0.3], [0.3, 0.7]]
R = [[0.2]]
"""
LAW = supple.VaryingVariance(["y1", "y2"], "x1", 5.0, 0.5)


def made(law: Any) -> supple.Task:
    """The task of the file from arrays."""
    return supple.linear(
        A=[[1.0, 0.1], [0.0, 0.9]],
        B=[[0.5], [1.0]],
        C=[[1.0, 0.0], [0.3, 1.0]],
        W=[0.02, 0.01],
        V=[0.05, 0.1],
        X0=[0.1, 0.2],
        Q=[[1.0, 0.3], [0.3, 0.7]],
        R=[[0.2]],
        x0=[2.0, -1.0],
        N=15,
        time_step=0.1,
        name="home",
        varying=law,
    )


def test_arrays_give_what_the_file_gives() -> None:
    file, arrays = supple.loads(FILE).evaluate(), made([LAW]).evaluate()
    plain = made([]).evaluate()
    for key in ("expected", "nominal"):
        values = [getattr(found.tasks["home"].cost, key) for found in (file, arrays)]
        np.testing.assert_allclose(values[0], values[1], rtol=1e-9)
    bits = [found.information.bits for found in (file, arrays, plain)]
    np.testing.assert_allclose(bits[0], bits[1], rtol=1e-9)
    assert bits[2] > 1.2 * bits[0], "noise that grows away from the light tells less"


def test_filter_by_hand() -> None:
    """Directed information of a scalar that stays where it is, against its own recursion in NumPy."""
    task = supple.linear(
        A=[[1.0]], B=[[1.0]], C=[[1.0]], W=[0.3], V=[0.1], X0=[2.0], Q=[[1e-6]], R=[[1.0]], x0=[2.0], N=6,
        varying=[supple.VaryingVariance("y1", "x1", 4.0, 0.5)],
    )  # fmt: skip
    found = task.evaluate()
    path = np.asarray(found.tasks["linear"].trajectory.states)[:, 0]
    predicted, nats = 2.0, 0.0
    for x in path:
        variance = 0.1 + 0.5 * (x - 4.0) ** 2
        nats += 0.5 * np.log(1.0 + predicted / variance)
        predicted = predicted * variance / (predicted + variance) + 0.3
    np.testing.assert_allclose(found.information.bits, nats / np.log(2.0), rtol=1e-9)


def light_dark(center: Any, coefficient: Any) -> supple.Task:
    """An own model in the plane that sees best where ``x1`` is ``center``."""
    model = supple.Model(
        step=lambda x, u, p: x + u,
        observe=lambda x, p: x,
        cost=lambda x, u, p: 0.5 * (u[..., 0] ** 2 + u[..., 1] ** 2) + 0.01 * (x[..., 0] ** 2 + x[..., 1] ** 2),
        final_cost=lambda x, p: 10.0 * (x[..., 0] ** 2 + x[..., 1] ** 2),
        states=["x1", "x2"],
        controls=2,
        measurements=2,
        backend="numpy",
        parameters={
            "center": supple.Parameter(5.0, (0.0, 10.0)),
            "coefficient": supple.Parameter(0.5, (0.0, 2.0)),
        },
    )
    return model.task(
        steps=10,
        time_step=1.0,
        initial_state=[2.0, 2.0],
        initial_control=[0.0, 0.0],
        noise=supple.Noise(
            initial=[0.5, 0.5],
            process=[1e-3, 1e-3],
            measurement=[0.1, 0.1],
            varying=[supple.VaryingVariance("y*", "x1", center, coefficient)],
        ),
    )


def test_own_models_and_gradients() -> None:
    """Parameters of the law move the information as the total gradient says."""
    task = light_dark("center", "coefficient")
    found = task.evaluate(gradient="total")
    gradient = found.tasks["task"].gradient.total
    assert gradient is not None
    for name, step in (("center", 1e-3), ("coefficient", 1e-4)):
        above, below = (
            task.at({name: task.values[name] + sign * step}).evaluate().information.bits for sign in (1, -1)
        )
        numeric = (above - below) / (2 * step) * np.log(2.0)
        np.testing.assert_allclose(gradient.information_nats[name], numeric, rtol=1e-4)
        assert abs(numeric) > 0.01


def test_what_is_wrong() -> None:
    for law, message in [
        ([supple.VaryingVariance("y3", "x1", 5.0, 0.5)], "no measurement is `y3`; measurements: `y1`, `y2`"),
        ([supple.VaryingVariance("y1", "x7", 5.0, 0.5)], "no state is `x7`"),
        ([supple.VaryingVariance("y1", "x1", 5.0, -0.5)], "must be at least 0, as it adds to a variance; found -0.5"),
        ([supple.VaryingVariance([], "x1", 5.0, 0.5)], "must name at least one measurement"),
        ([{"measurement": "y1"}], "a list of supple.VaryingVariance"),
        ([supple.VaryingVariance("y1", "x1", float("nan"), 0.5)], "center=nan: a finite number"),
        ([supple.VaryingVariance("y1", "x1", None, 0.5)], "center=None: a number, or the name of a parameter"),  # type: ignore[arg-type]
    ]:
        with pytest.raises(supple.UsageError) as raised:
            made(law)
        assert message in str(raised.value), str(raised.value)
