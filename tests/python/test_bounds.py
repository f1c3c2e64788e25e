"""How little information would do, from Python."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import supple
from supple.bounds import BoundReport

# The plant of Tanaka, Esfahani and Mitter, its cost x'x + u'u.
A = [[0.12, 0.63, -0.52, 0.33], [0.26, -1.28, 1.57, 1.13], [-1.77, -0.30, 0.77, 0.25], [-0.16, 0.20, -0.58, 0.56]]
B = [[0.66, -0.58, 0.03, -0.20], [2.61, -0.91, 0.87, -0.07], [-0.64, -1.12, -0.19, 0.61], [0.93, 0.58, -1.18, -1.21]]
W = [[4.94, -0.10, 1.29, 0.35], [-0.10, 5.55, 2.07, 0.31], [1.29, 2.07, 2.02, 1.43], [0.35, 0.31, 1.43, 3.10]]


@pytest.fixture(scope="module")
def plant() -> supple.Task:
    return supple.load(Path(__file__).parents[2] / "tasks" / "tanaka_plant.toml")


@pytest.mark.parametrize(
    ("cost", "minimum", "bound"), [(33.0, 6.1727, 5.778), (40.0, 3.2719, 2.338), (1000.0, 1.1861, 0.380)]
)
def test_the_plant_has_the_known_minimum(plant: supple.Task, cost: float, minimum: float, bound: float) -> None:
    found = plant.bound(stationary=True, cost=cost)
    assert found.minimum_bits_per_step == pytest.approx(minimum, abs=2e-4)
    assert found.kostina_hassibi_bits_per_step == pytest.approx(bound, abs=6e-4)
    assert found.floor_bits_per_step == pytest.approx(1.168539, abs=1e-6)
    assert 0.0 <= found.duality_gap_bits < 1e-6
    # What is proved from below, what was found, and what the sensor achieves.
    assert found.proved and found.not_proved is None and found.proof_distance < 1e-9
    assert found.minimum_lower_bits_per_step <= found.minimum_bits_per_step <= found.achieved_bits_per_step + 1e-12
    assert found.achieved_bits_per_step == pytest.approx(found.minimum_bits_per_step, abs=1e-6)
    assert found.achieved_cost == pytest.approx(cost, rel=1e-8)


def test_arrays_that_do_not_change_have_a_steady_state(plant: supple.Task) -> None:
    eye = np.eye(4)
    own = supple.linear(np.array(A), np.array(B), eye, np.array(W), eye, eye, eye, eye, N=20, time_step=1.0)
    bits = [task.bound(stationary=True, cost=40.0).minimum_bits_per_step for task in (plant, own)]
    assert bits[1] == pytest.approx(bits[0], rel=1e-6)
    varying = np.array([[[1.0 + 0.01 * t]] for t in range(20)])
    one = np.eye(1)
    changing = supple.linear(varying, one, one, one, one, one, one, one, N=20, time_step=1.0)
    with pytest.raises(supple.ComputeError, match="differ from step to step"):
        changing.bound(stationary=True)
    assert changing.bound().minimum_bits_per_step > 0.0


def test_the_virtual_sensor_attains_the_minimum(plant: supple.Task) -> None:
    """Its filter, run here, gives the information and the covariances that the minimum has."""
    found = plant.bound(cost=804.0).tasks["regulate"]
    sensor = found.virtual_sensor
    a, w = np.array(A), np.array(W)
    covariance, bits = np.eye(4), 0.0
    for c, v, gain in zip(sensor.measurement, sensor.variances, sensor.gain):
        c, gain = c.reshape(-1, 4), gain.reshape(4, -1)
        innovation = c @ covariance @ c.T + np.diag(v)
        bits += 0.5 * (np.linalg.slogdet(innovation)[1] - np.log(v).sum()) / np.log(2.0)
        np.testing.assert_allclose(gain, covariance @ c.T @ np.linalg.inv(innovation), rtol=1e-5, atol=1e-8)
        covariance = a @ (covariance - gain @ c @ covariance) @ a.T + w
    assert bits == pytest.approx(found.minimum_bits, rel=1e-3)
    assert found.minimum_per_step_bits.sum() == pytest.approx(found.minimum_bits, rel=1e-9)


def test_a_design_is_compared_with_the_minimum() -> None:
    found = supple.load("tasks/two_mass_small.toml").bound(curve=4)
    report = found.tasks["press"]
    assert isinstance(report, BoundReport)
    assert report.measurement_bits_per_step is not None and report.efficiency is not None
    assert report.efficiency == pytest.approx(report.minimum_bits_per_step / report.measurement_bits_per_step)
    assert report.minimum_per_step_bits.shape == (report.steps,) == report.control_per_step_bits.shape
    rates = [line.bits_per_step for line in report.order if line.ordered and line.bits_per_step is not None]
    assert len(rates) == 3 and rates == sorted(rates)
    assert [point.error for point in found.curves["press"]] == [None] * 4
    assert "efficiency" in repr(found) and "<table>" in found._repr_html_()
    assert found.plot.bound()._repr_svg_().startswith("<svg")
    again = pickle.loads(pickle.dumps(found))
    assert again.to_json() == found.to_json()
    with pytest.raises(AttributeError):
        found.minimum  # noqa: B018


def test_what_is_wrong_is_said(plant: supple.Task) -> None:
    with pytest.raises(supple.UsageError, match="choose a larger cost"):
        plant.bound(stationary=True, cost=30.0)
    with pytest.raises(supple.UsageError, match="no task `regulat`"):
        plant.bound(task="regulat")
    with pytest.raises(supple.UsageError, match="task=3: a name"):
        plant.bound(task=3)  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="a curve needs at least 2 points; found 1"):
        plant.bound(curve=1)
    with pytest.raises(supple.UsageError, match="a curve has at most"):
        plant.bound(curve=20_000)
    with pytest.raises(supple.UsageError, match="is not a number"):
        plant.bound(cost="much")  # type: ignore[arg-type]
    with pytest.raises(supple.ComputeError, match="has no steady state"):
        supple.load("tasks/two_mass.toml").bound(stationary=True)
