"""Controllers of results: against roll-outs, against their own formulas, and as files."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import supple


def follow(controller: supple.Controller, measured: NDArray[np.float64]) -> NDArray[np.float64]:
    """Controls by the documented formulas, from the documented arrays."""
    d = np.zeros(controller.states.shape[1])
    found = []
    for t in range(controller.steps):
        d = d + controller.L[t] @ (measured[t] - controller.expected_measurements[t] - controller.C[t] @ d)
        u = controller.controls[t] + controller.feedforward[t] + controller.K[t] @ d
        u = np.clip(u, controller.control_lower, controller.control_upper)
        found.append(u)
        d = controller.A[t] @ d + controller.B[t] @ (u - controller.controls[t])
    return np.array(found)


def test_controls_are_those_of_roll_outs_of_a_linear_system() -> None:
    found = supple.load("tasks/tanaka_plant.toml").evaluate(seed=5)
    controller, sample = found.controller(), found.tasks["regulate"].trajectory.sample  # type: ignore[union-attr]
    controls = np.array([controller.step(y) for y in sample.measurements[:-1]])
    assert np.abs(controls).max() > 1.0
    np.testing.assert_allclose(controls, sample.controls, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("file", "task"), [("two_mass", None), ("iiwa_door", "open"), ("peg_on_wall", None)])
def test_steps_are_the_documented_formulas(file: str, task: str | None) -> None:
    found = supple.load(f"tasks/{file}.toml").evaluate(seed=1)
    controller = found.controller(task)
    trajectory = found.tasks[controller.task].trajectory
    assert trajectory is not None
    measured = trajectory.sample.measurements
    controls = np.array([controller.step(y) for y in measured[:-1]])
    np.testing.assert_allclose(controls, follow(controller, measured), rtol=1e-9, atol=1e-9)
    n, m, p = len(controller.state_names), len(controller.control_names), len(controller.measurement_names)
    steps = controller.steps
    assert controller.filter_gain.shape == (steps + 1, n, p) and controller.feedback.shape == (steps, m, n)
    assert controller.input.shape == (steps, n, m) and controller.measurement.shape == (steps + 1, p, n)
    assert controller.measurement_covariance.shape == (steps + 1, p, p)
    np.testing.assert_array_equal(controller.states, trajectory.states)
    np.testing.assert_array_equal(controller.control_upper, np.full(m, np.inf))
    linear = supple.load(f"tasks/{file}.toml").linearise(task=controller.task)
    np.testing.assert_allclose(controller.belief_covariance, linear.belief_covariance, rtol=1e-6, atol=1e-12)


def test_a_plan_ends_and_begins_anew() -> None:
    controller = supple.load("tasks/two_mass.toml").evaluate().controller()
    first = [controller.step([0.1, 0.2]) for _ in range(controller.steps)]
    assert controller.position == controller.steps == 125
    with pytest.raises(supple.UsageError, match=r"ended after 125 steps: reset\(\) restarts it"):
        controller.step([0.1, 0.2])
    controller.reset()
    assert controller.position == 0
    np.testing.assert_array_equal(controller.estimate, controller.states[0])
    again = [controller.step(np.array([0.1, 0.2])) for _ in range(controller.steps)]
    np.testing.assert_array_equal(first, again)


def test_a_copy_begins_the_plan_anew() -> None:
    best = supple.load("tasks/two_mass.toml").design(starts=1)
    for controller in [best.controller(at="start"), supple.load("tasks/two_mass.toml").evaluate().controller()]:
        first = controller.step([0.1, 0.2])
        for copied in [pickle.loads(pickle.dumps(controller)), copy.copy(controller)]:
            assert copied.position == 0 and copied.parameters == controller.parameters
            np.testing.assert_array_equal(copied.feedback, controller.feedback)
            np.testing.assert_array_equal(copied.step([0.1, 0.2]), first)


def test_wrong_measurements_are_refused_and_change_nothing() -> None:
    controller = supple.load("tasks/two_mass.toml").evaluate().controller()
    controller.step([0.1, 0.2])
    before = controller.estimate
    for wrong, says in [
        ([0.1], "has length 1, not 2"),
        ([[0.1, 0.2]], "must be a vector"),
        (0.1, "must be a vector"),
        (["a", "b"], "must hold real numbers"),
        (np.ma.masked_array([0.1, 0.2], [True, False]), "masked"),
    ]:
        with pytest.raises(supple.UsageError, match=says):
            controller.step(wrong)  # type: ignore[arg-type]
    with pytest.raises(supple.ComputeError, match="not finite at step 1"):
        controller.step([np.nan, 0.0])
    assert controller.position == 1
    np.testing.assert_array_equal(controller.estimate, before)
    strided = np.array([0.1, 0.0, 0.2, 0.0])[::2]
    whole = controller.step(strided)
    controller.reset()
    controller.step([0.1, 0.2])
    np.testing.assert_array_equal(whole, controller.step(np.array([0.1, 0.2], dtype=np.float64)))


def test_files_hold_the_same(tmp_path: Path) -> None:
    controller = supple.load("tasks/iiwa_door.toml").evaluate().controller("close")
    read = json.loads(controller.to_json(tmp_path / "one.json").read_text())
    assert (read["format"], read["version"], read["supple"]) == ("supple-controller", 1, supple.__version__)
    whole = controller.to_dict()
    with np.load(controller.to_npz(tmp_path / "one.npz")) as arrays:
        assert set(arrays.files) - {"parameter_names", "parameter_values"} == set(read) - {"parameters"}
        parameters = dict(zip(arrays["parameter_names"].tolist(), arrays["parameter_values"].tolist()))
        assert parameters == read["parameters"] == controller.parameters
        for name in set(whole) - {"parameters"}:
            assert arrays[name].tolist() == whole[name], name
            if name not in ("control_lower", "control_upper"):
                assert read[name] == whole[name], name
        assert arrays["state_names"].dtype.kind == "U" and arrays["steps"].dtype == np.int64
    assert read["control_lower"] == [None] * 7
    paths = controller.to_c(tmp_path / "one.c")
    assert paths == [tmp_path / "one.c", tmp_path / "one.h"]
    assert "#define CLOSE_STEPS 500" in paths[1].read_text()


def test_the_command_line_writes_the_same_files(program: Path, tmp_path: Path) -> None:
    found = supple.load("tasks/two_mass.toml").design(starts=1)
    found.save(tmp_path / "best")
    for at in ("start", "optimum"):
        controller = found.controller(at=at)
        for ending, write in {"json": controller.to_json, "npz": controller.to_npz, "c": controller.to_c}.items():
            here, there = tmp_path / f"one.{ending}", tmp_path / "other" / f"one.{ending}"
            write(here)
            words = ["--at", at, "--to", ending, "--rollouts", "0", "--out", str(there)]
            subprocess.run([program, "export", tmp_path / "best", *words], check=True, capture_output=True)
            assert here.read_bytes() == there.read_bytes()
    assert found.controller().parameters == found.parameters
    assert found.controller(at="start").parameters == found.start_parameters
    kept = supple.Design.load(tmp_path / "best").controller()
    np.testing.assert_array_equal(kept.filter_gain, found.controller().filter_gain)


def test_costs_in_closed_loop_are_those_of_the_filter_that_runs() -> None:
    plant = supple.load("tasks/tanaka_plant.toml").evaluate(rollouts=50, seed=4)
    extended, along = plant.tasks["regulate"].monte_carlo, plant.controller().monte_carlo(50, seed=4)
    assert extended is not None and along.rollouts == 50 and along.diverged == 0
    assert along.cost_mean == pytest.approx(extended.cost_mean, rel=1e-10), "the same filter where all is linear"
    door = supple.load("tasks/iiwa_door.toml").evaluate().controller("open")
    door.step(np.zeros(len(door.measurement_names)))
    assert door.monte_carlo(8, seed=1).to_dict() == door.monte_carlo(8, seed=1).to_dict()
    assert door.position == 1
    with pytest.raises(supple.UsageError, match="at least 1"):
        door.monte_carlo(0)


def test_own_systems_have_controllers_too(tmp_path: Path) -> None:
    A, B, C = [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]]
    system = {"A": A, "B": B, "C": C, "W": np.eye(2) * 1e-4, "V": [[1e-3]], "X0": np.eye(2) * 0.1}
    task = supple.linear(**system, Q=np.eye(2), R=[[0.1]], N=30, x0=[1.0, 0.0])
    found = task.evaluate(seed=2)
    controller = found.controller()
    trajectory = next(iter(found.tasks.values())).trajectory
    assert trajectory is not None
    controls = np.array([controller.step(y) for y in trajectory.sample.measurements[:-1]])
    np.testing.assert_allclose(controls, trajectory.sample.controls, rtol=1e-12, atol=1e-12)
    found.save(tmp_path / "kept")
    with pytest.raises(supple.KeptError, match="a model in Python"):
        supple.load_result(tmp_path / "kept").controller()  # type: ignore[attr-defined]


def test_what_has_no_controller_says_so(tmp_path: Path) -> None:
    door = supple.load("tasks/iiwa_door.toml").evaluate()
    with pytest.raises(supple.UsageError, match="several tasks: give task= one of open, close"):
        door.controller()
    with pytest.raises(supple.UsageError, match="no task `shut`"):
        door.controller("shut")
    bare = supple.load("tasks/two_mass.toml").evaluate(trajectories=False)
    with pytest.raises(supple.UsageError, match="trajectories=True"):
        bare.controller()
    best = supple.load("tasks/two_mass.toml").design(starts=1)
    with pytest.raises(supple.UsageError, match="optimum"):
        best.controller(at="end")
    controller = best.controller()
    with pytest.raises(supple.UsageError, match="must be a file NAME.c"):
        controller.to_c(tmp_path / "one.txt")
    with pytest.raises(supple.StorageError):
        controller.to_json(tmp_path)


def test_steps_are_fast() -> None:
    controller = supple.load("tasks/two_mass.toml").evaluate().controller()
    y = np.array([0.1, 0.2])
    best = np.inf
    for _ in range(20):
        controller.reset()
        begin = time.perf_counter()
        for _ in range(controller.steps):
            controller.step(y)
        best = min(best, (time.perf_counter() - begin) / controller.steps)
    print(f"{1e6 * best:.2f} us per step from Python")
    assert best < 1e-4
