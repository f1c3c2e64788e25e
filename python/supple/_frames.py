"""Results as tables: one row per step, level, point, visited design or sensor. Information is in bits."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import UsageError
from .table import Table, dataset

if TYPE_CHECKING:
    from ._records import Array
    from .bounds import Bounds
    from .reports import TaskReport, TrajectoryReport
    from .sensors import Sensors
    from .studies import Pareto, Robustness, Trace

__all__ = ["bounds", "pareto", "robustness", "sensors", "trace", "trajectories", "trajectory_dataset"]

LN2 = math.log(2.0)

Row = Mapping[str, Any]


def _table(rows: Sequence[Row], units: Mapping[str, str]) -> Table:
    """Rows with equal keys as columns: strings as lists, numbers and booleans as arrays; missing numbers are NaN."""
    columns: dict[str, Any] = {}
    for name in rows[0] if rows else ():
        values = [row[name] for row in rows]
        if any(isinstance(value, str) for value in values):
            columns[name] = values
        else:
            columns[name] = np.array([math.nan if value is None else value for value in values])
    return Table(columns, {name: units[name] for name in columns if units.get(name)}, {})


def _parameters(made: Mapping[str, Any]) -> dict[str, str]:
    """Units of parameters by name."""
    return {entry["name"]: entry["unit"] for entry in made["about"]["parameters"]}


def _tasks(made: Mapping[str, Any]) -> list[str]:
    return [task["name"] for task in made["about"]["tasks"]]


def _trajectory(report: TaskReport) -> TrajectoryReport:
    if report.trajectory is None:
        raise UsageError(f"task `{report.name}` has no trajectory: evaluate it with trajectories=True")
    return report.trajectory


def trajectories(tasks: Iterable[TaskReport]) -> Table:
    """Plans, one row per step: time, states and their standard deviations, controls, contacts, quantities, terms of the
    cost, and the bits of all measurements.
    """
    rows: list[Row] = []
    units = {"time": "s", "information_bits": "bit"}
    for report in tasks:
        found = _trajectory(report)
        units |= dict(zip(found.state_names, found.state_units))
        units |= {f"{name}.deviation": unit for name, unit in zip(found.state_names, found.state_units)}
        units |= dict(zip(found.control_names, found.control_units))
        units |= {f"{name}.force": "N" for name in found.contacts} | {
            f"{name}.clearance": "m" for name in found.contacts
        }
        units |= {f"{one.name} ({one.of})": one.unit for one in found.quantities}
        for t, time in enumerate(found.time):
            row: dict[str, Any] = {"task": report.name, "step": t, "time": float(time)}
            row |= dict(zip(found.state_names, found.states[t]))
            row |= {f"{name}.deviation": value for name, value in zip(found.state_names, found.deviations[t])}
            given = found.controls[t] if t < len(found.controls) else [math.nan] * len(found.control_names)
            row |= dict(zip(found.control_names, given))
            for name, contact in found.contacts.items():
                row[f"{name}.force"] = contact.force_N[t]
                row[f"{name}.clearance"] = contact.clearance_m[t]
                row[f"{name}.touches"] = contact.touches[t]
            for one in found.quantities:
                row[f"{one.name} ({one.of})"] = one.values[t] if t < len(one.values) else math.nan
            row |= {f"cost {name}": cost.per_step[t] for name, cost in found.costs.items()}
            row["information_bits"] = report.information.per_step_nats[t] / LN2
            rows.append(row)
    names = {name: None for row in rows for name in row}
    return _table([{name: row.get(name) for name in names} for row in rows], units)


def trajectory_dataset(report: TaskReport) -> Any:
    """A plan as an xarray ``Dataset`` over time, state, control, contact, term of the cost and roll-out, with units."""
    found = _trajectory(report)
    variables: dict[str, Any] = {
        "states": (("time", "state"), found.states),
        "deviations": (("time", "state"), found.deviations),
        "controls": (("step", "control"), found.controls),
        "feedback": (("step", "control", "state"), found.feedback),
        "information_bits": ("time", report.information.per_step_nats / LN2),
    }
    coordinates: dict[str, Any] = {
        "time": found.time,
        "step": np.arange(len(found.controls)),
        "state": found.state_names,
        "control": found.control_names,
        "state_unit": ("state", found.state_units or [""] * len(found.state_names)),
        "control_unit": ("control", found.control_units or [""] * len(found.control_names)),
    }
    units = {"time": "s", "information_bits": "bit"}
    if found.contacts:
        curves = list(found.contacts.values())
        variables["contact_force"] = (("contact", "time"), np.stack([curve.force_N for curve in curves]))
        variables["contact_clearance"] = (("contact", "time"), np.stack([curve.clearance_m for curve in curves]))
        variables["contact_touches"] = (("contact", "time"), np.stack([curve.touches for curve in curves]))
        coordinates["contact"] = list(found.contacts)
        units |= {"contact_force": "N", "contact_clearance": "m"}
    if found.costs:
        variables["cost_per_step"] = (("cost", "time"), np.stack([curve.per_step for curve in found.costs.values()]))
        coordinates["cost"] = list(found.costs)
    if found.quantities:
        values = np.full((len(found.quantities), len(found.time)), math.nan)
        for row, one in zip(values, found.quantities):
            row[: len(one.values)] = one.values
        variables["quantities"] = (("quantity", "time"), values)
        coordinates["quantity"] = [f"{one.name} ({one.of})" for one in found.quantities]
        coordinates["quantity_unit"] = ("quantity", [one.unit for one in found.quantities])
    if found.threads:
        variables["threads"] = (("rollout", "time", "state"), _padded(found.threads, len(found.time)))
    return dataset(variables, units, {}, coordinates)


def _padded(runs: Sequence[Array], count: int) -> Array:
    """Runs of states as one array, (runs, count, n); NaN where a run ended early."""
    out = np.full((len(runs), count, runs[0].shape[1]), math.nan)
    for row, run in zip(out, runs):
        row[: len(run)] = run
    return out


def robustness(study: Robustness) -> Table:
    """One row per design, task, planning and noise level."""
    tasks = _tasks(study.made)
    rows = [
        {
            "design": study.designs[cell.design].name,
            "task": tasks[cell.task],
            "planned_for": cell.planned_for,
            study.varied: float(study.levels[cell.level]),
            "mean": cell.mean,
            "deviation": cell.deviation,
            "half_width_95": cell.half_width_95,
            "diverged": cell.diverged,
            "expected": cell.expected,
            "error": cell.error or "",
        }
        for cell in study.cells
    ]
    return _table(rows, _parameters(study.made))


def pareto(front: Pareto) -> Table:
    """One row per point of the front, the tightest cost limits first."""
    tasks = _tasks(front.made)
    rows = [
        {
            "factor": point.factor,
            "status": point.status,
            "information_bits": point.information_nats / LN2,
            **{f"{name}.expected_cost": float(cost) for name, cost in zip(tasks, point.costs)},
            **{f"{name}.bound": float(bound) for name, bound in zip(tasks, point.bounds)},
            **point.parameters,
        }
        for point in front.points
    ]
    return _table(rows, {"information_bits": "bit"} | _parameters(front.made))


def trace(study: Trace) -> Table:
    """One row per visited design of each search."""
    tasks = _tasks(study.made)
    rows = [
        {
            "method": run.method,
            "gradient": run.gradient,
            "start": run.start,
            "status": run.status,
            "visit": visit,
            "information_bits": point.information_nats / LN2,
            **{f"{name}.expected_cost": float(cost) for name, cost in zip(tasks, point.costs)},
            **point.parameters,
        }
        for run in study.runs
        for visit, point in enumerate(run.path)
    ]
    return _table(rows, {"information_bits": "bit"} | _parameters(study.made))


#: What a table of bounds says of the design itself, and of the proof.
OF_DESIGN = ["proved", "status", "own_cost", "minimum_cost", "control_bits_per_step", "measurement_bits_per_step"]


def bounds(found: Bounds) -> Table:
    """One row per task and point of its curve; one per task if there is no curve."""
    rows: list[Row] = []
    for name, task in found.tasks.items():
        curve = found.curves.get(name)
        points: Sequence[Any] = curve or [task]
        columns = ["cost", "minimum_bits_per_step", "minimum_lower_bits_per_step", "closed_form_bits_per_step"]
        columns += ["error"] if curve else OF_DESIGN
        rows += [{"task": name, **{column: getattr(point, column) for column in columns}} for point in points]
    return _table(rows, {name: "bit" for name in rows[0] if name.endswith("bits_per_step")} if rows else {})


def sensors(found: Sensors) -> Table:
    """One row per sensor."""
    rows = [sensor.to_dict() for sensor in found.sensors.values()]
    return _table(rows, {"bits_alone": "bit", "bits_beyond_others": "bit"})
