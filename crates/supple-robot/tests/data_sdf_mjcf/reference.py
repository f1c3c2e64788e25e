"""Writes NAME.json for each NAME.xml: what MuJoCo makes of it. Run in this folder; needs `mujoco` and `numpy`."""
import json
from pathlib import Path

import mujoco
import numpy as np


def named(model, kind, count, first, label):
    return [getattr(model, kind)(i).name or f"{label}{i}" for i in range(first, count)]


for path in sorted(Path(".").glob("*.xml")):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    random = np.random.default_rng(7)
    bodies = named(model, "body", model.nbody, 1, "body")
    inertias = []
    for i, name in enumerate(bodies, start=1):
        turned = np.zeros(9)
        mujoco.mju_quat2Mat(turned, model.body_iquat[i])
        turned = turned.reshape(3, 3)
        moment = turned @ np.diag(model.body_inertia[i]) @ turned.T
        inertias.append({"body": name, "mass": model.body_mass[i], "center": model.body_ipos[i].tolist(),
                         "moment": moment.tolist()})
    joints = named(model, "joint", model.njnt, 0, "joint")
    numbers = [{"joint": name, "limited": bool(model.jnt_limited[i]), "range": model.jnt_range[i].tolist(),
                "slide": bool(model.jnt_type[i] == mujoco.mjtJoint.mjJNT_SLIDE), "ref": model.qpos0[i],
                "rest": model.qpos_spring[i],
                "stiffness": model.jnt_stiffness[i], "damping": model.dof_damping[i],
                "armature": model.dof_armature[i], "friction": model.dof_frictionloss[i],
                "effort": model.jnt_actfrcrange[i].tolist() if model.jnt_actfrclimited[i] else None}
               for i, name in enumerate(joints)]
    cases = []
    for case in range(3):
        data.qpos = model.qpos0 + (random.uniform(-0.8, 0.8, model.nq) if case else 0)
        data.qvel = random.uniform(-1, 1, model.nv) if case else 0
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        cases.append({
            "q": data.qpos.tolist(), "v": data.qvel.tolist(), "mass_matrix": mass.tolist(),
            "bias": (data.qfrc_bias - data.qfrc_passive).tolist(),
            "bodies": [{"body": name, "position": data.xpos[i].tolist(), "rotation": data.xmat[i].tolist()}
                       for i, name in enumerate(bodies, start=1)],
            "sites": [{"site": model.site(i).name, "position": data.site_xpos[i].tolist(),
                       "rotation": data.site_xmat[i].tolist()} for i in range(model.nsite)]})
    result = {"mujoco": mujoco.__version__, "gravity": model.opt.gravity.tolist(), "inertias": inertias,
              "joints": numbers, "cases": cases}
    path.with_suffix(".json").write_text(json.dumps(result) + "\n")
