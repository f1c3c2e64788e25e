"""JAX functions whose values jump, such as rounded ones: derivatives miss the jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .._records import Array

__all__ = ["inner", "jumps", "misses_jumps"]

#: JAX's operations whose derivatives are 0 wherever they exist.
JUMPING = frozenset({"round", "floor", "ceil", "sign", "reduce_precision"})

#: Segments near the point along which derivatives are summed, and points on each.
SEGMENTS, POINTS = 8, 200

#: The share of the changes of an output that derivatives may miss: those at a jump that is crossed once, like that of an
#: angle that is wrapped.
MISSED = 0.2


def inner(jaxpr: Any) -> Iterator[Any]:
    """What JAX traced, and all functions inside it."""
    yield jaxpr
    for equation in jaxpr.eqns:
        for value in equation.params.values():
            for part in value if isinstance(value, (list, tuple)) else [value]:
                part = getattr(part, "jaxpr", part)
                if hasattr(part, "eqns"):
                    yield from inner(part)


def jumps(jaxpr: Any) -> list[str]:
    """Names of the operations that jump, and of those that convert to whole numbers."""
    found = set()
    for part in inner(jaxpr):
        for equation in part.eqns:
            name = equation.primitive.name
            whole = name == "convert_element_type" and np.issubdtype(equation.params["new_dtype"], np.integer)
            if name in JUMPING or whole and equation.invars[0].aval.dtype.kind == "f":
                found.add("int" if whole else name)
    return sorted(found)


def misses_jumps(function: Callable[[Any, Any, Any], Any], x: Array, u: Array, phi: Array) -> bool:
    """Whether the changes of a function along segments near a point are not the sums of its derivatives along them."""
    import jax
    import jax.numpy as jnp

    centre = np.concatenate([x, u])
    random = np.random.default_rng(0)
    scale = 0.1 * np.where(centre == 0.0, 1.0, np.abs(centre))
    starts, ends = (centre + scale * random.uniform(-1.0, 1.0, size=(SEGMENTS, len(centre))) for _ in range(2))
    n = len(x)

    def along(start: Any, end: Any) -> Any:
        def at(share: Any) -> Any:
            z = start + share * (end - start)
            return jnp.ravel(function(z[:n], z[n:], phi))

        shares = (jnp.arange(POINTS) + 0.5) / POINTS
        slopes = jax.vmap(lambda share: jax.jvp(at, (share,), (1.0,))[1])(shares)
        return jnp.stack([at(1.0) - at(0.0), slopes.mean(axis=0)])

    changes, sums = np.moveaxis(np.asarray(jax.jit(jax.vmap(along))(starts, ends)), 1, 0)
    with np.errstate(invalid="ignore"):
        missed = np.abs(changes - sums).sum(axis=0) > MISSED * np.abs(changes).sum(axis=0)
    return bool(np.any(missed & (np.abs(changes).sum(axis=0) > 0.0)))
