"""MuJoCo's twin of tasks that ``supple new --template`` writes, and of what else a robot in a task can have."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import supple

mujoco = pytest.importorskip("mujoco")

from supple._mujoco.plant import Plant
from supple._mujoco.validation import _trial

ROOT = Path(__file__).parents[2]
ARM = "crates/supple-cli/templates/arm.urdf"
TEMPLATES = ("press", "wipe", "insert", "reach", "hold", "handle")
#: Robots and templates whose tasks are made and run.
MADE = [(ARM, template) for template in TEMPLATES]
MADE += [("models/iiwa14_door.urdf", "press"), ("models/wiping_arm.sdf", "hold"), ("models/soft_gripper.xml", "hold")]
#: Steps of a plan that are run open loop.
STEPS = 12


@pytest.fixture(scope="module")
def made(program: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the tasks."""
    folder = tmp_path_factory.mktemp("templates")
    for robot, template in MADE:
        shutil.copy(ROOT / robot, folder)
        file = Path(robot).name
        words = [str(program), "new", _name(robot, template), "--robot", file, "--template", template]
        subprocess.run(words, check=True, capture_output=True, cwd=folder, stdin=subprocess.DEVNULL)
    return folder


def _name(robot: str, template: str) -> str:
    return f"{Path(robot).stem}_{template}"


def errors_of_steps(task: supple.Task) -> tuple[float, float]:
    """Of velocities in open loop by supple with 32 and 64 sub-steps, relative to MuJoCo with shorter and shorter steps."""
    (name,) = task.tasks
    plan = task.linearise(task=name)
    trial = _trial(task._native, name, (plan, 1), False, {})
    controls, count = plan.controls[:STEPS], (plan.states.shape[1] - trial.plant.constants) // 2

    def by_mujoco(substeps: int) -> NDArray[np.float64]:
        plant, states = Plant(trial.robot, 1, plan.time_step, substeps), [plan.states[:1]]
        for control in controls:
            states.append(plant.step(states[-1], control[None]))
        return np.concatenate(states)[:, count : 2 * count]

    def by_supple(substeps: int) -> NDArray[np.float64]:
        finer = task._native.changed([], [], substeps)
        return finer.simulate(name, controls, list(plan.states[0]))[:, count : 2 * count]

    # MuJoCo's steps are of first order too: its motion with none but the smallest steps.
    truth = 2.0 * by_mujoco(256) - by_mujoco(128)
    scale = np.abs(truth - truth[0]).max()
    coarse, fine = (float(np.abs(by_supple(substeps) - truth).max() / scale) for substeps in (32, 64))
    return coarse, fine


@pytest.mark.parametrize(("robot", "template"), MADE)
def test_templates_move_on_mujoco_as_on_supple(made: Path, robot: str, template: str) -> None:
    """Half the step is half the difference: both have the same laws."""
    coarse, fine = errors_of_steps(supple.load(made / f"{_name(robot, template)}.toml"))
    assert fine < 0.15, (coarse, fine)
    assert 1.7 < coarse / fine < 2.3, (coarse, fine)


@pytest.mark.parametrize("template", TEMPLATES)
def test_templates_are_validated(made: Path, template: str) -> None:
    found = supple.mujoco.validate(supple.load(made / f"arm_{template}.toml"), rollouts=4).tasks[template]
    assert found.mujoco.diverged == 0 and found.conclusion
    # What templates write is coarse: where that shows, it is said, with the remedy.
    holds = found.conclusion == "the design holds on MuJoCo as predicted"
    assert holds or "too coarse" in found.conclusion and "use `substeps = " in found.conclusion
    assert not (holds and found.broken)


def test_a_coarse_plan_is_broken_and_says_so(tmp_path: Path) -> None:
    text = (ROOT / "tasks" / "elastic_elbow.toml").read_text()
    text = text.replace("substeps = 4 ", "# ")
    coarse = text.replace("time_step = 5e-3", "time_step = 1e-2").replace("steps = 200", "steps = 100")
    folder = supple.loads(coarse, "tasks/task.toml").evaluate().save(tmp_path / "kept")
    words = [sys.executable, "-m", "supple", "validate", str(folder), "--rollouts", "4"]
    found = subprocess.run(words, check=False, capture_output=True, text=True)
    assert found.returncode == 1, found.stderr
    assert "the design is broken on MuJoCo: " in found.stdout
    assert "the discretisation of the plan is too coarse (with " in found.stdout
    assert "use `substeps = " in found.stdout and "a shorter `time_step`" in found.stdout


def test_factors_reach_mounts_and_expressions(made: Path) -> None:
    from supple._mujoco.validation import _truth

    task = supple.load(made / "arm_handle.toml")
    k = task.values["k"]
    assert task._native.number("sqrt(0.2 * k)") == pytest.approx(np.sqrt(0.2 * k))
    varied = _truth(task._native, {"damping": 3.0})
    assert varied.values() == task.values
    assert "3.0 * (sqrt(0.2 * k))" in varied.tables()
    assert _truth(task._native, {"stiffness": 2.0}).values()["k"] == 2.0 * k


ROBOT = """
<mujoco model="all">
  <compiler angle="degree" eulerseq="xyz"/>
  <default><joint damping="0.3"/></default>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <frame pos="0.1 0 0.2" euler="0 20 10">
        <body name="upper" pos="0 0 0.1" euler="10 0 30">
          <joint name="turn" axis="0 0 1" pos="0.02 0 0.01" ref="15" range="-90 90"/>
          <joint name="held" axis="1 1 0" pos="0 0.03 0.02" range="20 60"/>
          <joint name="out" type="slide" axis="0 1 0.2" range="-1 1" frictionloss="0.4"/>
          <joint name="held_too" type="slide" axis="0 0.3 1" range="-1 1"/>
          <inertial pos="0.1 0.02 0.1" mass="2" fullinertia="0.05 0.03 0.07 0.002 0.004 -0.003"/>
          <body name="lower" pos="0.3 0 0" euler="0 30 0">
            <joint name="elbow" axis="0 1 0" stiffness="3" springref="20" armature="0.01"/>
            <inertial pos="0.15 0 0" mass="1" diaginertia="0.01 0.04 0.04"/>
            <body name="tip" pos="0.3 0 0">
              <joint name="wrist" axis="1 0 0"/>
              <inertial pos="0.02 0.03 0" mass="0.3" diaginertia="0.002 0.002 0.002"/>
              <site name="point" pos="0.1 0 0" euler="0 45 0"/>
              <body name="finger" pos="0.05 0 0">
                <joint name="finger" type="slide" axis="0 1 0"/>
                <inertial pos="0 0 0" mass="0.1" diaginertia="0.001 0.001 0.001"/>
              </body>
              <body name="thumb" pos="0.05 0 0.02">
                <joint name="thumb" type="slide" axis="0 1 0"/>
                <inertial pos="0 0 0" mass="0.1" diaginertia="0.001 0.001 0.001"/>
              </body>
              <body name="nail" pos="0.07 0 0.02">
                <joint name="nail" axis="0 1 0"/>
                <inertial pos="0.01 0 0" mass="0.1" diaginertia="0.001 0.001 0.003"/>
              </body>
            </body>
          </body>
        </body>
      </frame>
    </body>
  </worldbody>
  <equality>
    <joint joint1="thumb" joint2="finger" polycoef="0.01 -0.5 0 0 0"/>
    <joint joint1="nail" joint2="held" polycoef="0.1 2 0 0 0"/>
  </equality>
  <actuator>
    <position name="servo" joint="turn" kp="100" kv="10" gear="2"/>
    <velocity name="speed" joint="out" kv="30"/>
    <general name="bent" joint="elbow" gainprm="4" biastype="affine" biasprm="0.5 -20 -2"/>
    <motor name="unused" joint="wrist" gear="3"/>
  </actuator>
</mujoco>
"""

TASK = """
[model]
kind = "robot"
file = "robot.xml"
actuated = ["servo", "speed", "bent", "wrist", "finger"]
locked = { held = 0.9, held_too = 0.05 }
friction_smoothing = "slide"

[model.drives]
servo = { kp = "2 * kp", gear = 1.5 }
speed = { kv = "kp / 4", rotor_inertia = 0.02 }
bent = { gear = 1.2, rotor_inertia = 0.03 }
wrist = { kp = 50.0, kv = "sqrt(kp)", gear = -2.0, rotor_inertia = 0.01 }
finger = { kv = 4.0 }

[model.links.lower]
mass = "1 + kp / 1000"
inertia_scale = 1.5

[model.joints.elbow]
friction = "0.2 * slide"
rest = "slide"

[[model.compliance]]
kind = "elastic_joint"
name = "motor"
joint = "wrist"
stiffness = "10 * kp"
damping = 1.0
motor_inertia = 0.05
motor_damping = "kp / 100"

[[model.compliance]]
kind = "spring"
name = "closer"
joint = "finger"
stiffness = "kp"
rest = 0.02

[[model.insert]]
name = "mount"
frame = "point"
position = [0.0, 0.02, 0.0]
rpy = [0.1, 0.2, 0.3]
axes = ["z", "rx"]
mass = "kp / 250"
center = [0.01, 0.0, "slide"]
inertia = [1e-3, 1e-3, 1e-3]
stiffness = ["20 * kp", 5.0]
damping = "sqrt(kp)"

[[model.compliance]]
kind = "contact"
name = "wall"
frame = "mount"
normal = [0.0, 0.0, 1.0]
stiffness = "kp"
smoothing = 0.05
friction = 0.4
slip = 0.1

[[model.sensors]]
kind = "joint_position"
deviation = 1e-3

[parameters]
kp = { initial = 100.0, bounds = [10.0, 1000.0] }
slide = { initial = 0.1, bounds = [0.01, 1.0] }

[[tasks]]
name = "move"
steps = 20
time_step = 0.005
noise = { initial_deviation = { "*" = 1e-3 }, process_deviation = { "v.*" = 1e-3 } }
initial_state = { "q.turn" = 0.5, "q.elbow" = 0.3, "v.elbow" = 0.5, "v.out" = 0.2, "c.wall" = 0.1 }

[[tasks.costs]]
kind = "joint_position"
target = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
weight = 1.0

[[tasks.costs]]
kind = "control"
weight = 1.0
"""


def test_everything_that_a_robot_can_have_moves_alike(tmp_path: Path) -> None:
    """Locked joints before and after others, joints that follow, drives of all kinds, expressions, mounts and friction."""
    (tmp_path / "robot.xml").write_text(ROBOT)
    (tmp_path / "task.toml").write_text(TASK)
    coarse, fine = errors_of_steps(supple.load(tmp_path / "task.toml"))
    assert fine < 0.02 and 1.7 < coarse / fine < 2.3, (coarse, fine)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('frame = "point"', 'frame = "lower"\ncarries = ["tip"]'),
        ("held_too = 0.05", "held_too = 0.05, mount_z = 0.01"),
        ("held_too = 0.05", "held_too = 0.05, mount_rx = -0.3"),
    ],
)
def test_mounts_carry_links_and_are_locked(tmp_path: Path, old: str, new: str) -> None:
    (tmp_path / "robot.xml").write_text(ROBOT)
    text = TASK.replace(old, new)
    if "mount_" in new:
        text = text.replace("target = [0.1, ", "target = [")
    (tmp_path / "task.toml").write_text(text)
    coarse, fine = errors_of_steps(supple.load(tmp_path / "task.toml"))
    assert fine < 0.02 and 1.7 < coarse / fine < 2.3, (coarse, fine)


@pytest.mark.parametrize(
    ("geom", "wall"),
    [
        ('type="plane" size="1 1 1" pos="0 0 -0.05" euler="6 0 0"', 'geom = "floor"'),
        ('type="box" size="0.1 1 1" pos="0 0 -0.1" euler="0 86 0"', 'geom = "floor"\nface = "-x"'),
    ],
)
def test_walls_of_the_robots_file_are_where_they_stand(tmp_path: Path, geom: str, wall: str) -> None:
    """Planes and boxes, turned and moved: the same motion as in supple, and other forces than without the change."""
    floor = f'<worldbody><geom name="floor" {geom}/>'
    (tmp_path / "robot.xml").write_text(ROBOT.replace("<worldbody>", floor))
    (tmp_path / "task.toml").write_text(TASK.replace("normal = [0.0, 0.0, 1.0]", wall))
    task = supple.load(tmp_path / "task.toml")
    coarse, fine = errors_of_steps(task)
    assert fine < 0.02 and 1.7 < coarse / fine < 2.3, (coarse, fine)
    (tmp_path / "task.toml").write_text(TASK)
    clear = supple.load(tmp_path / "task.toml")
    there, elsewhere = (made.evaluate().tasks["move"].contacts["wall"] for made in (task, clear))
    assert there.touches and abs(there.least_clearance_m - elsewhere.least_clearance_m) > 1e-3


def test_impossible_inertias_are_those_of_the_file(tmp_path: Path) -> None:
    """MuJoCo refuses them, and supple computes with them."""
    (tmp_path / "robot.xml").write_text(ROBOT.replace("0.01 0.04 0.04", "0.01 0.02 0.05"))
    (tmp_path / "task.toml").write_text(TASK)
    coarse, fine = errors_of_steps(supple.load(tmp_path / "task.toml"))
    assert fine < 0.02 and 1.7 < coarse / fine < 2.3, (coarse, fine)


def test_what_is_not_known_is_named(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(ROBOT)
    elbow = "[model.joints.elbow]"
    (tmp_path / "task.toml").write_text(TASK.replace(elbow, f"{elbow}\noffset = [0.0, 0.0, 0.1]"))
    with pytest.raises(supple.UsageError, match="does not know `offset`"):
        supple.mujoco.validate(supple.load(tmp_path / "task.toml"), 2)


def test_robots_and_templates_as_mjcf_are_accepted_by_mujoco(program: Path, made: Path) -> None:
    files = [ROOT / path for path in ("models", "tasks", "crates/supple-robot/tests/data_sdf_mjcf")]
    robots = sorted(path for folder in files for path in folder.iterdir() if path.suffix in (".urdf", ".sdf", ".xml"))
    tasks = [path for path in sorted((ROOT / "tasks").glob("*.toml")) if 'kind = "robot"' in path.read_text()]
    loaded = 0
    for path in [*robots, *tasks, *sorted(made.glob("*.toml")), ROOT / ARM]:
        found = subprocess.run([program, "robot", path, "--to", "mjcf"], check=False, capture_output=True, text=True)
        if found.returncode == 0:
            model = mujoco.MjModel.from_xml_string(found.stdout)
            assert model.nv > 0 or path.parent.name.startswith("data"), path
            loaded += 1
        if path.parent == made and path.suffix == ".toml":
            assert "link `mount` moves and has moments of inertia of 0, which MuJoCo refuses" in found.stderr, path
            assert "<!-- link mount moves and has" in found.stdout
    assert loaded >= len(tasks) + len(MADE) + 5
