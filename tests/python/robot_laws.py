"""The forces of compliance, written in NumPy from docs/theory/robot.md, apart from the package's own code."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def positive_part(z: float, epsilon: float) -> float:
    """(R.13a)"""
    if abs(z) >= epsilon:
        return max(z, 0.0)
    t = 1.0 + z / epsilon
    return epsilon * t**4 * (t**2 - 6.0 * t + 10.0) / 32.0


def half_way(R: Array) -> Array:
    """The turn by half of ``R``, by its rotation vector."""
    quaternion, vector, half = np.zeros(4), np.zeros(3), np.zeros(9)
    mujoco.mju_mat2Quat(quaternion, R.ravel())
    mujoco.mju_quat2Vel(vector, quaternion, 1.0)
    angle = np.linalg.norm(vector)
    mujoco.mju_axisAngle2Quat(quaternion, vector / max(angle, 1e-300), 0.5 * angle)
    mujoco.mju_quat2Mat(half, quaternion)
    return half.reshape(3, 3)


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
        speed = to_b.T @ (rate - 0.5 * np.cross(omega, p))
        force = -to_b @ (self.stiffness * (to_b.T @ p) + self.damping * speed)

        pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
        roll, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
        # How roll, pitch and yaw turn C: the columns are the axes that they turn about. Its inverse is N.
        axes = np.array(
            [
                [np.cos(yaw) * np.cos(pitch), -np.sin(yaw), 0.0],
                [np.sin(yaw) * np.cos(pitch), np.cos(yaw), 0.0],
                [-np.sin(pitch), 0.0, 1.0],
            ]
        )
        N = np.linalg.inv(axes)
        angles = np.array([roll, pitch, yaw])
        torque = -N.T @ (self.torsional_stiffness * angles + self.torsional_damping * (N @ omega))
        return torque, force


@dataclass(frozen=True)
class Contact:
    """Of a sphere about the origin of a frame with a wall, by the numbers of the task file."""

    frame: str
    normal: Array
    point: Array
    radius: float
    stiffness: float
    dissipation: float
    smoothing: float
    friction: float
    slip: float

    def depth(self, p: Array, c: float) -> float:
        """(R.14), of a sphere with its centre at ``p`` and the wall at ``c``."""
        return float(c - self.normal @ (p - self.point) + self.radius)

    def normal_force(self, depth: float, approach: float) -> float:
        """(R.14)"""
        rise = positive_part(1.0 + self.dissipation * approach, 0.5)
        return self.stiffness * positive_part(depth, self.smoothing) * rise

    def force(self, depth: float, v: Array) -> Array:
        """(R.15), in the world, given the velocity of the point that touches."""
        e = self.normal
        pressed = self.normal_force(depth, float(-e @ v))
        along = v - e * (e @ v)
        return pressed * e - self.friction * pressed * along / np.sqrt(along @ along + self.slip**2)

    def touches(self, depth: float, force: float) -> bool:
        """As reports of contacts count it."""
        return -depth < self.smoothing and force > 1e-6 * self.stiffness * self.smoothing


@dataclass(frozen=True)
class Spring:
    """Beside a joint."""

    joint: str
    stiffness: float
    damping: float
    rest: float

    def torque(self, q: float, v: float) -> float:
        return -self.stiffness * (q - self.rest) - self.damping * v


@dataclass(frozen=True)
class ElasticJoint:
    """Between a joint and its motor (R.9)."""

    joint: str
    stiffness: float
    damping: float
    motor_inertia: float
    motor_damping: float

    def torque(self, q: float, v: float, s: float, s_rate: float) -> float:
        """On the joint."""
        return self.stiffness * (s - q) + self.damping * (s_rate - v)
