"""What supple computes is what the robot does: every shipped robot moves again elsewhere, by MuJoCo.

MuJoCo reads and moves the bodies of the robot's file. What it does not have, compliance between frames and the law of
contact, is written in NumPy from the formulas of docs/theory/robot.md. This is the robot of supple.mujoco.validate; supple's
own reader and dynamics are not asked.
"""

from __future__ import annotations

import re
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

tomllib = pytest.importorskip("tomllib")
pytest.importorskip("mujoco")

from robot_twin import Array, Twin

ROOT = Path(__file__).parents[2]

#: By how much supple's time step is divided.
FACTORS = (1, 2, 4)
#: Steps of the reference in each of supple's.
SUBSTEPS = 4
#: Steps of MuJoCo's own in each of supple's, where its contacts are used.
SUBSTEPS_OF_MUJOCO = 20


def _table(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text())


#: Every task of every shipped robot: a new one cannot escape.
ROBOTS = [
    (path.stem, task["name"])
    for path in sorted((ROOT / "tasks").glob("*.toml"))
    if (table := _table(path))["model"]["kind"] == "robot"
    for task in table["tasks"]
]
PRESSING = [
    (name, task)
    for name, task in ROBOTS
    if any(law["kind"] == "contact" for law in _table(ROOT / "tasks" / f"{name}.toml")["model"].get("compliance", []))
]


@cache
def _planned(name: str) -> supple.Evaluation:
    return supple.load(ROOT / "tasks" / f"{name}.toml").evaluate()


class Case:
    """A task of a shipped robot with its plan, and its twin."""

    def __init__(self, name: str, task: str) -> None:
        self.path, self.name = ROOT / "tasks" / f"{name}.toml", task
        self.table = _table(self.path)
        self.report = _planned(name).tasks[task]
        found = self.report.trajectory
        assert found is not None
        self.plan = found
        self.states = list(self.plan.state_names)
        self.time_step = float(self.plan.t[1] - self.plan.t[0])
        self.twin = self.make_twin()

    def make_twin(self) -> Twin:
        values = {key: entry["initial"] for key, entry in self.table.get("parameters", {}).items()}
        channels = self.states, list(self.plan.control_names)
        return Twin(self.table["model"], self.path.parent, values, channels, self.time_step)

    def reference(self, substeps: int = SUBSTEPS) -> Array:
        """The states at supple's steps, as the twin moves under the plan's controls."""
        return self.twin.move(self.plan.x[0], self.plan.u, substeps)

    def moved_by_supple(self, factor: int, folder: Path) -> Array:
        """The same by supple with so many shorter steps for each of the plan's."""
        task = supple.load(_refined(self.path, factor, folder))
        found = task.simulate(np.repeat(self.plan.u, factor, axis=0), task=self.name)
        return found[::factor]


@cache
def _case(name: str, task: str) -> Case:
    return Case(name, task)


@cache
def _reference(name: str, task: str) -> Array:
    return _case(name, task).reference()


@pytest.fixture(params=ROBOTS, ids="-".join)
def case(request: pytest.FixtureRequest) -> Case:
    return _case(*request.param)


def _refined(path: Path, factor: int, folder: Path) -> Path:
    """A task file with shorter time steps, and as many more of them, beside a copy of what it names."""
    tasks = folder / "tasks"
    if not tasks.exists():
        shutil.copytree(path.parent, tasks)
        shutil.copytree(path.parents[1] / "models", folder / "models")

    def rewrite(text: str, key: str, by: Any) -> str:
        found, count = re.subn(rf"(?m)^{key} = (\S+)", lambda line: f"{key} = {by(line[1])!r}", text)
        assert count == len(_table(path)["tasks"]), f"{path}: {count} lines with `{key} = `"
        return found

    text = rewrite(path.read_text(), "time_step", lambda number: float(number) / factor)
    text = rewrite(text, "steps", lambda number: int(number) * factor)
    refined = tasks / f"{path.stem}_{factor}.toml"
    refined.write_text(text)
    return refined


def _semi_implicit(path: Path, folder: Path) -> Path:
    """A task file with the other integrator, beside a copy of what it names."""
    copy = _refined(path, 1, folder)
    lines = [line for line in copy.read_text().splitlines() if not line.startswith("integrator = ")]
    lines.insert(lines.index("[model]") + 1, 'integrator = "semi_implicit"')
    copy.write_text("\n".join(lines))
    return copy


def _largest_errors(found: Array, truth: Array, states: list[str]) -> dict[str, float]:
    """The largest error of positions and of velocities, each relative to the largest that there is."""
    errors = {}
    for prefix in "qv":
        columns = [i for i, name in enumerate(states) if name.startswith(f"{prefix}.")]
        moved = np.abs(truth[:, columns] - truth[0, columns]).max()
        errors[prefix] = float(np.abs(found[:, columns] - truth[:, columns]).max() / moved)
    return errors


def test_there_are_robots_to_compare() -> None:
    assert len(ROBOTS) >= 7 and len(PRESSING) >= 5
    laws = {law["kind"] for name, _ in ROBOTS for law in _table(ROOT / "tasks" / f"{name}.toml")["model"]["compliance"]}
    assert laws == {"bushing", "contact", "elastic_joint", "spring"}


def test_motion_converges_to_that_of_mujoco(case: Case, tmp_path: Path) -> None:
    """Both integrators of supple are of first order: half of the time step is half of the error."""
    truth = _reference(case.path.stem, case.name)
    errors = [_largest_errors(case.moved_by_supple(factor, tmp_path), truth, case.states) for factor in FACTORS]
    own = _largest_errors(case.reference(SUBSTEPS // 2), truth, case.states)
    for prefix in "qv":
        sizes = [error[prefix] for error in errors]
        assert own[prefix] < 0.01 * sizes[-1], "the reference must be far closer to the truth than supple's steps"
        first, second = (longer / shorter for longer, shorter in zip(sizes, sizes[1:]))
        # At the task's own time step velocities are off by up to a fifth, so that terms of second order still count.
        assert 1.4 < first < 2.7 and 1.6 < second < 2.5, (prefix, sizes)
        assert abs(second - 2.0) < abs(first - 2.0) + 0.02, (prefix, sizes)


def test_forces_are_those_of_mujoco_and_the_theory(case: Case, tmp_path: Path) -> None:
    """Semi-implicit steps (R.5), with accelerations from elsewhere, are supple's to rounding, all along the plan."""
    task = supple.load(_semi_implicit(case.path, tmp_path))
    substeps = case.table["model"].get("substeps", 1)
    h = case.time_step / substeps
    for x, u in zip(case.plan.x[:-1:5], case.plan.u[::5]):
        p, rate, c = case.twin.split(x)
        for _ in range(substeps):
            rate = rate + h * case.twin.accelerations(p, rate, c, u)
            p = p + h * rate
        found, change, _ = case.twin.split(task.simulate(u[None], initial_state=x, task=case.name)[1] - x)
        truth, of_rates = p - x[: len(p)], rate - x[len(p) : 2 * len(p)]
        assert np.abs(change - of_rates).max() <= 1e-8 * np.abs(of_rates).max() + 1e-12
        assert np.abs(found - truth).max() <= 1e-8 * np.abs(truth).max() + 1e-13


def test_plants_of_mujoco_move_as_the_reference(case: Case) -> None:
    """Steps of MuJoCo's, of first order, half the error at half their length; all copies move alike."""
    states, controls = case.plan.x[:-1:10], case.plan.u[::10]
    truth = np.array([case.twin.move(x, u[None], SUBSTEPS)[1] for x, u in zip(states, controls)])
    errors = []
    for substeps in (16, 32):
        moved = case.twin.by_mujoco(len(states), substeps).step(states, controls)
        errors.append(np.abs(moved - truth).max(axis=0))
    change = np.abs(truth - states).max(axis=0)
    assert (errors[1] <= 0.1 * change + 1e-9).all(), (errors[1], change)
    assert errors[1].sum() < 0.7 * errors[0].sum()


def test_plans_are_motions_under_their_controls(case: Case) -> None:
    task = supple.load(case.path)
    assert np.allclose(task.simulate(case.plan.u, task=case.name), case.plan.x, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("name", "task"), PRESSING, ids=map("-".join, PRESSING))
def test_contacts_touch_when_they_do_elsewhere(name: str, task: str, tmp_path: Path) -> None:
    """First and last touch agree within a time step: those of the plan, and those of supple at a quarter of its time step.

    A body that stops short of the wall's place, where the law sets in over its smoothing, arrives so slowly that the
    plan's own error of position is many steps' way: there it is the shorter time step alone.
    """
    case = _case(name, task)
    elsewhere = case.twin.pressed(_reference(name, task))
    assert set(elsewhere) == set(case.report.contacts)
    planned, finer = case.twin.pressed(case.plan.x), case.twin.pressed(case.moved_by_supple(4, tmp_path))

    def ends(touching: Array) -> Array:
        return np.flatnonzero(touching)[[0, -1]]

    for contact, (depths, _, touching) in elsewhere.items():
        found = case.report.contacts[contact]
        assert found.touches == touching.any() == finer[contact][2].any() == planned[contact][2].any(), contact
        if not found.touches:
            continue
        assert [found.first_s, found.last_s] == pytest.approx(list(case.plan.t[ends(planned[contact][2])]))
        assert np.abs(ends(finer[contact][2]) - ends(touching)).max() <= 1, contact
        if (depths >= 0.0).any():
            assert np.abs(ends(planned[contact][2]) - ends(touching)).max() <= 1, contact


@pytest.mark.parametrize(("name", "task"), PRESSING, ids=map("-".join, PRESSING))
def test_contacts_of_mujoco_touch_too(name: str, task: str) -> None:
    """MuJoCo's own contact, of a sphere and a plane, in place of the law of contact.

    Its wall does not set in before the body is there, so it is touched when the body arrives at the wall's place. How hard
    it is pressed depends on its stiffness, which is another.
    """
    case = _case(name, task)
    found = case.twin.pressed_by_mujoco(case.plan.x[0], case.plan.u, SUBSTEPS_OF_MUJOCO)
    arrived = 0
    for contact, (depths, _, touching) in case.twin.pressed(case.plan.x).items():
        theirs = found[contact]
        assert (theirs >= 0.0).all(), contact
        if theirs.any():
            assert touching.any() and np.argmax(theirs > 0.0) >= np.argmax(touching) - 1, contact
        if (depths >= 0.0).any():
            arrived += 1
            assert theirs.any(), contact
            # Where it is first seen to touch; a body that arrives fast bounces off a hard wall between two samples.
            place = int(np.argmax(depths >= 0.0))
            first = int(np.argmax(theirs > 0.0)) - place
            speed = (depths[place] - depths[place - 1]) / (case.plan.t[1] - case.plan.t[0])
            assert first >= -3 and (first <= 3 or speed > 0.2), (contact, first, speed)
    assert arrived > 0, "no contact presses as far as its wall: this compares nothing"
