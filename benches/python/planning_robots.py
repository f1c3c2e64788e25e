"""Robots of the problems of `globalisation.py`, as texts of URDF files, alike for supple and Pinocchio."""

from __future__ import annotations

import importlib.metadata
import sys
import xml.etree.ElementTree as xml
from dataclasses import dataclass

from supple_program import ROOT

PACKAGE = "example-robot-data"
# What neither program is to read.
LEFT_OUT = ("visual", "collision", "mimic", "dynamics", "safety_controller", "calibration")


@dataclass(frozen=True)
class Robot:
    """The text of a URDF file, and the joints that move in it."""

    urdf: str
    joints: tuple[str, ...]


def joint_text(
    name: str, kind: str, links: tuple[str, str], axis: str, offset: float = 0.0, effort: float = 1e3
) -> str:
    """A joint between parent and child, shifted along z by an offset, m."""
    parent, child = links
    limit = f'<limit lower="-1000" upper="1000" effort="{effort!r}" velocity="1000"/>' if kind != "fixed" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 {offset!r}" rpy="0 0 0"/><axis xyz="{axis}"/>{limit}</joint>\n'
    )


def link_text(name: str, mass: float, center: float = 0.0, inertia: float = 1e-3, along: float = 1e-3) -> str:
    """A link with its centre of mass on z, moments of inertia across and along z, kg m^2."""
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 {center!r}" rpy="0 0 0"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{inertia!r}" ixy="0" ixz="0" iyy="{inertia!r}" iyz="0" izz="{along!r}"/></inertial></link>\n'
    )


def rods(count: int, mass: float, length: float, first: tuple[str, float], effort: float) -> str:
    """Rods that hang on one another, all turning about y; the first on a link, shifted along z."""
    parent, offset = first
    text = ""
    for number in range(1, count + 1):
        text += link_text(f"rod{number}", mass, -length / 2, mass * length**2 / 12, 1e-3 * mass)
        text += joint_text(f"j{number}", "revolute", (parent, f"rod{number}"), "0 1 0", offset, effort)
        parent, offset = f"rod{number}", -length
    return text + '<link name="tip"/>\n' + joint_text("tip_joint", "fixed", (parent, "tip"), "0 1 0", offset)


def chain(count: int, mass: float = 1.0, length: float = 0.5, effort: float = 1e3) -> Robot:
    """Rods that hang below the world's origin: joints j1, j2, ..., the end is the link `tip`."""
    text = (
        '<robot name="chain">\n<link name="base"/>\n' + rods(count, mass, length, ("base", 0.0), effort) + "</robot>\n"
    )
    return Robot(text, tuple(f"j{number}" for number in range(1, count + 1)))


def cart_pole(poles: int = 1, effort: float = 1e3) -> Robot:
    """A cart of 1 kg on x with poles of 0.2 kg and 1 m that hang at 0 and stand at pi."""
    text = '<robot name="cart_pole">\n<link name="base"/>\n' + link_text("carriage", 1.0)
    text += joint_text("cart", "prismatic", ("base", "carriage"), "1 0 0", 0.0, effort)
    text += rods(poles, 0.2, 1.0, ("carriage", 0.0), 1e3) + "</robot>\n"
    return Robot(text, ("cart", *(f"j{number}" for number in range(1, poles + 1))))


def slides(count: int, mass: float = 1.0, effort: float = 1e3) -> Robot:
    """Masses on x, each sliding on the one before: joints s1, s2, ..., links m1, m2, ..."""
    text, parent = '<robot name="slides">\n<link name="base"/>\n', "base"
    for number in range(1, count + 1):
        text += link_text(f"m{number}", mass)
        text += joint_text(f"s{number}", "prismatic", (parent, f"m{number}"), "1 0 0", 0.0, effort)
        parent = f"m{number}"
    return Robot(text + "</robot>\n", tuple(f"s{number}" for number in range(1, count + 1)))


def public(path: str, joints: list[str]) -> Robot:
    """A robot of the package example-robot-data of which some joints move."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        sys.exit(f"the package {PACKAGE} is not installed here: pip install {PACKAGE}")
    found = [file for file in files if str(file).endswith(f"robots/{path}")]
    if not found:
        sys.exit(f"{PACKAGE} has no {path}")
    return reduced(found[0].locate().read_text(), joints)


def shipped(name: str, joints: list[str]) -> Robot:
    """A robot of the folder models of which some joints move."""
    return reduced((ROOT / "models" / name).read_text(), joints)


def reduced(text: str, joints: list[str]) -> Robot:
    """A robot of which all joints but some are fixed, without shapes, damping and friction. What turns without limits
    gets limits that are far away, such that all programs count its angle in radians."""
    root = xml.fromstring(text)
    for part in list(root):
        if part.tag not in ("link", "joint"):
            root.remove(part)
            continue
        for entry in [entry for entry in part if entry.tag in LEFT_OUT]:
            part.remove(entry)
        if part.tag == "joint" and part.get("name") not in joints:
            part.set("type", "fixed")
        elif part.get("type") == "continuous":
            part.set("type", "revolute")
            limit = part.find("limit")
            limit = xml.SubElement(part, "limit", effort="1000", velocity="1000") if limit is None else limit
            limit.set("lower", "-1000")
            limit.set("upper", "1000")
    missing = set(joints) - {joint.get("name") for joint in root.findall("joint")}
    if missing:
        sys.exit(f"{root.get('name')} has no joints {', '.join(sorted(missing))}")
    return Robot(xml.tostring(root, encoding="unicode"), tuple(joints))
