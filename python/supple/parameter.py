"""Parameters of tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

__all__ = ["CatalogueEntry", "Parameter"]


@dataclass(frozen=True)
class CatalogueEntry:
    """A value of a parameter that can be had.

    Attributes:
        value: The value, in the unit of the parameter.
        price: What it costs to buy, in any currency; ``None`` where it is not told.
        name: What its maker calls it.
    """

    value: float
    price: float | None = None
    name: str | None = None


@dataclass(frozen=True)
class Parameter:
    """A named number that designs and studies change.

    Attributes:
        initial: The value that it starts from.
        bounds: Least and greatest value.
        scale: How the design search moves it: by differences, ``linear``, or by ratios, ``log``.
        unit: Its unit, for people.
        role: Who may change it: the ``design`` search, or only the user, for a ``study``.
        catalogue: The values that can be had, numbers or entries; every value within the bounds where left out.
        price: What a value costs, in units of the budget: ``{"inverse": c}``, ``{"linear": c}``, ``{"log": {..}}`` or
            ``{"power": {..}}``, as in task files; nothing where left out.
    """

    initial: float
    bounds: tuple[float, float]
    scale: Literal["linear", "log"] = "linear"
    unit: str = ""
    role: Literal["design", "study"] = "design"
    catalogue: Sequence[CatalogueEntry | float] = ()
    price: Mapping[str, Any] | None = None
