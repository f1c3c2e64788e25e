"""Coordinates of configurations: as many numbers as there are degrees of freedom.

Positions of hinges and slides, and of free joints, are coordinates as they are. The orientation of a ball or free joint,
a quaternion ``Q`` in MuJoCo, is the vector ``r`` (3,), rad, of the turn from a reference orientation: ``Q = Q_ref exp(r)``.
Of the two vectors of one orientation it is the one closer to that before the step, so that steps stay smooth through half
a turn. At a whole turn from the reference the coordinates are singular.
"""

from __future__ import annotations

import mujoco
import numpy as np

from .._records import Array

__all__ = ["Chart"]


class Chart:
    """Coordinates (nv,) of configurations (nq,)."""

    def __init__(self, model: mujoco.MjModel, reference: Array) -> None:
        plain_q: list[int] = []
        plain_v: list[int] = []
        self.quaternions: list[tuple[int, int]] = []
        for joint in range(model.njnt):
            kind = int(model.jnt_type[joint])
            q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            if kind == mujoco.mjtJoint.mjJNT_FREE:
                plain_q += [q, q + 1, q + 2]
                plain_v += [v, v + 1, v + 2]
                self.quaternions.append((q + 3, v + 3))
            elif kind == mujoco.mjtJoint.mjJNT_BALL:
                self.quaternions.append((q, v))
            else:
                plain_q.append(q)
                plain_v.append(v)
        self._plain_q, self._plain_v = np.array(plain_q, dtype=int), np.array(plain_v, dtype=int)
        self._nq, self._nv = int(model.nq), int(model.nv)
        self._references = [_unit(reference[None, q : q + 4])[0] for q, _ in self.quaternions]

    def positions(self, coordinates: Array) -> Array:
        """Configurations (B, nq) of coordinates (B, nv)."""
        qpos = np.zeros((len(coordinates), self._nq))
        qpos[:, self._plain_q] = coordinates[:, self._plain_v]
        for (q, v), reference in zip(self.quaternions, self._references, strict=True):
            qpos[:, q : q + 4] = _product(reference[None], _exponential(coordinates[:, v : v + 3]))
        return qpos

    def coordinates(self, qpos: Array, near: Array) -> Array:
        """Coordinates (B, nv) of configurations (B, nq), those closest to ``near`` (B, nv)."""
        out = np.zeros((len(qpos), self._nv))
        out[:, self._plain_v] = qpos[:, self._plain_q]
        inverted = np.array([1.0, -1.0, -1.0, -1.0])
        for (q, v), reference in zip(self.quaternions, self._references, strict=True):
            turn = _product((reference * inverted)[None], _unit(qpos[:, q : q + 4]))
            out[:, v : v + 3] = _nearest(_logarithm(turn), near[:, v : v + 3])
        return out

    def to_tangent(self, coordinates: Array) -> Array | None:
        """The derivative (B, nv, nv) of the turn in the body's own axes, which MuJoCo differentiates by, by the coordinates;
        none where it is the identity everywhere."""
        if not self.quaternions:
            return None
        out = np.tile(np.eye(self._nv), (len(coordinates), 1, 1))
        for _, v in self.quaternions:
            out[:, v : v + 3, v : v + 3] = _right_jacobian(coordinates[:, v : v + 3])
        return out


def _unit(quaternion: Array) -> Array:
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.asarray(quaternion / np.where(length > 0.0, length, 1.0))


def _product(a: Array, b: Array) -> Array:
    """Products of quaternions (B, 4)."""
    a, b = np.broadcast_arrays(a, b)
    w = a[:, 0] * b[:, 0] - np.sum(a[:, 1:] * b[:, 1:], axis=1)
    xyz = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.concatenate([w[:, None], xyz], axis=1)


def _exponential(turn: Array) -> Array:
    """Quaternions (B, 4) of turns (B, 3)."""
    half = 0.5 * np.linalg.norm(turn, axis=1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * turn], axis=1)


def _logarithm(quaternion: Array) -> Array:
    """Turns (B, 3) of at most half a turn."""
    quaternion = np.where(quaternion[:, :1] < 0.0, -quaternion, quaternion)
    sine = np.linalg.norm(quaternion[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, quaternion[:, :1])
    small = sine < 1e-9
    factor = np.where(small, 2.0, angle / np.where(small, 1.0, sine))
    return np.asarray(factor * quaternion[:, 1:])


def _nearest(turn: Array, near: Array) -> Array:
    """Of the two rotation vectors (B, 3) shorter than a full turn with the same result, the one closer to ``near``."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    safe = np.where(angle > 0.0, angle, 1.0)
    other = np.where(angle > 0.0, turn * (1.0 - 2.0 * np.pi / safe), turn)
    closer = np.linalg.norm(other - near, axis=1) < np.linalg.norm(turn - near, axis=1)
    return np.where(closer[:, None], other, turn)


def _right_jacobian(turn: Array) -> Array:
    """``J`` (B, 3, 3) with ``exp(r + dr) = exp(r) exp(J dr)`` for small ``dr``."""
    angle = np.linalg.norm(turn, axis=1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    cross = np.zeros((len(turn), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -turn[:, 2], turn[:, 1], -turn[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    return np.asarray(np.eye(3) - first[:, None, None] * cross + second[:, None, None] * (cross @ cross))
