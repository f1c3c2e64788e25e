"""Rotations as matrices and quaternions."""

from __future__ import annotations

import mujoco
import numpy as np

from .._records import Array

__all__ = ["quaternion_of", "turn_of"]


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
