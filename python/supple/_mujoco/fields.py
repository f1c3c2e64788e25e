"""Parameters of a MuJoCo model: the numbers in the model that they set."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from .._records import Array
from ..errors import UsageError
from ..task import Parameter
from .names import actuator_names, find, name_of, sensor_names, unknown

__all__ = ["Field", "Target", "changed", "read"]

#: Kinds of objects by how the names of their fields begin.
_KINDS = {
    "body_": mujoco.mjtObj.mjOBJ_BODY,
    "geom_": mujoco.mjtObj.mjOBJ_GEOM,
    "site_": mujoco.mjtObj.mjOBJ_SITE,
    "tendon_": mujoco.mjtObj.mjOBJ_TENDON,
    "eq_": mujoco.mjtObj.mjOBJ_EQUALITY,
    "pair_": mujoco.mjtObj.mjOBJ_PAIR,
}

#: Fields on which no other constant of a model depends. After all others ``mj_setConst`` is called.
_FREE: tuple[str, ...] = (
    "jnt_stiffness",
    "jnt_range",
    "jnt_solref",
    "jnt_solimp",
    "jnt_margin",
    "jnt_springyield",
    "qpos_spring",
)
_FREE += ("dof_damping", "dof_frictionloss", "dof_solref", "dof_solimp", "geom_friction", "geom_solref", "geom_solimp")
_FREE += ("geom_margin", "geom_gap", "geom_fluid", "tendon_stiffness", "tendon_damping", "tendon_frictionloss")
_FREE += ("tendon_range", "actuator_gainprm", "actuator_biasprm", "actuator_dynprm", "actuator_forcerange", "opt")

_UNITS = {"body_mass": "kg", "body_inertia": "kg m^2", "tendon_stiffness": "N/m", "tendon_damping": "N s/m"}
_JOINT_UNITS = {
    "jnt_stiffness": ("N m/rad", "N/m"),
    "dof_damping": ("N m s/rad", "N s/m"),
    "dof_armature": ("kg m^2", "kg"),
    "dof_frictionloss": ("N m", "N"),
    "qpos_spring": ("rad", "m"),
}


@dataclass(frozen=True)
class Field:
    """A number of a MuJoCo model that a parameter sets.

    Attributes:
        field: Which field of ``MjModel``, such as ``jnt_stiffness`` or ``actuator_gainprm``; or an option such as
            ``opt.density``.
        name: Which joint, body, geom, site, tendon, actuator, sensor or equality; empty for options.
        index: Which of several numbers, or of several degrees of freedom of a joint; where there is one, none is needed.
        factor: The number is this times the parameter: -1 for the position gain in an actuator's ``biasprm``.
    """

    field: str
    name: str = ""
    index: int | None = None
    factor: float = 1.0


@dataclass(frozen=True)
class Target:
    """Where a parameter's number goes: ``model.FIELD.flat[place] = factor * value``."""

    field: str
    place: int
    factor: float


def read(model: mujoco.MjModel, name: str, given: Any) -> tuple[list[Target], Parameter]:
    """The targets and the parameter of one entry of ``parameters``.

    Raises:
        UsageError: What is wrong with it, and what is valid.
    """
    fields, options = _split(name, given)
    targets = [_target(model, name, field) for field in fields]
    values = [float(_array(model, target.field).flat[target.place]) / target.factor for target in targets]
    if isinstance(options, Parameter):
        return targets, options
    unknown_keys = set(options) - {"initial", "bounds", "scale", "unit", "role"}
    if unknown_keys:
        raise UsageError(
            f"parameters[{name!r}]: no option `{unknown_keys.pop()}`; there are initial, bounds, scale, unit, role"
        )
    initial = float(options.get("initial", values[0]))
    if "initial" not in options and not np.allclose(values, values[0], rtol=1e-9, atol=0.0):
        raise UsageError(f"parameters[{name!r}]: its numbers are {values} in the model: say which is `initial`")
    if "bounds" not in options and not initial > 0.0:
        raise UsageError(f"parameters[{name!r}] is {initial:g} in the model: give its `bounds`")
    bounds = options.get("bounds", (initial / 10.0, initial * 10.0))
    try:
        lower, upper = (float(bound) for bound in bounds)
    except (TypeError, ValueError):
        raise UsageError(f"parameters[{name!r}]: bounds are two numbers; found {bounds!r}") from None
    scale = options.get("scale", "linear" if "bounds" in options else "log")
    unit = str(options.get("unit", _unit(model, fields[0])))
    return targets, Parameter(initial, (lower, upper), scale, unit, options.get("role", "design"))


def _split(name: str, given: Any) -> tuple[list[Field], Parameter | Mapping[str, Any]]:
    """Fields and options of ``Field``, ``("jnt_stiffness", "wrist"[, index][, options])`` or ``([...], options)``."""
    valid = f'parameters[{name!r}]: a tuple (field, name[, index][, options]), such as ("jnt_stiffness", "wrist"), a Field, '
    valid += f"or a list of these (, options); found {given!r}"
    options: Parameter | Mapping[str, Any] = {}
    if isinstance(given, tuple) and given and isinstance(given[-1], (Parameter, Mapping)):
        *rest, options = given
        given = rest[0] if len(rest) == 1 and isinstance(rest[0], (list, Field)) else tuple(rest)
    entries: Iterable[Any] = given if isinstance(given, list) else [given]
    fields = []
    for entry in entries:
        if isinstance(entry, Field):
            fields.append(entry)
            continue
        if not (isinstance(entry, tuple) and 1 <= len(entry) <= 3 and all(isinstance(part, str) for part in entry[:2])):
            raise UsageError(valid)
        if len(entry) == 3 and not isinstance(entry[2], (int, np.integer)):
            raise UsageError(valid)
        fields.append(Field(*entry))
    if not fields:
        raise UsageError(valid)
    return fields, options


def _array(model: mujoco.MjModel, field: str) -> Array:
    """The array of a field; options of one number have none, see :func:`_apply`."""
    found: Any = model
    for part in field.split("."):
        found = getattr(found, part)
    return np.asarray(found)


def _target(model: mujoco.MjModel, name: str, field: Field) -> Target:
    at = f"parameters[{name!r}]"
    if not np.isfinite(field.factor) or field.factor == 0.0:
        raise UsageError(f"{at}: factor must be a number other than 0; found {field.factor}")
    try:
        array = _array(model, field.field)
    except AttributeError:
        valid = [
            entry
            for entry in dir(model)
            if entry.split("_")[0] in ("jnt", "dof", "body", "geom", "site", "tendon", "actuator")
        ]
        raise unknown(f"field of a MuJoCo model, as {at} wants,", field.field, valid) from None
    if array.dtype != np.float64:
        raise UsageError(f"{at}: `{field.field}` holds {array.dtype}, not numbers that change smoothly")
    rows = [0] if field.field.startswith("opt.") else _rows(model, at, field)
    width = array.size if field.field.startswith("opt.") else array.size // max(len(array), 1)
    places = [row * width + column for row in rows for column in range(width)]
    if len(places) == 1 and field.index in (None, 0):
        return Target(field.field, places[0], field.factor)
    if field.index is None or not 0 <= field.index < len(places):
        found = "none was given" if field.index is None else f"found {field.index}"
        raise UsageError(
            f"{at}: `{field.field}` of `{field.name}` has {len(places)} numbers: index must be 0 to {len(places) - 1}; {found}"
        )
    return Target(field.field, places[field.index], field.factor)


def _rows(model: mujoco.MjModel, at: str, field: Field) -> Sequence[int]:
    """Rows of a field that belong to the named object."""
    prefix = field.field.split("_")[0]
    if prefix in ("jnt", "dof", "qpos", "qpos0"):
        joint = find(f"joint, as {at} wants,", field.name, _all(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt))
        if prefix == "jnt":
            return [joint]
        first, last = (model.jnt_dofadr, model.nv) if prefix == "dof" else (model.jnt_qposadr, model.nq)
        end = int(first[joint + 1]) if joint + 1 < model.njnt else int(last)
        return range(int(first[joint]), end)
    if prefix == "actuator":
        return [find(f"actuator, as {at} wants,", field.name, actuator_names(model))]
    if prefix == "sensor":
        return [find(f"sensor, as {at} wants,", field.name, sensor_names(model))]
    for start, kind in _KINDS.items():
        if field.field.startswith(start):
            count = int(getattr(model, {"eq_": "neq", "pair_": "npair"}.get(start, f"n{start[:-1]}")))
            return [find(f"{start[:-1]}, as {at} wants,", field.name, _all(model, kind, count))]
    raise UsageError(
        f"{at}: fields of joints, bodies, geoms, sites, tendons, actuators, sensors, equalities and pairs can be parameters; found `{field.field}`"
    )


def _all(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    return [name_of(model, kind, i) for i in range(count)]


def _unit(model: mujoco.MjModel, field: Field) -> str:
    if field.field in _JOINT_UNITS:
        joint = find("joint", field.name, _all(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt))
        return _JOINT_UNITS[field.field][int(model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_SLIDE]
    return _UNITS.get(field.field, "")


def _needs_constants(targets: Iterable[Target]) -> bool:
    """Whether changes of these fields require ``mj_setConst``."""
    return any(target.field not in _FREE and not target.field.startswith("opt.") for target in targets)


def _apply(model: mujoco.MjModel, targets: Sequence[Target], value: float) -> None:
    """Sets a parameter's numbers."""
    for target in targets:
        *path, last = target.field.split(".")
        owner: Any = model
        for part in path:
            owner = getattr(owner, part)
        array = getattr(owner, last)
        if isinstance(array, np.ndarray):
            array.flat[target.place] = target.factor * value
        else:
            setattr(owner, last, target.factor * value)


def changed(model: mujoco.MjModel, targets: Sequence[Sequence[Target]], values: Iterable[float]) -> mujoco.MjModel:
    """A copy of a model with the numbers of all parameters set, and what depends on them."""
    made = copy.copy(model)
    for some, value in zip(targets, values, strict=True):
        _apply(made, some, float(value))
    if any(_needs_constants(some) for some in targets):
        mujoco.mj_setConst(made, mujoco.MjData(made))
    return made
