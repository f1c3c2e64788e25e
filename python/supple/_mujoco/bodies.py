"""The bodies of robot files as models of MuJoCo, which reads URDF and MJCF files itself; SDF files are written as MJCF."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from .._records import Array
from .._supple import as_mjcf
from ..errors import FileError, UsageError
from .rotations import quaternion_of

__all__ = ["FLUID", "Bodies", "again", "bodies", "set_linear"]

_INERTIA_FROM_GEOMS = 1
#: What links without mass and moments of inertia are given, kg and kg m^2: MuJoCo refuses them where they move.
LITTLE = 1e-12, 1e-15
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
#: Options of the fluid that bodies move in.
FLUID = ("density", "viscosity", "wind")
_JOINT_EQUALITY, _JOINT_DRIVE = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtTrn.mjTRN_JOINT)


#: The beginning of the root element of an SDF file.
_SDF = re.compile(r"<sdf[\s>]")


class Bodies:
    """Links and joints of a robot file: all links as bodies with names, without limits, contacts and visuals.

    All numbers are MuJoCo's own, in rad and m, and poses are those of bodies in their parents.

    Attributes:
        spec: The model. Its joints have no stops, but how soft these are in the file.
        inertias: Principal moments of bodies whose own are impossible, which MuJoCo refuses, in the axes of the body's
            inertia; the model has the mean of them in their place.
    """

    def __init__(self, spec: mujoco.MjSpec, inertias: dict[str, Array]) -> None:
        self.spec, self.inertias = spec, inertias


def bodies(
    file: str, texts: Mapping[str, str], locked: Mapping[str, float | None] | None = None, independent: bool = False
) -> Bodies:
    """The bodies of a robot file.

    Args:
        file: Its path.
        texts: Texts of it and of all files that it includes, by path.
        locked: Positions of joints that are fixed, rad or m; none where it is 0 or the middle of the joint's range.
        independent: Whether joints that follow others in the file move by themselves.

    Raises:
        FileError: Where MuJoCo cannot read it.
        UsageError: Where a joint that is to be locked is none of it.
    """
    text = texts[file]
    try:
        folder = file.rpartition("/")[0] + "/"
        included = {path.removeprefix(folder): other.encode() for path, other in texts.items() if path != file}
        if _SDF.search(text):
            text = as_mjcf(text, file)
        spec = mujoco.MjSpec.from_string(text, include=included)
        spec.modelfiledir = folder
        # Links without inertia remain separate bodies with almost no inertia.
        spec.compiler.fusestatic = False
        spec.compiler.boundmass, spec.compiler.boundinertia = LITTLE
        for index, body in enumerate(spec.bodies):
            body.name = body.name or f"body {index}"
        _settle(spec)
        for element in (*spec.sites, *spec.tendons):
            element.material = ""
        for lists in (spec.sensors, spec.keys, spec.geoms, spec.cameras, spec.lights, spec.pairs, spec.excludes):
            for element in list(lists):
                spec.delete(element)
        for lists in (spec.meshes, spec.hfields, spec.skins, spec.materials, spec.textures):
            for element in list(lists):
                spec.delete(element)
        inertias = dict(_balanced(spec))
        compiled = spec.compile()
    except ValueError as error:
        raise FileError(f"MuJoCo cannot read it: {error}", file=file) from error
    return Bodies(again(compiled, dict(locked or {}), independent), inertias)


def _settle(spec: mujoco.MjSpec) -> None:
    """Writes inertias that follow from geoms into their bodies."""
    followed = spec.compiler.inertiafromgeom == _INERTIA_FROM_GEOMS
    if not followed and all(body.explicitinertial or not body.geoms for body in spec.bodies[1:]):
        return
    found = spec.copy().compile()
    for body in spec.bodies[1:]:
        of = found.body(body.name)
        body.mass, body.inertia, body.ipos, body.iquat = float(of.mass[0]), of.inertia, of.ipos, of.iquat
        body.explicitinertial, body.fullinertia = True, np.full(6, np.nan)
    spec.compiler.inertiafromgeom = 0


def _balanced(spec: mujoco.MjSpec) -> Iterator[tuple[str, Array]]:
    """Replaces moments of inertia that MuJoCo rejects by their mean, and yields the original ones."""
    for body in spec.bodies[1:]:
        full = np.array(body.fullinertia)
        if np.isnan(full).any():
            moments = np.array(body.inertia)
        else:
            xx, yy, zz, xy, xz, yz = full
            moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        if moments.min() >= 0.0 and 2.0 * moments.max() <= moments.sum() * (1.0 - 1e-12):
            continue
        if not np.isnan(full).any():
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            body.iquat, body.fullinertia = quaternion_of(axes), np.full(6, np.nan)
        body.inertia = np.full(3, max(moments.mean(), LITTLE[1]))
        if moments.any():
            yield body.name, moments


def again(
    mj: mujoco.MjModel,
    locked: Mapping[str, float | None],
    independent: bool = False,
    carried: Mapping[str, str] | None = None,
) -> mujoco.MjSpec:
    """A model as it was compiled, with bodies, joints, sites, fluid, and what couples and drives joints.

    Args:
        mj: The model.
        locked: As for :func:`bodies`.
        independent: As for :func:`bodies`.
        carried: Bodies by the name of those that hang on them from now on, where they are, instead of on their common parent.

    Raises:
        UsageError: Where a joint or a body is none of it.
    """
    names = [mj.joint(i).name for i in range(mj.njnt)]
    for name in locked:
        if name not in names:
            raise UsageError(f"locked: joint `{name}` is not among MuJoCo's {', '.join(names)}")
    held = {index: _place(mj, index, locked[name]) for index, name in enumerate(names) if name in locked}
    lines = [] if independent else [line for line in range(mj.neq) if int(mj.eq_type[line]) == _JOINT_EQUALITY]
    # Chains of joints that follow others, at most as many as there are.
    for _ in lines:
        for line in lines:
            here, there, data = int(mj.eq_obj1id[line]), int(mj.eq_obj2id[line]), mj.eq_data[line]
            if there in held and here not in held:
                moved = held[there] - _start(mj, there)
                held[here] = _start(mj, here) + float(np.polyval(data[4::-1], moved))
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.boundmass, spec.compiler.boundinertia = LITTLE
    # Models that are made of this one keep its gravity, not its flags.
    switched_off = mj.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    spec.option.gravity = np.zeros(3) if switched_off else mj.opt.gravity
    for key in FLUID:
        setattr(spec.option, key, getattr(mj.opt, key))
    made = {0: spec.worldbody}
    hung = _hung(mj, carried or {})
    waiting = list(range(1, mj.nbody))
    while waiting:
        index = waiting.pop(0)
        mount = hung.get(index)
        parent = int(mj.body_parentid[index]) if mount is None else mount
        if parent in made:
            made[index] = _body(mj, made[parent], index, held, mount)
        else:
            waiting.append(index)
    for site in range(mj.nsite):
        made[int(mj.site_bodyid[site])].add_site(
            name=mj.site(site).name, pos=mj.site_pos[site], quat=mj.site_quat[site]
        )
    for line in lines:
        here, there = int(mj.eq_obj1id[line]), int(mj.eq_obj2id[line])
        if here not in held:
            if there < 0:
                raise UsageError(f"joint `{names[here]}` is held by an equality: lock it in the task")
            equality = spec.add_equality(name1=names[here], name2=names[there], type=mujoco.mjtEq.mjEQ_JOINT)
            equality.objtype, equality.data = mujoco.mjtObj.mjOBJ_JOINT, mj.eq_data[line]
    _couplings(mj, spec, held)
    for index in range(mj.nu):
        joint = int(mj.actuator_trnid[index, 0])
        if int(mj.actuator_trntype[index]) != _JOINT_DRIVE or joint in held:
            continue
        actuator = spec.add_actuator(name=mj.actuator(index).name or names[joint], target=names[joint])
        actuator.trntype, actuator.gear = mujoco.mjtTrn.mjTRN_JOINT, mj.actuator_gear[index]
        actuator.dyntype = mujoco.mjtDyn(int(mj.actuator_dyntype[index]))
        actuator.gaintype = mujoco.mjtGain(int(mj.actuator_gaintype[index]))
        actuator.biastype = mujoco.mjtBias(int(mj.actuator_biastype[index]))
        actuator.gainprm, actuator.biasprm = mj.actuator_gainprm[index], mj.actuator_biasprm[index]
    return spec


def _couplings(mj: mujoco.MjModel, spec: mujoco.MjSpec, held: Mapping[int, float]) -> None:
    """Adds tendons that exert a force by themselves.

    Raises:
        UsageError: Where there are other couplings.
    """
    for line in range(mj.neq):
        kind = mujoco.mjtEq(int(mj.eq_type[line]))
        if kind != mujoco.mjtEq.mjEQ_JOINT and mj.eq_active0[line]:
            word = kind.name.removeprefix("mjEQ_").lower()
            raise UsageError(f"equality `{word}`: MuJoCo's twin of a robot knows `joint` only")
    for index in range(mj.ntendon):
        forces = {key: getattr(mj, f"tendon_{key}")[index] for key in ("stiffness", "damping", "frictionloss")}
        if not any(np.any(value) for value in forces.values()):
            continue
        tendon = spec.add_tendon(name=mj.tendon(index).name)
        shift = 0.0
        first = int(mj.tendon_adr[index])
        for wrap in range(first, first + int(mj.tendon_num[index])):
            kind, of, by = mujoco.mjtWrap(int(mj.wrap_type[wrap])), int(mj.wrap_objid[wrap]), float(mj.wrap_prm[wrap])
            if kind == mujoco.mjtWrap.mjWRAP_JOINT and of in held:
                shift += by * held[of]
            elif kind == mujoco.mjtWrap.mjWRAP_JOINT:
                tendon.wrap_joint(mj.joint(of).name, by)
            elif kind == mujoco.mjtWrap.mjWRAP_SITE and mj.site(of).name:
                tendon.wrap_site(mj.site(of).name)
            elif kind == mujoco.mjtWrap.mjWRAP_PULLEY:
                tendon.wrap_pulley(by)
            else:
                raise UsageError(
                    f"tendon `{tendon.name}`: MuJoCo's twin of a robot knows joints, sites with names, and pulleys"
                )
        tendon.springlength = np.array(mj.tendon_lengthspring[index]) - shift
        for key, value in forces.items():
            set_linear(tendon, key, float(np.ravel(value)[0]))


def set_linear(element: Any, key: str, value: float) -> None:
    """Sets a stiffness or a damping, which recent versions of MuJoCo have as polynomials."""
    polynomial = np.array(getattr(element, key), dtype=np.float64)
    if polynomial.ndim:
        polynomial[0] = value
    setattr(element, key, polynomial if polynomial.ndim else value)


def _hung(mj: mujoco.MjModel, carried: Mapping[str, str]) -> dict[int, int]:
    """Mounts by what they carry, by numbers of bodies."""
    numbers = {mj.body(index).name: index for index in range(mj.nbody)}
    found = {}
    for name, mount in carried.items():
        if name not in numbers or mj.body_parentid[numbers[name]] != mj.body_parentid[numbers[mount]]:
            raise UsageError(
                f"insert `{mount}`: `{name}` is not among MuJoCo's bodies beside it, so it cannot be carried"
            )
        found[numbers[name]] = numbers[mount]
    return found


def _start(mj: mujoco.MjModel, joint: int) -> float:
    """The position of a joint at which bodies are where the file has them."""
    return float(mj.qpos0[mj.jnt_qposadr[joint]])


def _place(mj: mujoco.MjModel, joint: int, at: float | None) -> float:
    """Where a joint is locked: 0, or the middle of its range if that excludes 0."""
    if at is not None:
        return at
    lower, upper = mj.jnt_range[joint] if mj.jnt_limited[joint] else (-np.inf, np.inf)
    if lower <= 0.0 <= upper:
        return 0.0
    ends = [float(end) for end in (lower, upper) if np.isfinite(end)]
    return sum(ends) / len(ends)


def _body(
    mj: mujoco.MjModel, parent: mujoco.MjsBody, index: int, held: Mapping[int, float], mount: int | None
) -> mujoco.MjsBody:
    """A body; displacements of locked joints are in its pose and in the positions of preceding joints. With a mount, its
    pose is that in the mount."""
    joints = range(mj.body_jntadr[index], mj.body_jntadr[index] + mj.body_jntnum[index])
    if any(int(mj.jnt_type[joint]) not in (_HINGE, _SLIDE) for joint in joints):
        raise UsageError("a joint of the robot has more than one position: MuJoCo's twin has hinges and slides")
    place, turn = np.zeros(3), np.eye(3)
    free = []
    for joint in reversed(joints):
        pos, axis = mj.jnt_pos[joint], mj.jnt_axis[joint]
        if joint not in held:
            free.append((joint, turn.T @ (pos - place), turn.T @ axis))
            continue
        moved = held[joint] - _start(mj, joint)
        if int(mj.jnt_type[joint]) == _SLIDE:
            place = place + moved * axis
        else:
            R = _turn(axis, moved)
            place, turn = pos + R @ (place - pos), R @ turn
    p, R = _pose(mj, index)
    p, R = p + R @ place, R @ turn
    if mount is not None:
        at, to = _pose(mj, mount)
        p, R = to.T @ (p - at), to.T @ R
    body = parent.add_body(name=mj.body(index).name, pos=p, quat=quaternion_of(R), explicitinertial=True)
    body.mass, body.inertia = float(mj.body_mass[index]), mj.body_inertia[index]
    body.ipos, body.iquat = mj.body_ipos[index], mj.body_iquat[index]
    body.gravcomp = float(mj.body_gravcomp[index])
    for joint, pos, axis in reversed(free):
        own = body.add_joint(
            name=mj.joint(joint).name, type=mujoco.mjtJoint(int(mj.jnt_type[joint])), pos=pos, axis=axis
        )
        dof, at = mj.jnt_dofadr[joint], mj.jnt_qposadr[joint]
        own.ref, own.springref = mj.qpos0[at], mj.qpos_spring[at]
        own.armature, own.frictionloss = mj.dof_armature[dof], mj.dof_frictionloss[dof]
        own.solref_limit, own.solimp_limit = mj.jnt_solref[joint], mj.jnt_solimp[joint]
        for key, value in (("stiffness", mj.jnt_stiffness[joint]), ("damping", mj.dof_damping[dof])):
            set_linear(own, key, float(value))
    return body


def _pose(mj: mujoco.MjModel, body: int) -> tuple[Array, Array]:
    """In its parent, with all joints where they start."""
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, mj.body_quat[body])
    return np.array(mj.body_pos[body]), R.reshape(3, 3)


def _turn(axis: Array, angle: float) -> Array:
    quaternion, R = np.zeros(4), np.zeros(9)
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
    mujoco.mju_quat2Mat(R, quaternion)
    return R.reshape(3, 3)
