"""The forces of compliance in NumPy, implemented from docs/theory/robot.md, independently of supple's own code.

Leading axes are samples: a position is (..., 3), a turn (..., 3, 3), a number (...).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import numpy as np

from .._records import Array
from ..errors import UsageError

__all__ = ["LAWS", "Bushing", "Contact", "ElasticJoint", "Law", "Spring", "law", "numbers"]


def positive_part(z: Array, epsilon: float) -> Array:
    """(R.13a)"""
    t = 1.0 + np.clip(z, -epsilon, epsilon) / epsilon
    smooth = epsilon * t**4 * (t**2 - 6.0 * t + 10.0) / 32.0
    return np.where(np.abs(z) >= epsilon, np.maximum(z, 0.0), smooth)


def turned(R: Array, v: Array) -> Array:
    """``R v``"""
    return np.asarray(np.einsum("...ij,...j->...i", R, v))


def turned_back(R: Array, v: Array) -> Array:
    """``R' v``"""
    return np.asarray(np.einsum("...ji,...j->...i", R, v))


def half_way(R: Array) -> Array:
    """The rotation by half the angle of ``R`` (below pi): the rotation closest to ``I + R``, from its quaternion."""
    w = 0.5 * np.sqrt(np.maximum(1.0 + np.trace(R, axis1=-2, axis2=-1), 1e-12))
    vee = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    v = vee / (4.0 * w)[..., None]
    size = np.sqrt((1.0 + w) ** 2 + np.sum(v * v, axis=-1))
    w, v = (1.0 + w) / size, v / size[..., None]
    cross = np.zeros(R.shape)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    return np.asarray(np.eye(3) + 2.0 * w[..., None, None] * cross + 2.0 * cross @ cross)


@dataclass(frozen=True)
class Bushing:
    """Between the frames A and C, by the numbers of the task file."""

    frame_a: str
    frame_c: str
    stiffness: Array
    damping: Array
    torsional_stiffness: Array
    torsional_damping: Array

    def loads(self, p: Array, R: Array, rate: Array, omega: Array) -> tuple[Array, Array]:
        """Torque and force on C, the force half-way between both origins; (R.10) to (R.12).

        Args:
            p: Position of C's origin from A's.
            R: The turn from A to C.
            rate: How fast ``p`` changes, seen from A.
            omega: Angular velocity of C, seen from A.

        All are in the axes of A, and so is what is returned.
        """
        to_b = half_way(R)
        speed = turned_back(to_b, rate - 0.5 * np.cross(omega, p))
        force = -turned(to_b, self.stiffness * turned_back(to_b, p) + self.damping * speed)

        pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 0, 0], R[..., 1, 0]))
        roll, yaw = np.arctan2(R[..., 2, 1], R[..., 2, 2]), np.arctan2(R[..., 1, 0], R[..., 0, 0])
        # The columns are the axes of rates of roll, pitch and yaw of C. Its inverse is N.
        axes = np.zeros(R.shape)
        axes[..., 0, 0], axes[..., 1, 0] = np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch)
        axes[..., 2, 0], axes[..., 0, 1], axes[..., 1, 1], axes[..., 2, 2] = (
            -np.sin(pitch),
            -np.sin(yaw),
            np.cos(yaw),
            1,
        )
        N = np.asarray(np.linalg.inv(axes), dtype=np.float64)
        angles = np.stack([roll, pitch, yaw], axis=-1)
        torque = -turned_back(N, self.torsional_stiffness * angles + self.torsional_damping * turned(N, omega))
        return torque, force


@dataclass(frozen=True)
class Contact:
    """Of a sphere about the origin of a frame with a wall, by the numbers of the task file."""

    frame: str
    normal: Array
    stiffness: float
    smoothing: float
    point: Array = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0
    dissipation: float = 0.0
    friction: float = 0.0
    slip: float = 1e-2

    def depth(self, p: Array, c: Array) -> Array:
        """(R.14), of a sphere with its centre at ``p`` and the wall at ``c``."""
        return np.asarray(c - (p - self.point) @ self.normal + self.radius)

    def normal_force(self, depth: Array, approach: Array) -> Array:
        """(R.14)"""
        rise = positive_part(1.0 + self.dissipation * approach, 0.5)
        return np.asarray(self.stiffness * positive_part(depth, self.smoothing) * rise)

    def force(self, depth: Array, v: Array) -> Array:
        """(R.15), in the world, given the velocity of the point that touches."""
        e = self.normal
        away = v @ e
        pressed = self.normal_force(depth, -away)
        along = v - away[..., None] * e
        slip = np.sqrt(np.sum(along * along, axis=-1) + self.slip**2)
        return np.asarray(pressed[..., None] * e - (self.friction * pressed / slip)[..., None] * along)

    def touches(self, depth: Array, force: Array) -> Array:
        """As reports of contacts count it."""
        return np.asarray((-depth < self.smoothing) & (force > 1e-6 * self.stiffness * self.smoothing))


@dataclass(frozen=True)
class Spring:
    """Beside a joint: MuJoCo's own law."""

    joint: str
    stiffness: float = 0.0
    damping: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True)
class ElasticJoint:
    """Between a joint and its motor (R.9): a tendon and a body of MuJoCo's."""

    joint: str
    stiffness: float
    motor_inertia: float
    damping: float = 0.0
    motor_damping: float = 0.0


Law = Bushing | Contact | Spring | ElasticJoint

LAWS: dict[str, type[Law]] = {
    "bushing": Bushing,
    "contact": Contact,
    "spring": Spring,
    "elastic_joint": ElasticJoint,
}

_TEXTS = ("frame", "frame_a", "frame_c", "joint")


def law(table: Mapping[str, Any], values: Mapping[str, float]) -> Law:
    """An entry of ``[[model.compliance]]``, with the values of parameters that it names.

    Raises:
        UsageError: Where its kind, or one of its keys, is not known here.
    """
    name, kind = table["name"], LAWS.get(table["kind"])
    if kind is None:
        raise UsageError(
            f"compliance `{name}` is of kind `{table['kind']}`: MuJoCo's twin of a robot has {', '.join(LAWS)}"
        )
    known = {entry.name: entry for entry in fields(kind)}
    unknown = sorted(set(table) - set(known) - {"kind", "name"})
    if unknown:
        raise UsageError(
            f"compliance `{name}`: MuJoCo's twin of a robot does not know `{unknown[0]}` of a {table['kind']}"
        )
    found: dict[str, Any] = {}
    for key, entry in known.items():
        if key in table:
            found[key] = table[key] if key in _TEXTS else numbers(table[key], values)
        elif entry.default is MISSING and entry.default_factory is MISSING:
            raise UsageError(f"compliance `{name}` has no `{key}`: MuJoCo's twin of a robot needs it")
    if kind is Contact:
        found["normal"] = found["normal"] / np.linalg.norm(found["normal"])
    return kind(**found)


def numbers(given: Any, values: Mapping[str, float]) -> Any:
    """A number or a list of them, where names of parameters, and expressions of them, stand for their values.

    Raises:
        UsageError: Where a text stands for no number.
    """
    if isinstance(given, list):
        return np.array([numbers(entry, values) for entry in given])
    if not isinstance(given, str):
        return float(given)
    try:
        return float(values[given])
    except KeyError:
        raise UsageError(f"`{given}` is neither a parameter nor an expression of parameters") from None
