"""Models of MuJoCo's against MuJoCo itself, against the package's own robots, and against plans made again."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

mujoco = pytest.importorskip("mujoco")

import supple.mujoco as sm
from supple._backends import stencils

ARM = """
<mujoco model="arm">
  <option timestep="0.002" gravity="0 0 -9.81"><flag eulerdamp="disable" contact="disable"/></option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.1"/>
      <inertial mass="1.2" pos="0.15 0 0" diaginertia="0.002 0.01 0.01"/>
      <body name="fore" pos="0.3 0 0">
        <joint name="wrist" type="hinge" axis="0 1 0" stiffness="5" damping="0.05" armature="0.01"/>
        <inertial mass="0.5" pos="0.12 0 0" diaginertia="0.001 0.004 0.004"/>
        <site name="tip" pos="0.25 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="shoulder"/></actuator>
  <sensor>
    <framepos name="tip" objtype="site" objname="tip"/>
    <jointpos name="encoder" joint="shoulder" noise="0.01"/>
    <jointactuatorfrc name="torque" joint="shoulder"/>
  </sensor>
</mujoco>
"""

#: The same arm and task as the package's own robot.
TASK = """
[model]
kind = "robot"
integrator = "semi_implicit"
file = "arm.xml"
actuated = ["shoulder"]
substeps = 5
[[model.sensors]]
kind = "joint_position"
select = ["shoulder"]
variance = 1e-4
[model.joints.wrist]
stiffness = "wrist_kp"
[parameters.wrist_kp]
initial = 5.0
bounds = [0.5, 50.0]
scale = "log"
[[tasks]]
name = "task"
steps = 40
time_step = 0.01
initial_state = { "q.shoulder" = 0.4 }
noise = { initial = { "*" = 1e-4 }, process = { "v.*" = 1e-4 } }
[[tasks.costs]]
kind = "joint_position"
select = ["shoulder", "wrist"]
target = [-0.3, 0.2]
weight = 1.0
[[tasks.costs]]
kind = "joint_velocity"
weight = 0.01
[[tasks.costs]]
kind = "control"
weight = 0.01
"""

#: A top with a ball joint beside a floating body with a hinge, all of it smooth.
FLOATING = """
<mujoco>
  <option timestep="0.005" gravity="0 0 -1"><flag contact="disable"/></option>
  <worldbody>
    <body name="top" pos="1 0 0">
      <joint name="ball" type="ball" damping="0.1" stiffness="0.5"/>
      <geom type="capsule" fromto="0 0 0 0.2 0.1 0.3" size="0.02" mass="1"/>
      <site name="head" pos="0.2 0.1 0.3"/>
    </body>
    <body name="base">
      <freejoint name="root"/>
      <geom type="box" size="0.1 0.06 0.03" mass="1"/>
      <body pos="0.1 0 0">
        <joint name="fin" axis="0 1 0" stiffness="0.3" damping="0.02"/>
        <geom type="capsule" fromto="0 0 0 0.15 0 0.02" size="0.01" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="fin" kp="2"/><motor name="spin" joint="ball" gear="0 0 1"/></actuator>
  <sensor><framepos name="head" objtype="site" objname="head"/><gyro name="gyro" site="head"/></sensor>
</mujoco>
"""

ANKLE = {"wrist_kp": ("jnt_stiffness", "wrist")}


def arm(**options: Any) -> sm.Model:
    """The arm with a cost of states alone."""
    cost = sm.quadratic(
        states={"q.shoulder": (1.0, -0.3), "q.wrist": (1.0, 0.2), "v.*": 0.01}, controls=0.01, final_states=None
    )
    given = {"sensors": ["q.shoulder"], "parameters": ANKLE, "cost": cost, "substeps": 5, **options}
    return sm.Model(mujoco.MjModel.from_xml_string(ARM), **given)


def task_of(model: sm.Model, **options: Any) -> supple.Task:
    noise = model.noise(initial={"*": 1e-4}, process={"v.*": 1e-4}, measurement=1e-4)
    return model.task(**{"steps": 40, "noise": noise, "initial_state": {"q.shoulder": 0.4}, **options})


def points(model: sm.Model, size: int, spread: float = 0.4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random states and controls, and the parameters' values."""
    random = np.random.default_rng(1)
    start = np.array([float(value) for value in model.state()])
    x = start + spread * random.normal(size=(size, len(model.states)))
    u = random.uniform(-1.0, 1.0, size=(size, len(model.controls)))
    return x, u, np.array([parameter.initial for parameter in model.parameters.values()])


def test_steps_are_those_of_mujoco() -> None:
    model = arm()
    x, u, phi = points(model, 40)
    found = model._backend.steps(x, u, phi)
    mj = mujoco.MjModel.from_xml_string(ARM)
    for start, control, end in zip(x, u, found, strict=True):
        data = mujoco.MjData(mj)
        data.qpos[:], data.qvel[:], data.ctrl[:] = start[:2], start[2:], control
        mujoco.mj_step(mj, data, 5)
        assert np.array_equal(end, np.concatenate([data.qpos, data.qvel]))


def test_equal_points_give_equal_numbers_whatever_was_computed_before() -> None:
    text = FLOATING.replace('<flag contact="disable"/>', "").replace(
        "<worldbody>", '<worldbody><geom type="plane" size="2 2 .1" pos="0 0 -0.05"/>'
    )
    model = sm.Model(mujoco.MjModel.from_xml_string(text), cost=sm.quadratic(controls=1.0), substeps=3, threads=2)
    x, u, phi = points(model, 64)
    found = model._backend.steps(x, u, phi)
    order = np.random.default_rng(2).permutation(64)
    assert np.array_equal(model._backend.steps(x[order], u[order], phi), found[order])
    for i in range(5):
        assert np.array_equal(model._backend.steps(x[i : i + 1], u[i : i + 1], phi)[0], found[i])
    states, _, _ = model._backend.roll_out(x[0], u[:3], None, None, None, phi)
    assert np.array_equal(states[1], found[0])
    assert np.array_equal(model._backend.steps(states[1:3], u[1:3], phi), states[2:])


def test_the_model_given_is_not_changed() -> None:
    mj = mujoco.MjModel.from_xml_string(ARM)
    before = pickle.dumps(mj)
    model = sm.Model(mj, sensors=["q.*"], parameters={"mass": ("body_mass", "fore")}, cost=sm.quadratic(controls=1.0))
    task_of(model, steps=5).evaluate(gradient="total", mass=0.8)
    assert pickle.dumps(mj) == before
    assert model.mjmodel(mass=0.8).body_mass[2] == 0.8
    assert pickle.dumps(mj) == before


@pytest.mark.parametrize("integrator", ["mjINT_EULER", "mjINT_IMPLICITFAST", "mjINT_RK4"])
@pytest.mark.parametrize("substeps", [1, 3])
def test_first_derivatives(integrator: str, substeps: int) -> None:
    """``mjd_transitionFD``, with turns in coordinates, is the derivative of the steps, quaternions included."""
    mj = mujoco.MjModel.from_xml_string(FLOATING)
    mj.opt.integrator = getattr(mujoco.mjtIntegrator, integrator)
    model = sm.Model(mj, sensors=["gyro", "head", "q.fin"], cost=sm.quadratic(controls=1.0), substeps=substeps)
    x, u, phi = points(model, 6)
    z = np.concatenate([x, u], axis=1)
    n = len(model.states)
    truth = stencils.first(lambda z: model._backend.steps(z[:, :n], z[:, n:], phi), z, np.full(z.shape[1], 1e-3))
    found = model._backend.dynamics_jacobians(x, u, phi)
    assert np.abs(found - truth).max() < 2e-9
    truth = stencils.first(lambda x: model._backend.observations(x, phi), x, np.full(n, 1e-3))
    assert np.abs(model._backend.measurement_jacobians(x, phi) - truth).max() < 1e-9


def test_orders_of_differences() -> None:
    """Fourth order is closer to the truth than what MuJoCo gives at the same step."""
    errors = {}
    for order in (2, 4):
        model = arm(order=order)
        x, u, phi = points(model, 10, spread=2.0)
        truth = model._backend.simulator.dynamics_by_steps(x, u, phi, 1e-3)
        errors[order] = np.abs(model._backend.dynamics_jacobians(x, u, phi) - truth).max()
    assert errors[4] < 1e-10
    assert errors[4] < 0.1 * errors[2]


def test_turns_go_on_beyond_half_a_turn() -> None:
    text = '<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="b" type="ball"/><geom size=".1"/></body></worldbody>'
    text += '<actuator><motor name="m" joint="b" gear="0 0 1"/></actuator></mujoco>'
    model = sm.Model(mujoco.MjModel.from_xml_string(text), cost=sm.quadratic(controls=1.0))
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    x, _, _ = model._backend.roll_out(start, np.zeros((1250, 1)), None, None, None, np.zeros(0))
    assert np.allclose(x[:, 2], 2.0 * 0.002 * np.arange(1251), rtol=0, atol=1e-9)
    assert x[-1, 2] > np.pi


def test_contractions_are_derivatives_of_jacobians() -> None:
    cost = sm.quadratic(sensors={"tip": (3.0, [0.3, 0.0, 0.2])}, states={"q.wrist": ("weight", 0.2)}, controls=0.1)
    options = {"wrist_kp": ANKLE["wrist_kp"], "weight": ("dof_damping", "wrist", {"bounds": (0.01, 1.0)})}
    model = arm(cost=cost, sensors=["tip"], parameters=options)
    of = model._backend
    x, u, phi = points(model, 3)
    random = np.random.default_rng(3)
    n, m = 4, 1
    z = np.concatenate([x, u], axis=1)

    def by_phi(function: Any) -> np.ndarray:
        return stencils.first(lambda rows: np.array([function(row) for row in rows]), phi[None], 1e-3 * phi)[0]

    def check(found: Any, of_z: Any, of_phi: Any, points: np.ndarray) -> None:
        truth = stencils.first(of_z, points, np.full(points.shape[1], 2e-3))
        size = np.abs(truth).max() + np.abs(found[1]).max()
        assert np.abs(found[0] - truth).max() < 2e-6 * size
        assert np.abs(found[1] - by_phi(of_phi)).max() < 2e-6 * size

    def tiled(weights: np.ndarray, rows: np.ndarray) -> np.ndarray:
        return np.tile(weights, (len(rows) // len(weights), 1, 1))

    w = random.normal(size=(3, n, n + m))
    check(
        of.contract_dynamics(x, u, w, phi),
        lambda z: np.sum(tiled(w, z) * of.dynamics_jacobians(z[:, :n], z[:, n:], phi), axis=(1, 2)),
        lambda phi: np.sum(w * of.dynamics_jacobians(x, u, phi)),
        z,
    )
    c = random.normal(size=(3, 3, n))
    check(
        of.contract_measurements(x, c, phi),
        lambda x: np.sum(tiled(c, x) * of.measurement_jacobians(x, phi), axis=(1, 2)),
        lambda phi: np.sum(c * of.measurement_jacobians(x, phi)),
        x,
    )
    s = random.normal(size=(3, n + m, n + m))
    s += np.swapaxes(s, 1, 2)
    check(
        of.contract_stage_costs(x, u, s, phi),
        lambda z: np.sum(tiled(s, z) * of.stage_quadratics(z[:, :n], z[:, n:], phi)[0], axis=(1, 2)),
        lambda phi: np.sum(s * of.stage_quadratics(x, u, phi)[0]),
        z,
    )
    second, first = of.stage_quadratics(x, u, phi)
    truth = stencils.first(lambda z: of.stage_costs(z[:, :n], z[:, n:], phi), z, np.full(n + m, 1e-3))
    assert np.abs(first - truth).max() < 1e-8
    truth = stencils.first(lambda z: of.stage_quadratics(z[:, :n], z[:, n:], phi)[1], z, np.full(n + m, 1e-3))
    assert np.abs(second - truth).max() < 1e-6
    costates, dz, dl = random.normal(size=(3, n)), random.normal(size=(3, n + m)), random.normal(size=(3, n))
    h = 1e-4
    moved = [
        of.stage_parameters(x + s * h * dz[:, :n], u + s * h * dz[:, n:], costates + s * h * dl, phi) for s in (1, -1)
    ]
    found = of.stage_parameters_along(x, u, costates, dz, dl, phi)
    assert np.allclose(found, (moved[0] - moved[1]) / (2.0 * h), rtol=1e-5, atol=1e-7)


def test_total_gradient_is_that_of_planning_again() -> None:
    cost = sm.quadratic(sensors={"tip": (10.0, [0.3, 0.0, 0.2])}, states={"v.*": 0.01}, controls=0.01)
    parameters = {**ANKLE, "mass": ("body_mass", "fore", {"bounds": (0.2, 1.0)})}
    task = task_of(arm(cost=cost, sensors=["encoder", "q.wrist"], parameters=parameters))
    assert task.derivative_error is not None and task.derivative_error.first < 1e-9
    found = task.evaluate(gradient="total")
    total = found.tasks["task"].gradient.total
    assert total.valid
    for name, h in (("wrist_kp", 0.05), ("mass", 0.005)):
        slopes = []
        for step in (h, 2.0 * h):
            ends = [
                task.evaluate(at={name: found.parameters[name] + sign * step}, trajectories=False) for sign in (1, -1)
            ]
            numbers = [(end.information.nats, end.tasks["task"].cost.expected) for end in ends]
            slopes.append((np.array(numbers[0]) - np.array(numbers[1])) / (2.0 * step))
        truth = (4.0 * slopes[0] - slopes[1]) / 3.0
        assert np.allclose([total.information_nats[name], total.expected_cost[name]], truth, rtol=1e-6)


def test_the_same_arm_as_a_robot_of_a_task_file(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "arm.toml").write_text(TASK)
    truth = supple.load(tmp_path / "arm.toml").evaluate(gradient="both", wrist_kp=4.0)
    found = task_of(arm()).evaluate(gradient="both", wrist_kp=4.0)
    assert found.information.nats == pytest.approx(truth.information.nats, rel=1e-8)
    one, other = found.tasks["task"], truth.tasks["task"]
    assert one.cost.expected == pytest.approx(other.cost.expected, rel=1e-9)
    assert np.allclose(one.trajectory.x, other.trajectory.x, atol=1e-8)
    a, b = one.gradient, other.gradient
    assert a.total.information_nats["wrist_kp"] == pytest.approx(b.total.information_nats["wrist_kp"], rel=1e-6)
    assert a.total.expected_cost["wrist_kp"] == pytest.approx(b.total.expected_cost["wrist_kp"], rel=1e-6)
    assert a.frozen.information_nats["wrist_kp"] == pytest.approx(b.frozen.information_nats["wrist_kp"], rel=1e-6)


def test_costs_as_functions() -> None:
    def cost(x: Any, u: Any, p: Any) -> Any:
        return (
            (x[..., 0] + 0.3) ** 2
            + (x[..., 1] - 0.2) ** 2
            + 0.01 * np.sum(x[..., 2:] ** 2, axis=-1)
            + 0.01 * u[..., 0] ** 2
        )

    def final_cost(x: Any, p: Any) -> Any:
        return (x[..., 0] + 0.3) ** 2 + (x[..., 1] - 0.2) ** 2 + 0.01 * np.sum(x[..., 2:] ** 2, axis=-1)

    truth = task_of(arm()).evaluate(gradient="total")
    found = task_of(arm(cost=cost, final_cost=final_cost)).evaluate(gradient="total")
    assert found.information.nats == pytest.approx(truth.information.nats, rel=1e-8)
    slopes = [one.tasks["task"].gradient.total.information_nats["wrist_kp"] for one in (found, truth)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-6)


def test_one_parameter_may_set_several_numbers() -> None:
    both = [sm.Field("actuator_gainprm", "servo", 0), sm.Field("actuator_biasprm", "servo", 1, factor=-1.0)]
    mj = mujoco.MjModel.from_xml_string(FLOATING)
    model = sm.Model(mj, parameters={"kp": (both, {"bounds": (1.0, 4.0)})}, cost=sm.quadratic(controls=1.0))
    assert model.parameters["kp"].initial == 2.0
    changed = model.mjmodel(kp=3.0)
    assert changed.actuator_gainprm[0, 0] == 3.0 and changed.actuator_biasprm[0, 1] == -3.0


def test_constants_follow_masses() -> None:
    model = arm(parameters={"mass": ("body_mass", "fore")})
    heavier = model.mjmodel(mass=1.0)
    truth = mujoco.MjModel.from_xml_string(ARM.replace('mass="0.5"', 'mass="1"'))
    assert np.allclose(heavier.dof_invweight0, truth.dof_invweight0, rtol=1e-12)
    assert heavier.body_subtreemass[1] == pytest.approx(2.2)


def test_ranges_of_controls_are_kept() -> None:
    text = ARM.replace('joint="shoulder"/></actuator>', 'joint="shoulder" ctrlrange="-0.5 3"/></actuator>')
    cost = sm.quadratic(states={"q.shoulder": (5.0, -0.6)}, controls=0.01)
    model = sm.Model(mujoco.MjModel.from_xml_string(text), sensors=["q.*"], cost=cost, substeps=5)
    noise = model.noise(initial={"*": 1e-4}, process={"v.*": 1e-4}, measurement=1e-4)
    found = model.task(steps=40, noise=noise, initial_state={"q.shoulder": 0.4}).evaluate()
    u = found.tasks["task"].trajectory.u
    assert u.min() >= -0.5 and u.max() <= 3.0 and (u.max() > 2.999 or u.min() < -0.499)


def test_keyframes_and_sensor_noise() -> None:
    text = ARM.replace(
        "</mujoco>", '<keyframe><key name="up" qpos="0.1 0.2" qvel="1 2" ctrl="0.5"/></keyframe></mujoco>'
    )
    model = sm.Model(
        mujoco.MjModel.from_xml_string(text), sensors=["encoder"], keyframe="up", cost=sm.quadratic(controls=1.0)
    )
    assert [float(value) for value in model.state({"v.*": 3.0})] == [0.1, 0.2, 3.0, 3.0]
    assert model.sensor_variances.tolist() == [pytest.approx(1e-4)]
    assert list(model.noise(initial={}, process={}).measurement) == [pytest.approx(1e-4)]


def test_tasks_are_pickled() -> None:
    task = task_of(arm(), steps=10)
    again = pickle.loads(pickle.dumps(task.at(wrist_kp=3.0)))
    assert again.evaluate().to_dict()["tasks"] == task.evaluate(wrist_kp=3.0).to_dict()["tasks"]


def test_divergence_is_an_error_and_leaves_no_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(supple.UsageError, match="diverges"):
        task_of(arm(), initial_state={"v.*": 1e8})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sensors": ["torque"]}, "depends on more than positions and velocities"),
        ({"sensors": ["encodr"]}, "did you mean `encoder`"),
        ({"actuators": ["drve"]}, "did you mean `drive`"),
        ({"parameters": {"k": ("jnt_stifness", "wrist")}}, "did you mean `jnt_stiffness`"),
        ({"parameters": {"k": ("jnt_stiffness", "wrst")}}, "did you mean `wrist`"),
        ({"parameters": {"k": ("jnt_stiffness", "shoulder")}}, "give its `bounds`"),
        ({"parameters": {"k": ("actuator_gainprm", "drive")}}, "index must be 0 to"),
        ({"parameters": {"k": ("jnt_type", "wrist")}}, "not numbers that change smoothly"),
        ({"parameters": {"k": "jnt_stiffness"}}, "a tuple"),
        ({"cost": 3.0}, "must be supple.mujoco.quadratic"),
        ({"cost": sm.quadratic(states={"q.elbow": 1.0})}, "no state or control"),
        ({"cost": sm.quadratic(sensors={"tip": (1.0, [0.0, 1.0])})}, "3 numbers and 2 targets"),
        ({"cost": sm.quadratic(states={"q.*": -1.0})}, "at least 0"),
        ({"order": 3}, "2 or 4"),
        ({"substeps": 0}, "at least 1"),
        ({"keyframe": 0}, "the model has 0"),
    ],
)
def test_misuse(options: dict[str, Any], words: str) -> None:
    with pytest.raises(supple.UsageError, match=words):
        arm(**options)


def test_functions_that_return_the_wrong_shape() -> None:
    with pytest.raises(supple.UsageError, match="for a batch of"):
        task_of(arm(cost=lambda x, u, p: x.sum())).evaluate()


def test_files_that_are_none() -> None:
    with pytest.raises(supple.FileError, match="nowhere.xml"):
        sm.Model("nowhere.xml", cost=sm.quadratic(controls=1.0))


def test_the_example_on_a_public_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound is met, the search stops at it, and its gradient is that of planning again."""
    pytest.importorskip("gymnasium")
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "python" / "examples"))
    import mujoco_leg

    task = mujoco_leg.swing()
    now = task.evaluate(gradient="total")
    assert sm.gradient_error(task, step=0.02)["ankle"] < 1e-4
    best = task.design(settings={"branch_attempts": 0})
    assert best.status == "converged" and best.active_bounds == ["swing"]
    assert best.parameters["ankle"] < 60.0 and best.information.bits < now.information.bits


def test_what_a_model_is_changes_with_it(tmp_path: Path) -> None:
    """Journals of sweeps refuse those of another model."""
    text = "<mujoco><worldbody><body><joint name='j' stiffness='{}'/><geom size='0.1' mass='1'/></body></worldbody>"
    text += "<actuator><motor name='m' joint='j'/></actuator></mujoco>"

    def source(stiffness: float, weight: float) -> str:
        model = supple.mujoco.Model(
            mujoco.MjModel.from_xml_string(text.format(stiffness)),
            sensors=["q.j"],
            parameters={"k": ("jnt_stiffness", "j", supple.Parameter(2.0, (1.0, 5.0)))},
            cost=supple.mujoco.quadratic(states={"*": weight}, controls=0.1),
        )
        noise = model.noise(initial={"*": 1e-4}, process={"v.*": 1e-4}, measurement=1e-4)
        ((_, content),) = model.task(steps=3, noise=noise)._native.sources()
        return content

    assert source(2.0, 1.0) == source(2.0, 1.0)
    assert len({source(2.0, 1.0), source(3.0, 1.0), source(2.0, 2.0)}) == 3
