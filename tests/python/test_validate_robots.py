"""What moves MuJoCo's twin of a robot: SDF files of all kinds, what supple ignores in MJCF files, and what is varied."""

from __future__ import annotations

from pathlib import Path

import pytest

import supple

pytest.importorskip("mujoco")

TASK = """
[model]
kind = "robot"
file = "{file}"
substeps = {substeps}

[[model.sensors]]
kind = "joint_position"
variance = {variance}

[[tasks]]
name = "go"
steps = 50
time_step = 0.01
noise = {{ initial = {{ "q.*" = 1e-6, "v.*" = 1e-6 }}, process = {{ "v.*" = 1e-5 }} }}
costs = [
    {{ kind = "joint_position", target = 0.4, weight = 10.0, final_weight = 100.0 }},
    {{ kind = "control", weight = 1e-3 }},
    {{ kind = "joint_velocity", weight = 1e-2 }},
]
"""

SDF = """<sdf version="{version}">{before}<model name="m">
<link name="base"><inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial></link>
<joint name="w" type="fixed"><parent>world</parent><child>base</child></joint>
<link name="l"><pose {kind}>{pose}</pose>
<inertial><pose>0 0 0.2 0 0 0</pose><mass>2</mass><inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz></inertia></inertial>
</link><joint name="j" type="{joint}"><parent>base</parent><child>l</child>
<axis><xyz {axis}>0 1 0</xyz>{limit}<dynamics><damping>0.5</damping>{dynamics}</dynamics></axis></joint></model>{after}</sdf>"""
PLAIN = {"version": "1.9", "before": "", "after": "", "kind": "", "pose": "0.1 0 0.2 0.4 0.7 0", "joint": "revolute"}
PLAIN |= {"axis": "", "limit": "<limit><lower>-2</lower><upper>2</upper></limit>", "dynamics": ""}
SPRING = "<spring_reference>0.5</spring_reference><spring_stiffness>12</spring_stiffness>"

MJCF = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" {option}/><worldbody><body pos="0 0 0.5" {body}>
<joint name="a" axis="0 1 0" damping="0.2" armature="0.02" stiffness="3" frictionloss="{friction}"/>
<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.01 0.01 0.01"/></body></worldbody>{more}
<actuator>{actuator}</actuator></mujoco>"""
MOTOR = '<motor name="m" joint="a"/>'
TENDON = '<tendon><fixed stiffness="60"><joint joint="a" coef="1"/></fixed></tendon>'


def _task(folder: Path, text: str, suffix: str, variance: float = 1e-3, substeps: int = 32) -> supple.Task:
    (folder / f"robot{suffix}").write_text(text)
    path = folder / "task.toml"
    path.write_text(TASK.format(file=f"robot{suffix}", variance=variance, substeps=substeps))
    return supple.load(path)


def _mjcf(folder: Path, **given: str) -> supple.Task:
    return _task(
        folder,
        MJCF.format(**{"option": "", "body": "", "friction": "0", "more": "", "actuator": MOTOR} | given),
        ".xml",
    )


@pytest.mark.parametrize(
    "changed",
    [
        {"dynamics": SPRING},
        {"axis": 'expressed_in="__model__"'},
        {"version": "1.4"},
        {"kind": 'degrees="true"', "pose": "0.1 0 0.2 20 40 0"},
        {"kind": 'rotation_format="quat_xyzw"', "pose": "0.1 0 0.2 0 0.34202 0 0.93969"},
        {"before": '<world name="w"><gravity>0 0 -3</gravity>', "after": "</world>"},
        {"joint": "continuous", "limit": ""},
    ],
)
def test_sdf_files_of_all_kinds_hold(tmp_path: Path, changed: dict[str, str]) -> None:
    found = supple.mujoco.validate(_task(tmp_path, SDF.format(**PLAIN | changed), ".sdf"), rollouts=20).tasks["go"]
    assert "holds" in found.conclusion, found.conclusion
    assert abs(found.cost_difference) < 0.01 * found.predicted_cost


def test_precise_sensors_get_steps_that_are_short_enough(tmp_path: Path) -> None:
    """A change of velocities by 1 % is far beyond what an encoder of .1 mrad resolves: the filter was blamed on the file."""
    found = supple.mujoco.validate(
        _task(tmp_path, MJCF.format(option="", body="", friction="0", more="", actuator=MOTOR), ".xml", 1e-8, 64), 30
    )
    one = found.tasks["go"]
    assert one.mujoco_steps > 64 and "holds" in one.conclusion, (one.mujoco_steps, one.conclusion)
    assert one.mujoco.realised_bits == pytest.approx(one.predicted_bits, rel=0.2)


@pytest.mark.parametrize(
    "ignored", [{"body": 'gravcomp="1"'}, {"more": TENDON}, {"option": 'density="1e5" viscosity="3"'}]
)
def test_what_supple_ignores_moves_mujoco(tmp_path: Path, ignored: dict[str, str]) -> None:
    task = _mjcf(tmp_path, **ignored)
    assert any("is left out" in warning for warning in task.warnings)
    found = supple.mujoco.validate(task, rollouts=10).tasks["go"]
    assert "holds" not in found.conclusion and "elements that one of them ignores" in found.conclusion, found.conclusion


@pytest.mark.parametrize("name", ["mass", "stiffness", "friction", "damping"])
def test_what_is_varied_is_named_as_the_cause(tmp_path: Path, name: str) -> None:
    found = supple.mujoco.validate(_mjcf(tmp_path, friction="0.5"), rollouts=10, vary={name: 4.0}).tasks["go"]
    assert f"as requested ({name} x 4)" in found.conclusion, found.conclusion


@pytest.mark.parametrize("name", ["friction", "contact.stiffness"])
def test_factors_that_multiply_nothing_are_errors(tmp_path: Path, name: str) -> None:
    with pytest.raises(supple.UsageError, match=f"vary: {name}: the robot of `go` has nothing that it would multiply"):
        supple.mujoco.validate(_mjcf(tmp_path), 2, vary={name: 2.0})


def test_a_file_whose_actuators_are_all_unsupported_warns_of_the_efforts(tmp_path: Path) -> None:
    task = _mjcf(tmp_path, actuator='<damper name="m" joint="a" kv="1" ctrlrange="0 1"/>')
    assert any("no actuator of the file is supported" in warning for warning in task.warnings), task.warnings
    assert not any("no actuator" in warning for warning in _mjcf(tmp_path).warnings)
