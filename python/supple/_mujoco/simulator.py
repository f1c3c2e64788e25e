"""MuJoCo as plain functions of batches: ``x+ = f(x, u; phi)``, sensors, and their first derivatives.

A state ``x`` (n,) is coordinates (nv,), velocities (nv,) and activations (na,); see :mod:`.chart`. ``z = (x, u)``. Every step
begins with nothing but that: time 0, no warm start, no forces from outside, so that equal points give equal numbers.
"""

from __future__ import annotations

import copy
import hashlib
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np

from .._backends import stencils
from .._records import Array
from ..errors import UsageError
from . import fields
from .chart import Chart
from .names import Outputs

__all__ = ["Simulator"]

_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
#: Numbers above this are as good as infinite to MuJoCo (``mjMAXVAL``), which then writes a log file.
_HUGE = 1e9
#: Models of other parameters to keep: those that one gradient needs.
_MODELS = 64


class _Quiet:
    """While any instance is active, MuJoCo's warnings are discarded: trial plans often diverge, and each warning would be
    appended to a log file in the user's folder."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._entered = 0
        self._previous: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self._entered == 0:
                self._previous = mujoco.get_mju_user_warning()
                mujoco.set_mju_user_warning(lambda _: None)
            self._entered += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._entered -= 1
            if self._entered == 0:
                mujoco.set_mju_user_warning(self._previous)


QUIET = _Quiet()


class _Worker:
    """The workspace of one thread at a time: MuJoCo data, and a pool of MuJoCo's own threads."""

    def __init__(self, model: mujoco.MjModel, threads: int) -> None:
        self.data = [mujoco.MjData(model) for _ in range(threads)]
        self.here = mujoco.rollout.Rollout(nthread=0)
        self.pool = mujoco.rollout.Rollout(nthread=threads) if threads > 1 else self.here


class Simulator:
    """A MuJoCo model with chosen controls and parameters.

    Its own copy of the model differs from the one given in this: the solver of constraints runs until it has converged to
    ``tolerance``; controls are not clamped to their range, as plans already respect it; states that diverge are not reset.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        controls: Array | Any,
        targets: Sequence[Sequence[fields.Target]],
        *,
        reference: Array,
        held: Array,
        substeps: int,
        eps: float,
        order: int,
        tolerance: float,
        threads: int | None,
    ) -> None:
        self._base = _own(model, tolerance)
        self._controls = np.asarray(controls, dtype=np.intp)
        self.targets = [list(some) for some in targets]
        self._held = np.array(held, dtype=np.float64)
        self._substeps, self._eps, self._order, self._threads = substeps, eps, order, threads
        self.reference = np.array(reference, dtype=np.float64)
        self._prepare()

    def _prepare(self) -> None:
        base = self._base
        self.nv, self.na, self.nq = int(base.nv), int(base.na), int(base.nq)
        self.states, self.controls = 2 * self.nv + self.na, len(self._controls)
        self.chart = Chart(base, self.reference)
        self._models: OrderedDict[bytes, mujoco.MjModel] = OrderedDict()
        self._lock = threading.Lock()
        self._workers: list[_Worker] = []
        count = self._threads if self._threads is not None else _cores()
        self._count = max(1, int(count or 1))
        self._transition = int(base.opt.integrator) != int(mujoco.mjtIntegrator.mjINT_RK4)

    def scaled(self, factor: float) -> Simulator:
        """The same simulator with its finite-difference step scaled by a factor."""
        other = copy.copy(self)
        other._eps = factor * self._eps
        return other

    def __getstate__(self) -> dict[str, Any]:
        kept = ("_base", "_controls", "targets", "_held", "_substeps", "_eps", "_order", "_threads", "reference")
        return {name: getattr(self, name) for name in kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    def source(self) -> str:
        """A text that identifies the model: a fingerprint of MuJoCo's binary form of it, and all choices made."""
        buffer = np.zeros(mujoco.mj_sizeModel(self._base), dtype=np.uint8)
        mujoco.mj_saveModel(self._base, None, buffer)
        chosen = (self._controls.tolist(), self.targets, self._held.tolist(), self.reference.tolist())
        settings = (self._substeps, self._eps, self._order)
        return f"MuJoCo {mujoco.__version__}, {hashlib.sha256(buffer.tobytes()).hexdigest()}: {chosen}, {settings}"

    def model_at(self, phi: Array) -> mujoco.MjModel:
        """The model with these values of the parameters (P,). Not to be changed."""
        key = phi.tobytes()
        with self._lock:
            found = self._models.get(key)
            if found is not None:
                self._models.move_to_end(key)
                return found
        made = fields.changed(self._base, self.targets, phi)
        with self._lock:
            self._models[key] = made
            while len(self._models) > _MODELS:
                self._models.popitem(last=False)
        return made

    def _with_worker(self, work: Callable[[_Worker], Any]) -> Any:
        with self._lock:
            worker = self._workers.pop() if self._workers else None
        worker = worker or _Worker(self._base, self._count)
        try:
            with QUIET:
                return work(worker)
        finally:
            with self._lock:
                self._workers.append(worker)

    def _physics(self, x: Array) -> Array:
        """MuJoCo's own states (B, 1 + nq + nv + na), of time 0."""
        nv = self.nv
        return np.concatenate([np.zeros((len(x), 1)), self.chart.positions(x[:, :nv]), x[:, nv:]], axis=1)

    def _run(self, x: Array, u: Array, phi: Array, steps: int) -> tuple[Array, Array]:
        """MuJoCo's states after ``steps`` steps, and sensors at ``x``; NaN where they diverge."""
        sane = np.all(np.abs(x) < _HUGE, axis=1) & np.all(np.abs(u) < _HUGE, axis=1)
        start = self._physics(np.where(sane[:, None], x, 0.0))
        ctrl = np.tile(self._held, (len(x), 1, 1))
        ctrl[:, 0, self._controls] = np.where(sane[:, None], u, 0.0)
        model = self.model_at(phi)

        def work(worker: _Worker) -> tuple[Array, Array]:
            few = len(x) < 4 * len(worker.data)
            pool, data = (worker.here, worker.data[:1]) if few else (worker.pool, worker.data)
            state, sensed = pool.rollout(model, data, start, ctrl, nstep=steps)
            return state[:, -1], sensed[:, 0]

        state, sensed = self._with_worker(work)
        state, sensed = np.array(state), np.array(sensed)
        lost = ~sane | ~np.all(np.abs(state) < _HUGE, axis=1)
        state[lost] = np.nan
        sensed[~sane] = np.nan
        return state, sensed

    def steps(self, x: Array, u: Array, phi: Array) -> Array:
        """``f``: (B, n) from (B, n), (B, m)."""
        state, _ = self._run(x, u, phi, self._substeps)
        return self._coordinates(state, x)

    def _coordinates(self, state: Array, x: Array) -> Array:
        qpos, rest = state[:, 1 : 1 + self.nq], state[:, 1 + self.nq :]
        return np.concatenate([self.chart.coordinates(qpos, x[:, : self.nv]), rest], axis=1)

    def observe(self, x: Array, phi: Array, outputs: Outputs) -> Array:
        """Sensors and states: (B, r)."""
        out = np.empty((len(x), len(outputs)))
        picked = ~outputs.sensed
        out[:, picked] = x[:, outputs.sources[picked]]
        if outputs.sensed.any():
            _, sensed = self._run(x, np.zeros((len(x), self.controls)), phi, 1)
            out[:, outputs.sensed] = sensed[:, outputs.sources[outputs.sensed]]
        return out

    def dynamics_jacobians(self, x: Array, u: Array, phi: Array) -> Array:
        """``[f_x f_u]``: (B, n, n+m), by ``mjd_transitionFD``; by differences of steps for integrators without it."""
        if self._transition:
            return self._transitions(x, u, phi)
        return self.dynamics_by_steps(x, u, phi, self._eps)

    def dynamics_by_steps(self, x: Array, u: Array, phi: Array, eps: float) -> Array:
        """The same by differences of whole steps."""
        n = self.states
        z = np.concatenate([x, u], axis=1)
        return stencils.first(lambda z: self.steps(z[:, :n], z[:, n:], phi), z, np.full(z.shape[1], eps))

    def output_jacobians(self, x: Array, phi: Array, outputs: Outputs) -> Array:
        """The derivative of :meth:`observe` by ``x``: (B, r, n)."""
        out = np.zeros((len(x), len(outputs), self.states))
        picked = np.flatnonzero(~outputs.sensed)
        out[:, picked, outputs.sources[picked]] = 1.0
        if not outputs.sensed.any():
            return out
        if self._transition:
            C = self._sensor_jacobians(x, phi)[:, outputs.sources[outputs.sensed]]
        else:
            steps = np.full(self.states, self._eps)
            C = stencils.first(lambda at: self.observe(at, phi, outputs), x, steps)[:, outputs.sensed]
        out[:, outputs.sensed] = C
        return out

    def _transitions(self, x: Array, u: Array, phi: Array) -> Array:
        n, m, model = self.states, self.controls, self.model_at(phi)
        end = self.steps(x, u, phi)
        out = np.empty((len(x), n, n + m))
        start = self._physics(x)

        def one(data: mujoco.MjData, i: int) -> None:
            if not np.all(np.isfinite(end[i])):
                out[i] = np.nan
                return
            A, B = np.empty((n, n)), np.empty((n, int(model.nu)))
            total_a, total_b = np.eye(n), np.zeros((n, m))
            self._place(model, data, start[i], u[i])
            for step in range(self._substeps):
                if step:
                    mujoco.mj_step(model, data)
                self._differences(model, data, A, B, None)
                total_a, total_b = A @ total_a, A @ total_b + B[:, self._controls]
            out[i, :, :n], out[i, :, n:] = total_a, total_b

        self._each(one, len(x))
        return self._to_coordinates(out, x, end)

    def _sensor_jacobians(self, x: Array, phi: Array) -> Array:
        """Derivatives of all of ``sensordata`` by ``x``."""
        model = self.model_at(phi)
        out = np.empty((len(x), int(model.nsensordata), self.states))
        start = self._physics(x)
        still = np.zeros(self.controls)

        def one(data: mujoco.MjData, i: int) -> None:
            if not np.all(np.abs(x[i]) < _HUGE):
                out[i] = np.nan
                return
            self._place(model, data, start[i], still)
            self._differences(model, data, None, None, out[i])

        self._each(one, len(x))
        return self._to_coordinates(out, x, None)

    def _differences(self, model: mujoco.MjModel, data: mujoco.MjData, A: Any, B: Any, C: Any) -> None:
        """``mjd_transitionFD`` at ``eps``; with that at ``2 eps`` extrapolated to fourth order."""
        mujoco.mjd_transitionFD(model, data, self._eps, True, A, B, C, None)
        if self._order == 2:
            return
        wider = [None if matrix is None else np.empty_like(matrix) for matrix in (A, B, C)]
        mujoco.mjd_transitionFD(model, data, 2.0 * self._eps, True, *wider, None)
        for matrix, wide in zip((A, B, C), wider, strict=True):
            if wide is not None:
                matrix += (matrix - wide) / 3.0

    def _to_coordinates(self, out: Array, x: Array, end: Array | None) -> Array:
        """Converts derivatives from rotations in the body's axes, as MuJoCo has them, to coordinates."""
        columns = self.chart.to_tangent(x[:, : self.nv])
        if columns is None:
            return out
        nv = self.nv
        out[:, :, :nv] = out[:, :, :nv] @ columns
        rows = None if end is None else self.chart.to_tangent(np.nan_to_num(end[:, :nv]))
        if rows is not None:
            out[:, :nv] = np.linalg.solve(rows, out[:, :nv])
        return out

    def _place(self, model: mujoco.MjModel, data: mujoco.MjData, physics: Array, u: Array) -> None:
        """Sets data to a state without leftovers of earlier steps."""
        mujoco.mj_setState(model, data, physics, _FULL)
        data.qacc_warmstart[:] = 0.0
        data.ctrl[:] = self._held
        data.ctrl[self._controls] = u

    def _each(self, one: Callable[[mujoco.MjData, int], None], count: int) -> None:
        """Calls ``one`` for every point, on several threads if worthwhile; MuJoCo releases the GIL meanwhile."""

        def work(worker: _Worker) -> None:
            share = len(worker.data) if count >= 8 * len(worker.data) else 1
            if share == 1:
                for i in range(count):
                    one(worker.data[0], i)
                return

            def part(k: int) -> None:
                for i in range(k, count, share):
                    one(worker.data[k], i)

            with ThreadPoolExecutor(share) as threads:
                list(threads.map(part, range(share)))

        self._with_worker(work)

    def roll_out(self, start: Array, law: Callable[[int, Array], Array], count: int, phi: Array) -> tuple[Array, Array]:
        """States (N+1, n) and controls (N, m) from ``start`` under ``u = law(t, x)``; NaN from where they diverge."""
        model = self.model_at(phi)
        x, u = np.full((count + 1, self.states), np.nan), np.full((count, self.controls), np.nan)
        x[0] = start

        def work(worker: _Worker) -> None:
            data = worker.data[0]
            for t in range(count):
                u[t] = law(t, x[t])
                if not (np.all(np.abs(x[t]) < _HUGE) and np.all(np.abs(u[t]) < _HUGE)):
                    return
                self._place(model, data, self._physics(x[None, t])[0], u[t])
                mujoco.mj_step(model, data, self._substeps)
                state = np.concatenate([[0.0], data.qpos, data.qvel, data.act])
                x[t + 1] = self._coordinates(state[None], x[None, t])[0]

        self._with_worker(work)
        return x, u


def _own(model: mujoco.MjModel, tolerance: float) -> mujoco.MjModel:
    """A copy to work with.

    Raises:
        UsageError: Where its state is more than positions, velocities and activations.
    """
    own = copy.copy(model)
    plain = 1 + int(own.nq) + int(own.nv) + int(own.na)
    if mujoco.mj_stateSize(own, _FULL) != plain:
        raise UsageError(
            "the MuJoCo model has states beside positions, velocities and activations (delays, plugins or plasticity), "
            "which are not supported: remove them"
        )
    if own.nv == 0:
        raise UsageError("the MuJoCo model has no joint: nothing moves")
    own.opt.tolerance = min(float(own.opt.tolerance), tolerance)
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL) | int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return own


def _cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
