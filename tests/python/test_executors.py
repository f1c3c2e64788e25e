"""Studies on the workers of executors: the same results to the last bit, whatever becomes of the workers."""

from __future__ import annotations

import functools
import json
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import supple
from supple import _crew, _units, executors
from supple._supple import SweepCollector, __version__, instructions

pytestmark = pytest.mark.timeout(300)

GRID: supple.Grid = {"k1": "log:60:600:20", "k2": "log:100:600:40"}
SMALL: supple.Grid = {"k1": [100.0, 200.0], "k2": "log:100:600:40"}


@pytest.fixture(scope="module")
def task() -> supple.Task:
    os.chdir(Path(__file__).parents[2])
    return supple.load("tasks/two_mass.toml")


@pytest.fixture(scope="module")
def serial(task: supple.Task) -> str:
    return task.sweep(GRID, jobs=1).to_json()


@pytest.fixture
def pool() -> Iterator[Executor]:
    with ProcessPoolExecutor(2) as pool:
        yield pool


class Seen:
    """Counts progress, and does something once it is far enough."""

    def __init__(self, then: Callable[[], None] | None = None, after: int = 100) -> None:
        self.then, self.after = then, after
        self.begun: list[tuple[str, int, int]] = []
        self.done = 0

    def begin(self, what: str, done: int, total: int) -> None:
        self.begun.append((what, done, total))

    def advance(self, parts: int) -> None:
        self.done += parts
        if self.then is not None and self.done >= self.after:
            then, self.then = self.then, None
            then()

    def say(self, message: str) -> None:
        pass


def kill_child() -> None:
    os.kill(multiprocessing.active_children()[0].pid or 0, signal.SIGKILL)


class AtOnce(Executor):
    """Does everything when it is asked to: nobody's executor, but an executor."""

    def __init__(self) -> None:
        self.sizes: list[int] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.sizes.append(len(args[4]) if len(args) > 4 else 0)
        try:
            future.set_result(pickle.loads(pickle.dumps(fn))(*pickle.loads(pickle.dumps(args))))
        except BaseException as error:
            future.set_exception(error)
        return future


def test_tables_are_those_of_threads(task: supple.Task, serial: str, pool: Executor) -> None:
    seen = Seen()
    found = task.sweep(GRID, executor=pool, progress=seen)
    assert found.to_json() == serial
    assert seen.begun == [("points", 0, 800)] and seen.done == 800
    assert found.command_line == task.sweep(GRID).command_line
    for rollouts, starts in [(3, 0), (0, 2)]:
        grid = {"k1": [100.0, 300.0, 500.0], "drive_variance": [1e-3, 1e-2]}
        there = task.sweep(grid, rollouts=rollouts, starts=starts, seed=7, executor=pool)
        assert there.to_json() == task.sweep(grid, rollouts=rollouts, starts=starts, seed=7).to_json()


def test_any_executor_will_do(task: supple.Task, serial: str) -> None:
    at_once = AtOnce()
    assert task.sweep(GRID, executor=at_once).to_json() == serial
    # The first one is the question whether it can work; then batches grow, and shrink at the end.
    assert at_once.sizes[0] == 0 and sum(at_once.sizes) == 60 and max(at_once.sizes) > 1
    with ThreadPoolExecutor(2) as threads:
        assert task.sweep(GRID, executor=threads).to_json() == serial
    assert task.sweep(GRID, executor=lambda: ProcessPoolExecutor(1)).to_json() == serial


def test_batches_on_their_way_are_bounded(task: supple.Task) -> None:
    flying = [0, 0]

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            flying[0] += 1
            flying[1] = max(flying)
            future = super().submit(fn, *args, **kwargs)
            future.add_done_callback(lambda _: flying.__setitem__(0, flying[0] - 1))
            return future

    with Counting(2) as threads:
        task.sweep({"k1": "log:60:600:40", "k2": "log:100:600:40"}, executor=threads)
    assert 2 <= flying[1] <= 2 * _crew.FEWEST < 120


def without_seconds(design: supple.Design) -> Any:
    return {key: value for key, value in design.to_dict().items() if key not in ("seconds", "report_seconds")}


def test_designs_are_those_of_threads(task: supple.Task, pool: Executor) -> None:
    seen = Seen()
    found = task.design(starts=3, seed=5, executor=pool, progress=seen)
    assert without_seconds(found) == without_seconds(task.design(starts=3, seed=5))
    assert seen.begun == [("starts", 0, 3)] and seen.done == 3
    assert found.seconds > 0
    barrier = {"method": "barrier", "settings": {"max_evaluations": 5}, "starts": 2}
    there, here = task.design(executor=pool, **barrier), task.design(**barrier)  # type: ignore[arg-type]
    assert without_seconds(there) == without_seconds(here)


def test_robustness_is_that_of_threads(task: supple.Task, pool: Executor) -> None:
    designs = {"start": {}, "optimum": {}, "soft": {"k1": 60.0}}
    vary = {"wall_variance": [1e-5, 1e-4, 1e-3]}
    seen = Seen()
    found = task.robustness(designs, vary=vary, rollouts=4, seed=2, executor=pool, progress=seen)
    assert found.to_json() == task.robustness(designs, vary=vary, rollouts=4, seed=2).to_json()
    assert seen.begun[-1] == ("designs and levels", 0, 3 + 3 * 2 * 3)
    plain = {"designs": ["start"], "vary": vary, "rollouts": 2}
    there, here = task.robustness(**plain, executor=pool), task.robustness(**plain)  # type: ignore[arg-type]
    assert there.to_json() == here.to_json()


def test_a_number_of_processes_survives_one_that_is_killed(task: supple.Task, serial: str) -> None:
    assert task.sweep(GRID, executor=2, progress=Seen(kill_child)).to_json() == serial
    assert not multiprocessing.active_children()


def test_a_pool_that_breaks_keeps_what_is_done(task: supple.Task, serial: str, tmp_path: Path) -> None:
    with ProcessPoolExecutor(2) as pool, pytest.raises(supple.WorkerError, match="nothing is kept"):
        task.sweep(GRID, executor=pool, progress=Seen(kill_child))
    with ProcessPoolExecutor(2) as pool:
        with pytest.raises(supple.WorkerError, match=f"is kept in {tmp_path}: the same call resumes"):
            task.sweep(GRID, executor=pool, out=tmp_path, progress=Seen(kill_child))
    seen = Seen()
    with ProcessPoolExecutor(2) as pool:
        assert task.sweep(GRID, executor=pool, out=tmp_path, progress=seen).to_json() == serial
    (_, before, total), *_ = seen.begun
    assert 100 <= before < 800 and total == 800 and seen.done == total - before
    assert supple.load_result(tmp_path).to_json() == serial


def test_a_unit_that_kills_its_workers_is_named(task: supple.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    collector = SweepCollector(task._native, list(SMALL.items()), sizes=(0, 0, 0, 0), out=None)  # type: ignore[arg-type]
    deadly, _, words = [unit for unit in iter(lambda: collector.next_unit(1), None) if unit is not None][4]
    assert words.startswith("points 56 to 71, the first at k1 = 200.0, k2 = ")
    whole = _units.work

    @functools.wraps(whole)
    def work(*args: Any) -> _units.Answer:
        if deadly in args[4]:
            os.kill(os.getpid(), signal.SIGKILL)
        return whole(*args)

    monkeypatch.setattr(_units, "work", work)
    fork = multiprocessing.get_context("fork")
    seen = Seen()
    with pytest.raises(supple.WorkerError, match=f"{words} killed its worker 3 times; nothing is kept"):
        task.sweep(SMALL, executor=lambda: ProcessPoolExecutor(2, mp_context=fork), progress=seen)


def test_ctrl_c_keeps_what_is_done(task: supple.Task, serial: str, tmp_path: Path) -> None:
    def interrupt() -> None:
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()

    with pytest.raises(KeyboardInterrupt):
        task.sweep(GRID, executor=2, out=tmp_path, progress=Seen(interrupt))
    assert not multiprocessing.active_children()
    seen = Seen()
    assert task.sweep(GRID, executor=AtOnce(), out=tmp_path, progress=seen).to_json() == serial
    assert seen.begun[0][1] >= 100


def test_workers_go_on_in_the_middle_of_segments(task: supple.Task, serial: str, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    for points in (30, 200):
        with pytest.raises(KeyboardInterrupt):
            task.sweep(GRID, out=tmp_path, progress=Seen(interrupt, points))
    seen = Seen()
    assert task.sweep(GRID, executor=AtOnce(), out=tmp_path, progress=seen).to_json() == serial
    assert seen.done == 800 - seen.begun[0][1] < 800


def test_tasks_go_without_their_files(tmp_path: Path, pool: Executor) -> None:
    robot = "door.urdf"
    shutil.copy("models/iiwa14_door.urdf", tmp_path / robot)
    text = Path("tasks/iiwa_door.toml").read_text()
    (tmp_path / "door.toml").write_text(text.replace("../models/iiwa14_door.urdf", robot))
    task = supple.load(tmp_path / "door.toml")
    expected = task.evaluate(trajectories=False).to_json()
    packed = pickle.dumps(task)
    for file in tmp_path.iterdir():
        file.unlink()
    again = pickle.loads(packed)
    assert again.evaluate(trajectories=False).to_json() == expected
    assert again.evaluate(trajectories=False).made["sources"] == task.evaluate(trajectories=False).made["sources"]
    name = next(iter(task.parameters))
    values = {name: [task.values[name]]}
    assert task.sweep(values, executor=pool).to_json() == task.sweep(values).to_json()


def test_errors_of_workers_are_those_of_this_process(task: supple.Task, tmp_path: Path, pool: Executor) -> None:
    text = Path("tasks/two_mass.toml").read_text()
    (tmp_path / "task.toml").write_text(text + '\n[planning]\nmode = "sampled"\n')
    sampled = supple.load(tmp_path / "task.toml")
    with pytest.raises(supple.UsageError) as here:
        sampled.design(starts=1)
    with pytest.raises(supple.UsageError) as there:
        sampled.design(starts=1, executor=pool)
    assert str(there.value) == str(here.value)
    told = supple.FileError("no", file="a.toml", line=3, column=1, key="x", help="do", picture="^")
    for error in [
        told,
        supple.ComputeError("c"),
        supple.UsageError("u"),
        supple.KeptError("k"),
        supple.WorkerError("w"),
    ]:
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error) and vars(again) == vars(error)


def test_what_cannot_be_is_said(task: supple.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong in (0, 10**18, -1, True, "pool"):
        with pytest.raises(supple.UsageError, match="a number of processes from 1 to 1024"):
            task.sweep(SMALL, executor=wrong)  # type: ignore[arg-type]
    with pytest.raises(supple.UsageError, match="give only one"):
        task.sweep(SMALL, executor=2, jobs=2)
    with pytest.raises(supple.UsageError, match="not available on this machine"):
        executors.use_instructions("mmx")
    executors.use_instructions(instructions())
    assert "numbers would differ by rounding" in _units.hello(__version__, "mmx")
    assert _units.hello(__version__, instructions()) == ""
    monkeypatch.setattr(_crew, "__version__", "0.0.7")
    with pytest.raises(supple.WorkerError, match=f"has supple {__version__}, this process 0.0.7: install the same"):
        task.sweep(SMALL, executor=AtOnce())


def test_workers_that_do_not_know_a_large_study_are_sent_it(task: supple.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_crew, "SMALL", 0)
    sent: list[bool] = []

    class Spying(AtOnce):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            if len(args) > 4:
                sent.append(args[3] is not None)
            return super().submit(fn, *args, **kwargs)

    grid = {"k1": "log:60:500:7", "k2": "log:100:600:40"}
    assert task.sweep(grid, executor=Spying()).to_json() == task.sweep(grid).to_json()
    assert sent[0] is False and True in sent and sent[-1] is False


def test_dask_survives_a_worker_that_is_killed(task: supple.Task, serial: str, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as pool,
    ):
        assert task.sweep(SMALL, executor=pool).to_json() == task.sweep(SMALL).to_json()
        assert without_seconds(task.design(starts=2, executor=pool)) == without_seconds(task.design(starts=2))
        pids = client.run(os.getpid)

        def kill() -> None:
            os.kill(min(pids.values()), signal.SIGKILL)

        seen = Seen(kill)
        assert task.sweep(GRID, executor=pool, out=tmp_path, progress=seen).to_json() == serial
        assert seen.done == 800


MPI = """
import supple
from mpi4py.futures import MPIPoolExecutor

if __name__ == "__main__":
    task = supple.load("tasks/two_mass.toml")
    with MPIPoolExecutor() as pool:
        print(pool.num_workers)
        print(task.sweep({"k1": "log:60:600:20", "k2": "log:100:600:40"}, executor=pool).to_json(), end="")
"""


def test_mpi(serial: str, tmp_path: Path) -> None:
    pytest.importorskip("mpi4py")
    mpiexec = shutil.which("mpiexec", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    if mpiexec is None:
        pytest.skip("there is no mpiexec: pip install mpich")
    script = tmp_path / "script.py"
    script.write_text(MPI)
    command = [mpiexec, "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert found.returncode == 0, found.stderr
    workers, table = found.stdout.split("\n", 1)
    assert workers == "2" and table == serial


def test_the_page_runs(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    page = Path("docs/scaling.md").read_text()
    snippets = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert len(snippets) == 2
    for name in ("tasks", "models"):
        (tmp_path / name).symlink_to(Path(name).resolve())
    script = tmp_path / "script.py"
    check = (
        'assert len(table) == 160 and found.table["k1"].tolist() == table["k1"].tolist() and best.status == "converged"'
    )
    script.write_text("\n".join([*snippets, 'if __name__ == "__main__":', f"    {check}"]))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    words = [sys.executable, str(script)]
    found = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=240)
    assert found.returncode == 0, found.stderr


def test_results_are_json(task: supple.Task, pool: Executor) -> None:
    rows = task.sweep(SMALL, executor=pool).to_json().splitlines()
    assert len(rows) == 80 and json.loads(rows[0])["k1"] == 100


def test_executors_are_there_after_import_supple() -> None:

    words = "import supple; supple.executors.use_instructions('baseline'); print(supple.executors.__name__)"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "supple.executors"


def test_forked_workers_are_refused_where_jax_would_wait_forever() -> None:
    pytest.importorskip("jax")

    def made(backend: Any) -> supple.Task:
        model = supple.Model(
            step=lambda x, u, p: x + 0.1 * (u - p.k * x),
            observe=lambda x, p: x,
            cost=lambda x, u, p: x[0] ** 2 + u[0] ** 2,
            states=1,
            controls=1,
            measurements=1,
            parameters={"k": supple.Parameter(1.0, bounds=(0.1, 5.0))},
            backend=backend,
        )
        noise = supple.Noise(initial=[1e-2], process=[1e-3], measurement=[1e-2])
        return model.task(steps=10, time_step=0.1, initial_state=[1.0], initial_control=[0.0], noise=noise)

    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(1, mp_context=fork) as workers:
        for given in [workers, lambda: ProcessPoolExecutor(1, mp_context=fork)]:
            with pytest.raises(supple.UsageError, match="its processes are forked"):
                made("jax").sweep({"k": [1.0, 2.0]}, executor=given)
        assert len(made("recorded").sweep({"k": [1.0, 2.0]}, executor=workers).table) == 2
