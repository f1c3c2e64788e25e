"""Names of what a MuJoCo model consists of: its states, its controls, and what is measured of it."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError

__all__ = ["Channel", "Outputs", "controls", "find", "name_of", "select", "sensor_names", "states"]

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Channel:
    """A number with a name and a unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class Outputs:
    """Numbers that are states or entries of MuJoCo's ``sensordata``.

    Attributes:
        channels: What they are.
        sources: (r,) indices: of a state, or of an entry of ``sensordata`` where ``sensed``.
        sensed: (r,) which of them are sensed.
        groups: Where in them each chosen sensor or state begins and how many numbers it has, by name.
    """

    channels: tuple[Channel, ...]
    sources: NDArray[np.intp]
    sensed: NDArray[np.bool_]
    groups: dict[str, tuple[int, int]]

    def __len__(self) -> int:
        return len(self.channels)


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """The name of an object; its number where it has none."""
    return mujoco.mj_id2name(model, kind, index) or str(index)


def unknown(what: str, name: str, valid: Sequence[str]) -> UsageError:
    """The error for an unknown name."""
    near = get_close_matches(name, valid, n=1)
    hint = f" (did you mean `{near[0]}`?)" if near else ""
    listed = ", ".join(valid[:20]) + (", ..." if len(valid) > 20 else "")
    return UsageError(
        f"no {what} `{name}`{hint}; valid: {listed}" if valid else f"no {what} `{name}`: the model has none"
    )


def find(what: str, name: str, valid: Sequence[str]) -> int:
    """The index of a name.

    Raises:
        UsageError: Where it is not there; it names the nearest one.
    """
    if name not in valid:
        raise unknown(what, name, valid)
    return list(valid).index(name)


def select(what: str, pattern: str, valid: Sequence[str]) -> list[int]:
    """Indices of names that a name or a pattern with ``*`` fits.

    Raises:
        UsageError: Where it fits none.
    """
    if pattern in valid:
        return [list(valid).index(pattern)]
    found = [i for i, name in enumerate(valid) if fnmatch.fnmatchcase(name, pattern)] if "*" in pattern else []
    if not found:
        raise unknown(what, pattern, valid)
    return found


def states(model: mujoco.MjModel) -> tuple[Channel, ...]:
    """``q.JOINT``, ``v.JOINT`` and ``a.ACTUATOR``: coordinates, their rates, and activations of actuators.

    Coordinates of free joints are ``q.JOINT.x`` to ``.z`` and ``.rx`` to ``.rz``; those of ball joints only the latter.
    """
    positions: list[Channel] = []
    velocities: list[Channel] = []
    for joint in range(model.njnt):
        name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        kind = int(model.jnt_type[joint])
        turns = [(f".r{axis}", "rad") for axis in _AXES]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            parts = [(f".{axis}", "m") for axis in _AXES] + turns
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            parts = turns
        else:
            parts = [("", "m" if kind == mujoco.mjtJoint.mjJNT_SLIDE else "rad")]
        positions += [Channel(f"q.{name}{part}", unit) for part, unit in parts]
        velocities += [Channel(f"v.{name}{part}", f"{unit}/s") for part, unit in parts]
    activations = [Channel("", "")] * int(model.na)
    for actuator, name in enumerate(actuator_names(model)):
        first, count = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
        for i in range(count if first >= 0 else 0):
            activations[first + i] = Channel(f"a.{name}" if count == 1 else f"a.{name}.{i}", "")
    return (*positions, *velocities, *activations)


def actuator_names(model: mujoco.MjModel) -> list[str]:
    """Names of all actuators."""
    count = len(model.actuator_actadr)
    return [name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, i) for i in range(count)]


def controls(model: mujoco.MjModel, chosen: Iterable[str] | None) -> tuple[tuple[Channel, ...], NDArray[np.intp]]:
    """The controls (m,) of chosen actuators, of all where none are chosen, and their places in ``ctrl``.

    Raises:
        UsageError: Where an actuator is unknown, chosen twice, or there is none.
    """
    names = actuator_names(model)
    if isinstance(chosen, str):
        chosen = [chosen]
    indices = range(len(names)) if chosen is None else [i for name in chosen for i in select("actuator", name, names)]
    if len(set(indices)) != len(indices):
        raise UsageError("actuators: one of them is chosen twice")
    # Releases before 4 have one control per actuator and no such fields.
    first = getattr(model, "actuator_ctrladr", np.arange(len(names)))
    many = getattr(model, "actuator_ctrlnum", np.ones(len(names), dtype=int))
    channels: list[Channel] = []
    places: list[int] = []
    for i in indices:
        count = int(many[i])
        for part in range(count):
            channels.append(Channel(names[i] if count == 1 else f"{names[i]}.{part}", ""))
            places.append(int(first[i]) + part)
    if not places:
        raise UsageError("the MuJoCo model has no actuator: there is nothing to control")
    return tuple(channels), np.array(places, dtype=np.intp)


def sensor_names(model: mujoco.MjModel) -> list[str]:
    """Names of all sensors."""
    return [name_of(model, mujoco.mjtObj.mjOBJ_SENSOR, i) for i in range(model.nsensor)]


def outputs(model: mujoco.MjModel, chosen: Iterable[str] | None) -> Outputs:
    """Sensors by name and states by name or pattern; all sensors where none are chosen, all positions where there are none.

    Raises:
        UsageError: Where a name is unknown, or a sensor is none of positions and velocities alone.
    """
    named = states(model)
    state_names, sensors = [channel.name for channel in named], sensor_names(model)
    if isinstance(chosen, str):
        chosen = [chosen]
    if chosen is None:
        chosen = sensors or [name for name in state_names if name.startswith("q.")]
    channels: list[Channel] = []
    sources: list[int] = []
    sensed: list[bool] = []
    groups: dict[str, tuple[int, int]] = {}
    for name in chosen:
        if name in groups:
            raise UsageError(f"sensors: `{name}` is chosen twice")
        start = len(channels)
        if name in sensors:
            first, count = _sensor(model, sensors.index(name))
            parts = [name] if count == 1 else [f"{name}.{i}" for i in range(count)]
            channels += [Channel(part, "") for part in parts]
            sources += range(first, first + count)
        else:
            found = select("sensor or state", name, [*sensors, *state_names])
            if any(i < len(sensors) for i in found):
                raise UsageError(f"sensors: `{name}` fits sensors of the model: give their whole names")
            found = [i - len(sensors) for i in found]
            channels += [named[i] for i in found]
            sources += found
        sensed += [name in sensors] * (len(channels) - start)
        groups[name] = (start, len(channels) - start)
    return Outputs(tuple(channels), np.array(sources, dtype=np.intp), np.array(sensed, dtype=bool), groups)


def _sensor(model: mujoco.MjModel, sensor: int) -> tuple[int, int]:
    """Where a sensor's numbers begin, and how many there are."""
    stage = int(model.sensor_needstage[sensor])
    name = name_of(model, mujoco.mjtObj.mjOBJ_SENSOR, sensor)
    kind = mujoco.mjtSensor(int(model.sensor_type[sensor])).name.removeprefix("mjSENS_").lower()
    if stage not in (int(mujoco.mjtStage.mjSTAGE_POS), int(mujoco.mjtStage.mjSTAGE_VEL)) or kind in ("user", "plugin"):
        raise UsageError(
            f"sensor `{name}` ({kind}) depends on more than positions and velocities, such as the control of the same "
            "instant: a measurement is a function of the state. Choose others, or states by name such as `q.JOINT`"
        )
    return int(model.sensor_adr[sensor]), int(model.sensor_dim[sensor])
