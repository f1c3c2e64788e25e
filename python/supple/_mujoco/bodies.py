"""The bodies of robot files as models of MuJoCo. URDF and MJCF files are read by MuJoCo itself; SDF files in ``sdf``."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from ..errors import FileError
from .sdf import sdf

__all__ = ["bodies"]

_INERTIA_FROM_GEOMS = 1


def bodies(file: str, texts: Mapping[str, str]) -> mujoco.MjSpec:
    """Links and joints of a robot file: all links as bodies with names, without limits, contacts and what is only seen.

    Args:
        file: Its path.
        texts: Texts of it and of all files that it includes, by path.

    Raises:
        FileError: Where MuJoCo cannot read it.
    """
    text = texts[file]
    try:
        if "<sdf" in text[:2000]:
            spec = sdf(text, file)
        else:
            folder = file.rpartition("/")[0] + "/"
            included = {path.removeprefix(folder): other.encode() for path, other in texts.items() if path != file}
            spec = mujoco.MjSpec.from_string(text, include=included)
            spec.modelfiledir = folder
        # Links without inertia stay bodies of their own, with next to none.
        spec.compiler.fusestatic = False
        spec.compiler.boundmass = 1e-12
        spec.compiler.boundinertia = 1e-15
        for index, body in enumerate(spec.bodies):
            body.name = body.name or f"body {index}"
        _settle(spec)
    except ValueError as error:
        raise FileError(f"MuJoCo cannot read it: {error}", file=file) from error
    for lists in (spec.sensors, spec.keys, spec.geoms, spec.cameras, spec.lights, spec.pairs, spec.excludes):
        for element in list(lists):
            spec.delete(element)
    for lists in (spec.meshes, spec.hfields, spec.skins, spec.materials, spec.textures):
        for element in list(lists):
            spec.delete(element)
    for joint in spec.joints:
        joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
    return spec


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
