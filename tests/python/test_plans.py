"""Kinds of plans, as tasks ask for them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

ARRAYS: dict[str, Any] = {
    "A": [[1.0, 0.1], [-0.2, 0.9]],
    "B": [[0.0], [0.3]],
    "C": [[1.0, 0.0]],
    "W": [0.02, 0.03],
    "V": [[0.05]],
    "X0": [0.1, 0.2],
    "Q": [[1.0, 0.3], [0.3, 0.7]],
    "R": [[0.2]],
    "x0": [1.0, -0.5],
    "N": 20,
}


def gains(**planning: Any) -> tuple[np.ndarray[Any, np.dtype[np.float64]], float]:
    """Feedback gains (N, m, n) and expected cost of a linear problem with these settings of the planning."""
    report = supple.linear(**ARRAYS, planning=planning).evaluate().tasks["linear"]
    assert report.trajectory is not None and report.status == "converged"
    return report.trajectory.K, report.cost.expected


def test_the_light_is_sought() -> None:
    os.chdir(Path(__file__).parents[2])
    report = supple.load("tasks/light_dark.toml").evaluate(gradient="total").tasks["park"]
    assert report.status == "converged" and report.trajectory is not None
    assert report.trajectory.x[:, 0].max() > 3.8 and abs(report.trajectory.x[-1]).max() < 0.1
    assert report.cost.expected < 3.0
    assert report.gradient is not None and report.gradient.total is not None
    assert report.gradient.total.expected_cost["noise"] > 0.0


def test_linear_problems_have_nothing_to_seek() -> None:
    (nominal, cost), (belief, same) = gains(), gains(plan="belief")
    np.testing.assert_allclose(belief, nominal, rtol=1e-12)
    assert same == pytest.approx(cost, rel=1e-12)


def test_risk_stiffens_and_costs() -> None:
    (nominal, least), (averse, more) = gains(mode="nominal"), gains(plan="risk", risk_sensitivity=0.2)
    assert np.linalg.norm(averse) > 1.01 * np.linalg.norm(nominal) and more > least
    seeking, also_more = gains(plan="risk", risk_sensitivity=-0.2)
    assert np.linalg.norm(seeking) < np.linalg.norm(nominal) and also_more > least


def test_too_much_of_it_is_refused() -> None:
    with pytest.raises(supple.UsageError, match="; .* has one, and .* has none"):
        gains(plan="risk", risk_sensitivity=100.0)
    with pytest.raises(supple.UsageError, match="frozen"):
        supple.linear(**ARRAYS, planning={"plan": "risk", "risk_sensitivity": 0.1}).evaluate(gradient="total")
