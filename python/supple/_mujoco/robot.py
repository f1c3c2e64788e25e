"""A second model of a task file's robot, in MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from .._records import Array
from ..errors import FileError, UsageError
from .bodies import again, bodies, set_linear
from .laws import Bushing, Contact, ElasticJoint, Law, Spring, law, numbers
from .rotations import quaternion_of, turn_of

__all__ = ["FACTORS", "Robot", "compiled"]

#: What of ``[model]`` is known here, or moves nothing: a task with other keys moves in another way than its twin.
MODEL = {"kind", "file", "gravity", "actuated", "file_actuators", "independent_mimic", "links", "joints", "frames"}
MODEL |= {"compliance", "sensors", "integrator", "substeps", "friction_smoothing", "enforce_effort_limits"}
MODEL |= {"package_roots", "insert", "locked", "drives"}
LINK, JOINT = {"mass", "inertia_scale", "center"}, {"damping", "friction", "armature", "stiffness", "rest"}
INSERT = {"name", "frame", "position", "rpy", "axes", "carries", "mass", "center", "inertia", "stiffness", "damping"}
FRAME, DRIVE = {"on", "position", "rpy"}, {"gear", "rotor_inertia", "kp", "kv"}
#: Speed over which friction in joints builds up where the task says nothing, rad/s or m/s.
SMOOTHING = 1e-2
#: Factors on numbers of the robot's file.
FACTORS = ("mass", "damping", "stiffness", "friction")
#: Radius of the spheres that stand for points where MuJoCo's own contacts are used, m.
POINT = 1e-3
#: Impedance of MuJoCo's own contacts: small, so that they are springs and dampers whatever the body's acceleration.
IMPEDANCE = 1e-3
#: By which share sliding at 1 m/s raises the normal force of MuJoCo's own contacts, whose friction is a convex problem.
SLIDING = 1e-2
#: How much stiffer friction is than the normal force: at its limit, a sticking contact creeps by the square of the
#: coefficient over ``IMPEDANCE SLIDING STICKING``, .16 mm/s with a coefficient of .4.
STICKING = 1e8
#: Where MuJoCo wants a number for an end that a range has not.
FAR = 1e9


class Robot:
    """Bodies, drives and compliance of a task's robot.

    Bodies, damping and springs in joints, elastic joints and drives are MuJoCo's; bushings, friction in joints, and contacts
    where no ``presses`` are given, are laws that somebody has to apply.

    Args:
        model: The table ``[model]`` of the task file.
        source: Path of the robot's file, and the texts of it and of all that it includes, by path.
        values: Numbers by what stands for them: names of parameters, and expressions of parameters where the task has any.
        channels: Names of supple's states and controls.
        factors: Factors on numbers of the file, by the names of :data:`FACTORS`.
        presses: Force of each contact at which MuJoCo's own contacts have the damping of its law, N: they are then used in
            place of that law.
        stops: What stops the robot, lower and upper end: positions ``q.JOINT`` and controls by the names of supple's
            channels, and ``effort of DRIVE``. Everything else, and without them all, goes as far as it is driven.

    Raises:
        UsageError: Where the task has what this twin has not.
        FileError: Where MuJoCo cannot read the robot's file.
    """

    def __init__(
        self,
        model: Mapping[str, Any],
        source: tuple[str, Mapping[str, str]],
        values: Mapping[str, float],
        channels: tuple[Sequence[str], Sequence[str]],
        factors: Mapping[str, float] | None = None,
        presses: Mapping[str, float] | None = None,
        stops: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        if model["kind"] != "robot":
            raise UsageError(f"model is of kind `{model['kind']}`: MuJoCo can move robots from files")
        _known("[model]", model, MODEL)
        self._values = values
        states, controls = channels
        self.controls = list(controls)
        locked = model.get("locked", {})
        held = dict.fromkeys(locked) if isinstance(locked, list) else {k: float(v) for k, v in locked.items()}
        inserts = model.get("insert", [])
        mounted = {f"{entry['name']}_{axis}" for entry in inserts for axis in entry["axes"]}
        of_file = {name: at for name, at in held.items() if name not in mounted}
        read = bodies(*source, of_file, bool(model.get("independent_mimic", False)))
        self.spec, self.inertias = read.spec, read.inertias
        self.laws: dict[str, Law] = {entry["name"]: law(entry, values) for entry in model.get("compliance", [])}
        self.contacts = {name: law for name, law in self.laws.items() if isinstance(law, Contact)}
        self.bushings = {name: law for name, law in self.laws.items() if isinstance(law, Bushing)}
        self.motors = {name: law for name, law in self.laws.items() if isinstance(law, ElasticJoint)}
        self.own_contacts = presses is not None
        if "gravity" in model:
            self.spec.option.gravity = numbers(model["gravity"], values)
        for entry in inserts:
            self._insert(entry)
        if mounted & set(held):
            self.spec = again(compiled(self.spec), {name: held[name] for name in mounted & set(held)})
            self.laws = {name: law for name, law in self.laws.items() if name not in mounted & set(held)}
        self._overrides(model)
        self._scale(factors or {})
        self.frames = self._read_frames(model.get("frames", {}))
        self._coordinates(states)
        for entry in self.laws.values():
            if isinstance(entry, Spring):
                self._add_spring(entry)
        for name, motor in self.motors.items():
            self._add_motor(name, motor)
        self._drive(controls, model)
        self._stop(stops or {})
        self.smoothing = float(numbers(model.get("friction_smoothing", SMOOTHING), values))
        self.friction = self._take_friction()
        if presses is not None:
            mj = compiled(self.spec.copy())
            for name, force in presses.items():
                self._add_wall(name, force, mj)

    # Joints that the task inserts.

    def _insert(self, entry: Mapping[str, Any]) -> None:
        """A body on the frame, with all joints of the mount and their springs."""
        _known(f"insert `{entry.get('name')}`", entry, INSERT)
        name, axes = entry["name"], entry["axes"]
        body, p, R = _frame(self._read_frames({}), entry["frame"], f"insert `{name}`")
        place, rpy = (numbers(entry.get(key, [0.0] * 3), self._values) for key in ("position", "rpy"))
        pose = {"pos": p + R @ place, "quat": quaternion_of(R @ turn_of(rpy))}
        parent = self.spec.body(body)
        beyond = parent.add_body(name=name, **pose)
        mass = numbers(entry.get("mass", 0.0), self._values)
        beyond.mass, beyond.inertia = float(mass), numbers(entry.get("inertia", [0.0] * 3), self._values)
        beyond.ipos = numbers(entry.get("center", [0.0] * 3), self._values)
        beyond.explicitinertial = True
        count = len(axes)
        stiffness, damping = (
            np.broadcast_to(numbers(entry.get(key, 0.0), self._values), (count,)) for key in ("stiffness", "damping")
        )
        for axis, k, d in zip(axes, stiffness, damping, strict=True):
            turns = axis.startswith("r")
            kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
            along = np.eye(3)["xyz".index(axis[-1])]
            beyond.add_joint(name=f"{name}_{axis}", type=kind, axis=along)
            self.laws[f"{name}_{axis}"] = Spring(f"{name}_{axis}", float(k), float(d))
        if entry.get("carries"):
            self.spec = again(compiled(self.spec), {}, carried=dict.fromkeys(entry["carries"], name))

    # Numbers of the file.

    def _overrides(self, model: Mapping[str, Any]) -> None:
        for name, table in model.get("links", {}).items():
            _known(f"links.{name}", table, LINK)
            body, given = self.spec.body(name), {key: numbers(entry, self._values) for key, entry in table.items()}
            if body is None:
                raise UsageError(f"links: `{name}` is not among MuJoCo's bodies")
            body.mass = given.get("mass", body.mass)
            scale = given.get("inertia_scale", 1.0)
            self._scale_inertia(body, scale)
            body.ipos = given.get("center", body.ipos)
        for name, table in model.get("joints", {}).items():
            _known(f"joints.{name}", table, JOINT)
            joint, given = self.spec.joint(name), {key: numbers(entry, self._values) for key, entry in table.items()}
            if joint is None:
                raise UsageError(f"joints: `{name}` is not among MuJoCo's joints that move")
            set_linear(joint, "damping", given.get("damping", _linear(joint.damping)))
            set_linear(joint, "stiffness", given.get("stiffness", _linear(joint.stiffness)))
            joint.frictionloss = given.get("friction", joint.frictionloss)
            joint.armature = given.get("armature", joint.armature)
            if "rest" in given:
                joint.springref = given["rest"]

    def _scale(self, factors: Mapping[str, float]) -> None:
        mass, damping, stiffness, friction = (factors.get(name, 1.0) for name in FACTORS)
        for body in self.spec.bodies[1:]:
            body.mass *= mass
            self._scale_inertia(body, mass)
        joints = list(self.spec.joints)
        #: Which factors multiply any number of the file.
        self.scaled = {"mass"}
        self.scaled |= {"damping"} if any(_linear(joint.damping) for joint in joints) else set()
        self.scaled |= {"stiffness"} if any(_linear(joint.stiffness) for joint in joints) else set()
        self.scaled |= {"friction"} if any(joint.frictionloss for joint in joints) else set()
        for joint in joints:
            set_linear(joint, "damping", damping * _linear(joint.damping))
            set_linear(joint, "stiffness", stiffness * _linear(joint.stiffness))
            joint.frictionloss *= friction

    def _scale_inertia(self, body: mujoco.MjsBody, factor: float) -> None:
        body.inertia = np.array(body.inertia) * factor
        if body.name in self.inertias:
            self.inertias[body.name] = self.inertias[body.name] * factor

    def _take_friction(self) -> dict[str, float]:
        """Friction of joints by name: supple's is smoothed, MuJoCo's is dry friction."""
        found = {joint.name: float(joint.frictionloss) for joint in self.spec.joints if joint.frictionloss}
        for joint in self.spec.joints:
            joint.frictionloss = 0.0
        return found

    def _read_frames(self, own: Mapping[str, Any]) -> dict[str, tuple[str, Array, Array]]:
        """Bodies, sites, and the task's own frames: body, place and turn."""
        frames = {body.name: (body.name, np.zeros(3), np.eye(3)) for body in self.spec.bodies}
        for site in self.spec.sites:
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, site.quat)
            frames[site.name] = site.parent.name, np.array(site.pos), turn.reshape(3, 3)
        for name, table in own.items():
            _known(f"frames.{name}", table, FRAME)
            body, p, R = _frame(frames, table["on"], f"frames.{name}")
            place, rpy = (numbers(table.get(key, [0.0] * 3), self._values) for key in ("position", "rpy"))
            frames[name] = body, p + R @ place, R @ turn_of(rpy)
        return frames

    # Coordinates.

    def _coordinates(self, states: Sequence[str]) -> None:
        """Which positions are states of supple, and how the others depend on them: ``qpos = G q + offset``."""
        mj = compiled(self.spec.copy())
        if mj.nq != mj.njnt or mj.nv != mj.njnt:
            raise UsageError("a joint of the robot has more than one position: MuJoCo's twin has hinges and slides")
        names = [mj.joint(i).name for i in range(mj.njnt)]
        positions = [name.removeprefix("q.") for name in states if name.startswith("q.")]
        self.joints = [name for name in positions if name not in self.motors]
        missing = [name for name in self.joints if name not in names]
        if missing:
            raise UsageError(f"joint `{missing[0]}` is not among MuJoCo's {', '.join(names)}")
        self.states = list(states)
        self.row = {name: row for row, name in enumerate(names)}
        self.G, self.offset = np.zeros((len(names), len(self.joints))), np.zeros(len(names))
        for column, name in enumerate(self.joints):
            self.G[self.row[name], column] = 1.0
        # Repeated, as followers may follow other followers.
        follows = [one for one in self.spec.equalities if one.type == mujoco.mjtEq.mjEQ_JOINT]
        for equality in follows * len(follows):
            data = np.asarray(equality.data[:5])
            here, there = self.row[equality.name1], self.row[equality.name2]
            if data[2:].any():
                raise UsageError(f"joint `{equality.name1}` follows `{equality.name2}` by more than a line")
            self.G[here] = data[1] * self.G[there]
            rest = mj.qpos0[here] + data[0] - data[1] * mj.qpos0[there]
            self.offset[here] = rest + data[1] * self.offset[there]
            # As stiff as possible: in supple, followers follow exactly.
            equality.solimp, equality.solref = [0.9999, 0.9999, 1e-3, 0.5, 2.0], [1e-9, 1.0]
        free = [name for name, row in self.row.items() if not self.G[row].any()]
        if free:
            raise UsageError(
                f"joint `{free[0]}` moves in MuJoCo and is no position of the task: it may be locked there"
            )

    # What the compliance and the drives are in MuJoCo.

    def _add_spring(self, spring: Spring) -> None:
        joint = self.spec.joint(spring.joint)
        if joint is None:
            raise UsageError(f"spring: joint `{spring.joint}` is not among MuJoCo's joints that move")
        before = _linear(joint.stiffness)
        stiffness = before + spring.stiffness
        if stiffness > 0.0:
            joint.springref = (before * joint.springref + spring.stiffness * spring.rest) / stiffness
        set_linear(joint, "stiffness", stiffness)
        set_linear(joint, "damping", _linear(joint.damping) + spring.damping)

    def _add_motor(self, name: str, motor: ElasticJoint) -> None:
        """A body that turns by itself, and a tendon to the joint."""
        body = self.spec.worldbody.add_body(name=f"motor {name}", mass=1.0, inertia=[motor.motor_inertia] * 3)
        body.explicitinertial = True
        rotor = body.add_joint(name=f"motor {name}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        set_linear(rotor, "damping", motor.motor_damping)
        tendon = self.spec.add_tendon(name=f"motor {name}", springlength=[0.0, 0.0])
        set_linear(tendon, "stiffness", motor.stiffness)
        set_linear(tendon, "damping", motor.damping)
        tendon.wrap_joint(f"motor {name}", 1.0)
        tendon.wrap_joint(motor.joint, -1.0)

    def _drive(self, controls: Sequence[str], model: Mapping[str, Any]) -> None:
        """Actuators by the names of supple's controls: those of the file, and drives of joints and motors (R.8, R.25)."""
        elastic = {motor.joint: f"motor {name}" for name, motor in self.motors.items()}
        tables = {name: self._drive_table(name, table) for name, table in model.get("drives", {}).items()}
        own = {actuator.name: actuator for actuator in self.spec.actuators} if model.get("file_actuators", True) else {}
        for actuator in list(self.spec.actuators):
            if f"ctrl.{actuator.name}" not in controls or actuator.name not in own:
                self.spec.delete(actuator)
        for control in controls:
            kind, _, name = control.partition(".")
            table = tables.get(name, {})
            drive = own.get(name) if kind == "ctrl" else None
            if drive is not None:
                drive.name, joint = control, drive.target
                _change(drive, table)
            else:
                joint = name
                if self.spec.joint(joint) is None:
                    raise UsageError(
                        f"control `{control}`: MuJoCo's twin has neither an actuator nor a joint `{joint}`"
                    )
                drive = self.spec.add_actuator(name=control)
                drive.trntype, gear = mujoco.mjtTrn.mjTRN_JOINT, np.zeros(6)
                gear[0] = table.get("gear", 1.0)
                drive.gear = gear
                if kind == "tau":
                    drive.set_to_motor()
                else:
                    kp, kv = table.get("kp", 0.0), table.get("kv", 0.0)
                    _law(drive, kp if "kp" in table else kv, 0.0, kp, kv)
            drive.target = elastic.get(joint, joint)
            drive.ctrllimited = drive.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE
            turned = self.spec.joint(drive.target)
            turned.armature += table.get("rotor_inertia", 0.0) * float(drive.gear[0]) ** 2

    def _stop(self, stops: Mapping[str, tuple[float, float]]) -> None:
        limited = mujoco.mjtLimited.mjLIMITED_TRUE
        for name, (lower, upper) in stops.items():
            ends = np.clip([lower, upper], -FAR, FAR)
            joint = self.spec.joint(name.removeprefix("q.")) if name.startswith("q.") else None
            if joint is not None:
                joint.limited, joint.range = limited, ends
            for drive in self.spec.actuators:
                if drive.name == name:
                    drive.ctrllimited, drive.ctrlrange = limited, ends
                elif name == f"effort of {drive.name.partition('.')[2]}":
                    drive.forcelimited, drive.forcerange = limited, np.sort(ends / drive.gear[0])

    def _drive_table(self, name: str, table: Mapping[str, Any]) -> dict[str, float]:
        _known(f"drives.{name}", table, DRIVE)
        return {key: float(numbers(entry, self._values)) for key, entry in table.items()}

    def _add_wall(self, name: str, force: float, mj: mujoco.MjModel) -> None:
        """A sphere on the frame of a contact and a plane that can be moved, which collide only with each other.

        The static stiffness is that of the law. MuJoCo's force at rest is ``-solref[0] r / ((1 - d) A)`` at the depth ``r``,
        with its impedance ``d`` and the inverse inertia ``A`` of the body. In MuJoCo's friction a surface that slides at
        ``v`` also separates, with the acceleration ``friction b v`` where ``b`` is the damping of friction, so this is small.
        """
        contact = self.contacts[name]
        body, place, _ = _frame(self.frames, contact.frame, f"contact `{name}`")
        e = contact.normal
        side = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
        side /= np.linalg.norm(side)
        turn = np.column_stack([side, np.cross(e, side), e])
        wall = self.spec.worldbody.add_body(name=f"wall {name}", mocap=True, quat=quaternion_of(turn))
        radius = contact.radius or POINT
        shapes = {"contype": 0, "conaffinity": 0, "mass": 0.0}
        wall.add_geom(name=f"wall {name}", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], **shapes)
        sphere = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [radius, 0, 0], "pos": place}
        self.spec.body(body).add_geom(name=f"body {name}", **sphere, **shapes)
        pair = self.spec.add_pair(name=name, geomname1=f"body {name}", geomname2=f"wall {name}")
        pair.condim = 3 if contact.friction else 1
        pair.friction[:2] = contact.friction
        pair.solimp = [IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0]
        inverse = (1.0 - IMPEDANCE) * float(mj.body_invweight0[mj.body(body).id, 0])
        pair.solref = [-contact.stiffness * inverse, -contact.dissipation * force * inverse]
        if contact.friction:
            pair.solreffriction = [-1.0, -SLIDING * force * inverse / contact.friction]
        self.spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC


def compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """A model of MuJoCo's.

    Raises:
        FileError: Where MuJoCo refuses it.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise FileError(f"MuJoCo refuses the robot of the task: {error}") from error


def _known(where: str, table: Mapping[str, Any], keys: set[str]) -> None:
    unknown = sorted(set(table) - keys)
    if unknown:
        raise UsageError(f"{where}: MuJoCo's twin of a robot does not know `{unknown[0]}`")


def _frame(frames: Mapping[str, tuple[str, Array, Array]], name: str, where: str) -> tuple[str, Array, Array]:
    if name not in frames:
        raise UsageError(f"{where}: frame `{name}` is not among MuJoCo's bodies and sites")
    return frames[name]


def _law(drive: mujoco.MjsActuator, gain: float, offset: float, kp: float, kv: float) -> None:
    """``force = gain u + offset - kp l - kv l'``"""
    drive.gaintype, drive.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    gains, biases = np.zeros(len(drive.gainprm)), np.zeros(len(drive.biasprm))
    gains[0], biases[:3] = gain, [offset, -kp, -kv]
    drive.gainprm, drive.biasprm = gains, biases


def _change(drive: mujoco.MjsActuator, table: Mapping[str, float]) -> None:
    """Other numbers for an actuator of the file: the gain of a position or velocity actuator follows its kp or kv."""
    if "gear" in table:
        gear = np.zeros(6)
        gear[0] = table["gear"]
        drive.gear = gear
    if "kp" in table or "kv" in table:
        gain = float(drive.gainprm[0])
        offset, kp, kv = (float(entry) for entry in np.array(drive.biasprm[:3]) * [1.0, -1.0, -1.0])
        new_kp, new_kv = table.get("kp", kp), table.get("kv", kv)
        if offset == 0.0 and gain == kp:
            gain = new_kp
        elif offset == kp == 0.0 and gain == kv:
            gain = new_kv
        _law(drive, gain, offset, new_kp, new_kv)


def _linear(given: Any) -> float:
    """Stiffness or damping: recent versions of MuJoCo have polynomials."""
    return float(np.ravel(given)[0])
