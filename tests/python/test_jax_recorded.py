"""Models written in JAX against the built-in ones, a robot from a file and the golden numbers."""

from __future__ import annotations

import json
import pickle
import textwrap
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from jax_models import CartPole, TwoMass, own_task

import supple

pytest.importorskip("jax")

GOLDEN = Path(__file__).parents[2] / "crates/supple/tests/golden/two_mass.json"


class SmallTwoMass(TwoMass):
    """The model of `tasks/two_mass_small.toml`."""

    mass, damping = (0.2, 0.11), (9.8, 5.6)
    force, force_smoothing = 3.0, 5.0
    weights: ClassVar[dict[str, Any]] = {"force": 0.05, "speed": 0.1, "depth": 0.05, "control": 1e-8}
    parameters: ClassVar[dict[str, Any]] = {
        "k1": supple.Parameter(60.0, (20.0, 120.0), "log", "N/m", "design"),
        "k2": supple.Parameter(30.0, (3.0, 50.0), "log", "N/m", "design"),
    }
    noise: ClassVar[dict[str, Any]] = {
        "initial": [3e-4, 3e-4, 3e-4, 3e-4, 1e-4],
        "process": [1e-7, 1e-2, 1e-7, 4e-2, 0.0],
        "measurement": [5e-3, 5e-2],
    }
    first_guess: ClassVar[list[list[float]]] = [[10.0]]
    bound = 25.0


def golden() -> list[tuple[str, dict[str, Any]]]:
    points = json.loads(GOLDEN.read_text())
    return [(name, point) for name in ("two_mass", "two_mass_small") for point in points[name]]


@pytest.fixture(scope="module")
def two_mass() -> supple.Task:
    return own_task(TwoMass())


def relative(found: Any, expected: Any) -> float:
    """The largest difference, relative to the largest entry."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize(("name", "point"), golden())
def test_two_masses_give_the_golden_numbers(name: str, point: dict[str, Any]) -> None:
    model = TwoMass() if name == "two_mass" else SmallTwoMass()
    controls = [[u] for u in point["controls"]]
    k1, k2 = point["phi"]
    found = own_task(model, initial_control=controls).evaluate(gradient="both", k1=k1, k2=k2).tasks["press"]
    assert found.status == "converged"
    pairs = {
        "nominal_cost": found.cost.nominal,
        "belief_cost": found.cost.belief,
        "process_cost": found.cost.process,
        "initial_cost": found.cost.initial,
        "expected_cost": found.cost.expected,
        "directed_information_nat": found.information.total_nats,
    }
    for key, value in pairs.items():
        assert value == pytest.approx(point[key], rel=1e-6), key
    assert found.gradient is not None
    total, frozen = found.gradient.total, found.gradient.frozen
    assert total is not None and frozen is not None
    expected = point["total_gradient"]
    gradients = {
        "directed_information": total.information_nats,
        "nominal_cost": total.nominal_cost,
        "belief_cost": total.belief_cost,
        "process_cost": total.process_cost,
        "initial_cost": total.initial_cost,
    }
    for key, gradient in gradients.items():
        assert relative([gradient["k1"], gradient["k2"]], expected[key]) <= 2e-4, key
    pair = [frozen.information_nats["k1"], frozen.information_nats["k2"]]
    assert pair == pytest.approx(point["frozen_gradient"]["directed_information"], rel=1e-6)


def test_two_masses_are_the_built_in_ones(two_mass: supple.Task) -> None:
    built_in = supple.load("tasks/two_mass.toml")
    for design in ({}, {"k1": 120.0, "k2": 240.0}, {"wall_variance": 1e-3}):
        found, expected = (
            task.evaluate(gradient="both", rollouts=3, **design).tasks["press"] for task in (two_mass, built_in)
        )
        # The built-in model knows its contact, and is planned from afar as well.
        assert found.status == expected.status == "converged"
        assert found.cost.expected == pytest.approx(expected.cost.expected, rel=1e-9)
        assert found.information.total_nats == pytest.approx(expected.information.total_nats, rel=1e-9)
        assert found.trajectory is not None and expected.trajectory is not None
        for name in ("x", "u", "K"):
            assert relative(getattr(found.trajectory, name), getattr(expected.trajectory, name)) < 1e-7, name
        assert found.gradient is not None and expected.gradient is not None
        for kind in ("total", "frozen"):
            ours, theirs = (getattr(report.gradient, kind).information_nats for report in (found, expected))
            assert relative(list(ours.values()), list(theirs.values())) < 1e-7, kind
        assert found.monte_carlo is not None and expected.monte_carlo is not None
        assert found.monte_carlo.cost_mean == pytest.approx(expected.monte_carlo.cost_mean, rel=1e-6)


def test_designs_are_those_of_the_built_in_model(two_mass: supple.Task) -> None:
    found, expected = (task.design(starts=1) for task in (two_mass, supple.load("tasks/two_mass.toml")))
    assert found.information.nats == pytest.approx(expected.information.nats, rel=1e-4)


def urdf(model: CartPole) -> str:
    """The same cart and pole as a robot."""
    return textwrap.dedent(f"""\
        <robot name="cart_pole">
          <link name="rail"/>
          <link name="cart"><inertial><mass value="{model.cart_mass}"/>
            <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
          <link name="pole"><inertial><origin xyz="0 0 {model.length}"/><mass value="{model.pole_mass}"/>
            <inertia ixx="1" iyy="{model.inertia}" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
          <joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
            <limit lower="-9" upper="9" effort="99" velocity="99"/></joint>
          <joint name="hinge" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 1 0"/></joint>
        </robot>
        """)


TASK = """\
[model]
kind = "robot"
file = "cart_pole.urdf"
actuated = ["slide"]
[model.links.cart]
mass = "cart_mass"
[[model.sensors]]
kind = "joint_position"
select = ["slide"]
variance = 1e-4
[[model.sensors]]
kind = "joint_position"
select = ["hinge"]
variance = "sensor"
[parameters]
cart_mass = { initial = 1.0, bounds = [0.5, 2.0], scale = "log" }
sensor = { initial = 1e-4, bounds = [1e-8, 1.0], scale = "log" }
[[tasks]]
name = "press"
steps = 60
time_step = 0.02
bound = 250.0
initial_state = { "q.hinge" = 0.3 }
initial_control = [0.0]
noise = { initial = [1e-3, 1e-3, 1e-2, 1e-2], process = [0.0, 0.0, 1e-4, 1e-3] }
costs = [
  { kind = "joint_position", select = ["slide", "hinge"], weight = 1.0, final_weight = 20.0 },
  { kind = "joint_velocity", select = ["slide", "hinge"], weight = 0.1, final_weight = 2.0 },
  { kind = "control", weight = 0.01 },
]
"""


@pytest.fixture(scope="module")
def cart_pole() -> supple.Task:
    return own_task(CartPole())


def test_a_cart_pole_is_that_of_a_robot_file(cart_pole: supple.Task, tmp_path: Path) -> None:
    (tmp_path / "cart_pole.urdf").write_text(urdf(CartPole()))
    (tmp_path / "task.toml").write_text(TASK)
    robot = supple.load(tmp_path / "task.toml")
    found, expected = (task.evaluate(gradient="both").tasks["press"] for task in (cart_pole, robot))
    assert found.status == "converged" and found.iterations == expected.iterations
    assert found.trajectory is not None and expected.trajectory is not None
    assert relative(found.trajectory.x, expected.trajectory.x) < 1e-8
    assert found.cost.expected == pytest.approx(expected.cost.expected, rel=1e-9)
    assert found.information.total_nats == pytest.approx(expected.information.total_nats, rel=1e-9)
    for kind in ("total", "frozen"):
        for number in ("information_nats", "belief_cost"):
            ours, theirs = (getattr(getattr(report.gradient, kind), number) for report in (found, expected))
            assert relative(list(ours.values()), list(theirs.values())) < 1e-7, (kind, number)


def test_total_gradients_are_those_of_the_cart_pole_planned_anew(cart_pole: supple.Task) -> None:
    here = cart_pole.evaluate(gradient="total").tasks["press"]
    assert here.gradient is not None and here.gradient.total is not None

    def moved(factor: float) -> np.ndarray[Any, Any]:
        at = cart_pole.evaluate(cart_mass=1.0 + factor).tasks["press"]
        return np.array([at.information.total_nats, at.cost.nominal, at.cost.belief])

    def difference(step: float) -> np.ndarray[Any, Any]:
        return (moved(step) - moved(-step)) / (2.0 * step)

    expected = (4.0 * difference(5e-4) - difference(1e-3)) / 3.0
    total = here.gradient.total
    found = [gradient["cart_mass"] for gradient in (total.information_nats, total.nominal_cost, total.belief_cost)]
    assert found == pytest.approx(expected, rel=1e-6)


def test_no_python_is_called_after_a_task_is_made(two_mass: supple.Task) -> None:
    class Counted(TwoMass):
        calls = 0

        def step(self, x: Any, u: Any, p: Any) -> Any:
            Counted.calls += 1
            return super().step(x, u, p)

    task = own_task(Counted())
    before = Counted.calls
    task.evaluate(gradient="total", rollouts=4)
    assert Counted.calls == before


def information(task: supple.Task, k1: float) -> float:
    return task.evaluate(k1=k1).information.nats


def test_tasks_go_to_other_processes(two_mass: supple.Task) -> None:
    again = pickle.loads(pickle.dumps(two_mass))
    values = [100.0, 300.0]
    here = [information(again, k1) for k1 in values]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert list(pool.map(information, [two_mass] * 2, values)) == here
    sweep = two_mass.sweep({"k1": [100.0, 300.0]})
    assert sweep is not None


class Rounded(TwoMass):
    """Its wall has steps, which cannot be written out."""

    def observe(self, x: Any, p: Any) -> Any:
        import jax.numpy as jnp

        return jnp.stack([x[0], jnp.floor(x[2])])


def test_what_cannot_be_recorded_says_why_and_is_called_otherwise(caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(supple.UsageError, match=r"primitive `floor` in `observe`.*backend=\"jax\""):
        own_task(Rounded())
    with caplog.at_level("INFO", logger="supple"):
        assert own_task(Rounded(), "auto").evaluate().tasks["press"].status == "converged"
    assert "primitive `floor` in `observe`" in caplog.text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time_step": "tau"}, "no parameter `tau`"),
        ({"model": "{}"}, "the tapes of the model: missing field"),
        ({"model": None}, "have 2 parameters, the problem has 4"),
    ],
)
def test_descriptions_that_are_wrong_say_why(two_mass: supple.Task, change: dict[str, Any], message: str) -> None:
    from supple._supple import NativeTask

    description = two_mass._recipe[1]
    if change.get("model", "") is None:
        change = {"model": own_task(SmallTwoMass())._recipe[1]["systems"][0]["model"]}
    wrong = {**description, "systems": [{**description["systems"][0], **change}]}
    with pytest.raises(supple.UsageError, match=message):
        NativeTask.own(wrong)
