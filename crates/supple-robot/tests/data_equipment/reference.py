"""Writes arm.json: what MuJoCo makes of arm.xml. Run in this folder; needs `mujoco` and `numpy`."""
import json
from pathlib import Path

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path("arm.xml")
data = mujoco.MjData(model)
random = np.random.default_rng(3)
actuators, cases = [], []
for i in range(model.nu):
    one = lambda name: getattr(model, f"actuator_{name}")[i]
    ranged = lambda name: one(f"{name}range").tolist() if one(f"{name}limited") else None
    actuators.append({"name": model.actuator(i).name, "joint": model.joint(model.actuator_trnid[i][0]).name,
                      "gear": one("gear")[0], "control": ranged("ctrl"), "force": ranged("force")})
for _ in range(3):
    data.qpos, data.qvel = random.uniform(-0.1, 0.3, model.nq), random.uniform(-1, 1, model.nv)
    # Controls within their ranges, and forces too: MuJoCo clamps what is beyond.
    data.ctrl = random.uniform(-0.3, 0.5, model.nu)
    mujoco.mj_forward(model, data)
    cases.append({"q": data.qpos.tolist(), "v": data.qvel.tolist(), "u": data.ctrl.tolist(),
                  "force": data.actuator_force.tolist()})
mass = np.zeros((model.nv, model.nv))
mujoco.mj_resetData(model, data)
mujoco.mj_forward(model, data)
mujoco.mj_fullM(model, data, mass)
keys = [{"q": model.key_qpos[i].tolist(), "v": model.key_qvel[i].tolist(), "u": model.key_ctrl[i].tolist()}
        for i in range(model.nkey)]
walls = [{"name": name, "position": data.geom(name).xpos.tolist(), "rotation": data.geom(name).xmat.tolist(),
          "size": model.geom(name).size.tolist()} for name in ("floor", "top", "post")]
result = {"mujoco": mujoco.__version__, "joints": [model.joint(i).name for i in range(model.njnt)],
          "actuators": actuators, "cases": cases, "keys": keys, "walls": walls, "mass": mass.tolist(),
          "total_mass": float(model.body_mass.sum())}
Path("arm.json").write_text(json.dumps(result) + "\n")
