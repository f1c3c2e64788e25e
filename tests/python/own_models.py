"""Models written in JAX that tests and benchmarks share: `f(x, u, phi)` of float64 arrays."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

import supple
from supple._backends.recorded import Channel, record
from supple._supple import NativeTask

Array = NDArray[np.float64]


def positive(z: Any, smoothing: float) -> Any:
    """The smooth positive part."""
    import jax.numpy as jnp

    return 0.5 * (jnp.sqrt(z * z + smoothing**2) + z)


class TwoMass:
    """The model of `tasks/two_mass.toml` with its costs; parameters k1, k2, wall_variance, drive_variance."""

    mass, damping = (0.8, 0.4), (60.0, 35.0)
    time_step, contact_smoothing = 0.02, 0.01
    force, force_smoothing = 10.0, 0.1
    weights = {"force": 0.05, "speed": 0.1, "depth": 0.0, "control": 1e-4}
    states = (("x1", "m"), ("v1", "m/s"), ("x2", "m"), ("v2", "m/s"), ("xw", "m"))
    controls = (("u", "N"),)
    measurements = (("position of m1", "m"), ("force in the spring", "N"))
    parameters = {
        "k1": (500.0, (50.0, 600.0), "log", "N/m", "design"),
        "k2": (500.0, (100.0, 600.0), "log", "N/m", "design"),
        "wall_variance": (1e-4, (1e-8, 1.0), "log", "m^2", "study"),
        "drive_variance": (5e-3, (1e-8, 1.0), "log", "m^2/s^2", "study"),
    }
    noise = {
        "initial": [1e-3, 1e-3, 1e-3, 1e-3, "wall_variance"],
        "process": [1e-7, "drive_variance", 1e-7, 1e-2, 0.0],
        "measurement": [1e-3, 1e-2],
    }
    start, first_guess, bound, steps = [0.0, 0.0, 0.0, 0.0, 0.75], [[57.0]], 250.0, 125

    def step(self, x: Any, u: Any, phi: Any) -> Any:
        """Explicit Euler."""
        import jax.numpy as jnp

        x1, v1, x2, v2, wall = x
        coupling = phi[0] * (x1 - x2)
        contact = phi[1] * positive(x2 - wall, self.contact_smoothing)
        a1 = (u[0] - self.damping[0] * v1 - coupling) / self.mass[0]
        a2 = (coupling - self.damping[1] * v2 - contact) / self.mass[1]
        dt = self.time_step
        return jnp.stack([x1 + dt * v1, v1 + dt * a1, x2 + dt * v2, v2 + dt * a2, wall])

    def observe(self, x: Any, phi: Any) -> Any:
        """Position of the first mass, force in the spring."""
        import jax.numpy as jnp

        return jnp.stack([x[0], phi[0] * (x[2] - x[0])])

    def final_cost(self, x: Any, phi: Any) -> Any:
        """Force against its target, depth and speeds."""
        depth = x[2] - x[4]
        missing = self.force - positive(phi[1] * depth, self.force_smoothing)
        speeds = x[1] ** 2 + x[3] ** 2
        weights = self.weights
        return weights["force"] * missing**2 + weights["depth"] * depth**2 + weights["speed"] * speeds

    def cost(self, x: Any, u: Any, phi: Any) -> Any:
        """The same with the control."""
        return self.final_cost(x, phi) + self.weights["control"] * u[0] ** 2


class CartPole:
    """A pole on a cart, upright at angle 0, by its mass matrix; semi-implicit Euler. Parameters: length, sensor."""

    cart_mass, pole_mass, gravity, time_step = 1.0, 0.1, 9.81, 0.02
    states = (("q.slide", "m"), ("q.hinge", "rad"), ("v.slide", "m/s"), ("v.hinge", "rad/s"))
    controls = (("slide", "N"),)
    measurements = (("slide", "m"), ("hinge", "rad"))
    parameters = {
        "cart_mass": (1.0, (0.5, 2.0), "log", "kg", "design"),
        "sensor": (1e-4, (1e-8, 1.0), "log", "rad^2", "design"),
    }
    length, inertia = 0.5, 0.002
    noise = {"initial": [1e-3, 1e-3, 1e-2, 1e-2], "process": [0.0, 0.0, 1e-4, 1e-3], "measurement": [1e-4, "sensor"]}
    start, first_guess, bound, steps = [0.0, 0.3, 0.0, 0.0], [[0.0]], 250.0, 60

    def step(self, x: Any, u: Any, phi: Any) -> Any:
        """`M(q) a = tau - h(q, v)`, `v+ = v + dt a`, `q+ = q + dt v+`."""
        import jax.numpy as jnp

        q, v = x[:2], x[2:]
        sin, cos = jnp.sin(q[1]), jnp.cos(q[1])
        arm = self.pole_mass * self.length
        mass = jnp.array([[phi[0] + self.pole_mass, arm * cos], [arm * cos, arm * self.length + self.inertia]])
        rest = jnp.stack([arm * sin * v[1] ** 2 + u[0], arm * self.gravity * sin])
        v = v + self.time_step * jnp.linalg.solve(mass, rest)
        return jnp.concatenate([q + self.time_step * v, v])

    def observe(self, x: Any, phi: Any) -> Any:
        """Both positions."""
        return x[:2]

    def final_cost(self, x: Any, phi: Any) -> Any:
        """Upright and at rest."""
        return 20.0 * x[:2] @ x[:2] + 2.0 * x[2:] @ x[2:]

    def cost(self, x: Any, u: Any, phi: Any) -> Any:
        """The same, smaller, and the force."""
        return x[:2] @ x[:2] + 0.1 * x[2:] @ x[2:] + 0.01 * u @ u


def own_task(model: Any, **changed: Any) -> supple.Task:
    """The task of a model here, its functions written down as tapes."""
    parameters = [
        {"name": name, "initial": initial, "bounds": list(bounds), "scale": scale, "unit": unit, "role": role}
        for name, (initial, bounds, scale, unit, role) in model.parameters.items()
    ]
    task = {
        "name": "press",
        "steps": model.steps,
        "time_step": model.time_step,
        "bound": model.bound,
        "information_weight": 1.0,
        "initial_state": model.start,
        "initial_control": model.first_guess,
        "control_bounds": None,
        **model.noise,
        **changed,
    }
    plain = {"title": "", "parameters": parameters, "tasks": [task], "planning": {}, "design": {}}
    phi = np.array([entry["initial"] for entry in parameters])
    near = (np.array(model.start), np.array(model.first_guess[0]), phi)
    channels: tuple[tuple[Channel, ...], ...] = (model.states, model.controls, model.measurements)
    system = record(
        model.step,
        model.observe,
        model.cost,
        model.final_cost,
        near=near,
        channels=(channels[0], channels[1], channels[2]),
        time_step=model.time_step,
    )
    description = {"plain": json.dumps(plain), "systems": [system]}
    return supple.Task(NativeTask.own(description), ("own", description))
