"""Results as tables and frames: types of columns, every study, units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

ROOT = Path(__file__).parents[2]
pandas = pytest.importorskip("pandas")
polars = pytest.importorskip("polars")


@pytest.fixture(scope="module")
def small() -> supple.Task:
    return supple.load(ROOT / "tasks/two_mass_small.toml")


@pytest.fixture(scope="module")
def sweep(small: supple.Task) -> supple.Sweep:
    return small.sweep({"k1": [40.0, 60.0], "k2": [20.0, 30.0, 40.0]})


def test_whole_numbers_and_truths_stay_so(sweep: supple.Sweep) -> None:
    assert sweep.table["feasible"].dtype == bool
    assert sweep.table["press.iterations"].dtype == np.int64
    frame = sweep.to_pandas()
    assert (frame["feasible"].dtype, frame["press.iterations"].dtype) == (bool, np.int64)
    assert sweep.to_polars()["feasible"].dtype == polars.Boolean


def test_where_some_are_missing_frames_keep_the_type() -> None:
    columns = {"feasible": np.array([1.0, np.nan]), "press.iterations": np.array([3.0, np.nan])}
    table = supple.Table(columns, {}, {}, {"feasible": "truths", "press.iterations": "counts"})
    frame = table.to_pandas()
    assert frame["feasible"].tolist() == [True, pandas.NA]
    assert (str(frame["feasible"].dtype), str(frame["press.iterations"].dtype)) == ("boolean", "Int64")
    assert table.to_polars()["press.iterations"].to_list() == [3, None]


def test_texts_have_the_shape_of_the_grid(sweep: supple.Sweep) -> None:
    assert sweep.grid("press.status").tolist() == [["converged"] * 3] * 2
    assert sweep.grid("feasible").shape == (2, 3)


def test_every_study_is_a_frame(small: supple.Task) -> None:
    masses = supple.load(ROOT / "tasks/two_mass.toml")
    studies: dict[str, tuple[Any, set[str]]] = {
        "evaluate": (small.evaluate(), {"step", "time", "x1", "x1.deviation", "information_bits"}),
        "design": (small.design(starts=1), {"step", "time", "u"}),
        "robustness": (
            masses.robustness(["start"], vary={"wall_variance": [1e-5, 1e-4]}, rollouts=2),
            {"design", "task", "wall_variance", "mean", "diverged"},
        ),
        "pareto": (small.pareto(points=2, starts=1), {"factor", "information_bits", "press.expected_cost", "k1"}),
        "trace": (small.trace(starts=1, methods=["sqp"]), {"method", "visit", "information_bits", "k1"}),
        "bound": (small.bound(), {"task", "cost", "minimum_bits_per_step"}),
        "sensors": (small.sensors(count=1), {"name", "price", "bits_alone"}),
    }
    for kind, (study, columns) in studies.items():
        frame = study.to_pandas()
        assert len(frame) > 0 and columns <= set(frame.columns), (kind, list(frame.columns))
        assert not [name for name in frame.columns if "nats" in name], kind
    bits = studies["evaluate"][0].to_pandas()["information_bits"].sum()
    np.testing.assert_allclose(bits, small.evaluate().information.bits, rtol=1e-12)


def test_datasets_have_units(small: supple.Task, sweep: supple.Sweep) -> None:
    pytest.importorskip("xarray")
    plan = small.evaluate().to_xarray()
    assert plan["states"].dims == ("time", "state")
    assert plan["time"].attrs["units"] == "s"
    assert plan["states"].sel(state="x1").shape == (126,)
    assert dict(zip(plan["state"].values, plan["state_unit"].values))["v1"] == "m/s"
    grid = sweep.to_xarray()
    assert grid["information_bits"].dims == ("k1", "k2")
    assert grid["information_bits"].attrs["units"] == "bit"
    assert grid["information_bits"].sel(k1=60.0, k2=30.0) > 0


def test_masked_numbers_are_refused(small: supple.Task) -> None:
    masked = np.ma.array([[1.0], [2.0]], mask=[[False], [True]])
    with pytest.raises(supple.UsageError, match=r"controls\[1, 0\] is masked.*filled"):
        small.simulate(masked)
    row = np.ma.array([1.0], mask=[True])
    with pytest.raises(supple.UsageError, match=r"controls\[1\]\[0\] is masked"):
        small.simulate([[1.0], row])
    with pytest.raises(supple.UsageError, match=r"k1\[1\] is masked"):
        small.sweep({"k1": np.ma.array([40.0, 60.0], mask=[False, True])})
    plain = np.ma.array([[1.0], [2.0]])
    assert small.simulate(plain).shape == (3, 5)


def test_figures_say_in_python_what_they_lack(small: supple.Task, sweep: supple.Sweep) -> None:
    with pytest.raises(supple.UsageError) as lacking:
        small.evaluate().plot.pareto()
    assert "`task.pareto()`" in str(lacking.value) and "supple pareto" not in str(lacking.value)
    with pytest.raises(supple.UsageError) as bare:
        small.evaluate(trajectories=False).plot.belief()
    assert "trajectories=True" in str(bare.value)
    with pytest.raises(supple.UsageError) as curve:
        small.bound().plot.bound()
    assert "curve=True" in str(curve.value) and "--" not in str(curve.value)


def test_figures_are_drawn_on_axes_of_matplotlib(small: supple.Task, sweep: supple.Sweep) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    kept = small.evaluate()
    data = kept._kept.figure("information", others=[], task=None)
    figure, axes = pyplot.subplots(len(data["panels"]), squeeze=False)
    kept.plot.information(ax=axes)
    first = axes.flat[0]
    assert first.get_ylabel().startswith(data["panels"][0]["y"]["label"])
    lines = [series for series in data["panels"][0]["series"] if "line" in series["shape"]]
    assert len(first.lines) >= len(lines) > 0
    np.testing.assert_array_equal(first.lines[0].get_ydata(), lines[0]["shape"]["line"]["y"])
    assert first.get_xlim() == tuple(data["panels"][0]["x"]["range"])
    field = small.sweep({"k1": "log:30:100:4", "k2": "log:5:40:4"})
    panels = field._kept.figure("landscape", others=[], task=None)["panels"]
    _, grid = pyplot.subplots(len(panels), squeeze=False)
    field.plot.landscape(ax=grid)
    assert all(ax.collections for ax in grid.flat)
    with pytest.raises(supple.UsageError, match=r"ax holds 1 of matplotlib's axes, and the figure `landscape` has"):
        field.plot.landscape(ax=pyplot.figure().add_subplot())
    pyplot.close("all")


def test_contacts_costs_and_roll_outs_over_time(small: supple.Task) -> None:
    evaluation = small.evaluate(rollouts=3)
    report = evaluation.tasks["press"]
    trajectory = report.trajectory
    assert trajectory is not None
    count = len(trajectory.time)
    (name, contact), (_, seen) = next(iter(trajectory.contacts.items())), next(iter(report.contacts.items()))
    assert contact.name == name == seen.name
    assert contact.force_N.shape == contact.clearance_m.shape == contact.run_force_N.shape == (count,)
    assert contact.touches.dtype == bool and contact.touches.mean() == pytest.approx(seen.share_of_time)
    assert contact.force_N[contact.touches].max() == pytest.approx(seen.peak_force_N)
    assert contact.clearance_m.min() == pytest.approx(seen.least_clearance_m)
    # The terms of the cost add up to that of the plan.
    costs = np.sum([cost.per_step for cost in trajectory.costs.values()], axis=0)
    assert costs.shape == (count,) and costs.sum() == pytest.approx(report.cost.nominal)
    assert [run.shape for run in trajectory.threads] == [trajectory.states.shape] * 3
    assert "force_N" in contact.to_dict() and trajectory.to_dict()["contacts"][name]["touches"][0] in (True, False)
    frame = evaluation.to_pandas()
    np.testing.assert_array_equal(frame[f"{name}.force"], contact.force_N)
    np.testing.assert_array_equal(frame[f"{name}.touches"], contact.touches)
    for cost in trajectory.costs.values():
        np.testing.assert_array_equal(frame[f"cost {cost.name}"], cost.per_step)
    pytest.importorskip("xarray")
    data = evaluation.to_xarray()
    np.testing.assert_array_equal(data["contact_force"].sel(contact=name), contact.force_N)
    assert data["contact_force"].attrs["units"] == "N" and data["contact_clearance"].attrs["units"] == "m"
    assert data["threads"].dims == ("rollout", "time", "state") and data["threads"].shape == (
        3,
        *trajectory.states.shape,
    )
    assert data["cost_per_step"].sum() == pytest.approx(report.cost.nominal)
    assert small.evaluate(rollouts=0).tasks["press"].trajectory.threads == []  # type: ignore[union-attr]


def test_roll_outs_that_end_early_are_filled_with_nan() -> None:
    from supple._frames import _padded

    found = _padded([np.ones((2, 3)), np.ones((4, 3))], 4)
    assert found.shape == (2, 4, 3) and np.isnan(found[0, 2:]).all() and (found[1] == 1.0).all()
