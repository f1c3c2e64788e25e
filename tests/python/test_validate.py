"""Designs in closed loop on MuJoCo: :func:`supple.mujoco.validate`, and ``python3 -m supple validate``."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import supple

pytest.importorskip("mujoco")

from supple.__main__ import main
from supple._mujoco.bodies import bodies
from supple._mujoco.judgement import Moves, conclude
from supple._records import Array

#: Enough for statements about means.
ROLLOUTS = 60


@pytest.fixture(scope="module")
def wiping() -> supple.validation.Validation:
    return supple.mujoco.validate(supple.load("tasks/wiping_arm.toml"), rollouts=ROLLOUTS)


@pytest.mark.parametrize("file", ["elastic_elbow", "soft_gripper", "wiping_arm"])
def test_supples_own_rollouts_are_those_of_evaluate(file: str) -> None:
    """The same seeds, the same noise: to the last digits."""
    task = supple.load(f"tasks/{file}.toml")
    found = supple.mujoco.validate(task, rollouts=8, seed=3)
    expected = task.evaluate(rollouts=8, seed=3, trajectories=False)
    for name, report in expected.tasks.items():
        one, sampled = found.tasks[name], report.monte_carlo
        assert sampled is not None
        assert one.supple.cost_mean == pytest.approx(sampled.cost_mean, rel=1e-12)
        assert one.predicted_cost == pytest.approx(report.cost.expected, rel=1e-12)
        assert one.predicted_bits == pytest.approx(report.information.total_bits, rel=1e-12)
        assert one.predicted_contacts == {contact: made.touches for contact, made in report.contacts.items()}


def test_costs_on_mujoco_are_those_of_supple(wiping: supple.validation.Validation) -> None:
    """Under the same noise the two plants differ by the error of supple's time step alone."""
    task = wiping.tasks["wipe"]
    assert task.mujoco.diverged == task.supple.diverged == 0
    assert abs(task.cost_difference) < 0.05 * task.supple.cost_mean
    assert task.cost_difference == pytest.approx(task.mujoco.cost_mean - task.supple.cost_mean)
    lower, upper = task.mujoco.cost_interval_95
    assert lower < task.mujoco.cost_mean < upper
    width, of_difference = upper - lower, np.ptp(task.cost_difference_interval_95)
    assert of_difference < width, "roll-outs under the same noise differ less than among one another"
    assert task.mujoco.touched == {"wall": 1.0} and task.predicted_contacts == {"wall": True}
    assert task.mujoco.ends_well > 0.9 and task.supple.ends_well > 0.9
    assert task.mujoco.realised_bits == pytest.approx(task.predicted_bits, rel=0.5)


def test_a_linear_system_ends_within_its_predicted_deviations() -> None:
    """The deviations of the last state, from a sample of the linear system itself."""
    from supple._mujoco.validation import deviations

    A, B, C = np.array([[1.0, 0.1], [-0.2, 0.95]]), np.array([[0.0], [0.1]]), np.array([[1.0, 0.0]])
    task = supple.linear(
        A=A, B=B, C=C, Q=np.eye(2), R=np.eye(1), W=1e-3 * np.eye(2), V=1e-2 * np.eye(1), X0=1e-2 * np.eye(2), N=30
    )
    plan = task.linearise()
    found = task.simulate(plant=lambda x, u, t: A @ x + B @ u, rollouts=4000)
    assert np.allclose(deviations(plan), (found.states[:, -1] - plan.states[-1]).std(axis=0), rtol=0.05)


def test_errors_of_the_model_cost_what_they_should(wiping: supple.validation.Validation) -> None:
    task = supple.load("tasks/wiping_arm.toml")
    plain = wiping.tasks["wipe"]
    stiff = supple.mujoco.validate(task, ROLLOUTS, vary={"contact.stiffness": 3.0, "mass": 1.3}).tasks["wipe"]
    assert stiff.supple.cost_mean == plain.supple.cost_mean, "supple's own model is not varied"
    assert stiff.cost_difference > plain.cost_difference + 1.0
    assert stiff.mujoco.consistency is not None and plain.mujoco.consistency is not None
    assert stiff.mujoco.consistency.mean > plain.mujoco.consistency.mean
    unchanged = supple.mujoco.validate(task, ROLLOUTS, vary={"contact.stiffness": 1.0, "damping": 1.0})
    assert unchanged.tasks["wipe"].mujoco.cost_mean == pytest.approx(plain.mujoco.cost_mean, rel=1e-9)


def test_tasks_that_set_parameters_are_validated_with_them(tmp_path: Path) -> None:
    """A heavier forearm is heavier on MuJoCo too: its motion is that of the task, not that of the parameter."""
    text = Path("tasks/elastic_elbow.toml").read_text().replace("../models", str(Path("models").resolve()))
    head, tail = text.split("[[tasks]]", 1)
    parameter = '[parameters.payload]\ninitial = 1.0\nbounds = [0.5, 4.0]\nrole = "study"\n'
    parameter += '[model.links.forearm]\nmass = "payload"\n\n'
    lines = tail.replace('name = "press"', 'name = "loaded"\nset = { payload = 2.5 }', 1)
    file = tmp_path / "elbow.toml"
    file.write_text(f"{head}{parameter}[[tasks]]{tail}\n[[tasks]]{lines}")
    task = supple.load(file)
    found = supple.mujoco.validate(task, rollouts=16, seed=1)
    light, loaded = (found.tasks[name] for name in ("press", "loaded"))
    expected = task.evaluate(rollouts=0)
    assert expected.tasks["loaded"].set == {"payload": 2.5} and expected.tasks["press"].set == {}
    for name, one in (("press", light), ("loaded", loaded)):
        assert one.predicted_cost == pytest.approx(expected.tasks[name].cost.expected, rel=1e-9)
        assert one.mujoco.cost_mean == pytest.approx(one.supple.cost_mean, rel=0.03)
    assert abs(loaded.predicted_cost - light.predicted_cost) > 0.05 * light.predicted_cost


def test_parameters_are_varied_where_they_stand() -> None:
    """A soft spring that is twice as stiff is the robot of twice the parameter: measurements and costs too."""
    from supple._mujoco.validation import _truth

    task = supple.load("tasks/elastic_elbow.toml", k=100.0)
    varied = _truth(task._native, {"stiffness": 2.0})
    assert varied.values() == {**task.values, "k": 200.0}
    beyond = _truth(supple.load("tasks/elastic_elbow.toml", k=400.0)._native, {"stiffness": 2.0})
    assert beyond.values()["k"] == 800.0, "bounds are those of designs"
    peg = json.loads(_truth(supple.load("tasks/peg_on_wall.toml")._native, {"stiffness": 2.0}).tables())
    assert peg["model"]["compliance"][0]["stiffness"] == ["k", 0.0, 4e4]


def test_sensors_of_the_last_step_measure_mujocos_last_step(tmp_path: Path) -> None:
    """Accelerations, efforts and powers as MuJoCo has them: costs and bits are those of supple."""
    text = Path("tasks/wiping_arm.toml").read_text(encoding="utf-8").replace("../models", str(Path("models").resolve()))
    sensors = "".join(
        f'[[model.sensors]]\nkind = "{kind}"\nselect = ["elbow"]\nvariance = {variance}\n\n'
        for kind, variance in {"joint_acceleration": 400.0, "drive_effort": 0.1, "power": 1.0}.items()
    )
    path = tmp_path / "task.toml"
    path.write_text(text.replace("[parameters.k]", f"{sensors}[parameters.k]", 1), encoding="utf-8")
    task = supple.load(path)
    found = supple.mujoco.validate(task, rollouts=ROLLOUTS).tasks["wipe"]
    assert found.mujoco.diverged == 0 and found.mujoco.ends_well > 0.9
    assert abs(found.cost_difference) < 0.05 * found.supple.cost_mean
    assert found.mujoco.realised_bits == pytest.approx(found.supple.realised_bits, rel=0.25)
    assert found.mujoco.consistency is not None and found.mujoco.consistency.mean < 1.5


@pytest.mark.parametrize("file", ["elastic_elbow", "soft_gripper", "peg_on_wall", "wiping_arm"])
def test_mujocos_own_contacts_press_alike(file: str) -> None:
    task = supple.load(f"tasks/{file}.toml")
    found = supple.mujoco.validate(task, rollouts=20, contact="mujoco")
    for one in found.tasks.values():
        assert one.mujoco.diverged == 0
        assert all(share == 1.0 for share in one.mujoco.touched.values())
        assert one.mujoco.cost_mean == pytest.approx(one.supple.cost_mean, rel=0.1)
        assert one.mujoco.ends_well == 1.0 and one.mujoco.realised_bits < 1.6 * one.predicted_bits


def test_designs_have_a_start_and_an_optimum(tmp_path: Path) -> None:
    task = supple.load("tasks/elastic_elbow.toml")
    design = task.design()
    start = supple.mujoco.validate(design, 10, at="start")
    optimum = supple.mujoco.validate(design, 10)
    assert (start.at, start.parameters) == ("start", task.values)
    assert optimum.parameters == design.parameters != start.parameters
    assert optimum.tasks["press"].predicted_bits < start.tasks["press"].predicted_bits
    # A result that was kept is validated from the texts that it holds.
    again = supple.mujoco.validate(supple.load_result(design.save(tmp_path / "kept")), 10, at="optimum")  # type: ignore[arg-type]
    assert again.to_dict() == optimum.to_dict()
    assert "ends well" in repr(again) and "<table" in again._repr_html_()


def test_flags_of_mjcf_switch_gravity_off(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(
        """<mujoco><option gravity="0 0 -9.81"><flag gravity="disable"/></option><worldbody><body name="a">
        <joint name="ja" type="hinge" axis="0 1 0" damping="0.4" armature="0.02"/>
        <inertial pos="0.1 0 0" mass="1" diaginertia="0.004 0.005 0.006"/></body></worldbody>
        <actuator><motor name="ma" joint="ja"/></actuator></mujoco>"""
    )
    text = """
        model = { kind = "robot", file = "arm.xml", sensors = [{ kind = "joint_position", variance = 1e-6 }] }
        [[tasks]]
        name = "swing"
        steps = 200
        time_step = 0.002
        noise = { initial = [1e-6, 1e-6], process = [0.0, 1e-6] }
        costs = [
            { kind = "joint_position", target = [0.5], weight = 1.0, final_weight = 100.0 },
            { kind = "control", weight = 1.0 },
        ]
    """
    found = supple.mujoco.validate(supple.loads(text, str(tmp_path / "task.toml")), 20).tasks["swing"]
    assert not found.broken
    assert found.mujoco.cost_mean == pytest.approx(found.supple.cost_mean, rel=0.02)


def test_the_command_writes_what_the_function_finds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = supple.load("tasks/elastic_elbow.toml").evaluate().save(tmp_path / "kept")
    words = ["validate", str(folder), "--rollouts", "10", "--contact", "mujoco", "--vary", "mass=1.1", "--seed", "2"]
    assert main(words) == 0
    assert f"wrote {folder / 'validation.json'}" in capsys.readouterr().out
    found = json.loads((folder / "validation.json").read_text())
    assert (found["rollouts"], found["contact"], found["vary"], found["seed"]) == (10, "mujoco", {"mass": 1.1}, 2)
    expected = supple.mujoco.validate(supple.load("tasks/elastic_elbow.toml"), 10, "mujoco", {"mass": 1.1}, seed=2)
    assert found["tasks"]["press"] == json.loads(json.dumps(expected.to_dict()["tasks"]["press"]))
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found
    for wrong, message in [(["--vary", "mass"], "NAME=FACTOR"), (["--vary", "size=2"], "contact.stiffness")]:
        assert main(["validate", str(folder), *wrong]) == 2
        assert message in capsys.readouterr().err


def test_the_program_runs_it(program: Path, tmp_path: Path) -> None:
    folder = supple.load("tasks/elastic_elbow.toml").evaluate().save(tmp_path / "kept")
    words = ["validate", str(folder), "--rollouts", "5", "--python", sys.executable, "--json"]
    found = subprocess.run([program, *words], check=False, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout) == json.loads((folder / "validation.json").read_text())


@pytest.mark.parametrize("path", ["models/iiwa14_door.urdf", "models/wiping_arm.sdf", "models/soft_gripper.xml"])
def test_robots_as_mjcf_are_read_by_mujoco(program: Path, path: str, tmp_path: Path) -> None:
    """MuJoCo's bodies of the file that was written have the mass matrix that supple has."""
    import mujoco

    text = subprocess.run([program, "robot", path, "--to", "mjcf"], check=True, capture_output=True, text=True).stdout
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    dynamics = json.loads(
        subprocess.run([program, "robot", path, "--json"], check=True, capture_output=True, text=True).stdout
    )
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    G = np.zeros((model.nv, len(dynamics["joints"])))
    for column, name in enumerate(dynamics["joints"]):
        G[model.joint(name).dofadr[0], column] = 1.0
    for index in range(model.neq):
        follower, leader = model.eq_obj1id[index], model.eq_obj2id[index]
        G[follower] = model.eq_data[index, 1] * G[leader]
    assert np.allclose(G.T @ full @ G, dynamics["mass_matrix"], rtol=1e-9, atol=1e-12)


def loop(cost: float, interval: tuple[float, float]) -> supple.validation.SampledLoop:
    return supple.validation.SampledLoop(
        cost_mean=cost,
        cost_interval_95=np.array(interval),
        cost_median=cost,
        realised_bits=10.0,
        realised_bits_interval_95=np.array([9.0, 11.0]),
        consistency=None,
        touched={},
        limits=[],
        diverged=0,
        ends_well=1.0,
    )


def test_a_cost_of_many_times_the_predicted_one_is_broken_whatever_its_interval() -> None:
    """Ten roll-outs with a heavy tail: the interval reaches down to what was predicted."""
    moves = Mock(spec=Moves, **{"cause.return_value": "the steps"})
    few = conclude((1.0, 10.0), None, loop(1.0, (0.9, 1.1)), [(loop(28.0, (-5.0, 61.0)), "q")], moves, None, 100)
    assert few.broken and "28 instead of the predicted 1" in few.words and few.words.endswith("the steps")
    # Supple's own roll-outs are as far off: no step of MuJoCo is the cause.
    alike = conclude((1.0, 10.0), None, loop(14.0, (0.5, 28.0)), [(loop(28.0, (-5.0, 61.0)), "q")], moves, None, 100)
    assert alike.broken and "supple's own roll-outs are not as predicted either" in alike.words
    less = conclude((1.0, 10.0), None, loop(1.0, (0.9, 1.1)), [(loop(3.0, (0.5, 5.5)), "q")], moves, None, 100)
    assert not less.broken and less.words == "the design holds on MuJoCo as predicted"


def test_rollouts_that_diverge_are_counted_in_place_of_a_cost(wiping: supple.validation.Validation) -> None:
    task = wiping.tasks["wipe"]
    none = np.full(2, np.nan)
    lost = dataclasses.replace(task.mujoco, cost_mean=np.inf, cost_interval_95=none, diverged=3, consistency=None)
    page = repr(dataclasses.replace(wiping, tasks={"wipe": dataclasses.replace(task, mujoco=lost)}))
    assert f"MuJoCo diverges in 3 of {ROLLOUTS} roll-outs" in page and "nan" not in page and "inf" not in page


def test_cost_limits_count_on_mujoco() -> None:
    moves = Mock(spec=Moves, **{"cause.return_value": "the steps"})
    own, judge = loop(12.0, (11.9, 12.1)), (12.5, 10.0)
    beyond = conclude(judge, 13.0, own, [(loop(14.8, (14.5, 15.1)), "q")], moves, None, 100)
    assert beyond.broken and "14.8 instead of the predicted 12.5, above the limit of 13" in beyond.words
    within = conclude(judge, 15.0, own, [(loop(14.8, (14.5, 15.1)), "q")], moves, None, 100)
    assert not within.broken and within.words.startswith("the design is in doubt on MuJoCo")
    little = conclude(judge, 12.5, own, [(loop(12.8, (12.7, 12.9)), "q")], moves, None, 100)
    assert not little.broken and little.words == (
        "the design moves on MuJoCo as predicted; but its cost there, 12.7 to 12.9, is above the limit of 12.5, by 2.4%"
    )


def test_limits_are_looked_at_on_mujoco() -> None:
    """A plan that keeps a limit of the force on its wall; noise does not, here or there."""
    text = Path("tasks/peg_on_wall.toml").read_text(encoding="utf-8")
    limit = '[[tasks.limits]]\nkind = "contact_force"\ncontact = "wall"\nupper = 1.8\nenforce = true\n'
    task = supple.loads(f"{text}\n{limit}", "tasks/peg_on_wall.toml")
    found = supple.mujoco.validate(task, rollouts=40)
    one = found.tasks["insert"]
    here, there = (
        next(at for at in loop.limits if at.name == "normal force of wall") for loop in (one.supple, one.mujoco)
    )
    report = task.evaluate(rollouts=40).tasks["insert"]
    assert report.monte_carlo is not None and here.to_dict() == report.monte_carlo.limits[-1].to_dict()
    assert here.planned.max() == pytest.approx(1.8, rel=1e-6) and min(here.median, there.median) > 2.0
    assert there.share > 0.9 and there.worst > there.median
    expected = f"normal force of wall reaches {there.median:.4g} N in half of the roll-outs there"
    assert expected in one.conclusion and "normal force of wall above 1.8 N in" in repr(found)


def test_materials_of_sites_are_no_obstacle() -> None:
    text = """
    <mujoco><asset><material name="wood"/></asset><worldbody><site name="goal" material="wood"/><body name="arm">
    <joint name="turn" axis="0 1 0" damping="0.1"/><inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.01"/>
    </body></worldbody><actuator><motor joint="turn"/></actuator></mujoco>"""
    assert bodies("arm.xml", {"arm.xml": text}).spec.compile().nv == 1


def test_what_is_wrong_is_named() -> None:
    task = supple.load("tasks/wiping_arm.toml")
    for options, message in [
        ({"vary": {"size": 2.0}}, "mass, damping, stiffness, friction, contact.stiffness, contact.dissipation"),
        ({"vary": {"mass": 0.0}}, "above 0"),
        ({"vary": {"friction": -1.0}}, "at least 0"),
        ({"contact": "soft"}, '"same", "mujoco"'),
        ({"at": "end"}, '"start", "optimum"'),
        ({"rollouts": 1}, "at least 2"),
    ]:
        with pytest.raises(supple.UsageError, match=message.replace("(", r"\(")):
            supple.mujoco.validate(task, **options)  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="kind `two_mass`"):
        supple.mujoco.validate(supple.load("tasks/two_mass_small.toml"), 2)
    with pytest.raises(supple.UsageError, match="not read from a task file"):
        one = np.eye(1)
        linear = supple.linear(A=one, B=one, C=one, W=one, V=one, X0=one, Q=one, R=one, N=3)
        supple.mujoco.validate(linear, 2)
    text = Path("tasks/wiping_arm.toml").read_text()
    with pytest.raises(supple.UsageError, match="joints.elbow: MuJoCo's twin of a robot does not know `length_scale`"):
        longer = text.replace("[[model.sensors]]", "[model.joints.elbow]\nlength_scale = 1.1\n\n[[model.sensors]]", 1)
        supple.mujoco.validate(supple.loads(longer, "tasks/task.toml"), 2)


def test_the_documentation_has_these_numbers(wiping: supple.validation.Validation) -> None:
    """The table of docs/validation.md, from more roll-outs: predictions to its digits, means within their intervals."""
    text = (Path(__file__).parents[2] / "docs" / "validation.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("| ")
    ]
    for name, task in supple.load("tasks/iiwa_door.toml").evaluate(rollouts=0).tasks.items():
        of_door = [row for row in rows if row[:2] == [f"iiwa_door: {name}", "start"]]
        assert len(of_door) == 2
        for row in of_door:
            assert row[3] == f"{task.cost.expected:.4g}" and row[5] == f"{task.information.total_bits:.4g}"
    elbow = supple.mujoco.validate(supple.load("tasks/elastic_elbow.toml"), rollouts=20)
    for name, task in [("elastic_elbow: press", elbow.tasks["press"]), ("wiping_arm: wipe", wiping.tasks["wipe"])]:
        for plant, loop in [("supple", task.supple), (f"MuJoCo, {task.mujoco_steps} steps", task.mujoco)]:
            (row,) = [row for row in rows if row[:3] == [name, "start", plant]]
            assert row[3] == f"{task.predicted_cost:.4g}" and row[5] == f"{task.predicted_bits:.4g}"
            mean, half = map(float, row[4].split(" ± "))
            assert abs(loop.cost_mean - mean) <= half + 0.5 * np.ptp(loop.cost_interval_95)
            bits, half = map(float, row[6].split(" ± "))
            assert loop.realised_bits is not None
            assert abs(loop.realised_bits - bits) <= half + 0.5 * np.ptp(loop.realised_bits_interval_95)
            assert loop.consistency is not None
            assert loop.consistency.mean == pytest.approx(float(row[7].split(" ± ")[0]), rel=0.15)


STOPPED = """
<mujoco model="arm"><compiler angle="radian"/><option timestep="0.0005" integrator="implicitfast"/>
<worldbody><body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.3" range="-2 2" limited="true"/>
<inertial pos=".15 0 0" mass="1.5" diaginertia=".001 .012 .012"/>
<body name="fore" pos=".3 0 0"><joint name="elbow" axis="0 1 0" damping="0.2" range="-0.4 0.4" limited="true"
solreflimit="0.01 1"/><inertial pos=".12 0 0" mass=".8" diaginertia=".0005 .005 .005"/><site name="tip" pos=".25 0 0"/>
</body></body></worldbody>
<actuator><motor name="s" joint="shoulder" ctrlrange="-9 9" ctrllimited="true"/>
<position name="e" joint="elbow" kp="30" kv="2" forcerange="-4 4" forcelimited="true"/></actuator></mujoco>"""

REACH = """
model = { kind = "robot", file = "arm.xml", sensors = [{ kind = "joint_position", variance = 1e-4 }], substeps = 8 }

[[tasks]]
name = "reach"
steps = 100
time_step = 0.01

[tasks.noise]
initial = { "q.*" = 1e-4, "v.*" = 1e-4 }
process = { "q.*" = 1e-8, "v.*" = 1e-4 }

[[tasks.costs]]
kind = "frame_point"
frame = "tip"
target = [0.25, 0.0, 0.4]
weight = 20.0
final_weight = 4000.0

[[tasks.costs]]
kind = "joint_velocity"
weight = 0.05

[[tasks.costs]]
kind = "control"
weight = 1e-3
"""


@pytest.mark.parametrize("excess", ["all", "none"])
def test_stops_and_ranges_hold_where_rollouts_exceed_them(tmp_path: Path, excess: str) -> None:
    """A plan that bends an elbow to 1 rad whose stop is at .4, with 59 N m of a drive of 9, holds on a robot without stops."""
    robot, text = STOPPED, REACH
    if excess == "none":
        robot = robot.replace("-0.4 0.4", "-2 2").replace("-9 9", "-99 99").replace("-4 4", "-40 40")
    (tmp_path / "arm.xml").write_text(robot)
    (tmp_path / "task.toml").write_text(text)
    found = supple.mujoco.validate(supple.load(tmp_path / "task.toml"), rollouts=20)
    one = found.tasks["reach"]
    assert one.mujoco.cost_mean == pytest.approx(one.predicted_cost, rel=0.05)
    if excess == "none":
        assert one.stopped is None and not one.broken and "holds" in one.conclusion
        return
    assert one.stopped is not None and one.stopped.cost_mean > 3.0 * one.mujoco.cost_mean
    assert one.broken and one.stopped.ends_well == 0.0
    assert f"the cost on MuJoCo with its stops and ranges is {one.stopped.cost_mean:.4g}" in one.conclusion
    # What is commanded is cut; the stop gives way by a little.
    elbow = next(limit for limit in one.stopped.limits if limit.name == "position of joint `elbow`" and not limit.upper)
    assert -0.45 < elbow.worst < -0.4 and not any("control" in limit.name for limit in one.stopped.limits)
    assert "with stops and ranges" in repr(found)


def test_a_robot_with_stops_is_that_of_its_file(tmp_path: Path) -> None:
    """Step by step: the stops, ranges and softness that MuJoCo itself reads."""
    import mujoco

    from supple._mujoco.plant import Plant
    from supple._mujoco.validation import _stops, _trial

    (tmp_path / "arm.xml").write_text(STOPPED)
    (tmp_path / "task.toml").write_text(REACH)
    task = supple.load(tmp_path / "task.toml")
    trial = _trial(task._native, "reach", (task.linearise(), 8), False, {}, 20)
    stops = _stops(task._native, "reach")
    assert {name: ends for name, (_, ends) in stops.items() if "sub-step" not in name} == {
        "q.shoulder": (-2.0, 2.0),
        "q.elbow": (-0.4, 0.4),
        "ctrl.s": (-9.0, 9.0),
        "effort of e": (-4.0, 4.0),
    }
    plant = Plant(trial.with_stops(stops), 1, 0.01, 20)
    model = mujoco.MjModel.from_xml_string(STOPPED)
    model.opt.tolerance, model.opt.iterations = 1e-12, 100
    data = mujoco.MjData(model)
    x = np.zeros((1, 4))
    for step in range(60):
        u = np.array([[12.0 * np.sin(0.2 * step), -1.5]])
        x = plant.step(x, u)
        data.ctrl[:] = u[0]
        mujoco.mj_step(model, data, 20)
        assert np.allclose(x[0], [*data.qpos, *data.qvel], rtol=1e-6, atol=1e-7), step
    assert data.qpos[1] < -0.4, "the elbow rests on its stop"


def test_efforts_on_mujoco_are_greatest_within_steps(tmp_path: Path) -> None:
    """A servo whose effort at the ends of steps is a fraction of what it exerts after each change of its control."""
    text = REACH.replace(", substeps = 8", "").replace("target = [0.25, 0.0, 0.4]", "target = [0.45, 0.0, 0.25]")
    (tmp_path / "arm.xml").write_text(STOPPED.replace('kp="30" kv="2"', 'kp="60" kv="3"').replace("-4 4", "-1 1"))
    (tmp_path / "task.toml").write_text(text)
    task = supple.load(tmp_path / "task.toml")
    one = supple.mujoco.validate(task, rollouts=20).tasks["reach"]
    here, there = (
        {limit.upper: limit for limit in loop.limits if limit.name == "effort of e"}
        for loop in (one.supple, one.mujoco)
    )
    least, most = min(limit.worst for limit in there.values()), max(limit.worst for limit in there.values())
    assert max(most, -least) > 1.3 * max(here[True].worst, -here[False].worst), (here, there)

    # By MuJoCo's own model of the file, under the controls of the plan.
    import mujoco

    plan = task.linearise()
    model = mujoco.MjModel.from_xml_string(STOPPED.replace('kp="30" kv="2"', 'kp="60" kv="3"'))
    model.jnt_limited[:], model.actuator_ctrllimited[:], model.actuator_forcelimited[:] = 0, 0, 0
    data, forces = mujoco.MjData(model), []
    for control in plan.controls:
        data.ctrl[:] = control
        for _ in range(20):
            mujoco.mj_step(model, data)
            forces.append(float(data.actuator_force[1]))
    # Of the side where noise is little beside it.
    side = abs(max(forces)) > abs(min(forces))
    assert there[side].median == pytest.approx(max(forces) if side else min(forces), rel=0.1)


def test_the_discretisation_is_named_before_steps_of_mujoco() -> None:
    """A time step with whose finer sub-steps supple moves as MuJoCo does, at most 128 steps of which do not settle."""
    plan = supple.load("tasks/wiping_arm.toml").linearise()
    size = plan.states.shape[1]

    def ends(error: float) -> Callable[[Array, Array], Array]:
        return lambda states, controls: states + error

    class Coarse:
        def __init__(self, substeps: int) -> None:
            self.error = 0.0 if substeps >= 4 else 1e-3

        def simulate(self, name: str, controls: Array, start: list[float]) -> Array:
            return np.array([start, np.array(start) + self.error])

    def moves(supple_moves: Any, is_settled: bool) -> str:
        asked = Moves(
            plan,
            np.arange(0, len(plan.controls), 8),
            ends(0.0),
            ends(0.0),
            supple_moves,
            1,
            "wipe",
            is_settled,
            "",
            False,
        )
        return asked.cause(1.0)

    assert size and "use `substeps = 4`" in moves(Coarse, is_settled=False)
    assert "MuJoCo's own steps are not short enough" in moves(lambda _: Coarse(1), is_settled=False)
    assert "MuJoCo moves the robot differently" in moves(lambda _: Coarse(1), is_settled=True)


def test_rollouts_that_end_elsewhere_than_predicted_are_told() -> None:
    moves = Mock(spec=Moves, **{"cause.return_value": "the steps"})
    wide = dataclasses.replace(loop(1.0, (0.9, 1.1)), ends_well=0.7)
    found = conclude((1.0, 10.0), None, wide, [(wide, "v.wrist")], moves, None, 100)
    assert not found.broken and "holds on MuJoCo as predicted; but only 70% of the roll-outs there" in found.words
    assert "(furthest: `v.wrist`)" in found.words
    few = conclude((1.0, 10.0), None, wide, [(wide, "v.wrist")], moves, None, 10)
    assert few.words == "the design holds on MuJoCo as predicted", "three of ten are chance"
