"""The package gives what the command line gives, to the last bit."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple


def run(program: Path, *words: str) -> str:
    found = subprocess.run([program, *words], check=False, capture_output=True, text=True)
    assert found.returncode in (0, 1), found.stderr
    return found.stdout


def without_time(text: str) -> str:
    return re.sub(r'"((?:report_)?seconds)": [^,\n]+', r'"\1": 0', text)


@pytest.mark.parametrize(
    "file", ["two_mass", "iiwa_door", "elastic_elbow", "peg_on_wall", "soft_gripper", "wiping_arm"]
)
def test_evaluations_are_the_same_text(program: Path, file: str) -> None:
    path = f"tasks/{file}.toml"
    found = supple.load(path).evaluate(gradient="both", rollouts=8, seed=3, trajectories=False)
    words = ("--gradient", "both", "--rollouts", "8", "--seed", "3", "--json")
    assert found.to_json().strip() == run(program, "evaluate", path, *words).strip()


def test_parameters_are_set_alike(program: Path) -> None:
    found = supple.load("tasks/two_mass.toml").evaluate(k1=100.0, at={"k2": 123.456}, trajectories=False)
    expected = run(program, "evaluate", "tasks/two_mass.toml", "--set", "k1=100", "--set", "k2=123.456", "--json")
    assert found.to_json().strip() == expected.strip()


def test_designs_are_the_same_text(program: Path) -> None:
    found = supple.load("tasks/two_mass.toml").design(starts=2, seed=5)
    printed = run(program, "design", "tasks/two_mass.toml", "--starts", "2", "--seed", "5", "--json")
    assert without_time(found.to_json()).strip() == without_time(printed).strip()


def test_sweeps_are_the_same_text(program: Path) -> None:
    grid = {"k1": "log:50:600:4", "k2": [100.0, 250.0, 600.0]}
    found = supple.load("tasks/two_mass.toml").sweep(grid, rollouts=4, seed=1)
    words = ("--grid", "k1=log:50:600:4", "--grid", "k2=100,250,600", "--rollouts", "4", "--seed", "1", "--json")
    assert found.to_json() == run(program, "sweep", "tasks/two_mass.toml", *words)


def test_sweeps_over_local_minima_are_the_same_text(program: Path) -> None:
    task = supple.load("tasks/two_mass.toml")
    found = task.sweep({"k1": "log:300:500:4"}, branches=4, seed=1)
    words = ("--grid", "k1=log:300:500:4", "--branches", "4", "--seed", "1", "--json")
    assert found.to_json() == run(program, "sweep", "tasks/two_mass.toml", *words)
    # Never a costlier plan than that of the point alone.
    alone = [task.evaluate(k1=k1, rollouts=0).tasks["press"].cost.expected for k1 in found.table["k1"]]
    assert all(np.asarray(found.table["press.expected_cost"]) <= np.asarray(alone) * (1.0 + 1e-9))
    with pytest.raises(supple.errors.UsageError, match="branches and starts exclude each other"):
        task.sweep({"k1": [300.0]}, branches=4, starts=1)


def test_robustness_is_the_same_text(program: Path) -> None:
    designs = {"start": {}, "soft": {"k1": 60.0, "k2": 150.0}}
    found = supple.load("tasks/two_mass.toml").robustness(designs, vary={"wall_variance": "1e-5:1e-2:3"}, rollouts=8)
    words = ("--designs", "start,soft=k1:60,k2:150", "--vary", "wall_variance=1e-5:1e-2:3", "--rollouts", "8", "--json")
    assert found.to_json().strip() == run(program, "robustness", "tasks/two_mass.toml", *words).strip()


def test_fronts_and_traces_are_the_same_text(program: Path) -> None:
    task = supple.load("tasks/two_mass.toml")
    front = run(program, "pareto", "tasks/two_mass.toml", "--points", "3", "--starts", "1", "--json")
    assert task.pareto(points=3, starts=1).to_json().strip() == front.strip()
    words = ("--starts", "1", "--method", "sqp", "--gradient", "total", "--json")
    found = task.trace(starts=1, methods=["sqp"], gradients=["total"])
    assert found.to_json().strip() == run(program, "trace", "tasks/two_mass.toml", *words).strip()


def test_bounds_are_the_same_text(program: Path) -> None:
    plant = supple.load("tasks/tanaka_plant.toml")
    found = plant.bound(stationary=True, cost=40.0, curve=5)
    words = ("--stationary", "--cost", "40", "--curve=5", "--json")
    assert found.to_json().strip() == run(program, "bound", "tasks/tanaka_plant.toml", *words).strip()
    found = supple.load("tasks/two_mass.toml").bound(k1=135.912, k2=171.458)
    words = ("--set", "k1=135.912", "--set", "k2=171.458", "--json")
    assert found.to_json().strip() == run(program, "bound", "tasks/two_mass.toml", *words).strip()
    again: Any = json.loads(run(program, *found.command_line, "--json"))
    assert again["minimum_bits_per_step"] == found.minimum_bits_per_step


def test_folders_go_both_ways(program: Path, tmp_path: Path) -> None:
    task = supple.load("tasks/two_mass.toml")
    found = task.design(starts=1)
    ours = found.save(tmp_path / "ours")
    assert json.loads(run(program, "show", str(ours), "--json")) == found.to_dict()
    theirs = tmp_path / "theirs"
    run(program, "sweep", "tasks/two_mass.toml", "--grid", "k1=100,200", "--out", str(theirs))
    read = supple.load_result(theirs)
    assert isinstance(read, supple.Sweep)
    assert read.to_json() == task.sweep({"k1": [100.0, 200.0]}).to_json()
    page = run(program, "report", str(ours), str(theirs), "--out", str(tmp_path / "page.html"))
    assert "MB" in page


def test_the_command_that_does_the_same_is_kept(program: Path, tmp_path: Path) -> None:
    found = supple.load("tasks/two_mass.toml", k1=150.0).evaluate(gradient="total")
    words = found.command_line
    assert words[:2] == ["evaluate", "tasks/two_mass.toml"]
    again: Any = json.loads(run(program, *words, "--json"))
    assert again["objective"]["information_nats"] == found.information.nats


def test_the_same_folder_goes_on_where_the_other_ended(program: Path, tmp_path: Path) -> None:
    """A sweep's journal belongs to both: what one did, the other does not repeat."""
    out = tmp_path / "sweep"
    run(program, "sweep", "tasks/two_mass.toml", "--grid", "k1=log:50:600:8", "--out", str(out))
    before = (out / "table.csv").read_bytes()

    class Seen:
        done = -1

        def begin(self, what: str, done: int, total: int) -> None:
            self.done = done

        def advance(self, parts: int) -> None:
            raise AssertionError("a point was done again")

        def say(self, message: str) -> None: ...

    seen = Seen()
    supple.load("tasks/two_mass.toml").sweep({"k1": "log:50:600:8"}, out=out, progress=seen)
    assert seen.done == 8
    assert (out / "table.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("typo.toml", "title = 'x'\n[model]\nkind = 'two_mas'\n[[tasks]]\n"),
        ("syntax.toml", "title = \n"),
        ("unknown.toml", "titel = 'x'\n"),
    ],
)
def test_errors_have_the_words_and_the_place(program: Path, tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    printed = subprocess.run([program, "evaluate", path], check=False, capture_output=True, text=True).stderr
    with pytest.raises(supple.FileError) as caught:
        supple.load(path)
    error = caught.value
    assert f"error: {error}" == printed.rstrip("\n") or f"error: {error}".rstrip() == printed.rstrip()
    assert error.file == str(path) and error.line >= 1 and error.column >= 1


def test_other_errors_have_the_words(program: Path) -> None:
    task = supple.load("tasks/two_mass.toml")
    for call, words in [
        (lambda: task.evaluate(k9=1.0), ("evaluate", "--set", "k9=1")),
        (lambda: task.evaluate(k1=1e9), ("evaluate", "--set", "k1=1e9")),
        (lambda: task.sweep({"k1": [1.0]}), ("sweep", "--grid", "k1=1")),
    ]:
        printed = subprocess.run(
            [program, words[0], "tasks/two_mass.toml", *words[1:]], check=False, capture_output=True, text=True
        ).stderr
        with pytest.raises(supple.UsageError) as caught:
            call()
        assert str(caught.value).split(": ")[-1] in printed


def test_numbers_are_those_of_the_paper_task() -> None:
    """An anchor that does not go through the program."""
    best = supple.load("tasks/two_mass.toml").design(starts=2)
    assert best.status == "converged"
    assert np.isclose(best.information.bits, 242.785, atol=1e-3)
    assert np.isclose(best.parameters["k1"], 135.912, atol=1e-2)
