"""What tasks and results look like to those who use them."""

from __future__ import annotations

import json
import logging
import os
import pickle
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple


@pytest.fixture(scope="module")
def task() -> supple.Task:
    os.chdir(Path(__file__).parents[2])
    return supple.load("tasks/two_mass.toml")


@pytest.fixture(scope="module")
def best(task: supple.Task) -> supple.Design:
    return task.design(starts=1)


def test_tasks_say_what_they_are(task: supple.Task) -> None:
    assert task.tasks == ["press"]
    assert task.parameters["k1"] == supple.Parameter(500.0, (50.0, 600.0), "log", "N/m", "design")
    assert task.values["wall_variance"] == 1e-4
    assert task.at(k1=60.0).values["k1"] == 60.0 and task.values["k1"] == 500.0
    assert "k1" in repr(task) and "<table>" in task._repr_html_()


def test_simulations_are_motions_under_given_controls(task: supple.Task) -> None:
    path = task.evaluate(k1=200.0).tasks["press"].trajectory
    assert path is not None
    assert np.allclose(task.simulate(path.u, k1=200.0), path.x, rtol=1e-12, atol=1e-12)
    assert not np.allclose(task.simulate(path.u), path.x, atol=1e-4), "the parameters count"
    later = task.simulate(path.u[50:], initial_state=path.x[50], task="press", at={"k1": 200.0})
    assert np.allclose(later, path.x[50:], rtol=1e-12, atol=1e-12), (
        "from any state, over as many steps as there are controls"
    )
    longer = task.simulate(np.zeros((300, 1)))
    assert longer.shape == (301, 5) and np.array_equal(longer[0], path.x[0])


def test_simulations_of_matrices_end_with_them() -> None:
    one, two = np.ones((1, 1)), np.array([[[1.0]], [[2.0]], [[3.0]]])
    noise = {"W": one, "V": one, "X0": one, "Q": one, "R": one}
    task = supple.linear(A=two, B=one, C=one, x0=[1.0], time_step=0.1, **noise)
    assert task.simulate([[0.0], [1.0], [1.0]]).ravel().tolist() == [1.0, 1.0, 3.0, 10.0]
    assert task.simulate([[5.0]]).ravel().tolist() == [1.0, 6.0]
    with pytest.raises(supple.UsageError, match="the list of controls of task .* has length 4, not 3"):
        task.simulate(np.zeros((4, 1)))


@pytest.mark.parametrize(
    ("controls", "options", "words"),
    [
        (np.zeros(5), {}, r"controls has the shape \(5,\): it must be \(N, m\)"),
        (np.zeros((0, 1)), {}, r"controls has the shape \(0, 1\): it must be \(N, m\)"),
        (np.zeros((5, 2)), {}, "a row of the controls of task `press` has length 2, not 1"),
        ([[0.0], [np.nan]], {}, r"controls\[1, 0\] is nan: it must be finite"),
        ([["fast"]], {}, "controls holds <U4: it must hold real numbers"),
        (np.zeros((5, 1)), {"initial_state": [0.0]}, "the first state of task `press` has length 1, not 5"),
        (np.zeros((5, 1)), {"task": "pull"}, "no task `pull`; valid: press"),
        (np.zeros((5, 1)), {"k1": 1.0}, "outside"),
    ],
)
def test_simulations_that_cannot_be(task: supple.Task, controls: Any, options: dict[str, Any], words: str) -> None:
    with pytest.raises(supple.UsageError, match=words):
        task.simulate(controls, **options)


def test_simulations_that_diverge_or_lack_a_task(task: supple.Task) -> None:
    with pytest.raises(supple.ComputeError, match="the state of a simulation is not finite at step"):
        task.simulate(np.full((50, 1), 1e308))
    with pytest.raises(supple.UsageError, match="there are several tasks: give task= one of open, close"):
        supple.load("tasks/iiwa_door.toml").simulate(np.zeros((1, 7)))


def test_arrays_have_shapes_and_own_their_memory(task: supple.Task) -> None:
    found = task.evaluate(gradient="total", rollouts=5)
    report = found.tasks["press"]
    path = report.trajectory
    assert path is not None
    assert (
        path.x.shape == (126, 5) and path.u.shape == (125, 1) and path.K.shape == (125, 1, 5) and path.t.shape == (126,)
    )
    assert all(array.dtype == np.float64 and array.flags.c_contiguous for array in (path.x, path.u, path.K))
    assert report.information.per_step_nats.sum() == pytest.approx(report.information.total_nats, rel=1e-14)
    assert (
        report.monte_carlo is not None
        and report.monte_carlo.rollouts == 5
        and report.monte_carlo.cost_standard_error > 0
    )
    assert report.gradient is not None and report.gradient.total is not None and report.gradient.frozen is None
    assert set(report.gradient.total.information_nats) == set(task.parameters)
    assert list(path.measurements) == ["position of m1", "force in the spring"]
    assert found.information.bits_per_second == report.information.bits_per_second
    parts = report.cost
    assert parts.nominal + parts.belief + parts.process + parts.initial == pytest.approx(parts.expected, rel=1e-14)


def test_contacts_are_typed_records_by_name(best: supple.Design, task: supple.Task) -> None:
    wall = best.tasks["press"].contacts["wall"]
    assert wall.touches and wall.first_s is not None and 0.0 < wall.first_s < 1.25 and wall.last_s == 2.5
    assert (
        0.0 < wall.share_of_time < 1.0 and wall.peak_force_N >= wall.mean_force_N > 1.0 > 0.0 > wall.least_clearance_m
    )
    assert best.warnings == [] and best.tasks["press"].warnings == []
    assert best.evaluations_without_contact == best.starts[0].evaluations_without_contact == 0
    assert wall.to_dict() == best.to_dict()["optimum"]["tasks"][0]["contacts"][0]
    assert supple.load("tasks/light_dark.toml").evaluate().tasks["park"].contacts == {}
    sweep = task.sweep({"k1": [100.0, 300.0]})
    assert (sweep.table["press.wall.share_of_time"] > 0).all() and (sweep.table["press.misses_contact"] == 0).all()


def test_terms_of_the_cost_are_typed_records_by_name(best: supple.Design) -> None:
    cost = best.tasks["press"].cost
    assert sum(term.stages + term.last for term in cost.terms.values()) == pytest.approx(cost.nominal, rel=1e-12)
    force = cost.terms["1 contact_force"].targets["smoothed normal force"]
    assert (force.target, force.unit, force.in_final_cost) == (10.0, "N", True) and 7.0 < force.mean < force.end < 10.0
    assert cost.terms["3 control"].targets["u"].in_final_cost is False
    assert next(iter(cost.to_dict()["terms"])) == "1 contact_force"


def test_a_contact_that_is_missed_is_a_warning(tmp_path: Path) -> None:
    text = Path("tasks/two_mass.toml").read_text()
    idle = tmp_path / "idle.toml"
    idle.write_text(text.replace("weight = 0.05", "weight = 1e-12").replace("[57.0]", "[0.0]"))
    found = supple.load(idle).evaluate()
    wall = found.tasks["press"].contacts["wall"]
    assert not wall.touches and wall.first_s is None and wall.last_s is None and wall.peak_force_N == 0.0
    (warning,) = found.tasks["press"].warnings
    assert found.warnings[0] == warning
    assert warning.startswith(
        "task `press`: the plan never makes contact with `wall`, but cost 1 (contact_force) tracks a force of 10 N there"
    )
    assert warning in repr(found)


def test_several_tasks_add_up() -> None:
    found = supple.load("tasks/iiwa_door.toml").evaluate(trajectories=False)
    reports = found.tasks.values()
    assert len(found.tasks) == 2
    assert found.information.nats == pytest.approx(sum(report.information.total_nats for report in reports))
    seconds = sum(report.information.total_bits / report.information.bits_per_second for report in reports)
    assert found.information.bits_per_second == pytest.approx(found.information.bits / seconds)


def test_designs_read_like_the_documentation(best: supple.Design) -> None:
    assert best.parameters["k1"] == pytest.approx(135.912, abs=1e-2)
    assert best.tasks["press"].cost.expected == pytest.approx(250.0, rel=1e-6)
    assert best.active_bounds == ["press"] and best.bound_prices["press"] > 0
    assert len(best.starts) == 1 and best.starts[0].status == "converged"
    assert best.start_information.bits > best.information.bits
    assert "converged" in repr(best) and "242.785" in best._repr_html_()


def test_results_are_json_and_pickles(best: supple.Design, task: supple.Task) -> None:
    assert json.loads(json.dumps(best.to_dict()))["status"] == "converged"
    assert (
        json.loads(json.dumps(best.tasks["press"].to_dict()))["cost"]["expected"] == best.tasks["press"].cost.expected
    )
    again = pickle.loads(pickle.dumps(best))
    assert again.to_json() == best.to_json()
    sweep = task.sweep({"k1": [100.0, 300.0]})
    assert pickle.loads(pickle.dumps(sweep)).to_json() == sweep.to_json()
    moved = pickle.loads(pickle.dumps(task.at(k1=77.0)))
    assert moved.values == task.at(k1=77.0).values
    assert moved.evaluate().to_json() == task.evaluate(k1=77.0).to_json()


def test_tables_become_frames(task: supple.Task) -> None:
    sweep = task.sweep({"k1": np.geomspace(50, 600, 4), "k2": "100:600:3"})
    assert len(sweep.table) == 12 and sweep.grid("information_nats").shape == (4, 3)
    assert sweep.table.units["k1"] == "N/m" and "<table>" in sweep._repr_html_()
    pandas = pytest.importorskip("pandas")
    frame = sweep.table.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and frame.shape[0] == 12
    assert np.array_equal(frame["k1"].to_numpy(), sweep.table["k1"])
    pytest.importorskip("polars")
    assert sweep.table.to_polars().shape == frame.shape
    with pytest.raises(KeyError, match="no column `nats`; valid: "):
        sweep.table["nats"]


def test_figures_and_reports(best: supple.Design, task: supple.Task, tmp_path: Path) -> None:
    sweep = task.sweep({"k1": "log:50:600:5", "k2": "log:100:600:5"})
    figure = best.plot.landscape(sweep=sweep)
    assert figure._repr_svg_().startswith("<svg") or "<svg" in figure._repr_svg_()
    for ending, magic in (("svg", b"<"), ("png", b"\x89PNG"), ("pdf", b"%PDF")):
        assert figure.save(tmp_path / f"landscape.{ending}").read_bytes().startswith(magic)
    assert figure.save(tmp_path / "LANDSCAPE.SVG").read_bytes().startswith(b"<")
    with pytest.raises(supple.StorageError, match="cannot be written: No such file"):
        figure.save(tmp_path / "nowhere" / "landscape.svg")
    with pytest.raises(supple.StorageError, match="cannot be written: No such file"):
        best.report(tmp_path / "nowhere" / "page.html")
    assert best.plot.landscape(points=3).render("svg") != figure.render("svg")
    assert "<html" in best.report(tmp_path / "page.html", sweep).read_text()[:200].lower()
    best.plot.belief(), best.plot.gains(), best.plot.information()
    with pytest.raises(supple.UsageError, match=r"requires a result of `task.pareto\(\)`"):
        best.plot.pareto()


def test_misuse_says_what_is_valid(task: supple.Task) -> None:
    cases: list[tuple[Any, str]] = [
        (lambda: task.evaluate(k1="soft"), "parameter `k1` = 'soft' is not a number"),  # type: ignore[arg-type]
        (lambda: task.evaluate(k1="200"), "parameter `k1` = '200' is not a number"),  # type: ignore[arg-type]
        (lambda: task.evaluate(k1=True), "parameter `k1` = True is not a number"),
        (lambda: task.evaluate(k1=np.complex128(200 + 1j)), "is not a number"),  # type: ignore[arg-type]
        (lambda: supple.combine([task, task]), "valid: tasks, one by one"),  # type: ignore[arg-type]
        (lambda: task.sweep({"k1": [100.0]}).grid("cost"), "no column `cost`; valid: k1, "),
        (lambda: task.evaluate(gradient="exact"), 'valid: "total", "frozen", "both"'),  # type: ignore[arg-type]
        (lambda: task.evaluate(rollouts=-1), "rollouts=-1: a whole number of at least 0"),
        (lambda: task.evaluate(seed=2**64), "seed=18446744073709551616: at most 18446744073709551615"),
        (lambda: task.evaluate(k1=float("nan")), "parameter `k1` = NaN is outside"),
        (lambda: task.design(method="newton"), 'valid: "sqp", "cobyla", "barrier", None'),  # type: ignore[arg-type]
        (lambda: task.design(settings={"starst": 2}), "unknown field `starst`"),
        (lambda: task.design(starts=0), "starts: must be at least 1"),
        (lambda: task.sweep({"k1": [[1.0, 2.0]]}), "has the shape (1, 2); valid: a list of numbers"),
        (lambda: task.sweep({"k1": "log:50:600"}), "FROM:TO:COUNT"),
        (lambda: task.sweep({"k1": [100.0]}, jobs=0), "jobs=0"),
        (lambda: task.sweep({"k1": [100.0]}, jobs=10**5), "at most 1024"),
        (lambda: task.sweep({"k1": [100.0]}, starts=10**10), "at most 10000"),
        (lambda: task.robustness(vary={"k1": [60.0, 70.0]}), "is a design parameter"),
        (lambda: task.robustness(vary={}), "vary names 0 parameters"),
        (lambda: task.robustness(["stiff"], vary={"wall_variance": [1e-5, 1e-4]}), "`stiff` is not a design"),
        (lambda: task.pareto(points=1), "at least 2"),
    ]
    for call, words in cases:
        with pytest.raises(supple.UsageError) as caught:
            call()
        assert words in str(caught.value), str(caught.value)
    with pytest.raises(supple.FileError, match="cannot be read"):
        supple.load("tasks/none.toml")
    with pytest.raises(supple.FileError, match="result.json"):
        supple.load_result("tasks")


class Watcher:
    """Notes what it is told, from which threads."""

    def __init__(self) -> None:
        self.begun: list[tuple[str, int, int]] = []
        self.done = 0
        self.said: list[str] = []
        self.threads: set[int] = set()

    def begin(self, what: str, done: int, total: int) -> None:
        self.begun.append((what, done, total))
        self.threads.add(threading.get_ident())

    def advance(self, parts: int) -> None:
        self.done += parts
        self.threads.add(threading.get_ident())

    def say(self, message: str) -> None:
        self.said.append(message)


def test_progress_is_told_on_the_thread_that_asked(task: supple.Task) -> None:
    watcher = Watcher()
    task.sweep({"k1": "log:50:600:40"}, progress=watcher)
    assert watcher.begun == [("points", 0, 40)] and watcher.done == 40
    assert watcher.threads == {threading.get_ident()}
    watcher = Watcher()
    task.design(starts=3, progress=watcher)
    causes = ("causes of the change of information, percent", 0, 100)
    parts = [("starts", 0, 3), ("evaluation of start and optimum", 0, 2), causes]
    assert watcher.begun == parts and watcher.done == 105 and "designs, best" in watcher.said[-1]


def test_an_exception_in_progress_stops_the_work(task: supple.Task) -> None:
    class Broken(Watcher):
        def advance(self, parts: int) -> None:
            raise RuntimeError("no more")

    clock = time.perf_counter()
    with pytest.raises(RuntimeError, match="no more"):
        task.sweep({"k1": "log:50:600:200", "k2": "log:100:600:200"}, progress=Broken())
    assert time.perf_counter() - clock < 20


@pytest.mark.skipif(os.name == "nt", reason="signals are not those of Windows")
def test_ctrl_c_keeps_what_is_done(task: supple.Task, tmp_path: Path) -> None:
    grid = {"k1": "log:50:600:200", "k2": "log:100:600:200"}
    threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    clock = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        task.sweep(grid, out=tmp_path / "sweep")
    assert time.perf_counter() - clock < 10
    watcher = Watcher()
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        task.sweep(grid, out=tmp_path / "sweep", progress=watcher)
    assert watcher.begun[0][1] > 0, "what was done was lost"


def test_other_threads_run_meanwhile(task: supple.Task) -> None:
    """Long work does not hold the interpreter's lock."""
    ticks = 0
    ended = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not ended.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    clock = time.perf_counter()
    task.sweep({"k1": "log:50:600:60", "k2": "log:100:600:20"})
    seconds = time.perf_counter() - clock
    ended.set()
    thread.join()
    assert ticks > 50 * seconds


def test_studies_are_logged(task: supple.Task, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="supple"):
        task.design(starts=1)
    assert [record.message.split()[0:2] for record in caplog.records] == [["design", "begins"], ["design", "done"]]


def test_exceptions_are_pickles() -> None:
    with pytest.raises(supple.FileError) as caught:
        supple.load("tasks/none.toml")
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and again.file == "tasks/none.toml"


def test_tasks_from_texts_name_no_command_that_would_do_something_else() -> None:
    text = Path("tasks/iiwa_door.toml").read_text().replace("steps = 500", "steps = 40")
    door = supple.loads(text, "tasks/iiwa_door.toml", k1=1e5)
    found = door.evaluate(trajectories=False)
    assert found.command_line == []
    assert found.made["sources"][0]["text"] == text
    again = pickle.loads(pickle.dumps(door))
    assert again.evaluate(trajectories=False).to_json() == found.to_json()


def test_quantities_over_time(tmp_path: Path) -> None:
    text = Path("tasks/wiping_arm.toml").read_text().replace('"../models', f'"{Path("models").resolve()}')
    text += '\n[[tasks.limits]]\nkind = "contact_force"\ncontact = "wall"\nupper = 5.2\n'
    text += '\n[[tasks.curves]]\nkind = "power"\nselect = ["elbow"]\n'
    (tmp_path / "task.toml").write_text(text)
    found = supple.load(tmp_path / "task.toml").evaluate(trajectories=True, rollouts=0)
    plan = found.tasks["wipe"].trajectory
    assert plan is not None
    by = {f"{one.name} ({one.of})": one for one in plan.quantities}
    force, power = by["normal force of wall (limit 1)"], by["power of elbow (curve 1)"]
    assert (force.unit, force.upper, force.lower, power.unit) == ("N", 5.2, None, "W")
    assert np.array_equal(force.values, plan.contacts["wall"].force_N)
    assert np.array_equal(power.values, plan.u[:, 1] * plan.x[:-1, plan.state_names.index("v.elbow")])
    worst = [one for one in found.tasks["wipe"].limits_violated if one.name == "normal force of wall"]
    assert worst[0].worst == force.values.max() > 5.2
    table = found.to_pandas()
    assert table["power of elbow (curve 1)"].isna().sum() == 1
