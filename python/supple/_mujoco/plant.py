"""Many copies of a robot in one MuJoCo model, stepped together."""

from __future__ import annotations

import re
from collections.abc import Callable

import mujoco
import numpy as np

from .._records import Array
from ..errors import UsageError
from .bodies import FLUID
from .laws import turned, turned_back
from .robot import POINT, STICKING, Robot, compiled
from .simulator import QUIET

__all__ = ["Plant"]

#: Rates above this, rad/s or m/s, count as diverged: MuJoCo is not to see what is not finite.
_WILD = 1e6


class Plant:
    """Copies of a robot, moved by MuJoCo; ``R`` copies, ``n`` states in supple's order, ``m`` controls.

    Bushings and contacts are forces on bodies, found anew at each of MuJoCo's steps; smooth friction in joints is damping by
    ``phi / sqrt(v^2 + v_phi^2)``, found anew too.

    Args:
        robot: The robot.
        copies: How many.
        time_step: Length of a step of supple's, s.
        substeps: Steps of MuJoCo's in each.
    """

    def __init__(self, robot: Robot, copies: int, time_step: float, substeps: int) -> None:
        self.robot, self.copies, self._time_step = robot, copies, time_step
        every = mujoco.MjSpec()
        # Keep the masses unchanged: the bounds in the robot file have been applied already.
        single = compiled(robot.spec.copy())
        for key in ("gravity", "cone", *FLUID):
            setattr(every.option, key, getattr(robot.spec.option, key))
        every.compiler.boundmass, every.compiler.boundinertia = 1e-12, 1e-15
        for copy in range(copies):
            every.attach(robot.spec.copy(), prefix=f"{copy}:", frame=every.worldbody.add_frame())
        self.mj = compiled(every)
        options = self.mj.opt
        options.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        options.tolerance, options.iterations, options.ls_tolerance = 1e-12, 100, 1e-4
        options.impratio = STICKING
        options.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.data = mujoco.MjData(self.mj)
        self._least, self._most = (np.full((copies, int(single.nu)), sign * np.inf) for sign in (1.0, -1.0))
        if robot.inertias:
            for copy in range(copies):
                for name, moments in robot.inertias.items():
                    self.mj.body(f"{copy}:{name}").inertia = moments
            mujoco.mj_setConst(self.mj, self.data)
        self.substeps = substeps
        self._views(single)

    def _views(self, single: mujoco.MjModel) -> None:
        """Views of MuJoCo's arrays by copy, and the indices of their contents."""
        robot, data, R = self.robot, self.data, self.copies
        self._qpos, self._qvel = data.qpos.reshape(R, -1), data.qvel.reshape(R, -1)
        self._ctrl, self._force = data.ctrl.reshape(R, -1), data.actuator_force.reshape(R, -1)
        self._place = data.xpos[1:].reshape(R, -1, 3)
        self._turn = data.xmat[1:].reshape(R, -1, 3, 3)
        self._centre = data.xipos[1:].reshape(R, -1, 3)
        self._velocity = data.cvel[1:].reshape(R, -1, 6)
        self._loads = data.xfrc_applied[1:].reshape(R, -1, 6)
        self._of_tree = data.subtree_com
        self._root = self.mj.body_rootid[1:].reshape(R, -1)
        self._mocap = data.mocap_pos.reshape(R, -1, 3)
        self._body = {single.body(i).name: i - 1 for i in range(single.nbody)}
        self._file_joints = [single.joint(name).id for name in robot.row]
        self._motors = [single.joint(f"motor {name}").id for name in robot.motors]
        self._leaders = [self._file_joints[robot.row[name]] for name in robot.joints]
        self._damping, self._plain_damping = self.mj.dof_damping.reshape(R, -1), single.dof_damping.copy()
        self._sliding = [int(single.joint(name).dofadr[0]) for name in robot.friction]
        self._friction = np.array(list(robot.friction.values()))
        # Columns of supple's controls in MuJoCo's order.
        self._columns = [robot.controls.index(single.actuator(i).name) for i in range(single.nu)]
        self._gears = single.actuator_gear[:, 0].copy()
        self._dofs = {name: self._file_joints[robot.row[name]] for name in robot.joints}
        self._dofs |= dict(zip(robot.motors, self._motors, strict=True))
        # Drives are called after their joints, or after the actuators of the file; what several of them exert together on a
        # joint is the effort of none.
        joints = [single.joint(int(single.actuator_trnid[i, 0])).name.removeprefix("motor ") for i in range(single.nu)]
        drives = {single.actuator(i).name.partition(".")[2]: joint for i, joint in enumerate(joints)}
        self._moved = {
            name: joint for name, joint in drives.items() if joints.count(joint) == 1 and joint in self._dofs
        }
        self._recalled = [self._recalling(name) for name in robot.states if name.startswith("last.")]
        self._walls = [int(single.body_mocapid[single.body(f"wall {name}").id]) for name in self._own_walls()]

    def _own_walls(self) -> list[str]:
        return list(self.robot.contacts) if self.robot.own_contacts else []

    @property
    def substeps(self) -> int:
        """MuJoCo steps per step of supple."""
        return self._substeps

    @substeps.setter
    def substeps(self, count: int) -> None:
        self._substeps = count
        self.mj.opt.timestep = self._time_step / count

    @property
    def moving(self) -> int:
        """How many positions there are among the states: of joints and motors."""
        return len(self.robot.joints) + len(self.robot.motors)

    @property
    def constants(self) -> int:
        """How many of the states are places of walls."""
        return len(self.robot.contacts)

    def step(self, states: Array, controls: Array) -> Array:
        """The states (R, n) after a step of supple's from states (R, n) under controls (R, m); NaN where one diverges."""
        self.put(states, controls)
        wild = np.zeros(self.copies, dtype=bool)
        with QUIET:
            for step in range(self._substeps):
                if self._recalled and step == self._substeps - 1:
                    before = self.states()
                self._slide()
                mujoco.mj_step1(self.mj, self.data)
                self.apply()
                mujoco.mj_step2(self.mj, self.data)
                np.minimum(self._least, self._force, out=self._least)
                np.maximum(self._most, self._force, out=self._most)
                beyond = ~(np.abs(self._qvel) < _WILD).all(axis=1)
                if beyond.any():
                    wild |= beyond
                    self._qpos[beyond] = self._rest
                    self._qvel[beyond] = 0.0
                    self.data.qacc_warmstart.reshape(self.copies, -1)[beyond] = 0.0
        found = self.states()
        if self._recalled:
            efforts = self.data.qfrc_actuator.reshape(self.copies, -1)
            recalled = (recall(before, controls, found, efforts) for recall in self._recalled)
            found = np.column_stack([found, *recalled])
        found[wild] = np.nan
        return found

    def peaks(self) -> dict[str, tuple[Array, Array]]:
        """The least and the greatest effort, (R,), that each drive has exerted within any step, by ``effort of DRIVE``."""
        found = {}
        for place, column in enumerate(self._columns):
            ends = np.array([self._least[:, place], self._most[:, place]]) * self._gears[place]
            found[f"effort of {self.robot.controls[column].partition('.')[2]}"] = ends.min(axis=0), ends.max(axis=0)
        return found

    def _recalling(self, name: str) -> Callable[[Array, Array, Array, Array], Array]:
        """What a state ``last.NAME`` keeps of the last of MuJoCo's steps (R.28), (R,): from the states before it, the controls,
        the states after it, and the efforts of drives."""
        robot, plain = self.robot, name.removeprefix("last.")
        # Further sensors of the same number have a number of their own.
        for what in (plain, re.sub(r"\.\d+$", "", plain)):
            kind, _, rest = what.rpartition(" of ") if " of " in what else what.partition(".")
            if what in robot.states:
                place = robot.states.index(what)
                return lambda x, u, after, efforts: x[:, place]
            if what in robot.controls:
                place = robot.controls.index(what)
                return lambda x, u, after, efforts: u[:, place]
            if kind == "a" and f"v.{rest}" in robot.states:
                place = robot.states.index(f"v.{rest}")
                return lambda x, u, after, efforts: (after[:, place] - x[:, place]) / self.mj.opt.timestep
            if kind in ("effort", "power") and rest in self._moved:
                dof, place = self._dofs[self._moved[rest]], robot.states.index(f"v.{self._moved[rest]}")
                if kind == "effort":
                    return lambda x, u, after, efforts: efforts[:, dof]
                return lambda x, u, after, efforts: efforts[:, dof] * x[:, place]
        raise UsageError(f"what `{name}` keeps is not known in MuJoCo")

    @property
    def _rest(self) -> Array:
        return np.asarray(self.mj.qpos0.reshape(self.copies, -1)[0])

    def put(self, states: Array, controls: Array) -> None:
        """Moves the copies to states and holds controls."""
        robot = self.robot
        count, moving = len(robot.joints), self.moving
        q, v = states[:, :moving], states[:, moving : 2 * moving]
        self._c = states[:, 2 * moving : 2 * moving + self.constants]
        self._qpos[:, self._file_joints] = q[:, :count] @ robot.G.T + robot.offset
        self._qvel[:, self._file_joints] = v[:, :count] @ robot.G.T
        self._qpos[:, self._motors], self._qvel[:, self._motors] = q[:, count:], v[:, count:]
        self._ctrl[:] = controls[:, self._columns]
        self._warm()
        self._slide()
        for place, (wall, name) in enumerate(zip(self._walls, self._own_walls())):
            contact = robot.contacts[name]
            back = contact.radius - (contact.radius or POINT)
            self._mocap[:, wall] = contact.point + (self._c[:, place] + back)[:, None] * contact.normal

    def _warm(self) -> None:
        # The step must depend on state and controls only.
        self.data.qacc_warmstart[:] = 0.0

    def _slide(self) -> None:
        """Friction in joints (R.8), as damping at the current rates."""
        if self._sliding:
            speed = np.sqrt(self._qvel[:, self._sliding] ** 2 + self.robot.smoothing**2)
            self._damping[:, self._sliding] = self._plain_damping[self._sliding] + self._friction / speed

    def states(self) -> Array:
        """States (R, n) of the copies, without what sensors recall of the last step."""
        moving = [*self._leaders, *self._motors]
        return np.hstack([self._qpos[:, moving], self._qvel[:, moving], self._c])

    def apply(self) -> None:
        """Applies the forces of bushings and of supple's contact law to the bodies at their current places."""
        self._loads[:] = 0.0
        for bushing in self.robot.bushings.values():
            (a, pa, Ra), (b, pb, Rb) = self.frame(bushing.frame_a), self.frame(bushing.frame_c)
            (va, wa), (vb, wb) = self._moves(a, pa), self._moves(b, pb)
            rate = vb - va - np.cross(wa, pb - pa)
            p, omega = turned_back(Ra, pb - pa), turned_back(Ra, wb - wa)
            torque, force = bushing.loads(p, np.swapaxes(Ra, -1, -2) @ Rb, turned_back(Ra, rate), omega)
            # The force acts on both at the same point, half-way between the frames.
            middle, force, torque = 0.5 * (pa + pb), turned(Ra, force), turned(Ra, torque)
            self._load(b, middle, force, torque)
            self._load(a, middle, -force, -torque)
        if not self.robot.own_contacts:
            for name in self.robot.contacts:
                body, point, _, force = self.touch(name)
                self._load(body, point, force, np.zeros_like(force))

    def touch(self, name: str) -> tuple[int, Array, Array, Array]:
        """Of a contact: the body, the point that touches (R, 3), its depth (R,), and the force on the body (R, 3)."""
        contact = self.robot.contacts[name]
        body, p, _ = self.frame(contact.frame)
        point = p - contact.radius * contact.normal
        depth = contact.depth(p, self._c[:, list(self.robot.contacts).index(name)])
        velocity, _ = self._moves(body, point)
        return body, point, depth, contact.force(depth, velocity)

    def frame(self, name: str) -> tuple[int, Array, Array]:
        """Body, place (R, 3) and turn (R, 3, 3) of a frame in the world; body -1 is the world."""
        if name not in self.robot.frames:
            raise UsageError(f"frame `{name}` is not among MuJoCo's bodies and sites")
        on, place, turn = self.robot.frames[name]
        body = self._body[on]
        if body < 0:
            return body, np.broadcast_to(place, (self.copies, 3)), np.broadcast_to(turn, (self.copies, 3, 3))
        R = self._turn[:, body]
        return body, self._place[:, body] + R @ place, R @ turn

    def _moves(self, body: int, point: Array) -> tuple[Array, Array]:
        """Velocity of a point that a body carries, and the body's angular velocity, each (R, 3)."""
        if body < 0:
            return np.zeros_like(point), np.zeros_like(point)
        omega, of_centre = self._velocity[:, body, :3], self._velocity[:, body, 3:]
        return of_centre + np.cross(omega, point - self._of_tree[self._root[:, body]]), omega

    def _load(self, body: int, point: Array, force: Array, torque: Array) -> None:
        if body >= 0:
            self._loads[:, body, :3] += force
            self._loads[:, body, 3:] += torque + np.cross(point - self._centre[:, body], force)

    def mean_forces(self, states: Array, controls: Array) -> dict[str, float]:
        """The mean normal force of supple's law of contact over the states at which it touches, N, by contact."""
        self.put(states, controls)
        mujoco.mj_step1(self.mj, self.data)
        found = {}
        for name, contact in self.robot.contacts.items():
            _, _, depth, force = self.touch(name)
            normal = force @ contact.normal
            touching = contact.touches(depth, normal)
            found[name] = float(normal[touching].mean()) if touching.any() else 0.0
        return found

    def pressed(self) -> dict[str, Array]:
        """Normal forces of MuJoCo's own contacts by name, N, (R,)."""
        found = {name: np.zeros(self.copies) for name in self.robot.contacts}
        force = np.zeros(6)
        for index, contact in enumerate(self.data.contact):
            mujoco.mj_contactForce(self.mj, self.data, index, force)
            copy, _, name = self.mj.geom(contact.geom[0]).name.partition(":")
            found[name.partition(" ")[2]][int(copy)] = force[0]
        return found
