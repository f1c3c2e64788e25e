"""Writes servo.json: accelerations and measurements that MuJoCo computes for servo.xml. Needs `mujoco` and `numpy`."""
import json
from pathlib import Path

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path("servo.xml")
model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
data = mujoco.MjData(model)
random = np.random.default_rng(5)
cases = []
for _ in range(4):
    data.qpos, data.qvel = random.uniform(-0.6, 0.6, 3), random.uniform(-1, 1, 3)
    data.ctrl[:4] = random.uniform(-0.3, 1.0, 4)
    mujoco.mj_forward(model, data)
    cases.append({"x": [*data.qpos, *data.qvel], "u": data.ctrl[:4].tolist(), "a": data.qacc.tolist(),
                  "sensors": data.sensordata[:5].tolist(), "tip": data.site("tip").xmat.tolist()})
mujoco.mj_resetData(model, data)
mujoco.mj_forward(model, data)
result = {"mujoco": mujoco.__version__, "tip": data.site("tip").xmat.tolist(), "cases": cases}
Path("servo.json").write_text(json.dumps(result) + "\n")
