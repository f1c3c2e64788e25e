"""Derivatives that the user gives, in place of those of a backend."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._records import Array
from .._source import of_function
from ..errors import UsageError
from .functions import Functions, Values, pack, unpack

__all__ = ["Given", "Overridden"]

Shape = tuple[int | str, ...]


class Given:
    """Some of the protocol's derivatives, written for batches and for parameters by name.

    Each is an attribute that takes ``phi`` and gives checked arrays; ``None`` where it is not given.
    """

    def __init__(self, functions: Mapping[str, Callable[..., Any]], of: Functions) -> None:
        self._functions = dict(functions)
        self._of = of
        self._shapes = self.shapes(of.states, of.controls, of.measurements, len(of.parameters))
        for name, function in self._functions.items():
            if not callable(function):
                raise UsageError(f"derivatives: `{name}` is {type(function).__name__}, which is not a function")

    @staticmethod
    def shapes(n: int, m: int, p: int, count: int) -> dict[str, tuple[Shape, ...]]:
        """What each derivative returns; ``B`` points."""
        z = n + m
        point, by_x = (("B", z), (count,)), (("B", n), (count,))
        return {
            "dynamics_jacobians": (("B", n, z),),
            "measurement_jacobians": (("B", p, n),),
            "stage_quadratics": (("B", z, z), ("B", z)),
            "final_quadratics": (("B", n, n), ("B", n)),
            "dynamics_curvature": (("B", z, z),),
            "contract_dynamics": point,
            "contract_measurements": by_x,
            "contract_stage_costs": point,
            "contract_final_costs": by_x,
            "stage_parameters": ((count,),),
            "final_parameters": ((count,),),
            "stage_parameters_along": ((count,),),
            "final_parameters_along": ((count,),),
        }

    @property
    def names(self) -> list[str]:
        """Names of those that are given."""
        return list(self._functions)

    def __getattr__(self, name: str) -> Callable[..., Any] | None:
        if name.startswith("_"):
            raise AttributeError(name)
        function = self._functions.get(name)
        if function is None:
            return None
        return lambda *arguments: self._call(name, arguments)

    def _call(self, name: str, arguments: tuple[Any, ...]) -> Any:
        *points, phi = arguments
        with np.errstate(all="ignore"):
            found = self._functions[name](*points, Values(self._of.parameters, phi))
        shapes = self._shapes[name]
        parts = found if len(shapes) > 1 else (found,)
        if not isinstance(parts, (tuple, list)) or len(parts) != len(shapes):
            raise UsageError(
                f"derivatives: `{name}` returned {type(found).__name__}: it must return a tuple of {len(shapes)} arrays"
            )
        checked = tuple(_checked(name, part, shape, len(points[0])) for part, shape in zip(parts, shapes))
        return checked if len(shapes) > 1 else checked[0]

    def source(self) -> str:
        """The code of the functions."""
        return "\n".join(f"{name}:\n{of_function(function)}" for name, function in self._functions.items())

    def __reduce__(self) -> tuple[Any, ...]:
        packed = [(name, pack(function, f"derivatives: `{name}`")) for name, function in self._functions.items()]
        return _unpacked, (packed, self._of)


def _unpacked(packed: list[tuple[str, bytes]], of: Functions) -> Given:
    return Given({name: unpack(content, f"derivatives: `{name}`") for name, content in packed}, of)


def _checked(name: str, value: Any, shape: Shape, count: int) -> Array:
    wanted = tuple(count if length == "B" else int(length) for length in shape)
    array = np.asarray(value)
    if array.dtype != np.float64 or array.shape != wanted:
        raise UsageError(
            f"derivatives: `{name}` returned an array of {array.dtype} of the shape {array.shape}: for {count} points it must "
            f"return float64 of the shape {wanted}"
        )
    return np.ascontiguousarray(array)


class Overridden:
    """A backend with some derivatives from elsewhere."""

    def __init__(self, backend: Any, given: Given) -> None:
        self.backend = backend
        self.given = given

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("backend", "given"):
            raise AttributeError(name)
        found = getattr(self.given, name) if not name.startswith("_") else None
        return getattr(self.backend, name) if found is None else found

    @property
    def calls_jax(self) -> bool:
        """Whether JAX compiles its other functions."""
        return bool(getattr(self.backend, "calls_jax", False))

    def source(self) -> str:
        """The code of both."""
        return f"{self.backend.source()}\n{self.given.source()}"

    def __reduce__(self) -> tuple[Any, ...]:
        return Overridden, (self.backend, self.given)
