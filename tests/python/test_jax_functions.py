"""Every function of one number that JAX writes as a primitive of its own is recorded, and the engine runs the record."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import supple

jax = pytest.importorskip("jax")

import jax.numpy as jnp  # noqa: E402

FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "log1p": lambda x: jnp.log1p(x * x),
    "softplus": lambda x: jax.nn.softplus(x),
    "logaddexp": lambda x: jnp.logaddexp(x, 0.3),
    "logsumexp": lambda x: jax.nn.logsumexp(jnp.stack([x, 0.3 * x, 1.0 + 0.0 * x])),
    "expm1": jnp.expm1,
    "tanh": jnp.tanh,
    "arcsinh": jnp.arcsinh,
    "arctan": jnp.arctan,
    "sigmoid": jax.nn.sigmoid,
    "exp": jnp.exp,
    "sqrt": lambda x: jnp.sqrt(1.0 + x * x),
    "sinc": lambda x: jnp.sin(x) * jnp.cos(x) / (2.0 + x),
}


def of_function(function: Callable[[Any], Any], backend: Any) -> supple.Task:
    """A point that a nonlinear spring holds."""

    def step(x: Any, u: Any, p: Any) -> Any:
        return jnp.stack([x[0] + 0.1 * x[1], 0.9 * x[1] + 0.1 * (u[0] - p.k * function(x[0]))])

    model = supple.Model(
        step=step,
        observe=lambda x, p: x[:1],
        cost=lambda x, u, p: x @ x + 0.1 * u @ u,
        parameters={"k": supple.Parameter(0.5, (0.1, 1.0))},
        states=["x", "v"],
        controls=["u"],
        measurements=["x"],
        backend=backend,
    )
    return model.task(
        steps=10,
        time_step=0.1,
        initial_state=[0.4, 0.0],
        initial_control=[0.0],
        noise=supple.Noise(initial=[0.01, 0.01], process=[1e-4, 1e-3], measurement=[1e-2]),
    )


@pytest.mark.parametrize("name", FUNCTIONS)
def test_recorded_functions_give_the_numbers_of_jax(name: str) -> None:
    recorded = of_function(FUNCTIONS[name], "recorded").evaluate(trajectories=False)
    called = of_function(FUNCTIONS[name], "jax").evaluate(trajectories=False)
    np.testing.assert_allclose(recorded.information.bits, called.information.bits, rtol=1e-9)
    cost = recorded.tasks["task"].cost.expected
    np.testing.assert_allclose(cost, called.tasks["task"].cost.expected, rtol=1e-9)


def test_a_record_that_the_engine_refuses_is_called_in_jax(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    import supple.model

    recorded = supple.model._record

    def misnamed(*arguments: Any) -> dict[str, Any]:
        """A record with an instruction that the engine does not know."""
        system = recorded(*arguments)
        assert "ln_1p" in system["model"]
        return {**system, "model": system["model"].replace("ln_1p", "ln_of_1p")}

    monkeypatch.setattr(supple.model, "_record", misnamed)
    with caplog.at_level("INFO", logger="supple"):
        task = of_function(FUNCTIONS["log1p"], "auto")
    assert "the engine does not take their record" in caplog.text
    assert task.evaluate().tasks["task"].status == "converged"
    with pytest.raises(supple.UsageError, match="ln_of_1p"):
        of_function(FUNCTIONS["log1p"], "recorded")
