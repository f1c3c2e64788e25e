"""The motion of MuJoCo's twin of a robot by its forces and the Runge-Kutta method, with what follows exactly where it should be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from supple._mujoco.plant import Plant
from supple._mujoco.robot import Robot

Array = NDArray[np.float64]


class Twin:
    """Bodies, drives and compliance of a task's robot.

    Args:
        model: The table ``[model]`` of the task file.
        folder: The folder of the task file.
        values: Parameters by name.
        channels: Names of supple's states and controls.
        time_step: Time step of the task, s.
    """

    def __init__(
        self,
        model: Mapping[str, Any],
        folder: Path,
        values: Mapping[str, float],
        channels: tuple[Sequence[str], Sequence[str]],
        time_step: float,
    ) -> None:
        file = str(folder / model["file"])
        self._given = model, (file, {file: Path(file).read_text()}), values, channels
        self.robot = Robot(*self._given)
        assert not any(joint.frictionloss for joint in self.robot.spec.joints), (
            "MuJoCo's dry friction is no law of supple's"
        )
        self.contacts = self.robot.contacts
        self._time_step = time_step
        self._one = Plant(self.robot, 1, time_step, 1)
        moving = len(self.robot.joints) + len(self.robot.motors)
        # Velocities of MuJoCo's joints by those of supple's positions.
        self._G = np.array([self._velocities(rate) for rate in np.eye(moving)]).T

    def _velocities(self, rate: Array) -> Array:
        zeros = np.zeros(len(rate))
        controls = np.zeros((1, len(self.robot.controls)))
        self._one.put(np.concatenate([zeros, rate, np.zeros(len(self.contacts))])[None], controls)
        return self._one.data.qvel.copy()

    def split(self, x: Array) -> tuple[Array, Array, Array]:
        """Positions, rates and constants of a state of supple's."""
        count = self._G.shape[1]
        return x[:count], x[count : 2 * count], x[2 * count :]

    def accelerations(self, p: Array, rate: Array, c: Array, u: Array) -> Array:
        """Of all positions, by the forces of MuJoCo and of the laws, with joints that follow others held to them."""
        mj, data = self._one.mj, self._one.data
        self._one.put(np.concatenate([p, rate, c])[None], u[None])
        mujoco.mj_step1(mj, data)
        self._one.apply()
        mujoco.mj_fwdActuation(mj, data)
        mujoco.mj_fwdAcceleration(mj, data)
        M = np.zeros((mj.nv, mj.nv))
        mujoco.mj_fullM(mj, data, M)
        G = self._G
        return np.asarray(np.linalg.solve(G.T @ M @ G, G.T @ data.qfrc_smooth))

    def move(self, x: Array, controls: Array, substeps: int) -> Array:
        """States after each control, each held for a time step, by the classical Runge-Kutta method of fourth order."""
        h = self._time_step / substeps
        p, rate, c = self.split(x)
        found = [x]

        def slope(y: tuple[Array, Array], u: Array) -> tuple[Array, Array]:
            return y[1], self.accelerations(y[0], y[1], c, u)

        def ahead(y: tuple[Array, Array], k: tuple[Array, Array], h: float) -> tuple[Array, Array]:
            return y[0] + h * k[0], y[1] + h * k[1]

        y = p, rate
        for u in controls:
            for _ in range(substeps):
                a = slope(y, u)
                b = slope(ahead(y, a, 0.5 * h), u)
                d = slope(ahead(y, b, 0.5 * h), u)
                e = slope(ahead(y, d, h), u)
                mean = tuple((a[i] + 2.0 * b[i] + 2.0 * d[i] + e[i]) / 6.0 for i in (0, 1))
                y = ahead(y, (mean[0], mean[1]), h)
            found.append(np.concatenate([*y, c]))
        return np.array(found)

    def by_mujoco(self, copies: int, substeps: int, presses: Mapping[str, float] | None = None) -> Plant:
        """The same as MuJoCo moves it; with its own contacts where forces on them are given."""
        robot = Robot(*self._given, presses=presses)
        return Plant(robot, copies, self._time_step, substeps)

    def pressed(self, x: Array) -> dict[str, tuple[Array, Array, Array]]:
        """Depths, normal forces, and where it touches, of each contact along states (N + 1, n), by its law."""
        plant = self.by_mujoco(len(x), 1)
        plant.put(x, np.zeros((len(x), len(self.robot.controls))))
        mujoco.mj_step1(plant.mj, plant.data)
        found = {}
        for name, law in self.contacts.items():
            _, _, depths, forces = plant.touch(name)
            normal = forces @ law.normal
            found[name] = depths, normal, law.touches(depths, normal)
        return found

    def pressed_by_mujoco(self, x: Array, controls: Array, substeps: int) -> dict[str, Array]:
        """The normal force of MuJoCo's own contacts at every step, by name, as MuJoCo moves the bodies; each (N + 1,)."""
        plant = self.by_mujoco(1, substeps, dict.fromkeys(self.contacts, 0.0))
        state = x[None]
        forces = [dict.fromkeys(self.contacts, 0.0)]
        for u in controls:
            state = plant.step(state, u[None])
            forces.append({name: float(force[0]) for name, force in plant.pressed().items()})
        return {name: np.array([now[name] for now in forces]) for name in self.contacts}
