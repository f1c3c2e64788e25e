"""The robot of a task file a second time: its bodies by MuJoCo, its compliance by the formulas of the theory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from robot_bodies import bodies, quaternion_of, turn_of
from robot_laws import Bushing, Contact, ElasticJoint, Spring

Array = NDArray[np.float64]

#: What of ``[model]`` is known here. A task with other keys moves in another way than its twin: teach it these.
MODEL = {"kind", "file", "gravity", "actuated", "frames", "compliance", "sensors", "integrator", "substeps"}
LAWS: dict[str, type] = {"bushing": Bushing, "contact": Contact, "spring": Spring, "elastic_joint": ElasticJoint}
#: Numbers that a task may leave out.
DEFAULTS = {"point": [0.0, 0.0, 0.0], "rest": 0.0, "friction": 0.0, "slip": 1e-2}
TEXTS = ("frame", "frame_a", "frame_c", "joint")
#: Radius of the spheres that stand for points where MuJoCo's own contacts are used, m.
POINT = 1e-3


class Twin:
    """Bodies, drives and compliance of a task's robot.

    Args:
        model: The table ``[model]`` of the task file.
        folder: The folder of the task file.
        values: Parameters by name.
        states: Names of supple's states, which give the order of positions.
        walls: Where the walls stand: MuJoCo's own contacts are then used in place of the law of contact.
    """

    def __init__(
        self,
        model: Mapping[str, Any],
        folder: Path,
        values: Mapping[str, float],
        states: Sequence[str],
        walls: Mapping[str, float] | None = None,
    ) -> None:
        unknown = set(model) - MODEL
        assert not unknown, f"teach the twin of robots the keys {sorted(unknown)} of [model]"
        self._values = values
        spec = bodies(folder / model["file"])
        self._frames: dict[str, tuple[str, Array, Array]] = {}
        self._read_frames(spec, model.get("frames", {}))
        self.laws = {law["name"]: self._law(law) for law in model.get("compliance", [])}
        self.contacts = {name: law for name, law in self.laws.items() if isinstance(law, Contact)}
        self.uses_law_of_contact = walls is None
        for name, wall in (walls or {}).items():
            self._add_wall(spec, name, wall)
        self._equalities = [list(np.asarray(equality.data[:5])) for equality in spec.equalities]
        followers = [(equality.name1, equality.name2) for equality in spec.equalities]

        self.mj = spec.compile()
        if "gravity" in model:
            self.mj.opt.gravity[:] = [self._number(entry) for entry in model["gravity"]]
        assert not self.mj.dof_frictionloss.any(), "teach the twin of robots the friction of joints"
        self.data = mujoco.MjData(self.mj)
        self._coordinates(states, followers)
        actuated = model.get("actuated", self.joints)
        self._drives = [self._driven(joint) for joint in actuated]

    # Files.

    def _number(self, value: float | str) -> float:
        return self._values[value] if isinstance(value, str) else float(value)

    def _law(self, table: Mapping[str, Any]) -> Any:
        kind = LAWS.get(table["kind"])
        assert kind is not None, f"teach the twin of robots compliance of kind {table['kind']}"
        needed = set(kind.__dataclass_fields__)
        unknown = set(table) - needed - {"kind", "name"}
        assert not unknown, f"teach the twin of robots the keys {sorted(unknown)} of {table['name']}"
        found: dict[str, Any] = {}
        for key in needed:
            given = table.get(key, DEFAULTS.get(key, 0.0))
            if key in TEXTS:
                found[key] = given
            elif isinstance(given, list):
                found[key] = np.array([self._number(entry) for entry in given])
            else:
                found[key] = self._number(given)
        if kind is Contact:
            found["normal"] = found["normal"] / np.linalg.norm(found["normal"])
        return kind(**found)

    def _read_frames(self, spec: mujoco.MjSpec, own: Mapping[str, Any]) -> None:
        """Bodies, sites, and the task's own frames: body, place and turn."""
        for body in spec.bodies:
            self._frames[body.name] = body.name, np.zeros(3), np.eye(3)
        for site in spec.sites:
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, site.quat)
            self._frames[site.name] = site.parent.name, np.array(site.pos), turn.reshape(3, 3)
        for name, table in own.items():
            body, p, R = self._frames[table["on"]]
            place, rpy = (np.array([self._number(n) for n in table.get(k, [0.0] * 3)]) for k in ("position", "rpy"))
            self._frames[name] = body, p + R @ place, R @ turn_of(rpy)

    def _add_wall(self, spec: mujoco.MjSpec, name: str, wall: float) -> None:
        """A sphere on the frame of a contact and a plane at its wall, which collide with one another alone."""
        law = self.contacts[name]
        body, place, _ = self._frames[law.frame]
        radius = law.radius or POINT
        on = spec.body(body)
        on.add_geom(name=f"{name} body", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], pos=place, mass=0)
        # The plane's normal is its z axis.
        e = law.normal
        side = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
        side /= np.linalg.norm(side)
        turn = np.column_stack([side, np.cross(e, side), e])
        back = law.radius - radius
        origin = law.point + (wall + back) * e
        spec.worldbody.add_geom(
            name=f"{name} wall",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[1, 1, 1],
            pos=origin,
            quat=quaternion_of(turn),
        )
        for geom in (f"{name} body", f"{name} wall"):
            spec.geom(geom).contype = spec.geom(geom).conaffinity = 0
        pair = spec.add_pair(name=name, geomname1=f"{name} body", geomname2=f"{name} wall")
        pair.condim = 3 if law.friction else 1
        pair.friction[:2] = law.friction
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC

    def _coordinates(self, states: Sequence[str], followers: Sequence[tuple[str, str]]) -> None:
        """Which positions are supple's, and how the others follow them: ``qpos = G q + offset``."""
        names = [self.mj.joint(i).name for i in range(self.mj.njnt)]
        self.motors = {name: law for name, law in self.laws.items() if isinstance(law, ElasticJoint)}
        positions = [name.removeprefix("q.") for name in states if name.startswith("q.")]
        self.joints = [name for name in positions if name not in self.motors]
        assert set(self.joints) <= set(names), f"{self.joints} are not all joints of MuJoCo's {names}"
        assert positions == [*self.joints, *self.motors]
        constants = [name.removeprefix("c.") for name in states if name.startswith("c.")]
        assert constants == list(self.contacts)
        self._row = {name: row for row, name in enumerate(names)}
        self._G = np.zeros((len(names), len(self.joints)))
        self._offset = np.zeros(len(names))
        for column, name in enumerate(self.joints):
            self._G[self._row[name], column] = 1.0
        for (follower, leader), data in zip(followers, self._equalities):
            assert not any(data[2:]), f"{follower} follows {leader} by more than a line"
            here, there = self._row[follower], self._row[leader]
            self._G[here] = data[1] * self._G[there]
            rest = self.mj.qpos0[here] + data[0] - data[1] * self.mj.qpos0[there]
            self._offset[here] = rest + data[1] * self._offset[there]
        assert self._G.any(axis=1).all(), "a joint of MuJoCo's is no position of supple's and follows none"

    def _driven(self, joint: str) -> tuple[int, int | None]:
        """The row of a drive's joint, and the place of its motor where the joint is elastic."""
        elastic = [place for place, law in enumerate(self.motors.values()) if law.joint == joint]
        return self._row[joint], elastic[0] if elastic else None

    # Motion.

    def split(self, x: Array) -> tuple[Array, Array, Array]:
        """Positions, rates and constants of a state of supple's."""
        count = len(self.joints) + len(self.motors)
        return x[:count], x[count : 2 * count], x[2 * count :]

    def put(self, p: Array, rate: Array) -> None:
        """Moves MuJoCo's bodies to positions and rates in the order of supple's."""
        count = len(self.joints)
        self.data.qpos[:] = self._G @ p[:count] + self._offset
        self.data.qvel[:] = self._G @ rate[:count]
        mujoco.mj_fwdPosition(self.mj, self.data)
        mujoco.mj_fwdVelocity(self.mj, self.data)

    def frame(self, name: str) -> tuple[int, Array, Array]:
        """Body, place and turn of a frame in the world."""
        body, place, turn = self._frames[name]
        index = self.mj.body(body).id
        R = self.data.xmat[index].reshape(3, 3)
        return index, self.data.xpos[index] + R @ place, R @ turn

    def jacobian(self, body: int, point: Array) -> tuple[Array, Array]:
        """Of the velocity of a point of the world that a body carries, and of the body's angular velocity."""
        linear, angular = np.zeros((3, self.mj.nv)), np.zeros((3, self.mj.nv))
        mujoco.mj_jac(self.mj, self.data, linear, angular, point, body)
        return linear, angular

    def touch(self, name: str, c: float) -> tuple[float, Array, Array]:
        """Depth of a contact, the force on the body in the world, and the Jacobian of the point that touches."""
        law = self.contacts[name]
        body, p, _ = self.frame(law.frame)
        J, _ = self.jacobian(body, p - law.radius * law.normal)
        depth = law.depth(p, c)
        return depth, law.force(depth, J @ self.data.qvel), J

    def applied(self, s: Array, s_rate: Array, c: Array, u: Array) -> tuple[Array, Array]:
        """Forces of drives and compliance on MuJoCo's joints and on the motors, where the bodies are."""
        tau, on_motors, motor = np.zeros(self.mj.nv), np.zeros(len(self.motors)), 0
        for (row, elastic), force in zip(self._drives, u):
            if elastic is None:
                tau[row] += force
            else:
                on_motors[elastic] += force
        q, v = self.data.qpos, self.data.qvel
        for law in self.laws.values():
            if isinstance(law, Spring):
                row = self._row[law.joint]
                tau[row] += law.torque(q[row], v[row])
            elif isinstance(law, ElasticJoint):
                row = self._row[law.joint]
                torque = law.torque(q[row], v[row], s[motor], s_rate[motor])
                tau[row] += torque
                on_motors[motor] -= torque + law.motor_damping * s_rate[motor]
                motor += 1
            elif isinstance(law, Bushing):
                tau += self._bushing(law)
        if self.uses_law_of_contact:
            for name, wall in zip(self.contacts, c):
                _, force, J = self.touch(name, wall)
                tau += J.T @ force
        return tau, on_motors

    def _bushing(self, law: Bushing) -> Array:
        (a, pa, Ra), (b, pb, Rb) = self.frame(law.frame_a), self.frame(law.frame_c)
        v = self.data.qvel
        (at_a, turn_a), (at_c, turn_c) = self.jacobian(a, pa), self.jacobian(b, pb)
        rate = (at_c - at_a) @ v - np.cross(turn_a @ v, pb - pa)
        torque, force = law.loads(Ra.T @ (pb - pa), Ra.T @ Rb, Ra.T @ rate, Ra.T @ ((turn_c - turn_a) @ v))
        # The force acts on both at the same point, half-way.
        middle = 0.5 * (pa + pb)
        apart = self.jacobian(b, middle)[0] - self.jacobian(a, middle)[0]
        return apart.T @ (Ra @ force) + (turn_c - turn_a).T @ (Ra @ torque)

    def accelerations(self, p: Array, rate: Array, c: Array, u: Array) -> Array:
        """Of all positions, with joints that follow others held to them."""
        count = len(self.joints)
        self.put(p, rate)
        tau, on_motors = self.applied(p[count:], rate[count:], c, u)
        M = np.zeros((self.mj.nv, self.mj.nv))
        mujoco.mj_fullM(self.mj, self.data, M)
        G = self._G
        forces = G.T @ (tau + self.data.qfrc_passive - self.data.qfrc_bias)
        inertias = np.array([law.motor_inertia for law in self.motors.values()])
        return np.concatenate([np.linalg.solve(G.T @ M @ G, forces), on_motors / inertias])

    def move(self, x: Array, controls: Array, time_step: float, substeps: int) -> Array:
        """States after each control, each held for a time step, by the classical Runge-Kutta method of fourth order."""
        h = time_step / substeps
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

    def move_by_mujoco(self, x: Array, controls: Array, time_step: float, substeps: int) -> dict[str, Array]:
        """The normal force of MuJoCo's own contacts at every step, by name, as MuJoCo moves the bodies; each (N + 1,)."""
        self.mj.opt.timestep = h = time_step / substeps
        p, rate, c = self.split(x)
        count = len(self.joints)
        self.put(p, rate)
        mujoco.mj_forward(self.mj, self.data)
        s, s_rate = p[count:].copy(), rate[count:].copy()
        inertias = np.array([law.motor_inertia for law in self.motors.values()])
        forces = [self.pressed()]
        for u in controls:
            for _ in range(substeps):
                mujoco.mj_step1(self.mj, self.data)
                tau, on_motors = self.applied(s, s_rate, c, u)
                self.data.qfrc_applied[:] = tau
                mujoco.mj_step2(self.mj, self.data)
                s_rate = s_rate + h * on_motors / inertias
                s = s + h * s_rate
            forces.append(self.pressed())
        return {name: np.array([now[name] for now in forces]) for name in self.contacts}

    def pressed(self) -> dict[str, float]:
        """Normal forces of MuJoCo's own contacts by name, N."""
        found = dict.fromkeys(self.contacts, 0.0)
        force = np.zeros(6)
        for index, contact in enumerate(self.data.contact):
            pair = {self.mj.geom(geom).name for geom in contact.geom}
            mujoco.mj_contactForce(self.mj, self.data, index, force)
            for name in found:
                if pair == {f"{name} body", f"{name} wall"}:
                    found[name] = float(force[0])
        return found
