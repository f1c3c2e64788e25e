"""Parameters of tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from ._asked import check_choice, finite

__all__ = ["CatalogueEntry", "Parameter"]


@dataclass(frozen=True)
class CatalogueEntry:
    """An available value of a parameter.

    Attributes:
        value: The value, in the unit of the parameter.
        price: Its purchase price, in any currency; ``None`` if it is not given.
        name: The manufacturer's name for it.
    """

    value: float
    price: float | None = None
    name: str | None = None


@dataclass(frozen=True)
class Parameter:
    """A named number that designs and studies vary.

    Attributes:
        initial: The initial value.
        bounds: Least and greatest value.
        scale: How the design search varies it: by differences, ``linear``, or by ratios, ``log``.
        unit: Its unit, for people.
        role: What may change it: the ``design`` search, or only the user, for a ``study``.
        catalogue: The available values, numbers or entries; default: every value within the bounds.
        price: The price of a value, in units of the budget: ``{"inverse": c}``, ``{"linear": c}``, ``{"log": {..}}`` or
            ``{"power": {..}}``, as in task files; default: free.
    """

    initial: float
    bounds: tuple[float, float]
    scale: Literal["linear", "log"] = "linear"
    unit: str = ""
    role: Literal["design", "study"] = "design"
    catalogue: Sequence[CatalogueEntry | float] = ()
    price: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        finite("initial", self.initial)
        for index, bound in enumerate(self.bounds):
            finite(f"bounds[{index}]", bound)
        check_choice("scale", [self.scale], ["linear", "log"])
        check_choice("role", [self.role], ["design", "study"])
