"""The interface of a model that is implemented in Python.

All arrays are float64 and C-contiguous. ``B`` points at once: never one by one. ``n`` states, ``m`` controls, ``p``
measurements, ``P`` parameters, ``z = (x, u)``, ``N`` steps.
"""

from __future__ import annotations

from typing import Protocol

from .._records import Array

__all__ = ["Backend"]


class Backend(Protocol):
    """The functions ``x+ = f(x, u; phi)``, ``y = g(x; phi)``, ``l(x, u; phi)``, ``l_N(x; phi)`` and their derivatives."""

    states: int
    controls: int
    measurements: int

    def roll_out(
        self,
        start: Array,
        controls: Array,
        feedback: Array | None,
        reference: Array | None,
        bounds: tuple[Array, Array] | None,
        phi: Array,
    ) -> tuple[Array, Array, float]:
        """States (N+1, n), controls (N, m) and cost from ``start`` (n,) under ``u_t = controls_t + feedback_t (x_t -
        reference_t)``, kept within bounds (m,), (m,); (N, m), (N, m, n), (N, n). Without feedback ``u_t = controls_t``."""

    def steps(self, x: Array, u: Array, phi: Array) -> Array:
        """``f``: (B, n)."""

    def observations(self, x: Array, phi: Array) -> Array:
        """``g``: (B, p)."""

    def stage_costs(self, x: Array, u: Array, phi: Array) -> Array:
        """``l``: (B,)."""

    def final_costs(self, x: Array, phi: Array) -> Array:
        """``l_N``: (B,)."""

    def dynamics_jacobians(self, x: Array, u: Array, phi: Array) -> Array:
        """``[f_x f_u]``: (B, n, n+m)."""

    def measurement_jacobians(self, x: Array, phi: Array) -> Array:
        """``g_x``: (B, p, n)."""

    def stage_quadratics(self, x: Array, u: Array, phi: Array) -> tuple[Array, Array]:
        """``l_zz``: (B, n+m, n+m), and ``l_z``: (B, n+m)."""

    def final_quadratics(self, x: Array, phi: Array) -> tuple[Array, Array]:
        """``l_N,xx``: (B, n, n), and ``l_N,x``: (B, n)."""

    def dynamics_curvature(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """``(lambda' f)_zz``: (B, n+m, n+m), with costates (B, n)."""

    def contract_dynamics(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, [f_x f_u]>``, adjoints (B, n, n+m): by ``z`` (B, n+m), by ``phi`` (P,)."""

    def contract_measurements(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, g_x>``, adjoints (B, p, n): by ``x`` (B, n), by ``phi`` (P,)."""

    def contract_stage_costs(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, l_zz>``, adjoints (B, n+m, n+m): by ``z`` (B, n+m), by ``phi`` (P,)."""

    def contract_final_costs(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, l_N,xx>``, adjoints (B, n, n): by ``x`` (B, n), by ``phi`` (P,)."""

    def stage_parameters(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """``sum l_phi + lambda' f_phi``: (P,)."""

    def final_parameters(self, x: Array, phi: Array) -> Array:
        """``sum l_N,phi``: (P,)."""

    def stage_parameters_along(
        self, x: Array, u: Array, costates: Array, dz: Array, dcostates: Array, phi: Array
    ) -> Array:
        """The derivative of :meth:`stage_parameters` along ``dz`` (B, n+m) and ``dcostates`` (B, n): (P,)."""

    def final_parameters_along(self, x: Array, dx: Array, phi: Array) -> Array:
        """The derivative of :meth:`final_parameters` along ``dx`` (B, n): (P,)."""
