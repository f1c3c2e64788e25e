"""Arrays of values of a tape, and the primitives that only move their entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .tape import Tape, Untranslatable

Ids = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Symbolic:
    """An array whose entries are values of a tape.

    Entries of `kind` "f" are numbers, those of "i" are integers held as numbers, and those of "b" are conditions, which
    hold where the value is above 0.
    """

    ids: Ids
    kind: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""
        return self.ids.shape


#: An array that is known, or a symbolic one.
Array = Any


def kind_of(dtype: Any) -> str:
    """The kind of an array's entries: "f", "i" or "b"; others as NumPy names them."""
    kind = str(np.dtype(dtype).kind)
    return "i" if kind == "u" else kind


def lift(tape: Tape, array: Array) -> Symbolic:
    """An array as a symbolic one."""
    if isinstance(array, Symbolic):
        return array
    known = np.asarray(array)
    kind = kind_of(known.dtype)
    if kind not in ("f", "i", "b"):
        raise Untranslatable(f"`{tape.name}` has an array of {known.dtype}")
    ids = np.empty(known.shape, dtype=np.int64)
    for place, value in np.ndenumerate(known):
        ids[place] = tape.constant(float(value))
    return Symbolic(ids, kind)


def elementwise(function: Callable[..., int], kind: str, *arrays: Symbolic) -> Symbolic:
    """A function of scalars at every entry of arrays, which are broadcast."""
    spread = np.broadcast_arrays(*(array.ids for array in arrays))
    ids = np.empty(spread[0].shape, dtype=np.int64)
    for place in np.ndindex(ids.shape):
        ids[place] = function(*(int(array[place]) for array in spread))
    return Symbolic(ids, kind)


def settled(tape: Tape, array: Array) -> Array:
    """The array itself, or as a known one where it is one after all."""
    if not isinstance(array, Symbolic):
        return array
    known = [tape.known(int(value)) for value in array.ids.flat]
    numbers = [number for number in known if number is not None]
    if len(numbers) < len(known):
        return array
    if array.kind == "b":
        return np.array([number > 0.0 for number in numbers]).reshape(array.shape)
    dtype = np.int64 if array.kind == "i" else np.float64
    return np.array(numbers).astype(dtype).reshape(array.shape)


def broadcast_in_dim(x: Any, shape: tuple[int, ...], broadcast_dimensions: tuple[int, ...]) -> Any:
    """`x` with its axes at the given places of a larger shape."""
    middle = [1] * len(shape)
    for axis, place in enumerate(broadcast_dimensions):
        middle[int(place)] = x.shape[axis]
    return np.broadcast_to(x.reshape(middle), shape)


def slice_(x: Any, start: Any, limit: Any, strides: Any) -> Any:
    """A slice with fixed bounds."""
    steps = strides if strides is not None else [1] * x.ndim
    return x[tuple(slice(int(a), int(b), int(step)) for a, b, step in zip(start, limit, steps))]


def starts(x: Any, sizes: Any, indices: list[Any]) -> tuple[slice, ...]:
    """The part of `x` of these sizes that starts at the indices, moved inside as JAX does."""
    firsts = [min(max(int(index), 0), x.shape[axis] - int(sizes[axis])) for axis, index in enumerate(indices)]
    return tuple(slice(first, first + int(size)) for first, size in zip(firsts, sizes))


def pad(x: Any, filler: Any, config: Any) -> Any:
    """`x` with so much of the filler before, after and between its entries; negative paddings cut."""
    for axis, (low, high, inside) in enumerate(config):
        count = x.shape[axis]
        length = max(count + (count - 1) * int(inside), 0) if count else 0
        wide = np.full(x.shape[:axis] + (length,) + x.shape[axis + 1 :], filler, dtype=x.dtype)
        spread = np.moveaxis(wide, axis, 0)
        spread[:: int(inside) + 1] = np.moveaxis(x, axis, 0)
        low, high = int(low), int(high)
        kept = spread[max(-low, 0) : length - max(-high, 0)]
        ends = [np.full((max(size, 0),) + kept.shape[1:], filler, dtype=x.dtype) for size in (low, high)]
        x = np.moveaxis(np.concatenate([ends[0], kept, ends[1]]), 0, axis)
    return x


def move(primitive: str, arrays: list[Any], parameters: dict[str, Any]) -> Any:
    """The result of a primitive that only moves entries; none where it is another."""
    x = arrays[0]
    if primitive == "reshape":
        return None if parameters.get("dimensions") is not None else x.reshape(parameters["new_sizes"])
    if primitive == "broadcast_in_dim":
        return broadcast_in_dim(x, parameters["shape"], parameters["broadcast_dimensions"])
    if primitive == "squeeze":
        return np.squeeze(x, axis=tuple(int(axis) for axis in parameters["dimensions"]))
    if primitive == "expand_dims":
        return np.expand_dims(x, tuple(int(axis) for axis in parameters["dimensions"]))
    if primitive == "transpose":
        return np.transpose(x, parameters["permutation"])
    if primitive == "rev":
        return np.flip(x, axis=tuple(int(axis) for axis in parameters["dimensions"]))
    if primitive == "slice":
        return slice_(x, parameters["start_indices"], parameters["limit_indices"], parameters["strides"])
    if primitive == "concatenate":
        return np.concatenate(arrays, axis=int(parameters["dimension"]))
    if primitive == "stack":
        return np.stack(arrays, axis=int(parameters["axis"]))
    if primitive == "pad":
        return pad(x, arrays[1].item(), parameters["padding_config"])
    if primitive == "tile":
        return np.tile(x, parameters["reps"])
    return None


#: What `move` knows.
MOVES = frozenset(
    ["reshape", "broadcast_in_dim", "squeeze", "expand_dims", "transpose", "rev", "slice", "concatenate", "stack"]
    + ["pad", "tile"]
)
