"""Models written in JAX that tests and benchmarks share."""

from __future__ import annotations

from typing import Any, ClassVar

import supple


def positive(z: Any, smoothing: float) -> Any:
    """The smooth positive part."""
    import jax.numpy as jnp

    return 0.5 * (jnp.sqrt(z * z + smoothing**2) + z)


class TwoMass:
    """The model of `tasks/two_mass.toml` with its costs; parameters k1, k2, wall_variance, drive_variance."""

    mass, damping = (0.8, 0.4), (60.0, 35.0)
    time_step, contact_smoothing = 0.02, 0.01
    force, force_smoothing = 10.0, 0.1
    weights: ClassVar[dict[str, Any]] = {"force": 0.05, "speed": 0.1, "depth": 0.0, "control": 1e-4}
    states: ClassVar[dict[str, Any]] = {"x1": "m", "v1": "m/s", "x2": "m", "v2": "m/s", "xw": "m"}
    controls: ClassVar[dict[str, Any]] = {"u": "N"}
    measurements: ClassVar[dict[str, Any]] = {"position of m1": "m", "force in the spring": "N"}
    parameters: ClassVar[dict[str, Any]] = {
        "k1": supple.Parameter(500.0, (50.0, 600.0), "log", "N/m", "design"),
        "k2": supple.Parameter(500.0, (100.0, 600.0), "log", "N/m", "design"),
        "wall_variance": supple.Parameter(1e-4, (1e-8, 1.0), "log", "m^2", "study"),
        "drive_variance": supple.Parameter(5e-3, (1e-8, 1.0), "log", "m^2/s^2", "study"),
    }
    noise: ClassVar[dict[str, Any]] = {
        "initial": [1e-3, 1e-3, 1e-3, 1e-3, "wall_variance"],
        "process": [1e-7, "drive_variance", 1e-7, 1e-2, 0.0],
        "measurement": [1e-3, 1e-2],
    }
    start: ClassVar[list[float]] = [0.0, 0.0, 0.0, 0.0, 0.75]
    first_guess: ClassVar[list[list[float]]] = [[57.0]]
    bound, steps = 250.0, 125

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Explicit Euler."""
        import jax.numpy as jnp

        x1, v1, x2, v2, wall = x
        coupling = p.k1 * (x1 - x2)
        contact = p.k2 * positive(x2 - wall, self.contact_smoothing)
        a1 = (u[0] - self.damping[0] * v1 - coupling) / self.mass[0]
        a2 = (coupling - self.damping[1] * v2 - contact) / self.mass[1]
        dt = self.time_step
        return jnp.stack([x1 + dt * v1, v1 + dt * a1, x2 + dt * v2, v2 + dt * a2, wall])

    def observe(self, x: Any, p: Any) -> Any:
        """Position of the first mass, force in the spring."""
        import jax.numpy as jnp

        return jnp.stack([x[0], p.k1 * (x[2] - x[0])])

    def final_cost(self, x: Any, p: Any) -> Any:
        """Force against its target, depth and speeds."""
        depth = x[2] - x[4]
        missing = self.force - positive(p.k2 * depth, self.force_smoothing)
        speeds = x[1] ** 2 + x[3] ** 2
        weights = self.weights
        return weights["force"] * missing**2 + weights["depth"] * depth**2 + weights["speed"] * speeds

    def cost(self, x: Any, u: Any, p: Any) -> Any:
        """The same with the control."""
        return self.final_cost(x, p) + self.weights["control"] * u[0] ** 2


class CartPole:
    """A pole on a cart, upright at angle 0, by its mass matrix; semi-implicit Euler. Parameters: cart_mass, sensor."""

    cart_mass, pole_mass, gravity, time_step = 1.0, 0.1, 9.81, 0.02
    states: ClassVar[dict[str, Any]] = {"q.slide": "m", "q.hinge": "rad", "v.slide": "m/s", "v.hinge": "rad/s"}
    controls: ClassVar[dict[str, Any]] = {"slide": "N"}
    measurements: ClassVar[dict[str, Any]] = {"slide": "m", "hinge": "rad"}
    parameters: ClassVar[dict[str, Any]] = {
        "cart_mass": supple.Parameter(1.0, (0.5, 2.0), "log", "kg", "design"),
        "sensor": supple.Parameter(1e-4, (1e-8, 1.0), "log", "rad^2", "design"),
    }
    length, inertia = 0.5, 0.002
    noise: ClassVar[dict[str, Any]] = {
        "initial": [1e-3, 1e-3, 1e-2, 1e-2],
        "process": [0.0, 0.0, 1e-4, 1e-3],
        "measurement": [1e-4, "sensor"],
    }
    start: ClassVar[list[float]] = [0.0, 0.3, 0.0, 0.0]
    first_guess: ClassVar[list[list[float]]] = [[0.0]]
    bound, steps = 250.0, 60

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """`M(q) a = tau - h(q, v)`, `v+ = v + dt a`, `q+ = q + dt v+`."""
        import jax.numpy as jnp

        q, v = x[:2], x[2:]
        sin, cos = jnp.sin(q[1]), jnp.cos(q[1])
        arm = self.pole_mass * self.length
        mass = jnp.array([[p.cart_mass + self.pole_mass, arm * cos], [arm * cos, arm * self.length + self.inertia]])
        rest = jnp.stack([arm * sin * v[1] ** 2 + u[0], arm * self.gravity * sin])
        v = v + self.time_step * jnp.linalg.solve(mass, rest)
        return jnp.concatenate([q + self.time_step * v, v])

    def observe(self, x: Any, p: Any) -> Any:
        """Both positions."""
        return x[:2]

    def final_cost(self, x: Any, p: Any) -> Any:
        """Upright and at rest."""
        return 20.0 * x[:2] @ x[:2] + 2.0 * x[2:] @ x[2:]

    def cost(self, x: Any, u: Any, p: Any) -> Any:
        """The same, smaller, and the force."""
        return x[:2] @ x[:2] + 0.1 * x[2:] @ x[2:] + 0.01 * u @ u


def own_task(model: Any, backend: Any = "recorded", **changed: Any) -> supple.Task:
    """The task of a model here."""
    made = supple.Model(
        step=model.step,
        observe=model.observe,
        cost=model.cost,
        final_cost=model.final_cost,
        parameters=model.parameters,
        states=model.states,
        controls=model.controls,
        measurements=model.measurements,
        backend=backend,
    )
    settings = {
        "steps": model.steps,
        "time_step": model.time_step,
        "initial_state": model.start,
        "initial_control": model.first_guess,
        "noise": supple.Noise(**model.noise),
        "bound": model.bound,
        "name": "press",
    }
    return made.task(**{**settings, **changed})
