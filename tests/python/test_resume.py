"""Studies with a folder are resumed by the same call, to the same bits."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import supple

Call = Callable[..., "supple.Design | supple.Pareto | supple.Trace | supple.Robustness"]


class StoppedAfter:
    """Progress that is interrupted, as by Ctrl-C, after so many parts."""

    def __init__(self, parts: int) -> None:
        self.left = parts

    def begin(self, what: str, done: int, total: int) -> None:
        pass

    def advance(self, parts: int) -> None:
        self.left -= parts
        if self.left <= 0:
            raise KeyboardInterrupt

    def say(self, message: str) -> None:
        pass


STUDIES: dict[str, Call] = {
    "design": lambda task, **given: task.design(starts=3, rollouts=0, **given),
    "pareto": lambda task, **given: task.pareto(points=3, starts=1, **given),
    "trace": lambda task, **given: task.trace(starts=2, methods=["sqp"], gradients=["total"], **given),
    "robustness": lambda task, **given: task.robustness(
        {"start": {}, "soft": {"k1": 100.0}}, vary={"wall_variance": [1e-5, 1e-4]}, rollouts=4, **given
    ),
}


def untimed(found: supple.Result) -> str:
    """The result without how long it took."""
    return re.sub(r'"(?:report_)?seconds": [^,\n]+', "", found.to_json())


@pytest.fixture(scope="module")
def task() -> supple.Task:
    return supple.load(Path(__file__).parents[2] / "tasks" / "two_mass.toml")


@pytest.mark.parametrize("name", STUDIES)
def test_the_same_call_resumes(name: str, task: supple.Task, tmp_path: Path) -> None:
    study = STUDIES[name]
    with pytest.raises(KeyboardInterrupt):
        study(task, out=tmp_path, progress=StoppedAfter(1))
    assert [file.name for file in tmp_path.iterdir()] == ["journal.redb"]
    resumed = study(task, out=tmp_path)
    assert untimed(resumed) == untimed(study(task))
    # The result says it all.
    assert not (tmp_path / "journal.redb").exists()
    assert supple.load_result(tmp_path).to_json() == resumed.to_json()


def test_another_study_does_not_resume(task: supple.Task, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        STUDIES["pareto"](task, out=tmp_path, progress=StoppedAfter(1))
    with pytest.raises(supple.KeptError, match="another"):
        task.pareto(points=4, starts=1, out=tmp_path)


def test_workers_elsewhere_keep_no_journal(task: supple.Task, tmp_path: Path) -> None:
    with pytest.raises(supple.UsageError, match="leave out executor"):
        task.robustness(["start"], vary={"wall_variance": [1e-5]}, out=tmp_path, executor=2)
    with pytest.raises(supple.UsageError, match="leave out executor"):
        task.design(out=tmp_path, executor=2)
