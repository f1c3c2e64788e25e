"""The bodies of robot files as models of MuJoCo. URDF and MJCF files are read by MuJoCo itself; SDF files here."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Elements of an SDF model that are read, or do not move anything.
KNOWN = {
    "model": {"link", "joint", "frame"},
    "link": {"pose", "inertial", "visual", "collision"},
    "joint": {"parent", "child", "axis"},
    "axis": {"xyz", "limit", "dynamics"},
    "frame": {"pose"},
}

JOINTS = {"revolute": mujoco.mjtJoint.mjJNT_HINGE, "prismatic": mujoco.mjtJoint.mjJNT_SLIDE}


def bodies(path: Path) -> mujoco.MjSpec:
    """The links and joints of a robot file, all links as bodies of their names, without limits and contacts."""
    spec = _sdf(path) if path.suffix == ".sdf" else mujoco.MjSpec.from_file(str(path))
    # Links without inertia stay bodies of their own, with next to none.
    spec.compiler.fusestatic = False
    spec.compiler.boundmass = 1e-12
    spec.compiler.boundinertia = 1e-15
    for joint in spec.joints:
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    return spec


def _sdf(path: Path) -> mujoco.MjSpec:
    """An SDF file with one model: links, joints with one axis in the child's frame, and frames."""
    model = ET.parse(path).getroot().find("model")
    assert model is not None, f"{path}: there is no model"
    _check(model, path)
    links = {link.attrib["name"]: link for link in model.iter("link")}
    frames = {frame.attrib["name"]: frame for frame in model.iter("frame")}
    joints = {_text(joint, "child"): joint for joint in model.iter("joint")}
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
    made = {"world": spec.worldbody}

    def body(name: str) -> mujoco.MjsBody:
        if name in made:
            return made[name]
        joint = joints.get(name)
        parent = "world" if joint is None else _text(joint, "parent")
        base = (np.zeros(3), np.eye(3)) if parent == "world" else pose(parent)
        p, R = pose(name)
        made[name] = body(parent).add_body(name=name, pos=base[1].T @ (p - base[0]), quat=quaternion_of(base[1].T @ R))
        assert joint is not None, f"{path}: link {name} floats"
        if joint.attrib["type"] != "fixed":
            axis = joint.find("axis")
            made[name].add_joint(
                name=joint.attrib["name"],
                type=JOINTS[joint.attrib["type"]],
                axis=_numbers(axis, "xyz", 3),
                damping=float(axis.findtext("dynamics/damping") or 0.0),
                frictionloss=float(axis.findtext("dynamics/friction") or 0.0),
            )
        _inertia(made[name], links[name].find("inertial"))
        return made[name]

    for name in links:
        body(name)
    for name, frame in frames.items():
        on, (p, R) = frame.attrib["attached_to"], pose(name)
        base = pose(on)
        made[on].add_site(name=name, pos=base[1].T @ (p - base[0]), quat=quaternion_of(base[1].T @ R))
    return spec


def _check(model: ET.Element, path: Path) -> None:
    for element in model.iter():
        for child in element:
            known = KNOWN.get(element.tag)
            assert known is None or child.tag in known, f"{path}: teach this reader <{child.tag}> in <{element.tag}>"


def _inertia(body: mujoco.MjsBody, inertial: ET.Element | None) -> None:
    if inertial is None:
        return
    numbers = _numbers(inertial, "pose", 6)
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = float(_text(inertial, "mass")), numbers[:3], quaternion_of(turn_of(numbers[3:]))
    moments = [float(_text(inertial, f"inertia/{entry}")) for entry in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    assert not any(moments[3:]), "teach this reader products of inertia"
    body.inertia = moments[:3]


def _text(element: ET.Element, name: str) -> str:
    found = element.findtext(name)
    assert found is not None, f"<{element.tag}> has no <{name}>"
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
