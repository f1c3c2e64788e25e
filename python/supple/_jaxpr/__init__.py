"""Functions written in JAX as tapes: straight programmes that the engine differentiates and compiles itself.

`translate` is all that others need. Nothing here imports JAX before it is called.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import numpy.typing as npt

from . import interpret
from .arrays import Symbolic, lift
from .tape import Tape, Untranslatable
from .verify import DERIVATIVE_POINTS, POINTS, Mistranslated, check_derivatives, check_values, points

__all__ = ["Mistranslated", "Untranslatable", "translate"]


def double_precision() -> AbstractContextManager[Any]:
    """A context in which JAX computes in float64."""
    import jax

    if hasattr(jax, "enable_x64"):
        context: AbstractContextManager[Any] = jax.enable_x64(True)
        return context
    from jax import experimental

    older: AbstractContextManager[Any] = getattr(experimental, "enable_x64")()  # noqa: B009
    return older


def translate(
    function: Callable[..., Any],
    name: str,
    x: npt.ArrayLike,
    u: npt.ArrayLike,
    phi: npt.ArrayLike,
    outputs: int | None,
    time_step: float | None = None,
) -> dict[str, Any]:
    """Writes a function of JAX arrays as a tape, and checks it near a point.

    Args:
        function: `function(x, u, phi)`, or `function(x, u, phi, time_step)` where a time step is given: float64 arrays
            of shapes (n,), (m,) and (parameters,), and a number in s. Pure: the same at every call.
        name: what it is called in messages.
        x: a state near which it is checked, (n,).
        u: a control, (m,).
        phi: parameters.
        outputs: how many numbers it returns, as an array of shape (outputs,); None for one number.
        time_step: the time step, s, where the function takes it.

    Returns:
        The tape as the engine reads it: a dict of plain lists and numbers.

    Raises:
        Untranslatable: where the function does something that cannot be written out; it may still be called.
        Mistranslated: where the tape, or another call, gives other numbers.
        ValueError: where the function returns another shape.
    """
    import jax

    arguments = [np.asarray(array, dtype=np.float64).reshape(-1) for array in (x, u, phi)]
    sizes = [len(array) for array in arguments]
    extra = [] if time_step is None else [np.asarray(time_step, dtype=np.float64)]
    with double_precision():
        found = [_write(function, name, sizes, arguments + extra, outputs) for _ in range(2)]
        (tape, rules), (again, _) = found
        if tape != again:
            raise Mistranslated(
                f"`{name}` is not the same at every call: it must depend on its arguments only (keep random numbers, "
                "clocks and counters out of it, and state that changes)"
            )
        centre = np.concatenate([*arguments, [1.0 if time_step is None else time_step]])
        cuts = np.cumsum(sizes)

        def of_inputs(row: Any) -> Any:
            parts = [row[a:b] for a, b in zip([0, *cuts[:-1]], cuts)]
            return jax.numpy.reshape(function(*parts, *([row[-1]] if extra else [])), (-1,))

        # Compiled once: otherwise, a function that changes at every trace would look like one that rounds badly.
        compiled = jax.jit(jax.vmap(of_inputs))

        def called(at: Any) -> Any:
            return np.asarray(compiled(at))

        def differentiated(at: Any) -> Any:
            return np.asarray(jax.jit(jax.vmap(jax.jacrev(of_inputs)))(at))[:, :, :-1]

        at = points(centre, POINTS)
        check_values(name, tape, called, at)
        if rules:
            check_derivatives(name, tape, differentiated, at[1 : 1 + DERIVATIVE_POINTS], rules)
    return tape


def _write(
    function: Callable[..., Any], name: str, sizes: list[int], arguments: list[Any], outputs: int | None
) -> tuple[dict[str, Any], set[str]]:
    """The tape of one trace, and the custom derivative rules that the function has."""
    import jax

    # A new lambda, since JAX caches traces by function.
    closed = jax.make_jaxpr(lambda *given: function(*given))(*arguments)
    shape = () if outputs is None else (outputs,)
    shapes = [tuple(int(length) for length in value.shape) for value in closed.out_avals]
    if shapes != [shape]:
        listed = " and ".join(str(found) for found in shapes)
        raise ValueError(
            f"`{name}` returns {'an array' if len(shapes) == 1 else 'arrays'} of shape {listed}, not {shape}"
        )
    if closed.out_avals[0].dtype not in (np.float64, np.int64, np.bool_):
        raise Untranslatable(f"`{name}` returns {closed.out_avals[0].dtype}, not float64: use float64 throughout")
    tape = Tape((sizes[0], sizes[1], sizes[2]), name)
    ends = np.cumsum([0, *sizes])
    inputs: list[Any] = [Symbolic(np.arange(a, b, dtype=np.int64), "f") for a, b in itertools.pairwise(ends)]
    if len(arguments) > len(sizes):
        inputs.append(Symbolic(np.array(ends[-1], dtype=np.int64), "f"))
    (result,) = interpret.run(tape, closed, inputs)
    return tape.finished([int(value) for value in lift(tape, result).ids.flat]), tape.own_rules
