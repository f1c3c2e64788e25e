"""Primitives that work entry by entry, and reductions, as instructions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from . import scalars
from .arrays import Array, Symbolic, elementwise, kind_of, lift
from .tape import Tape, Untranslatable


def instruction(name: str) -> Callable[..., int]:
    """The function of scalars that is one instruction."""

    def emit(tape: Tape, *operands: int) -> int:
        return tape.emit(name, *operands)

    return emit


def _swapped(function: Callable[[Tape, int, int], int]) -> Callable[[Tape, int, int], int]:
    return lambda tape, a, b: function(tape, b, a)


def _inverse_root(tape: Tape, a: int) -> int:
    return tape.emit("recip", tape.emit("sqrt", a))


def _power_of_two(tape: Tape, a: int) -> int:
    return tape.emit("exp", scalars.scaled(tape, float(np.log(2.0)), a))


def _arc_tangent(tape: Tape, a: int) -> int:
    return tape.emit("atan2", a, tape.constant(1.0))


#: Functions of numbers, by the name of their primitive; integers only where `EXACT` says so.
NUMBERS: dict[str, Callable[..., int]] = {
    "add": instruction("add"),
    "add_any": instruction("add"),
    "sub": instruction("sub"),
    "mul": instruction("mul"),
    "div": instruction("div"),
    "neg": instruction("neg"),
    "sin": instruction("sin"),
    "cos": instruction("cos"),
    "tan": scalars.tan,
    "tanh": instruction("tanh"),
    "sinh": scalars.sinh,
    "cosh": scalars.cosh,
    "asin": scalars.asin,
    "acos": scalars.acos,
    "atan": _arc_tangent,
    "atan2": instruction("atan2"),
    "asinh": scalars.asinh,
    "acosh": scalars.acosh,
    "atanh": scalars.atanh,
    "exp": instruction("exp"),
    "exp2": _power_of_two,
    "expm1": instruction("exp_m1"),
    "log": instruction("ln"),
    "log1p": instruction("ln_1p"),
    "logistic": scalars.logistic,
    "sqrt": instruction("sqrt"),
    "rsqrt": _inverse_root,
    "cbrt": scalars.cbrt,
    "square": lambda tape, a: tape.emit("mul", a, a),
    "abs": scalars.absolute,
    "sign": scalars.sign,
    "max": scalars.maximum,
    "min": scalars.minimum,
    "pow": scalars.general_power,
    "clamp": scalars.clamp,
    "copy": lambda tape, a: a,
    "copy_p": lambda tape, a: a,
    "stop_gradient": lambda tape, a: a,
    "device_put": lambda tape, a: a,
    "optimization_barrier": lambda tape, a: a,
    "sharding_constraint": lambda tape, a: a,
    "reduce_precision": lambda tape, a: a,
    "real": lambda tape, a: a,
}

#: Those that keep integers exact.
EXACT = frozenset(
    ["add", "add_any", "sub", "mul", "neg", "square", "abs", "sign", "max", "min", "clamp"]
    + ["copy", "copy_p", "stop_gradient", "device_put", "optimization_barrier", "sharding_constraint"]
)

COMPARISONS: dict[str, Callable[[Tape, int, int], int]] = {
    "gt": scalars.greater,
    "lt": _swapped(scalars.greater),
    "ge": scalars.at_least,
    "le": _swapped(scalars.at_least),
    "eq": scalars.equal,
    "ne": lambda tape, a, b: scalars.negated(tape, scalars.equal(tape, a, b)),
}

CONDITIONS: dict[str, Callable[..., int]] = {
    "and": scalars.both,
    "or": scalars.either,
    "xor": scalars.differs,
    "ne": scalars.differs,
    "eq": lambda tape, a, b: scalars.negated(tape, scalars.differs(tape, a, b)),
    "not": scalars.negated,
    "max": scalars.either,
    "min": scalars.both,
}


def entries(tape: Tape, name: str, arrays: list[Symbolic], parameters: dict[str, Any]) -> Symbolic | None:
    """The result of a primitive that works entry by entry; none where it is another."""
    kind = arrays[0].kind
    if name in ("gt", "lt", "ge", "le", "eq", "ne") and kind != "b":
        return elementwise(partial(COMPARISONS[name], tape), "b", *arrays)
    if kind == "b" and name in CONDITIONS:
        return elementwise(partial(CONDITIONS[name], tape), "b", *arrays)
    if name == "is_finite":
        return elementwise(partial(scalars.finite, tape), "b", *arrays)
    if name == "integer_pow":
        return elementwise(lambda a: scalars.power(tape, a, int(parameters["y"])), kind, *arrays)
    if name == "reduce_precision" and (parameters["exponent_bits"], parameters["mantissa_bits"]) != (11, 52):
        raise Untranslatable(f"`{tape.name}` rounds numbers (`reduce_precision`)")
    if name in NUMBERS and (kind == "f" or kind == "i" and name in EXACT):
        if name == "stop_gradient":
            tape.own_rules.add(name)
        return elementwise(partial(NUMBERS[name], tape), kind, *arrays)
    return None


def convert(tape: Tape, array: Symbolic, dtype: Any) -> Symbolic:
    """Entries as those of another type."""
    kind = kind_of(dtype)
    if kind == "f" and np.dtype(dtype) != np.float64:
        raise Untranslatable(
            f"`{tape.name}` turns numbers into {np.dtype(dtype)}: compute in float64, which jax_enable_x64 allows"
        )
    if kind == array.kind or (array.kind, kind) == ("i", "f"):
        return Symbolic(array.ids, kind)
    if array.kind == "b" and kind in ("f", "i"):
        return elementwise(partial(scalars.truth, tape), kind, array)
    if kind == "b":
        zero = tape.constant(0.0)
        return elementwise(lambda a: scalars.negated(tape, scalars.equal(tape, a, zero)), "b", array)
    raise Untranslatable(f"`{tape.name}` rounds numbers that are not constant to {np.dtype(dtype)}")


def select_n(tape: Tape, which: Array, cases: list[Array]) -> Symbolic:
    """At each entry the case with the number that `which` says."""
    lifted = [lift(tape, case) for case in cases]
    if not isinstance(which, Symbolic):
        chosen = np.broadcast_to(np.asarray(which).astype(np.int64), lifted[0].shape)
        stacked = np.stack([case.ids for case in lifted])
        return Symbolic(np.take_along_axis(stacked, chosen[None], axis=0)[0], lifted[0].kind)
    if which.kind == "b":
        return elementwise(partial(scalars.choose, tape), lifted[0].kind, which, lifted[1], lifted[0])
    result = lifted[0]
    for number, case in enumerate(lifted[1:]):
        above = partial(scalars.shifted, tape, by=-number - 0.5)
        condition = elementwise(above, "b", which)
        result = elementwise(partial(scalars.choose, tape), result.kind, condition, case, result)
    return result


#: What reductions and running sums do with two numbers, or with two conditions.
FOLDS: dict[str, str] = {
    "reduce_sum": "add",
    "reduce_prod": "mul",
    "reduce_max": "max",
    "reduce_min": "min",
    "reduce_and": "and",
    "reduce_or": "or",
    "reduce_xor": "xor",
    "cumsum": "add",
    "cumprod": "mul",
    "cummax": "max",
    "cummin": "min",
}

#: What nothing comes to.
EMPTY = {"add": 0.0, "mul": 1.0, "max": -np.inf, "min": np.inf, "and": 1.0, "or": 0.0, "xor": 0.0}


def reduce(tape: Tape, name: str, array: Symbolic, axes: tuple[int, ...]) -> Symbolic:
    """A reduction over axes."""
    operation = FOLDS[name]
    table = CONDITIONS if array.kind == "b" else NUMBERS
    if operation not in table:
        raise Untranslatable(f"primitive `{name}` of conditions in `{tape.name}`")
    function = table[operation]
    last = np.moveaxis(array.ids, axes, range(-len(axes), 0)) if axes else array.ids[..., None]
    kept = last.shape[: array.ids.ndim - len(axes)]
    flat = last.reshape(kept + (-1,))
    ids = np.empty(kept, dtype=np.int64)
    for place in np.ndindex(kept):
        row = [int(value) for value in flat[place]]
        total = row[0] if row else tape.constant(EMPTY[operation])
        for value in row[1:]:
            total = function(tape, total, value)
        ids[place] = total
    return Symbolic(ids, array.kind)


def furthest(tape: Tape, name: str, array: Symbolic, axis: int) -> Symbolic:
    """The places of the largest (`argmax`) or smallest (`argmin`) entries along an axis, the first ones at ties."""
    rows = np.moveaxis(array.ids, axis, 0)
    ids = np.empty(rows.shape[1:], dtype=np.int64)
    for place in np.ndindex(ids.shape):
        column = [int(row[place]) for row in rows]
        if array.kind == "b":
            column = [scalars.truth(tape, value) for value in column]
        best, found = column[0], tape.constant(0.0)
        for number, value in enumerate(column[1:], start=1):
            wins = scalars.greater(tape, value, best) if name == "argmax" else scalars.greater(tape, best, value)
            best = scalars.choose(tape, wins, value, best)
            found = scalars.choose(tape, wins, tape.constant(float(number)), found)
        ids[place] = found
    return Symbolic(ids, "i")


def accumulate(tape: Tape, name: str, array: Symbolic, axis: int, backwards: bool) -> Symbolic:
    """A running sum, product, maximum or minimum along an axis."""
    function = NUMBERS[FOLDS[name]]
    rows = np.moveaxis(array.ids, axis, 0).copy()
    order = range(len(rows) - 2, -1, -1) if backwards else range(1, len(rows))
    for i in order:
        before = i + 1 if backwards else i - 1
        for place in np.ndindex(rows.shape[1:]):
            rows[(i, *place)] = function(tape, int(rows[(before, *place)]), int(rows[(i, *place)]))
    return Symbolic(np.moveaxis(rows, 0, axis), array.kind)
