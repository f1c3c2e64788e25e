"""Descriptions of tasks for the native part: plain numbers, or names of parameters in their place."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import check_unmasked
from ._asked import real
from ._records import Array
from ._source import source
from ._supple import NativeTask
from .errors import UsageError
from .task import CatalogueEntry, Parameter, Task

__all__ = [
    "Noise",
    "Number",
    "VaryingVariance",
    "bounds",
    "check_printable",
    "combine",
    "control_rows",
    "declared",
    "made",
    "names",
    "numbers",
    "parameters",
    "resolver",
    "varying",
]

#: A number, or the name of a parameter in its place.
Number = float | str


@dataclass(frozen=True)
class VaryingVariance:
    """A state-dependent term added to measurement variances: ``coefficient (state - center)^2``.

    Attributes:
        measurement: Names of the measurements, one or a list, in which ``*`` matches any characters.
        state: Name of the state.
        center: Value of the state at which the term is zero, in its unit; or the name of a parameter.
        coefficient: Variance per squared unit of the state, at least 0; or the name of a parameter.
    """

    measurement: str | Sequence[str]
    state: str
    center: Number
    coefficient: Number

    def describe(self) -> dict[str, Any]:
        """Plain names and numbers."""
        named = [self.measurement] if isinstance(self.measurement, str) else list(self.measurement)
        if not all(isinstance(name, str) for name in [*named, self.state]):
            raise UsageError(f"varying: {self!r}: measurements and state are given by their names")
        found: dict[str, Any] = {"measurement": named, "state": self.state}
        for key in ("center", "coefficient"):
            given = getattr(self, key)
            try:
                found[key] = given if isinstance(given, str) else real(given)
            except (TypeError, ValueError):
                raise UsageError(f"varying: {key}={given!r}: a number, or the name of a parameter") from None
            if isinstance(found[key], float) and not math.isfinite(found[key]):
                raise UsageError(f"varying: {key}={given!r}: a finite number")
        return found


def varying(given: Sequence[VaryingVariance]) -> list[dict[str, Any]]:
    """The state-dependent part of the noise, as plain objects."""
    if not _is_list(given) or not all(isinstance(law, VaryingVariance) for law in given):
        raise UsageError(
            f"varying={given!r}: a list of supple.VaryingVariance(measurement, state, center, coefficient)"
        )
    return [law.describe() for law in given]


@dataclass(frozen=True)
class Noise:
    """Covariances of a task: lists of variances, or whole matrices; entries may be names of parameters.

    Attributes:
        initial: Covariance of the initial state, (n,) or (n, n).
        process: Covariance of the noise that each step adds to the state, (n,) or (n, n).
        measurement: Covariance of the measurement noise, positive definite, (p,) or (p, p).
        varying: State-dependent terms added to its variances; default: none.
    """

    initial: Sequence[Number] | Sequence[Sequence[Number]] | ArrayLike
    process: Sequence[Number] | Sequence[Sequence[Number]] | ArrayLike
    measurement: Sequence[Number] | Sequence[Sequence[Number]] | ArrayLike
    varying: Sequence[VaryingVariance] = ()

    def describe(self) -> dict[str, Any]:
        """Plain lists."""
        plain = {key: _covariance(key, getattr(self, key)) for key in ("initial", "process", "measurement")}
        return plain | ({"varying": varying(self.varying)} if len(self.varying) else {})


def _covariance(key: str, given: Any) -> list[Any]:
    rows = [numbers(row) if _is_list(row) else row for row in given] if _is_list(given) else None
    if rows is None:
        raise UsageError(f"noise: {key}={given!r}: it must be a list of variances, or a square matrix")
    lengths = {len(row) for row in rows if isinstance(row, list)}
    if not lengths:
        return numbers(rows)
    if lengths != {len(rows)} or not all(isinstance(row, list) for row in rows):
        raise UsageError(f"noise: {key} has {len(rows)} rows of {sorted(lengths)} numbers: it must be square")
    return rows


def _is_list(given: object) -> bool:
    return isinstance(given, (list, tuple)) or isinstance(given, np.ndarray) and given.ndim > 0


def numbers(given: Any) -> list[Number]:
    """Numbers as Python numbers; names are kept."""
    try:
        return [entry if isinstance(entry, str) else real(entry) for entry in given]
    except (TypeError, ValueError):
        raise UsageError(f"{given!r}: valid: a list of numbers or names of parameters") from None


def control_rows(given: Any) -> list[list[Number]]:
    """An initial guess of the controls as rows: one for all steps, or one per step."""
    if not _is_list(given):
        raise UsageError(
            f"initial_control={given!r}: it must be a list of one number per control, or of one row per step"
        )
    return [numbers(row) for row in given] if any(_is_list(row) for row in given) else [numbers(given)]


def names(what: str, given: int | Sequence[str] | Mapping[str, str], letter: str) -> dict[str, str]:
    """Names with their units.

    Raises:
        UsageError: If there is none, or one occurs twice.
    """
    if isinstance(given, (int, np.integer)) and not isinstance(given, bool):
        found = {f"{letter}{index + 1}": "" for index in range(given)}
    elif isinstance(given, Mapping):
        found = {str(name): str(unit) for name, unit in given.items()}
    elif isinstance(given, str) or not isinstance(given, Sequence):
        raise UsageError(f'{what}={given!r}: names in a list, ["{letter}1"], or how many there are')
    else:
        found = {str(name): "" for name in given}
        if len(found) < len(given):
            raise UsageError(f"{what}={list(given)!r}: a name occurs twice")
    if not found:
        raise UsageError(f"{what}={given!r}: there must be at least one")
    for name in found:
        check_printable(what, name)
    return found


def check_printable(what: str, name: object) -> None:
    """Checks a name.

    Raises:
        UsageError: If it is not a text, empty, or breaks lines.
    """
    if not (isinstance(name, str) and name.strip() and name.isprintable()):
        raise UsageError(f"{what}: {name!r} is no name: valid: text in one line, not empty")


def parameters(given: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Declared parameters.

    Raises:
        UsageError: If one is not a :class:`Parameter`.
    """
    for name, parameter in given.items():
        if not isinstance(parameter, Parameter):
            raise UsageError(
                f"parameters: `{name}` is {parameter!r}: declare it as supple.Parameter(initial, (least, greatest)), with "
                "scale, unit and role where they differ from the default"
            )
    return dict(given)


def declared(given: Mapping[str, Parameter]) -> list[dict[str, Any]]:
    """Parameters as the native part reads them."""
    listed = []
    for name, parameter in given.items():
        entry = asdict(parameter)
        try:
            entry["initial"] = real(entry["initial"])
            lower, upper = entry["bounds"]
            entry["bounds"] = [real(lower), real(upper)]
        except (TypeError, ValueError):
            raise UsageError(f"parameter `{name}`: {parameter!r}: initial is a number, bounds are two") from None
        del entry["catalogue"]
        if len(parameter.catalogue):
            entry["catalogue"] = [_catalogued(name, listed) for listed in parameter.catalogue]
        listed.append({"name": name, **entry})
    return listed


def _catalogued(name: str, listed: CatalogueEntry | float) -> dict[str, Any]:
    """An entry of a catalogue as the native part reads it."""
    entry = asdict(listed) if isinstance(listed, CatalogueEntry) else {"value": listed}
    try:
        numbers = {key: real(entry[key]) for key in ("value", "price") if entry.get(key) is not None}
    except (TypeError, ValueError):
        raise UsageError(
            f"parameter `{name}`: catalogue: {listed!r}: a number, or supple.CatalogueEntry(value, price, name)"
        ) from None
    bad = next((key for key, number in numbers.items() if not math.isfinite(number)), None)
    if bad is not None:
        raise UsageError(f"parameter `{name}`: catalogue: {listed!r}: {bad} is not finite")
    return {**numbers, **({"name": str(entry["name"])} if entry.get("name") is not None else {})}


def resolver(given: Mapping[str, Parameter]) -> Callable[[str, Any, tuple[int, ...]], Array]:
    """A function that gives the numbers of a list at the parameters' initial values, checked."""

    def number(what: str, entry: Any) -> float:
        if isinstance(entry, str):
            if entry not in given:
                valid = ", ".join(f"`{name}`" for name in given) or "none"
                raise UsageError(f"{what}: no parameter `{entry}`; valid: {valid}")
            return float(given[entry].initial)
        try:
            value = real(entry)
        except (TypeError, ValueError):
            raise UsageError(f"{what}: {entry!r} is neither a number nor the name of a parameter") from None
        if not math.isfinite(value):
            raise UsageError(f"{what}: {value} is not finite")
        return value

    def resolve(what: str, entries: Any, shape: tuple[int, ...]) -> Array:
        check_unmasked(what, entries)
        if not _is_list(entries):
            raise UsageError(f"{what}={entries!r}: it must be a list of {shape[-1]} numbers")
        if any(_is_list(row) for row in entries):
            rows = [[number(what, entry) for entry in row] for row in entries]
            lengths = sorted({len(row) for row in rows})
            if len(shape) != 2 or lengths != [shape[1]]:
                raise UsageError(f"{what} has rows of {lengths} numbers: {shape[-1]} are needed")
            return np.array(rows, dtype=np.float64)
        found = [number(what, entry) for entry in entries]
        if len(shape) != 1 or len(found) != shape[0]:
            raise UsageError(f"{what} has {len(found)} numbers: {shape[-1]} are needed")
        return np.array(found, dtype=np.float64)

    return resolve


def bounds(given: Sequence[tuple[float, float]] | None) -> list[list[float | None]] | None:
    """Lower and upper bounds of controls, ``None`` for infinite ones."""
    if given is None:
        return None
    try:
        pairs = [(real(lower), real(upper)) for lower, upper in given]
    except (TypeError, ValueError):
        raise UsageError(f"control_bounds={given!r}: one pair (least, greatest) for each control") from None
    if any(math.isnan(bound) for pair in pairs for bound in pair):
        raise UsageError(f"control_bounds={given!r}: a bound is nan; plus or minus infinity for none")
    sides = ([pair[side] for pair in pairs] for side in (0, 1))
    return [[bound if math.isfinite(bound) else None for bound in side] for side in sides]


def made(description: dict[str, Any]) -> Task:
    """The task of a description; other processes rebuild the task in the same way."""
    described = {"source": source(description), **description}
    return Task(NativeTask.own(described), ("own", described))


def combine(*tasks: Task, title: str | None = None) -> Task:
    """Combines several tasks that share their parameters: information is summed, and every cost limit applies.

    Settings of planning and design, and parameter values, are taken from the first task.

    Raises:
        UsageError: If parameters differ, names of tasks repeat, or a task was loaded from a file.
    """
    if not tasks:
        raise UsageError("combine needs at least one task")
    for task in tasks:
        if not isinstance(task, Task):
            raise UsageError(f"combine(..., {task!r}): valid: tasks, one by one, as in combine(first, second)")
    kinds = [task._recipe[0] for task in tasks]
    if any(kind != "own" for kind in kinds):
        raise UsageError(
            "combine takes tasks of own models; tasks of a task file are combined there, one [[tasks]] each"
        )
    described = [json.loads(task._recipe[1]["plain"]) for task in tasks]
    whole = described[0]
    for other in described[1:]:
        if other["parameters"] != whole["parameters"]:
            raise UsageError(
                f"the tasks `{whole['tasks'][0]['name']}` and `{other['tasks'][0]['name']}` do not have the same parameters: "
                "give their models the same `parameters`, in the same order, used or not"
            )
    whole["tasks"] = [entry for one in described for entry in one["tasks"]]
    names = [entry["name"] for entry in whole["tasks"]]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise UsageError(f"two tasks are called `{repeated}`: give each a unique name, model.task(name=...)")
    whole["title"] = whole["title"] if title is None else title
    systems = [system for task in tasks for system in task._recipe[1]["systems"]]
    errors = [task.derivative_error for task in tasks]
    known = [(error.first, error.second, error.third) for error in errors if error is not None]
    worst = type(errors[0])(*map(max, zip(*known))) if len(known) == len(tasks) and errors[0] is not None else None
    whole_task = made({"plain": json.dumps(whole), "systems": systems, "derivative_error": worst})
    return whole_task.at(tasks[0].values)
