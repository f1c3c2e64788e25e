"""Functions of models that tests share, as users write them: in JAX for one point, in NumPy for batches."""

from __future__ import annotations

from functools import cache
from typing import Any

import jax.numpy as jnp
import numpy as np

import supple

Parameter = supple.Parameter

TWO_MASS: dict[str, Any] = {
    "parameters": {
        "k1": Parameter(500.0, (50.0, 600.0), "log", "N/m"),
        "k2": Parameter(500.0, (100.0, 600.0), "log", "N/m"),
        "wall_variance": Parameter(1e-4, (1e-8, 1.0), "log", "m^2", "study"),
        "drive_variance": Parameter(5e-3, (1e-8, 1.0), "log", "m^2/s^2", "study"),
    },
    "states": {"x1": "m", "v1": "m/s", "x2": "m", "v2": "m/s", "xw": "m"},
    "controls": {"u": "N"},
    "measurements": {"position of m1": "m", "force in the spring": "N"},
}

PRESS: dict[str, Any] = {
    "name": "press",
    "steps": 125,
    "time_step": 0.02,
    "initial_state": [0.0, 0.0, 0.0, 0.0, 0.75],
    "initial_control": [57.0],
    "noise": supple.Noise(
        initial=[1e-3, 1e-3, 1e-3, 1e-3, "wall_variance"],
        process=[1e-7, "drive_variance", 1e-7, 1e-2, 0.0],
        measurement=[1e-3, 1e-2],
    ),
    "bound": 250.0,
}

CART_POLE: dict[str, Any] = {
    "parameters": {
        "stiffness": Parameter(0.1, (0.01, 0.4), "log", "N m/rad"),
        "angle_variance": Parameter(1e-4, (1e-5, 1e-2), "log", "rad^2", "study"),
    },
    "states": ["x", "a", "dx", "da"],
    "controls": ["force"],
    "measurements": ["x", "a"],
}

BALANCE: dict[str, Any] = {
    "name": "balance",
    "steps": 60,
    "time_step": 0.02,
    "initial_state": [-0.5, 0.1, 0.0, 0.0],
    "initial_control": [0.0],
    "noise": supple.Noise(
        initial=[1e-3, 1e-3, 1e-2, 1e-2], process=[0.0, 0.0, 1e-4, 1e-3], measurement=[1e-4, "angle_variance"]
    ),
    "bound": 60.0,
}


def _positive(z: Any, smoothing: float) -> Any:
    return 0.5 * ((z * z + smoothing**2) ** 0.5 + z)


def two_mass_step(x: Any, u: Any, p: Any) -> Any:
    x1, v1, x2, v2, wall = x
    coupling, contact = p.k1 * (x1 - x2), p.k2 * _positive(x2 - wall, 0.01)
    a1, a2 = (u[0] - 60.0 * v1 - coupling) / 0.8, (coupling - 35.0 * v2 - contact) / 0.4
    return jnp.stack([x1 + 0.02 * v1, v1 + 0.02 * a1, x2 + 0.02 * v2, v2 + 0.02 * a2, wall])


def two_mass_observe(x: Any, p: Any) -> Any:
    return jnp.stack([x[0], p["k1"] * (x[2] - x[0])])


def two_mass_final_cost(x: Any, p: Any) -> Any:
    missing = 10.0 - _positive(p.k2 * (x[2] - x[4]), 0.1)
    return 0.05 * missing**2 + 0.1 * (x[1] ** 2 + x[3] ** 2)


def two_mass_cost(x: Any, u: Any, p: Any) -> Any:
    return two_mass_final_cost(x, p) + 1e-4 * u[0] ** 2


def _cart_pole(sin: Any, cos: Any, x: Any, u: Any, p: Any) -> tuple[Any, ...]:
    _, angle, speed, rate = x
    torque = p.stiffness * angle
    force = u + 0.1 * sin * (0.5 * rate**2 - 9.81 * cos) + 2.0 * torque * cos
    push = force / (1.0 + 0.1 * sin**2)
    return speed, rate, push, (9.81 * sin - push * cos) / 0.5 - 40.0 * torque


def cart_pole_step(x: Any, u: Any, p: Any) -> Any:
    return x + 0.02 * jnp.stack(_cart_pole(jnp.sin(x[1]), jnp.cos(x[1]), x, u[0], p))


def cart_pole_observe(x: Any, p: Any) -> Any:
    return x[:2]


def cart_pole_cost(x: Any, u: Any, p: Any) -> Any:
    return x[0] ** 2 + x[1] ** 2 + 0.1 * (x[2] ** 2 + x[3] ** 2) + 0.01 * u[0] ** 2 + p.stiffness * x[1] ** 4


def cart_pole_final_cost(x: Any, p: Any) -> Any:
    return 20.0 * (x[0] ** 2 + x[1] ** 2) + 2.0 * (x[2] ** 2 + x[3] ** 2)


def batch_step(x: Any, u: Any, p: Any) -> Any:
    rates = _cart_pole(np.sin(x[..., 1]), np.cos(x[..., 1]), np.moveaxis(x, -1, 0), u[..., 0], p)
    return x + 0.02 * np.stack(rates, axis=-1)


def batch_observe(x: Any, p: Any) -> Any:
    return x[..., :2]


def batch_cost(x: Any, u: Any, p: Any) -> Any:
    squares = x[..., 0] ** 2 + x[..., 1] ** 2 + 0.1 * (x[..., 2] ** 2 + x[..., 3] ** 2)
    return squares + 0.01 * u[..., 0] ** 2 + p.stiffness * x[..., 1] ** 4


def batch_final_cost(x: Any, p: Any) -> Any:
    return 20.0 * (x[..., 0] ** 2 + x[..., 1] ** 2) + 2.0 * (x[..., 2] ** 2 + x[..., 3] ** 2)


@cache
def two_mass_model(backend: Any = "auto") -> supple.Model:
    """The model of tasks/two_mass.toml; one for all tests, so that it is compiled once."""
    return supple.Model(
        step=two_mass_step,
        observe=two_mass_observe,
        cost=two_mass_cost,
        final_cost=two_mass_final_cost,
        backend=backend,
        **TWO_MASS,
    )


def two_mass(backend: Any = "auto", **changed: Any) -> supple.Task:
    """The task of tasks/two_mass.toml."""
    return two_mass_model(backend).task(**{**PRESS, **changed})


def cart_pole_model(backend: Any = "auto", **changed: Any) -> supple.Model:
    """A cart-pole: in NumPy with ``backend="numpy"``, in JAX otherwise."""
    names = ("step", "observe", "cost", "final_cost")
    kind = "batch" if backend == "numpy" else "cart_pole"
    functions = {name: globals()[f"{kind}_{name}"] for name in names}
    return supple.Model(**{**functions, **CART_POLE, "backend": backend, **changed})


def cart_pole(backend: Any = "auto", **changed: Any) -> supple.Task:
    """A cart-pole that is to stand upright at 0."""
    return _cart_pole_model(backend).task(**{**BALANCE, **changed})


@cache
def _cart_pole_model(backend: str) -> supple.Model:
    return cart_pole_model(backend)


class Counting:
    """A backend that counts its calls, and the points of each."""

    def __init__(self, backend: Any) -> None:
        self.backend = backend
        self.calls: list[tuple[str, int]] = []

    def __getattr__(self, name: str) -> Any:
        method = getattr(self.backend, name)

        def counted(*arguments: Any) -> Any:
            self.calls.append((name, len(arguments[0])))
            return method(*arguments)

        return counted


def backend_of(task: supple.Task) -> Any:
    """What the engine calls."""
    return task._recipe[1]["systems"][0]["backend"]


def with_backend(task: supple.Task, backend: Any) -> supple.Task:
    """The same task with another backend."""
    from supple._supple import NativeTask

    description = task._recipe[1]
    description = {**description, "systems": [{**description["systems"][0], "backend": backend}]}
    return supple.Task(NativeTask.own(description), ("own", description))
