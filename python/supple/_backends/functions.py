"""User-supplied functions with their dimensions, and their transfer to other processes."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import check_unmasked
from .._records import Array
from .._source import of_function
from ..errors import UsageError

__all__ = ["Functions", "Values", "checked", "pack", "unpack"]


class Values(Mapping[str, Any]):
    """Parameters by name: ``p["k1"]``, or ``p.k1`` where the name is an identifier."""

    __slots__ = ("_names", "_phi")

    def __init__(self, names: tuple[str, ...], phi: Any) -> None:
        self._names = names
        self._phi = phi

    def __getitem__(self, name: str) -> Any:
        try:
            return self._phi[self._names.index(name)]
        except ValueError:
            raise KeyError(self._unknown(name)) from None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._names:
            raise AttributeError(self._unknown(name))
        return self._phi[self._names.index(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def _unknown(self, name: str) -> str:
        valid = ", ".join(f"`{other}`" for other in self._names) or "none"
        return f"no parameter `{name}`; valid: {valid}"


@dataclass(frozen=True)
class Functions:
    """The parts of a model.

    Attributes:
        step: ``f(x, u, p)``, the next state (n,).
        observe: ``g(x, p)``, the measurement (p,).
        cost: ``l(x, u, p)``, a number.
        final_cost: ``l_N(x, p)``, a number.
        states: n.
        controls: m.
        measurements: p.
        parameters: Names of all parameters.
    """

    step: Callable[..., Any]
    observe: Callable[..., Any]
    cost: Callable[..., Any]
    final_cost: Callable[..., Any]
    states: int
    controls: int
    measurements: int
    parameters: tuple[str, ...]

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """What each function returns at one point."""
        return {"step": (self.states,), "observe": (self.measurements,), "cost": (), "final_cost": ()}

    def has_control(self, name: str) -> bool:
        """Whether a function takes ``u``."""
        return name in ("step", "cost")

    def call(self, name: str, x: Any, u: Any, phi: Any) -> Any:
        """A function at points as they are; ``u`` is left out where it takes none."""
        values = Values(self.parameters, phi)
        return getattr(self, name)(x, u, values) if self.has_control(name) else getattr(self, name)(x, values)

    def batch(self, name: str, x: Array, u: Array, phi: Array) -> Array:
        """A function at B points, checked: (B, ...).

        Raises:
            UsageError: Where it returns another type or shape.
        """
        with np.errstate(all="ignore"):
            return checked(f"`{name}`", self.call(name, x, u, phi), (len(x), *self.shapes[name]))

    def source(self) -> str:
        """The code of all functions, which says what the model is."""
        return "\n".join(of_function(getattr(self, name)) for name in self.shapes)

    def __reduce__(self) -> tuple[Any, ...]:
        functions = [(name, pack(getattr(self, name), f"`{name}`")) for name in self.shapes]
        return _unpacked, (functions, self.states, self.controls, self.measurements, self.parameters)


def _unpacked(
    packed: list[tuple[str, bytes]], states: int, controls: int, measurements: int, parameters: tuple[str, ...]
) -> Functions:
    step, observe, cost, final_cost = (unpack(content, f"`{name}`") for name, content in packed)
    return Functions(step, observe, cost, final_cost, states, controls, measurements, parameters)


def checked(what: str, value: Any, shape: tuple[int, ...]) -> Array:
    """What a function returned, as an array of float64 of this shape.

    Raises:
        UsageError: Where it is of another type or shape.
    """
    check_unmasked(what, value)
    try:
        array = np.asarray(value)
    except Exception as error:
        raise UsageError(f"{what} returned {type(value).__name__}, which is no array of numbers: {error}") from error
    if array.dtype.kind in "iub":
        if array.ndim and len(array) > 1 and (array != array[:1]).any():
            raise UsageError(f"{what} returned {array.dtype}, which has no derivatives: it must return float64")
        array = array.astype(np.float64)
    if array.dtype != np.float64:
        if value is None:
            raise UsageError(f"{what} returned None: it must return an array of float64; is `return` missing?")
        found = type(value).__name__ if array.dtype == object else f"an array of {array.dtype}"
        raise UsageError(
            f"{what} returned {found}: it must return float64. Use np.float64 throughout; arrays made with dtype=np.float32 "
            "make all that they touch less exact"
        )
    if array.shape != shape:
        batch = shape[:1]
        raise UsageError(
            f"{what} returned an array of the shape {array.shape}: for a batch of {batch[0]} points it must have the shape "
            f"{shape}. Points are along the first axis, numbers of a point along the last: write x[..., 0], and "
            "np.stack([...], axis=-1)"
        )
    return np.ascontiguousarray(array)


def pack(function: Callable[..., Any], name: str) -> bytes:
    """A function as bytes: by its name in its module, or with cloudpickle where it has none.

    Raises:
        UsageError: Where neither works.
    """
    script = getattr(function, "__module__", None) == "__main__"
    try:
        import cloudpickle
    except ImportError:
        cloudpickle = None
    try:
        if script and cloudpickle is not None:
            # The module `__main__` differs in another process.
            return bytes(cloudpickle.dumps(function))
        return pickle.dumps(function)
    except Exception as error:
        if cloudpickle is None:
            raise UsageError(
                f"{name}, {_name(function)}, cannot be sent to another process: {error}. Define it with `def` at the top "
                "level of a module, or install cloudpickle, which sends lambdas, functions inside functions and those of "
                "notebooks too"
            ) from error
    try:
        return bytes(cloudpickle.dumps(function))
    except Exception as error:
        raise UsageError(
            f"{name}, {_name(function)}, cannot be sent to another process: {error}. It refers to something that belongs "
            "to this process, such as an open file, a lock or a generator: make that inside of the function, or define the "
            "function at the top level of a module that makes it"
        ) from error


def unpack(content: bytes, name: str) -> Callable[..., Any]:
    """The function of these bytes.

    Raises:
        UsageError: Where its module or cloudpickle is missing here.
    """
    try:
        function: Callable[..., Any] = pickle.loads(content)
    except (ImportError, AttributeError) as error:
        raise UsageError(
            f"{name} cannot be read in this process: {error}. Install the module that defines it here, cloudpickle included, "
            "or define the function in a module that both processes can import"
        ) from error
    return function


def _name(function: object) -> str:
    return f"`{getattr(function, '__qualname__', type(function).__name__)}`"
