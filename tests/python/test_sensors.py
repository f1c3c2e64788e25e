"""Sets of sensors, and prices of parameters, from Python."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

import supple


def run(program: Path, *words: str) -> str:
    found = subprocess.run([program, *words], check=False, capture_output=True, text=True)
    assert found.returncode in (0, 1), found.stderr
    return found.stdout


def without_time(text: str) -> str:
    return re.sub(r'"((?:report_)?seconds)": [^,\n]+', r'"\1": 0', text)


FILE = "tasks/wiping_arm_sensors.toml"


def test_sets_of_sensors_are_the_same_text(program: Path) -> None:
    task = supple.load(FILE)
    assert (
        task.sensors(budget=5.0).to_json().strip() == run(program, "sensors", FILE, "--budget", "5", "--json").strip()
    )
    found = task.sensors(count=2, goal="information", method="greedy", task="wipe")
    words = ("--count", "2", "--for", "information", "--method", "greedy", "--task", "wipe", "--json")
    assert found.to_json().strip() == run(program, "sensors", FILE, *words).strip()
    assert found.command_line == ["sensors", FILE, *words[:-1]]


def test_a_set_has_a_certificate(tmp_path: Path) -> None:
    found = supple.load(FILE).sensors(budget=5.0)
    assert sorted(found.chosen.sensors) == ["elbow encoder", "tachometers", "wrist encoder"]
    assert found.chosen.price == pytest.approx(4.5)
    assert found.none.expected_cost > found.chosen.expected_cost > found.all.expected_cost
    certificate = found.certificate
    assert certificate.bound <= found.chosen.expected_cost
    assert certificate.proved and certificate.ratio == 1.0
    assert certificate.certified_ratio is not None and 0.9 < certificate.certified_ratio <= 1.0
    assert len(found.sensors) == 10
    encoder = found.sensors["shoulder encoder"]
    assert encoder.saved_alone_per_price == pytest.approx(encoder.saved_alone / encoder.price)
    read = supple.load_result(found.save(tmp_path / "sensors"))
    assert isinstance(read, supple.Sensors)
    assert read.chosen.sensors == found.chosen.sensors
    assert "shoulder encoder" in repr(found)


def test_the_cheapest_set_and_what_is_refused() -> None:
    task = supple.load(FILE)
    found = task.sensors(cost=78.0)
    assert sorted(found.chosen.sensors) == ["tachometers", "wrist torque"] and found.tasks == ["wipe"]
    assert task.sensors(method="greedy").best is None
    with pytest.raises(supple.SuppleError, match="with all of them"):
        task.sensors(cost=70.0)
    with pytest.raises(supple.UsageError, match="at least 0"):
        task.sensors(budget=-1.0)
    with pytest.raises(supple.UsageError, match="budget=nan: a finite number"):
        task.sensors(budget=float("nan"))
    with pytest.raises(supple.UsageError, match='goal=\'price\': valid: "cost", "information"'):
        task.sensors(goal="price")  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="whole number"):
        task.sensors(count=1.5)  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="task=3: a name"):
        task.sensors(task=3)  # type: ignore[arg-type]


def test_own_measurements_are_candidates() -> None:
    found = supple.load("tasks/two_mass.toml").sensors(count=1)
    assert found.chosen.sensors == ["position of m1"]
    linear = supple.linear(
        A=[[1.0, 0.1], [0.0, 1.0]],
        B=[[0.0], [0.1]],
        C=[[1.0, 0.0], [0.0, 1.0]],
        Q=[[1.0, 0.0], [0.0, 1.0]],
        R=[[1.0]],
        W=[[0.1, 0.0], [0.0, 0.1]],
        V=[[0.1, 0.0], [0.0, 0.1]],
        X0=[[1.0, 0.0], [0.0, 1.0]],
        N=5,
    )
    assert len(linear.sensors().sensors) == 2


def test_prices_of_parameters(program: Path) -> None:
    path = "tasks/two_mass_sensors.toml"
    task = supple.load(path)
    assert task.parameters["force_variance"].price == {"inverse": 0.5}
    price = task.evaluate(trajectories=False).price
    assert price is not None and price.budget == 200.0
    assert price.parameters == pytest.approx({"position_variance": 50.0, "force_variance": 50.0})
    found = task.design(starts=1)
    assert found.status == "converged" and found.price is not None
    assert found.price.total < 2.0
    assert found.budget_nats_per_unit == 0.0
    printed = run(program, "design", path, "--starts", "1", "--json")
    assert without_time(found.to_json()).strip() == without_time(printed).strip()
    assert supple.load("tasks/two_mass.toml").evaluate(trajectories=False).price is None


def test_plans_that_nothing_may_build_on_are_told(tmp_path: Path, program: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text(Path("tasks/two_mass.toml").read_text() + "\n[planning]\nmax_iterations = 1\n")
    task = supple.load(file)
    found = task.sensors(count=1)
    (plan,) = found.plans.values()
    assert plan.status == "max_iterations" and "did not converge" in plan.warnings[0]
    assert plan.trust is not None and plan.trust.verdict != "holds"
    bounds = task.bound()
    assert bounds.warnings == plan.warnings and bounds.trust.reasons == plan.trust.reasons
    for shown in [repr(found), repr(bounds)]:
        assert "did not converge" in shown
    for words in [("sensors", file, "--count", "1"), ("bound", file)]:
        made = subprocess.run([program, *words], check=False, capture_output=True, text=True)
        assert made.returncode == 1 and "Warning: task `press`: the plan did not converge" in made.stdout


def test_plans_that_hold_are_told() -> None:
    task = supple.load("tasks/two_mass.toml")
    for trust in [task.sensors(count=1).plans["press"].trust, task.bound().trust]:
        assert trust is not None and trust.verdict == "holds"
    front = task.pareto(points=3, starts=1)
    assert [[trust.verdict for trust in point.trust] for point in front.points] == [["holds"]] * 3
    assert task.bound(stationary=False).warnings == []
