"""Own models written in JAX, as tapes that the engine differentiates and compiles itself: no Python is called after this."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

from .._jaxpr import translate
from .._records import Array

__all__ = ["Channel", "record"]

#: Name and unit of a state, control or measurement.
Channel = tuple[str, str]


def record(
    step: Callable[..., Any],
    observe: Callable[..., Any],
    cost: Callable[..., Any] | None,
    final_cost: Callable[..., Any] | None,
    *,
    near: tuple[Array, Array, Array],
    channels: tuple[Sequence[Channel], Sequence[Channel], Sequence[Channel]],
    time_step: float | str,
) -> dict[str, Any]:
    """The description of a system whose functions are written in JAX, as ``NativeTask.own`` takes it.

    Args:
        step: ``f(x, u, phi)``, (n,).
        observe: ``g(x, phi)``, (p,).
        cost: ``l(x, u, phi)``, a number; none where there is no cost in stages.
        final_cost: ``l_N(x, phi)``, a number; none where there is none.
        near: A state (n,), control (m,) and parameters (P,) near which the tapes are compared with the functions.
        channels: Names and units of states, controls and measurements.
        time_step: Time step, s: a number, or a parameter's name.

    Raises:
        Untranslatable: Where a function does something that cannot be written as a tape; it may still be called.
        Mistranslated: Where a function does not give the same numbers at every call.
        ValueError: Where a function returns another shape.
    """
    x, u, phi = near
    states, controls, measurements = ([{"name": name, "unit": unit} for name, unit in list_] for list_ in channels)

    def without_control(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda x, u, phi: function(x, phi)

    model = {
        "channels": {"states": states, "controls": controls, "measurements": measurements},
        "parameters": len(phi),
        "step": translate(step, "step", x, u, phi, len(x)),
        "observe": translate(without_control(observe), "observe", x, u, phi, len(measurements)),
        "cost": None if cost is None else translate(cost, "cost", x, u, phi, None),
        "final_cost": None,
    }
    if final_cost is not None:
        model["final_cost"] = translate(without_control(final_cost), "final_cost", x, u, phi, None)
    return {"kind": "recorded", "model": json.dumps(model), "time_step": time_step}
