"""SDF files as models of MuJoCo, which does not read them: links, joints with one axis, and frames."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import mujoco
import numpy as np

from .._records import Array
from ..errors import FileError

__all__ = ["quaternion_of", "sdf", "turn_of"]

#: Elements of an SDF model that are read, or do not move anything.
KNOWN = {
    "model": {"link", "joint", "frame"},
    "link": {"pose", "inertial", "visual", "collision"},
    "joint": {"parent", "child", "axis"},
    "axis": {"xyz", "limit", "dynamics"},
    "frame": {"pose"},
}

JOINTS = {"revolute": mujoco.mjtJoint.mjJNT_HINGE, "prismatic": mujoco.mjtJoint.mjJNT_SLIDE}


def sdf(text: str, file: str) -> mujoco.MjSpec:
    """The bodies of an SDF file with one model.

    Raises:
        FileError: Where it has what cannot be read here.
    """
    model = ET.fromstring(text).find("model")
    if model is None:
        raise FileError("there is no <model>", file=file)
    _check(model, file)
    links = {link.attrib["name"]: link for link in model.iter("link")}
    frames = {frame.attrib["name"]: frame for frame in model.iter("frame")}
    joints = {_text(joint, "child", file): joint for joint in model.iter("joint")}
    poses: dict[str, tuple[Array, Array]] = {"__model__": (np.zeros(3), np.eye(3))}

    def pose(name: str) -> tuple[Array, Array]:
        """In the model."""
        if name not in poses:
            element = links[name] if name in links else frames[name]
            numbers = _numbers(element, "pose", 6)
            given = element.find("pose")
            attached = element.get("attached_to", "__model__")
            base = pose(given.get("relative_to", attached) if given is not None else attached)
            poses[name] = base[0] + base[1] @ numbers[:3], base[1] @ turn_of(numbers[3:])
        return poses[name]

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    made = {"world": spec.worldbody}

    def body(name: str) -> mujoco.MjsBody:
        if name in made:
            return made[name]
        joint = joints.get(name)
        if joint is None:
            raise FileError(f"link `{name}` floats: no joint carries it", file=file)
        parent = _text(joint, "parent", file)
        base = (np.zeros(3), np.eye(3)) if parent == "world" else pose(parent)
        p, R = pose(name)
        made[name] = body(parent).add_body(name=name, pos=base[1].T @ (p - base[0]), quat=quaternion_of(base[1].T @ R))
        kind = joint.attrib["type"]
        axis = joint.find("axis")
        if kind in JOINTS and axis is not None:
            lower, upper = (axis.findtext(f"limit/{end}") for end in ("lower", "upper"))
            made[name].add_joint(
                limited=mujoco.mjtLimited.mjLIMITED_FALSE
                if None in (lower, upper)
                else mujoco.mjtLimited.mjLIMITED_TRUE,
                range=[float(lower or 0.0), float(upper or 0.0)],
                name=joint.attrib["name"],
                type=JOINTS[kind],
                axis=_numbers(axis, "xyz", 3),
                damping=float(axis.findtext("dynamics/damping") or 0.0),
                frictionloss=float(axis.findtext("dynamics/friction") or 0.0),
            )
        elif kind != "fixed":
            raise FileError(f"joint `{joint.attrib['name']}` of type `{kind}` cannot be read here", file=file)
        _inertia(made[name], links[name].find("inertial"), file)
        return made[name]

    for name in links:
        body(name)
    for name, frame in frames.items():
        on, (p, R) = frame.attrib["attached_to"], pose(name)
        base = pose(on)
        made[on].add_site(name=name, pos=base[1].T @ (p - base[0]), quat=quaternion_of(base[1].T @ R))
    return spec


def _check(model: ET.Element, file: str) -> None:
    for element in model.iter():
        for child in element:
            known = KNOWN.get(element.tag)
            if known is not None and child.tag not in known:
                raise FileError(f"<{child.tag}> in <{element.tag}> cannot be read here", file=file)


def _inertia(body: mujoco.MjsBody, inertial: ET.Element | None, file: str) -> None:
    if inertial is None:
        return
    numbers = _numbers(inertial, "pose", 6)
    xx, yy, zz, xy, xz, yz = (
        float(inertial.findtext(f"inertia/{entry}") or 0.0) for entry in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    body.explicitinertial = True
    body.mass, body.ipos = float(_text(inertial, "mass", file)), numbers[:3]
    body.inertia, body.iquat = moments, quaternion_of(turn_of(numbers[3:]) @ axes)


def _text(element: ET.Element, name: str, file: str) -> str:
    found = element.findtext(name)
    if found is None:
        raise FileError(f"<{element.tag}> has no <{name}>", file=file)
    return found.strip()


def _numbers(element: ET.Element, name: str, count: int) -> Array:
    """The numbers of a child; zeros where there is none."""
    found = element.findtext(name)
    return np.zeros(count) if found is None else np.array([float(number) for number in found.split()])


def turn_of(rpy: Array) -> Array:
    """Roll, pitch and yaw about fixed axes as a matrix."""
    R = np.eye(3)
    for axis, angle in enumerate(rpy):
        quaternion, turn = np.zeros(4), np.zeros(9)
        mujoco.mju_axisAngle2Quat(quaternion, np.eye(3)[axis], angle)
        mujoco.mju_quat2Mat(turn, quaternion)
        R = turn.reshape(3, 3) @ R
    return R


def quaternion_of(R: Array) -> Array:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, R.ravel())
    return found
