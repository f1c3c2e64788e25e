"""Comparison of tapes with the functions that they were made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from .tape import VALUE, Untranslatable, evaluate

Numbers = npt.NDArray[np.float64]


class Mistranslated(Exception):
    """A tape that does not give what its function gives, or a function that does not always give the same."""


#: At how many points values are compared, and derivatives.
POINTS, DERIVATIVE_POINTS = 32, 6

#: How far values may be off, relative to the largest of the output; and derivatives.
TOLERANCE, DERIVATIVE_TOLERANCE = 1e-12, 1e-8


def points(centre: Numbers, count: int, spread: float = 0.1) -> Numbers:
    """`centre` itself and random points near it, the same in every run: points x inputs."""
    random = np.random.default_rng(20_240_229)
    scale = spread * np.where(centre == 0.0, 1.0, np.abs(centre))
    near = centre + scale * random.uniform(-1.0, 1.0, size=(count - 1, len(centre)))
    return np.concatenate([centre[None], near])


def check_values(name: str, tape: dict[str, Any], function: Callable[[Numbers], Numbers], at: Numbers) -> None:
    """Compares the outputs of a tape with those of its function (points x inputs to points x outputs).

    What the function itself makes of the rounding of its inputs is allowed on top.

    Raises:
        Mistranslated: where an output is off.
    """
    found, expected = evaluate(tape, at), function(at)
    nudged = function(at * (1.0 + 4.0 * np.finfo(float).eps))
    finite = np.where(np.isfinite(expected), np.abs(expected), 0.0)
    with np.errstate(invalid="ignore"):
        allowed = TOLERANCE * finite.max(axis=0, initial=1e-300) + 100.0 * np.abs(nudged - expected)
        allowed = np.where(np.isfinite(allowed), allowed, 0.0)
        same = (found == expected) | (np.isnan(found) & np.isnan(expected)) | (np.abs(found - expected) <= allowed)
    if not same.all():
        point, output = (int(place[0]) for place in np.nonzero(~same))
        raise Mistranslated(
            f"`{name}` written out gives {found[point, output]} for entry {output + 1} where JAX gives "
            f"{expected[point, output]}: is it the same at every call, and free of effects?"
        )


def check_derivatives(
    name: str, tape: dict[str, Any], jacobian: Callable[[Numbers], Numbers], at: Numbers, rules: set[str]
) -> None:
    """Compares the derivatives of a tape with those of JAX (points x outputs x inputs).

    Raises:
        Untranslatable: where they differ, since the function has rules of its own for derivatives.
    """
    found, expected = jacobians(tape, at), jacobian(at)
    sizes = np.where(np.isfinite(expected), np.abs(expected), 0.0)
    # Outputs that hardly depend on the inputs are scaled by those that do.
    scale = np.maximum(sizes.max(axis=(0, 2), initial=1e-300), 1e-3 * sizes.max(initial=0.0))
    with np.errstate(invalid="ignore"):
        off = np.abs(found - expected) > DERIVATIVE_TOLERANCE * scale[None, :, None]
    if off.any():
        listed = ", ".join(f"`{rule}`" for rule in sorted(rules))
        raise Untranslatable(
            f"derivatives of `{name}` by rules of its own ({listed}), other than those of what it computes"
        )


def jacobians(tape: dict[str, Any], at: Numbers) -> Numbers:
    """Derivatives of a tape's outputs by all inputs but the time step, in forward mode: points x outputs x inputs."""
    count, inputs = at.shape
    values: list[Any] = [at[:, i] for i in range(inputs)]
    rates: list[Any] = [np.zeros((count, inputs)) for _ in range(inputs)]
    for i in range(inputs):
        rates[i][:, i] = 1.0
    for constant in tape["constants"]:
        values.append(np.full(count, constant))
        rates.append(np.zeros((count, inputs)))
    with np.errstate(all="ignore"):
        for instruction in tape["instructions"]:
            ((operation, operands),) = instruction.items()
            operands = operands if isinstance(operands, list) else [operands]
            arguments = [values[operand] for operand in operands]
            values.append(VALUE[operation](*arguments))
            rates.append(_rate(operation, arguments, [rates[operand] for operand in operands], values[-1]))
    columns = [rates[output] for output in tape["outputs"]]
    return np.stack(columns, axis=1)[:, :, : inputs - 1]


def _rate(operation: str, values: list[Any], rates: list[Any], result: Any) -> Any:
    """The derivatives of one result."""
    if operation == "select":
        return np.where(values[0][:, None] > 0.0, rates[1], rates[2])
    slopes = SLOPES[operation](*values, result)
    return sum(np.asarray(slope).reshape(-1, 1) * rate for slope, rate in zip(slopes, rates))


#: The derivatives of instructions by their operands, given these and the result.
SLOPES: dict[str, Callable[..., tuple[Any, ...]]] = {
    "add": lambda a, b, r: (1.0, 1.0),
    "sub": lambda a, b, r: (1.0, -1.0),
    "mul": lambda a, b, r: (b, a),
    "div": lambda a, b, r: (1.0 / b, -r / b),
    "neg": lambda a, r: (-1.0,),
    "recip": lambda a, r: (-r * r,),
    "sqrt": lambda a, r: (0.5 / r,),
    "sin": lambda a, r: (np.cos(a),),
    "cos": lambda a, r: (-np.sin(a),),
    "exp": lambda a, r: (r,),
    "ln": lambda a, r: (1.0 / a,),
    "tanh": lambda a, r: (1.0 - r * r,),
    "exp_m1": lambda a, r: (r + 1.0,),
    "ln_1p": lambda a, r: (1.0 / (1.0 + a),),
    "atan2": lambda a, b, r: (b / (a * a + b * b), -a / (a * a + b * b)),
}
