"""Checks of derivatives, linearisations and citations from Python."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import supple

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def small() -> supple.Task:
    return supple.load(ROOT / "tasks/two_mass_small.toml")


def test_check_compares_every_derivative(small: supple.Task) -> None:
    report = small.check()
    assert report.passed
    rows = {row.name: row for row in report.tasks["press"].rows}
    assert len(rows) == 17
    total = rows["total gradient, information"]
    assert total.error <= total.tolerance
    assert total.place in small.parameters
    assert small.check(k1=80.0).passed
    assert {fact.name for fact in report.tasks["press"].facts} >= {"largest spectral radius of A"}


def test_a_linearisation_is_a_linear_task_of_the_same_numbers(small: supple.Task) -> None:
    found = small.linearise()
    steps, n, m, p = 125, 5, 1, 2
    assert found.status == "converged"
    assert (found.A.shape, found.B.shape, found.C.shape) == ((steps, n, n), (steps, n, m), (steps + 1, p, n))
    assert found.feedback.shape == (steps, m, n)
    assert found.cost_hessian.shape == (steps + 1, n + m, n + m)
    # Information and belief are those of the linear system, whatever the costs.
    linear = supple.linear(**found.system(), Q=np.eye(n), R=np.eye(m), time_step=found.time_step)
    own, of_task = linear.evaluate(), small.evaluate()
    np.testing.assert_allclose(own.information.bits, of_task.information.bits, rtol=1e-9)
    trajectory = of_task.tasks["press"].trajectory
    assert trajectory is not None
    np.testing.assert_array_equal(found.feedback, trajectory.feedback)
    deviations = np.sqrt(np.diagonal(found.belief_covariance, axis1=1, axis2=2))
    np.testing.assert_allclose(deviations, trajectory.deviations, rtol=1e-12)
    with pytest.raises(supple.UsageError, match="press"):
        small.linearise(task="pres")


def test_citations_are_bibtex_and_agree_with_the_file() -> None:
    text = supple.cite()
    assert f"version = {{{supple.__version__}}}" in text
    assert text.count("{") == text.count("}")
    assert re.findall(r"^@(\w+){(\w+),$", text, re.M) == [("software", "supple"), ("misc", "haninger2021minimum")]
    file = (ROOT / "CITATION.cff").read_text()
    assert f"version: {supple.__version__}\n" in file
    assert "10.48550/arXiv.2103.14830" in file and "10.48550/arXiv.2103.14830" in text


def test_the_controller_runs_on_a_plant_of_the_users(small: supple.Task) -> None:
    plan = small.linearise()

    def linear(x: np.ndarray, u: np.ndarray, t: int) -> np.ndarray:
        return plan.states[t + 1] + plan.A[t] @ (x - plan.states[t]) + plan.B[t] @ (u - plan.controls[t])

    runs = small.simulate(plant=linear, rollouts=400, seed=1)
    assert runs.states.shape == (400, 126, 5)
    assert runs.controls.shape == (400, 125, 1)
    # On the linear plant the filter's errors have the covariance of the belief.
    errors = (runs.states - runs.estimates)[:, 60]
    found, expected = np.var(errors, axis=0), np.diag(plan.belief_covariance[60])
    np.testing.assert_allclose(found, expected, rtol=0.3)
    again = small.simulate(plant=linear, rollouts=400, seed=1)
    np.testing.assert_array_equal(runs.states, again.states)
    quiet = small.simulate(plant=linear, noise=False)
    np.testing.assert_allclose(quiet.states[0], plan.states, atol=1e-12)
    with pytest.raises(supple.UsageError, match="plant returned the shape"):
        small.simulate(plant=lambda x, u, t: x[:2])
    with pytest.raises(supple.UsageError, match="give controls=.*or plant="):
        small.simulate()
    with pytest.raises(supple.ComputeError, match="not finite at step 1"):
        small.simulate(plant=lambda x, u, t: x * np.inf)
