"""Custom physics: a pole on a cart, whose spring and angle sensor are to be designed.

Its twin in Rust is crates/supple/examples/03_own_model.rs; both print the same.
"""

import jax.numpy as jnp

import supple


def step(x, u, p):
    """The next state. State ``[x, a, x', a']``: place of the cart, angle of the pole, and their rates."""
    place, angle, speed, rate = x
    sin, cos = jnp.sin(angle), jnp.cos(angle)
    torque = p.stiffness * angle
    force = u[0] + 0.1 * sin * (0.5 * rate**2 - 9.81 * cos) + 2.0 * torque * cos
    push = force / (1.0 + 0.1 * sin**2)
    turn = (9.81 * sin - push * cos) / 0.5 - 40.0 * torque
    return x + 0.02 * jnp.array([speed, rate, push, turn])


def observe(x, p):
    """Place and angle."""
    return x[:2]


def cost(x, u, p):
    """In every step."""
    return x[0] ** 2 + x[1] ** 2 + 0.1 * (x[2] ** 2 + x[3] ** 2) + 0.01 * u[0] ** 2


def final_cost(x, p):
    """At the end."""
    return 20.0 * (x[0] ** 2 + x[1] ** 2) + 2.0 * (x[2] ** 2 + x[3] ** 2)


model = supple.Model(
    step=step,
    observe=observe,
    cost=cost,
    final_cost=final_cost,
    states=["x", "a", "dx", "da"],
    controls=["force"],
    measurements=["x", "a"],
    parameters={
        "stiffness": supple.Parameter(0.1, (0.01, 0.4), "log", "N m/rad"),
        "angle_variance": supple.Parameter(1e-4, (1e-5, 1e-2), "log", "rad^2"),
    },
)
task = model.task(
    name="balance",
    title="A pole on a cart",
    steps=150,
    time_step=0.02,
    bound=28.0,
    initial_state=[-0.5, 0.1, 0.0, 0.0],
    initial_control=[0.0],
    noise=supple.Noise(
        initial=[1e-3, 1e-3, 1e-2, 1e-2],
        process=[0.0, 0.0, 1e-4, 1e-3],
        measurement=[1e-4, "angle_variance"],
    ),
)

start = task.evaluate(gradient="total")
print(f"{start.information.bits:.3f} bits at cost {start.tasks['balance'].cost.expected:.4f}")
for name, value in start.tasks["balance"].gradient.total.information_nats.items():
    print(f"d nats / d {name} = {value:.5f}")
best = task.design(starts=2)
for name, parameter in task.parameters.items():
    print(f"{name} = {best.parameters[name]:.4f} {parameter.unit}")
print(f"{best.information.bits:.3f} bits at cost {best.tasks['balance'].cost.expected:.3f}")
