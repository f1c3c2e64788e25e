"""How stiff should a cheetah's ankle be?

The front leg of Gymnasium's half-cheetah, a public MuJoCo model, swings its foot forward. Hip and knee have motors and
encoders; the ankle has a spring and nothing else: neither motor nor sensor. A stiffer ankle is easier to predict, a softer
one helps the swing. The design search finds the stiffness that needs the least information at a bounded cost.

    pip install supple[mujoco] gymnasium
    python mujoco_leg.py
"""

from __future__ import annotations

from pathlib import Path

import gymnasium
import mujoco

import supple
import supple.mujoco

CHEETAH = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "half_cheetah.xml"


def leg() -> mujoco.MjModel:
    """The front leg, hung from a torso that stands still, with a site at the tip of its foot."""
    spec = mujoco.MjSpec.from_file(str(CHEETAH))
    spec.compiler.settotalmass = -1.0
    for name in ("rootx", "rootz", "rooty"):
        spec.delete(spec.joint(name))
    for name in ("bthigh", "bshin", "bfoot", "ffoot"):
        spec.delete(spec.actuator(name))
    spec.delete(spec.body("bthigh"))
    spec.body("ffoot").add_site(name="toe", pos=[0.09, 0.0, -0.12])
    spec.add_sensor(name="toe", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="toe")
    spec.option.timestep = 0.005
    return spec.compile()


def swing() -> supple.Task:
    """The task: within half a second the toe is to be 0.22 m further forward and 0.04 m further up."""
    model = supple.mujoco.Model(
        leg(),
        actuators=["fthigh", "fshin"],
        sensors=["q.fthigh", "q.fshin"],
        parameters={"ankle": ("jnt_stiffness", "ffoot", {"bounds": (2.0, 200.0), "scale": "log"})},
        cost=supple.mujoco.quadratic(
            controls=5.0,
            states={"v.*": 0.1},
            final_states={"v.*": 5.0},
            final_sensors={"toe": (30000.0, [0.8, 0.0, 0.2])},
        ),
        substeps=4,
    )
    noise = model.noise(
        initial={"q.*": 1e-4, "v.*": 1e-3},
        process={"v.*": 1e-2, "v.ffoot": 0.1},
        measurement=1e-5,
    )
    design = {"starts": 1, "branch_attempts": 4, "rounds": 1}
    return model.task(steps=25, noise=noise, bound=28.0, name="swing", title="A cheetah's leg", design=design)


def main() -> None:
    """Designs the ankle and compares the gradient with differences of whole plans."""
    task = swing()
    print(task)
    print(f"relative errors of derivatives: {task.derivative_error}")
    now = task.evaluate(gradient="total")
    print(now)
    k, h = now.parameters["ankle"], 0.01
    ahead, behind = (task.evaluate(ankle=k * (1.0 + sign * h)).information.nats for sign in (1.0, -1.0))
    print(
        f"d information / d ankle: {now.tasks['swing'].gradient.total.information_nats['ankle']:.8g} nats per N m/rad,"
    )
    print(f"by planning again        {(ahead - behind) / (2.0 * h * k):.8g}")
    best = task.design()
    print(best)


if __name__ == "__main__":
    main()
