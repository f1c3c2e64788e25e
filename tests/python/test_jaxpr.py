"""Functions written in JAX, as tapes: every primitive against JAX, and what cannot be written out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

jax = pytest.importorskip("jax")
import jax.numpy as jnp

from supple._jaxpr import Mistranslated, Untranslatable, double_precision, translate
from supple._jaxpr.tape import evaluate
from supple._jaxpr.verify import jacobians, points

X, U, PHI = np.array([0.4, -0.7, 1.3]), np.array([0.6]), np.array([1.5, 0.2])

Function = Callable[[Any, Any, Any], Any]


def matrix(x: Any) -> Any:
    """A matrix that needs pivots: its first entry is small."""
    return jnp.array([[0.01 * x[0], 1.0, x[1]], [x[2], x[0] * x[1], 3.0], [0.5, x[2], 5.0]])


def large(x: Any) -> Any:
    """8 x 8, not symmetric."""
    return 2.0 * jnp.eye(8) + jnp.outer(jnp.sin(jnp.arange(8.0)), jnp.tile(x, 3)[:8])


def odd_functions(x: Any) -> Any:
    return jnp.stack([jnp.sinh(x), jnp.tanh(x), jnp.arcsinh(x), jnp.arctanh(0.3 * x), jnp.cbrt(x), jnp.arctan(x)])


VECTORS: dict[str, Function] = {
    "arithmetic": lambda x, u, phi: (x + u[0]) * phi[0] / (2.0 - x) - (-x) ** 2,
    "powers": lambda x, u, phi: (x**2 + 1.0) ** 2.5 + (x**2 + 0.1) ** -0.3 + jnp.abs(x) ** phi[0] + (x + 3.0) ** -3,
    "exponentials": lambda x, u, phi: jnp.exp(x) + jnp.expm1(x) + jnp.log(x**2 + 1.0) + jnp.log1p(x**2) + jnp.exp2(x),
    "roots": lambda x, u, phi: jnp.sqrt(x**2 + 1.0) + jax.lax.rsqrt(x**2 + 2.0) + jnp.square(x),
    "angles": lambda x, u, phi: jnp.sin(x) + jnp.cos(x) + jnp.tan(x) + jnp.arctan2(x, u[0]),
    "arcs": lambda x, u, phi: jnp.arcsin(0.3 * x) + jnp.arccos(0.3 * x) + jnp.cosh(x) + jnp.arccosh(x**2 + 1.1),
    "sigmoid": lambda x, u, phi: jax.nn.sigmoid(10.0 * x) + jax.nn.silu(x),
    "softplus": lambda x, u, phi: jax.nn.softplus(x) + jax.nn.relu(x),
    "softmax": lambda x, u, phi: jax.nn.softmax(x) + jax.nn.logsumexp(x),
    "ties": lambda x, u, phi: (
        jnp.maximum(x, u[0]) + jnp.minimum(x, 0.0) + jnp.abs(x) * jnp.sign(x) + jnp.clip(x, -0.5, 0.5)
    ),
    "clamp": lambda x, u, phi: jax.lax.clamp(-0.5, x, 0.5),
    "choice": lambda x, u, phi: jnp.where((x > 0.0) & ~(x >= 1.0) | (x == 7.0), jnp.exp(x), x),
    "choice of rows": lambda x, u, phi: jnp.select([x < -0.5, x <= 0.5], [x, 2.0 * x], 3.0 * x),
    "finite": lambda x, u, phi: jnp.where(jnp.isfinite(x) & ~jnp.isnan(x), x, 0.0),
    "indices": lambda x, u, phi: x[jnp.array([2, 0, 1])] + x[::-1] + x[-1] + jnp.roll(x, 1) + jnp.take(x, 1),
    "updates": lambda x, u, phi: x.at[0].set(u[0]).at[1].add(3.0).at[jnp.array([0, 0])].add(x[:2]).at[2].multiply(2.0),
    "windows": lambda x, u, phi: jax.lax.dynamic_slice(jnp.pad(x, (1, 2)), (1,), (3,)) + jnp.concatenate([x[1:], u]),
    "windows written": lambda x, u, phi: jax.lax.dynamic_update_slice(x, u, (1,)),
    "shapes": lambda x, u, phi: jnp.outer(x, x).T.reshape(-1)[:3] + jnp.squeeze(x[None]) + jnp.stack([x, x]).sum(0),
    "sums": lambda x, u, phi: (
        jnp.cumsum(x) + jnp.cumprod(x) + jnp.flip(jnp.cumsum(jnp.flip(x))) + jnp.prod(x) + x.mean()
    ),
    "extremes": lambda x, u, phi: x * jnp.max(x) + jnp.min(x) + jnp.ptp(x) + jnp.any(x > 1.0) * jnp.all(x > 0.0),
    "counts": lambda x, u, phi: x * jnp.sum(x > 0.0),
    "products": lambda x, u, phi: (
        matrix(x) @ x + jnp.einsum("i,ij,jk->k", x, matrix(x), matrix(x)) + jnp.cross(x, x**2)
    ),
    "batches": lambda x, u, phi: jax.vmap(lambda row: jnp.dot(row, x))(matrix(x)),
    "solve": lambda x, u, phi: jnp.linalg.solve(matrix(x), x),
    "solve whose rows are known to stay": lambda x, u, phi: jnp.linalg.solve(
        jnp.array([[2.0, x[0], 0.0], [0.0, 1.0, x[1]], [0.0, 0.0, 3.0]]), x
    ),
    "inverse": lambda x, u, phi: jnp.linalg.inv(matrix(x)) @ x,
    "solve of 8": lambda x, u, phi: jnp.linalg.solve(large(x), jnp.ones(8))[:3],
    "inverse of 8": lambda x, u, phi: jnp.linalg.inv(large(x))[0, :3],
    "cholesky": lambda x, u, phi: jnp.linalg.cholesky(matrix(x) @ matrix(x).T + jnp.eye(3))[2],
    "cholesky solve": lambda x, u, phi: jax.scipy.linalg.solve(matrix(x) @ matrix(x).T + jnp.eye(3), x, assume_a="pos"),
    "loop": lambda x, u, phi: jax.lax.fori_loop(0, 5, lambda i, s: s + 0.1 * i * jnp.sin(s), x),
    "loop backwards": lambda x, u, phi: jax.lax.scan(lambda c, w: (c * w, c + w), x[0], x, reverse=True)[1],
    "loop while": lambda x, u, phi: jax.lax.while_loop(lambda s: s[0] < 3, lambda s: (s[0] + 1, s[1] * x), (0, x))[1],
    "branches": lambda x, u, phi: (
        jax.lax.cond(x[0] > 0.2, jnp.sin, jnp.cos, x) + jax.lax.cond(True, jnp.exp, jnp.sin, x)
    ),
    "branches by number": lambda x, u, phi: jax.lax.switch(
        (x[0] > 0.2).astype(int) + 1, [jnp.sin, jnp.cos, jnp.exp], x
    ),
    "gradient": lambda x, u, phi: jax.grad(lambda q: jnp.sum(jnp.sin(q) ** 2) * phi[0])(x),
    "hessian": lambda x, u, phi: jax.hessian(lambda q: jnp.sum(jnp.sin(q) ** 3) * phi[0])(x) @ x,
    "remembered": lambda x, u, phi: jax.checkpoint(lambda q: jnp.sin(q) * phi[1])(x),
    "compiled": lambda x, u, phi: jax.jit(lambda q: jnp.sin(q) * phi[1])(x),
    "random constants": lambda x, u, phi: jax.random.normal(jax.random.PRNGKey(0), (3,)) * x,
    "constant": lambda x, u, phi: jnp.array([3.0, 4.0, 5.0]),
    "places of extremes": lambda x, u, phi: x[jnp.argmax(x)] * x + x[jnp.argmin(x)],
    "integers": lambda x, u, phi: x * jnp.arange(3) + jnp.ones(3, dtype=int) // 2,
}


@pytest.mark.parametrize("name", VECTORS)
def test_functions_give_what_jax_gives_with_its_derivatives(name: str) -> None:
    function = VECTORS[name]
    tape = translate(function, name, X, U, PHI, 3)
    at = points(np.concatenate([X, U, PHI, [1.0]]), 9)
    with double_precision():
        rows = [(row[:3], row[3:4], row[4:6]) for row in jnp.asarray(at)]
        expected = np.array([function(*row) for row in rows], dtype=float)
        slopes = np.array([np.hstack(jax.jacfwd(function, (0, 1, 2))(*row)) for row in rows])
    found = evaluate(tape, at)
    assert np.abs(found - expected).max() <= 1e-12 * max(np.abs(expected).max(), 1.0)
    assert np.abs(jacobians(tape, at) - slopes).max() <= 1e-9 * max(np.abs(slopes).max(), 1.0)


def test_functions_keep_their_digits_near_zero() -> None:
    small = np.array([1e-12, -3e-9, 2e-5])
    tape = translate(lambda x, u, phi: odd_functions(x).reshape(-1), "f", small, U, PHI, 18)
    with double_precision():
        expected = np.asarray(odd_functions(jnp.asarray(small))).reshape(-1)
    found = evaluate(tape, np.concatenate([small, U, PHI, [1.0]])[None])[0]
    assert np.abs(found / expected - 1.0).max() < 1e-14
    tape = translate(lambda x, u, phi: jnp.concatenate([jnp.expm1(x), jnp.log1p(x)]), "f", small, U, PHI, 6)
    found = evaluate(tape, np.concatenate([small, U, PHI, [1.0]])[None])[0]
    assert np.abs(found / np.concatenate([np.expm1(small), np.log1p(small)]) - 1.0).max() < 1e-15


def test_functions_do_not_overflow_on_the_way() -> None:
    far = np.array([800.0, -800.0, 0.0])
    for function in (jax.nn.sigmoid, jax.nn.softplus, jnp.tanh, jnp.arcsinh):
        tape = translate(lambda x, u, phi, function=function: function(x), "f", far, U, PHI, 3)
        at = np.concatenate([far, U, PHI, [1.0]])[None]
        assert np.isfinite(evaluate(tape, at)).all() and np.isfinite(jacobians(tape, at)).all()


def test_ties_have_the_derivatives_of_jax() -> None:
    def ties(x: Any, u: Any, phi: Any) -> Any:
        bounds = jax.lax.clamp(0.0, x[0], 1.0) + jax.lax.clamp(-1.0, x[0], 0.0)
        smooth = jax.nn.softplus(x[0]) + x[0] ** 1.5 + x[0] ** 2.7
        return jnp.stack([jnp.maximum(x[0], 0.0), jnp.abs(x[0]), jnp.sign(x[0]), bounds, jax.nn.relu(x[0]), smooth])

    zero = np.zeros(1)
    tape = translate(ties, "ties", zero, U, PHI, 6)
    with double_precision():
        expected = np.asarray(jax.jacrev(ties)(zero, U, PHI))[:, 0]
    assert jacobians(tape, np.concatenate([zero, U, PHI, [1.0]])[None])[0, :, 0] == pytest.approx(expected, abs=1e-15)


def test_a_time_step_is_an_input() -> None:
    tape = translate(lambda x, u, phi, dt: x + dt * jnp.sin(x), "step", X, U, PHI, 3, time_step=0.1)
    at = np.concatenate([X, U, PHI, [0.3]])[None]
    assert evaluate(tape, at)[0] == pytest.approx(X + 0.3 * np.sin(X), rel=1e-15)


def test_equal_expressions_and_constants_take_no_instructions() -> None:
    def function(x: Any, u: Any, phi: Any) -> Any:
        unused = jnp.exp(x)
        return (jnp.sin(x) * 0.0 + jnp.sin(x) * 1.0 + 0.0) * jnp.cos(jnp.zeros(3)) + 0.0 * unused

    tape = translate(function, "f", X, U, PHI, 3)
    assert tape["instructions"] == [{"sin": 0}, {"sin": 1}, {"sin": 2}] and tape["constants"] == []


@jax.custom_jvp
def straight_through(x: Any) -> Any:
    """A step whose derivative is said to be 1."""
    return jnp.where(x > 0.0, 1.0, 0.0)


straight_through.defjvp(lambda primals, tangents: (straight_through(primals[0]), tangents[0]))


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda x, u, phi: jax.scipy.special.erf(x), "primitive `erf` in `f`"),
        (lambda x, u, phi: jnp.floor(x), "primitive `floor` in `f`"),
        (lambda x, u, phi: jnp.sort(x), "primitive `sort` in `f`"),
        (lambda x, u, phi: x[(10.0 * x).astype(int)], "rounds numbers that are not constant"),
        (lambda x, u, phi: x.astype(jnp.float32).astype(float), "float32"),
        (lambda x, u, phi: jax.lax.while_loop(lambda s: s[0] < 10.0, lambda s: s * 2.0, x), "whose end depends on"),
        (lambda x, u, phi: jax.lax.stop_gradient(x) * x, "derivatives of `f` by rules of its own (`stop_gradient`)"),
        (lambda x, u, phi: straight_through(x), "`custom_jvp_call`"),
        (lambda x, u, phi: jnp.linalg.svd(matrix(x))[1], "primitive `svd` in `f`"),
        (lambda x, u, phi: jax.debug.print("{}", x) or x, "primitive `debug_"),
        (lambda x, u, phi: x + jnp.inf, "constant inf"),
        (lambda x, u, phi: jax.lax.fori_loop(0, 10**6, lambda i, s: s + jnp.sin(s), x), "rounds"),
        (lambda x, u, phi: jnp.linalg.inv(jnp.eye(17) + x[0] * jnp.ones((17, 17)))[0, :3], "17 x 17"),
    ],
)
def test_what_cannot_be_written_out_says_why(function: Function, message: str) -> None:
    with pytest.raises(Untranslatable) as error:
        translate(function, "f", X, U, PHI, 3)
    assert message in str(error.value)


def test_wrong_shapes_say_which() -> None:
    with pytest.raises(ValueError, match=r"`f` returns an array of shape \(3,\), not \(2,\)"):
        translate(lambda x, u, phi: x, "f", X, U, PHI, 2)
    with pytest.raises(ValueError, match=r"arrays of shape \(3,\) and \(3,\), not \(\)"):
        translate(lambda x, u, phi: (x, x), "cost", X, U, PHI, None)


def test_functions_that_are_not_the_same_at_every_call_are_found() -> None:
    random = np.random.default_rng(0)
    with pytest.raises(Mistranslated, match="not the same at every call"):
        translate(lambda x, u, phi: x * random.uniform(), "f", X, U, PHI, 3)


def test_a_function_of_what_changes_outside_is_found() -> None:
    calls = []

    def function(x: Any, u: Any, phi: Any) -> Any:
        calls.append(None)
        return x * (1.0 if len(calls) < 3 else 2.0)

    with pytest.raises(Mistranslated, match="where JAX gives"):
        translate(function, "f", X, U, PHI, 3)
