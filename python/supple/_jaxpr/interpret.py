"""A jaxpr run on values of a tape: every array is written out entry by entry."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from . import linear, rules, scalars
from .arrays import MOVES, Array, Symbolic, elementwise, lift, move, settled, starts
from .tape import Tape, Untranslatable

#: Loops that run longer are not written out.
MOST_ROUNDS = 20_000

#: Functions of JAX's with rules of their own for derivatives, by their primitives: `logaddexp` and `relu`. What is written
#: in their place has the same derivatives at every point.
SMOOTH: dict[tuple[str, ...], tuple[int, Callable[..., int]]] = {
    ("max", "sub", "ne", "add", "abs", "neg", "exp", "log1p", "add", "select_n"): (2, scalars.logaddexp),
    ("max 0.0",): (1, scalars.relu),
}


def run(tape: Tape, closed: Any, arguments: list[Array]) -> list[Array]:
    """The outputs of a closed jaxpr."""
    return evaluate(tape, closed.jaxpr, list(closed.consts), arguments)


def evaluate(tape: Tape, jaxpr: Any, constants: list[Array], arguments: list[Array]) -> list[Array]:
    """The outputs of a jaxpr with these constants."""
    environment: dict[Any, Array] = {}

    def read(variable: Any) -> Array:
        return variable.val if hasattr(variable, "val") else environment[variable]

    environment.update(zip(jaxpr.constvars, constants))
    environment.update(zip(jaxpr.invars, arguments))
    for equation in jaxpr.eqns:
        results = apply(tape, equation, [read(variable) for variable in equation.invars])
        environment.update((variable, settled(tape, value)) for variable, value in zip(equation.outvars, results))
    return [read(variable) for variable in jaxpr.outvars]


def apply(tape: Tape, equation: Any, values: list[Array]) -> list[Array]:
    """The results of one equation."""
    name, parameters = equation.primitive.name, equation.params
    known = not any(isinstance(value, Symbolic) for value in values)
    if name in CONTROL:
        return CONTROL[name](tape, values, parameters)
    inner = body(parameters)
    if inner is not None and name in CALLS:
        return call(tape, name, inner, values)
    if known:
        return settle(tape, equation, values)
    result = simple(tape, name, values, parameters)
    if result is None:
        raise Untranslatable(f"primitive `{name}` in `{tape.name}`")
    return result if isinstance(result, list) else [result]


def settle(tape: Tape, equation: Any, values: list[Array]) -> list[Array]:
    """The results of an equation all of whose inputs are known: computed by JAX, or by NumPy where equivalent."""
    name, parameters = equation.primitive.name, equation.params
    if name in MOVES and all(isinstance(value, np.ndarray) for value in values):
        moved = move(name, values, parameters)
        if moved is not None:
            return [moved]
    quick = QUICK.get(name)
    if quick is not None and all(np.ndim(value) == 0 for value in values):
        dtype = equation.outvars[0].aval.dtype
        return [np.asarray(quick(*(np.asarray(value) for value in values))).astype(dtype)]
    if equation.effects:
        raise Untranslatable(f"primitive `{name}` in `{tape.name}` has effects")
    found = equation.primitive.bind(*map(_typed, values, equation.invars), **parameters)
    return list(found) if equation.primitive.multiple_results else [found]


def _typed(value: Any, variable: Any) -> Any:
    """A known value in the type that JAX would give it: the tape has only one integer type."""
    wanted = getattr(variable.aval, "dtype", None)
    if isinstance(value, np.ndarray) and wanted is not None and value.dtype != wanted:
        return value.astype(wanted)
    return value


#: What loop counters need, without a call of JAX's for each.
QUICK: dict[str, Any] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.bitwise_and,
    "or": np.bitwise_or,
    "convert_element_type": lambda a: a,
    "select_n": lambda which, *cases: cases[int(which)],
}

#: Primitives that stand for the jaxpr in their parameters.
CALLS = frozenset(
    ["pjit", "jit", "closed_call", "core_call", "xla_call", "remat", "remat2", "checkpoint", "custom_jvp_call"]
    + ["custom_vjp_call", "custom_vjp_call_jaxpr", "custom_lin", "core_closed_call"]
)


def body(parameters: dict[str, Any]) -> Any:
    """The jaxpr in the parameters of an equation, if there is one."""
    for key in ("jaxpr", "call_jaxpr", "fun_jaxpr"):
        if hasattr(parameters.get(key), "eqns"):
            return parameters[key]
    return None


def call(tape: Tape, name: str, inner: Any, values: list[Array]) -> list[Array]:
    """The results of a jaxpr within a jaxpr."""
    open_jaxpr = getattr(inner, "jaxpr", inner)
    if name.startswith("custom_"):
        count, rule = SMOOTH.get(tuple(primitives(open_jaxpr)), (0, None))
        if rule is not None and count == len(values):
            return [elementwise(partial(rule, tape), "f", *(lift(tape, value) for value in values))]
        tape.own_rules.add(name)
    return evaluate(tape, open_jaxpr, list(getattr(inner, "consts", [])), values)


def primitives(jaxpr: Any) -> Iterator[str]:
    """The names of a jaxpr's primitives, with inner jaxprs expanded in place; single primitives with their constant."""
    for equation in jaxpr.eqns:
        inner = body(equation.params)
        if inner is not None:
            yield from primitives(getattr(inner, "jaxpr", inner))
            continue
        constants = [
            str(float(variable.val)) for variable in equation.invars if np.ndim(getattr(variable, "val", [])) == 0
        ]
        yield " ".join([equation.primitive.name, *constants] if len(jaxpr.eqns) == 1 else [equation.primitive.name])


def simple(tape: Tape, name: str, values: list[Array], parameters: dict[str, Any]) -> Any:
    """The result of a primitive without a jaxpr of its own; none where it is not known."""
    if name == "select_n":
        return rules.select_n(tape, values[0], values[1:])
    if name in ("gather", "dynamic_slice", "dynamic_update_slice") or name.startswith("scatter"):
        return indexed(tape, name, values, parameters)
    arrays = [lift(tape, value) for value in values]
    first = arrays[0]
    if name in MOVES:
        moved = move(name, [array.ids for array in arrays], parameters)
        return None if moved is None else Symbolic(moved, first.kind)
    if name == "convert_element_type":
        return rules.convert(tape, first, parameters["new_dtype"])
    if name == "split":
        places = np.cumsum(parameters["sizes"])[:-1]
        return [Symbolic(part, first.kind) for part in np.split(first.ids, places, axis=int(parameters["axis"]))]
    if name == "unstack":
        return [Symbolic(part, first.kind) for part in np.moveaxis(first.ids, int(parameters["axis"]), 0)]
    if name in ("cumsum", "cumprod", "cummax", "cummin"):
        return rules.accumulate(tape, name, first, int(parameters["axis"]), bool(parameters["reverse"]))
    if name in rules.FOLDS:
        return rules.reduce(tape, name, first, tuple(int(axis) for axis in parameters["axes"]))
    if name in ("argmax", "argmin"):
        return rules.furthest(tape, name, first, int(parameters["axes"][0]))
    if name == "dot_general":
        return linear.dot_general(tape, first, arrays[1], parameters["dimension_numbers"])
    if name == "cholesky":
        return linear.cholesky(tape, first)
    if name == "lu":
        return linear.lu(tape, first)
    if name == "triangular_solve":
        return linear.triangular_solve(tape, first, arrays[1], parameters)
    if name == "optimization_barrier":
        return arrays
    return rules.entries(tape, name, arrays, parameters)


def indexed(tape: Tape, name: str, values: list[Array], parameters: dict[str, Any]) -> Symbolic:
    """Entries taken from, or put into, an array at known places; or taken along one axis at others."""
    updates = {"gather": 1, "dynamic_slice": 1, "dynamic_update_slice": 2}.get(name, 2)
    arrays = [lift(tape, value) for value in values[:updates]] if name != "scatter" else []
    if name == "dynamic_slice":
        return slice_at(tape, arrays[0], values[1:], [int(size) for size in parameters["slice_sizes"]])
    if name == "dynamic_update_slice" and not any(isinstance(value, Symbolic) for value in values[2:]):
        ids = arrays[0].ids.copy()
        ids[starts(ids, arrays[1].shape, values[2:])] = arrays[1].ids
        return Symbolic(ids, arrays[0].kind)
    if name == "gather":
        chosen = values[1]
        if not isinstance(chosen, Symbolic):
            return gather(tape, arrays[0], np.asarray(chosen), parameters)
        return gather_at(tape, arrays[0], chosen, parameters)
    if name.startswith("scatter") and not isinstance(values[1], Symbolic):
        return scatter(tape, name, values, parameters)
    raise Untranslatable(f"primitive `{name}` in `{tape.name}` at places that are not constant")


def gather(tape: Tape, array: Symbolic, places: Any, parameters: dict[str, Any]) -> Symbolic:
    """Entries of an array at known places: JAX itself takes them, of the numbers of the values."""
    from jax import lax

    numbers = np.arange(array.ids.size, dtype=np.int64).reshape(array.shape)
    taken = np.asarray(lax.gather_p.bind(numbers, places, **{**parameters, "fill_value": -1}))
    if taken.size and taken.min() < 0:
        raise Untranslatable(f"`{tape.name}` reads beyond the end of an array")
    return Symbolic(array.ids.reshape(-1)[taken], array.kind)


def slice_at(tape: Tape, array: Symbolic, firsts: list[Array], sizes: list[int]) -> Symbolic:
    """A part of an array; along axes with unknown start, a selection among all parts."""
    for axis, (first, size) in enumerate(zip(firsts, sizes)):
        rows, last = np.moveaxis(array.ids, axis, 0), array.shape[axis] - size
        cases = [Symbolic(np.moveaxis(rows[place : place + size], 0, axis), array.kind) for place in range(last + 1)]
        if not isinstance(first, Symbolic):
            array = cases[min(max(int(np.asarray(first)), 0), last)]
            continue
        array = cases[0]
        for place, case in enumerate(cases[1:], start=1):
            beyond = elementwise(partial(scalars.shifted, tape, by=0.5 - place), "b", first)
            array = elementwise(partial(scalars.choose, tape), array.kind, beyond, case, array)
    return array


def gather_at(tape: Tape, array: Symbolic, places: Symbolic, parameters: dict[str, Any]) -> Symbolic:
    """Entries of an array at places along one axis that are not known: a choice among all of them."""
    numbers = parameters["dimension_numbers"]
    if places.shape[-1] != 1:
        raise Untranslatable(f"primitive `gather` in `{tape.name}` at places that are not constant")
    axis = int(numbers.start_index_map[0])
    last = array.shape[axis] - int(parameters["slice_sizes"][axis])
    result = gather(tape, array, np.zeros(places.shape, dtype=np.int64), parameters)
    # Where the axes of the places are in the result.
    offsets = [int(axis) for axis in numbers.offset_dims]
    batch = [axis for axis in range(result.ids.ndim) if axis not in offsets]
    shape = [result.shape[axis] if axis in batch else 1 for axis in range(result.ids.ndim)]
    spread = Symbolic(places.ids[..., 0].reshape(shape), "i")
    for place in range(1, last + 1):
        case = gather(tape, array, np.full(places.shape, place, dtype=np.int64), parameters)
        # Places beyond the end count as the last one.
        beyond = elementwise(partial(scalars.shifted, tape, by=0.5 - place), "b", spread)
        result = elementwise(partial(scalars.choose, tape), array.kind, beyond, case, result)
    return result


def scatter(tape: Tape, name: str, values: list[Array], parameters: dict[str, Any]) -> Symbolic:
    """An array with entries at known places replaced by others, or changed with them."""
    from jax import lax

    combine = {"scatter": None, "scatter-add": "add", "scatter_add": "add", "scatter-mul": "mul", "scatter_mul": "mul"}
    combine |= {"scatter-sub": "sub", "scatter_sub": "sub"}
    combine |= {"scatter-min": "min", "scatter_min": "min", "scatter-max": "max", "scatter_max": "max"}
    if name not in combine:
        raise Untranslatable(f"primitive `{name}` in `{tape.name}`")
    array, places, updates = lift(tape, values[0]), np.asarray(values[1]), lift(tape, values[2])
    ids, flat = array.ids.copy(), updates.ids.reshape(-1)
    operation = combine[name]
    for number, value in enumerate(flat):
        # Where one update goes, found by JAX: one after the other, since several may go to one place.
        mark = np.zeros(updates.ids.size, dtype=np.int64)
        mark[number] = 1
        zeros = np.zeros(array.shape, dtype=np.int64)
        moved = lax.scatter_add(
            zeros, places, mark.reshape(updates.shape), parameters["dimension_numbers"], mode=parameters["mode"]
        )
        target = np.asarray(moved) > 0
        for place in zip(*np.nonzero(target)):
            before = int(ids[place])
            ids[place] = int(value) if operation is None else rules.NUMBERS[operation](tape, before, int(value))
    return Symbolic(ids, array.kind)


def scan(tape: Tape, values: list[Array], parameters: dict[str, Any]) -> list[Array]:
    """A loop of known length, written out."""
    fixed, carried = parameters["num_consts"], parameters["num_carry"]
    length, closed = int(parameters["length"]), parameters["jaxpr"]
    if length > MOST_ROUNDS:
        raise Untranslatable(f"a loop of {length} rounds in `{tape.name}`; up to {MOST_ROUNDS} are written out")
    constants, state, rows = values[:fixed], values[fixed : fixed + carried], values[fixed + carried :]
    outputs: list[list[Array]] = []
    for i in range(length - 1, -1, -1) if parameters["reverse"] else range(length):
        now = [Symbolic(row.ids[i], row.kind) if isinstance(row, Symbolic) else np.asarray(row)[i] for row in rows]
        found = run(tape, closed, [*constants, *state, *now])
        state = found[:carried]
        outputs.append(found[carried:])
    if parameters["reverse"]:
        outputs.reverse()
    return [*state, *(stack(tape, list(column)) for column in zip(*outputs))] if outputs else empty_scan(state, closed)


def empty_scan(state: list[Array], closed: Any) -> list[Array]:
    """What a loop without rounds gives."""
    ends = closed.jaxpr.outvars[len(state) :]
    return [*state, *(np.zeros((0, *end.aval.shape), dtype=end.aval.dtype) for end in ends)]


def stack(tape: Tape, column: list[Array]) -> Array:
    """Arrays as the rows of one."""
    if not any(isinstance(entry, Symbolic) for entry in column):
        return np.stack([np.asarray(entry) for entry in column])
    lifted = [lift(tape, entry) for entry in column]
    return Symbolic(np.stack([entry.ids for entry in lifted]), lifted[0].kind)


def while_(tape: Tape, values: list[Array], parameters: dict[str, Any]) -> list[Array]:
    """A loop whose end can be told without the inputs, written out."""
    of_test, of_body = parameters["cond_nconsts"], parameters["body_nconsts"]
    test, inner, state = values[:of_test], values[of_test : of_test + of_body], values[of_test + of_body :]
    for _ in itertools.repeat(None, MOST_ROUNDS + 1):
        (goes_on,) = run(tape, parameters["cond_jaxpr"], [*test, *state])
        if isinstance(goes_on, Symbolic):
            raise Untranslatable(
                f"a loop in `{tape.name}` whose end depends on states, controls or parameters (`while`)"
            )
        if not bool(np.asarray(goes_on)):
            return state
        state = run(tape, parameters["body_jaxpr"], [*inner, *state])
    raise Untranslatable(f"a loop of more than {MOST_ROUNDS} rounds in `{tape.name}`")


def cond(tape: Tape, values: list[Array], parameters: dict[str, Any]) -> list[Array]:
    """The known branch, or if it is unknown, all branches and a selection among their results."""
    which, arguments, branches = values[0], values[1:], parameters["branches"]
    if not isinstance(which, Symbolic):
        place = min(max(int(np.asarray(which)), 0), len(branches) - 1)
        return run(tape, branches[place], arguments)
    found = [run(tape, branch, arguments) for branch in branches]
    results: list[Array] = []
    for cases in zip(*found):
        lifted = [lift(tape, case) for case in cases]
        results.append(rules.select_n(tape, which, list(lifted)))
    return results


def custom_linear_solve(tape: Tape, values: list[Array], parameters: dict[str, Any]) -> list[Array]:
    """The solution of a linear equation by the steps that it is solved with."""
    lengths, solve = parameters["const_lengths"], parameters["jaxprs"].solve
    before = lengths.matvec + lengths.vecmat
    right = values[before + lengths.solve + lengths.transpose_solve :]
    return run(tape, solve, [*values[before : before + lengths.solve], *right])


CONTROL = {"scan": scan, "while": while_, "cond": cond, "custom_linear_solve": custom_linear_solve}
