"""Tasks of own models in other processes."""

from __future__ import annotations

import pickle
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

import supple

pytest.importorskip("jax")

from own_functions import BALANCE, backend_of, batch_step, cart_pole, cart_pole_model

pytestmark = pytest.mark.timeout(300)


def evaluated(task: supple.Task) -> str:
    """All numbers of an evaluation as a text."""
    return str(task.evaluate(gradient="total").tasks["balance"].to_dict())


@pytest.mark.parametrize("backend", ["jax", "numpy", "recorded"])
def test_workers_give_the_same_to_the_last_bit(backend: Any) -> None:
    task = cart_pole(backend).at(stiffness=0.2)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(evaluated, task).result() == evaluated(task)


@pytest.mark.parametrize("backend", ["jax", "recorded"])
def test_sweeps_on_executors_are_those_of_threads(backend: Any, tmp_path: Path) -> None:
    task = cart_pole(backend)
    grid = {"stiffness": [0.1, 0.2, 0.3]}
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        found = task.sweep(grid, executor=pool, out=tmp_path / "sweep")
    assert found.to_json() == task.sweep(grid).to_json()


def test_what_was_measured_travels_too() -> None:
    task = cart_pole("numpy")
    again = pickle.loads(pickle.dumps(task))
    assert task.derivative_error is not None and again.derivative_error is not None
    assert again.derivative_error.to_dict() == task.at(stiffness=0.2).derivative_error.to_dict()  # type: ignore[union-attr]
    assert again.parameters == task.parameters and again.values == task.values
    ours, theirs = backend_of(task), backend_of(again)
    assert all((ours.lengths[key] == theirs.lengths[key]).all() for key in ours.lengths)


def lambdas() -> supple.Task:
    return cart_pole_model("numpy", observe=lambda x, p: x[..., :2]).task(**BALANCE)


def test_lambdas_travel_with_cloudpickle() -> None:
    pytest.importorskip("cloudpickle")
    task = lambdas()
    assert evaluated(pickle.loads(pickle.dumps(task))) == evaluated(task)


def test_lambdas_without_cloudpickle_say_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    with pytest.raises(
        supple.UsageError, match=r"`observe`, `lambdas\.<locals>\.<lambda>`, cannot .*top level.*cloudpickle"
    ):
        pickle.dumps(lambdas())
    # Functions of modules need none.
    assert evaluated(pickle.loads(pickle.dumps(cart_pole("numpy")))) == evaluated(cart_pole("numpy"))


def test_functions_that_hold_what_cannot_travel_say_so() -> None:
    pytest.importorskip("cloudpickle")
    lock = threading.Lock()

    def observe(x: Any, p: Any) -> Any:
        with lock:
            return x[..., :2]

    task = cart_pole_model("numpy", observe=observe).task(**BALANCE)
    assert task.evaluate().tasks["balance"].status == "converged"
    with pytest.raises(supple.UsageError, match="`observe`, .*observe`, cannot be sent to another process: .*lock"):
        pickle.dumps(task)


def test_functions_whose_module_is_missing_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = pickle.dumps(cart_pole("numpy"))
    for name in [name for name in sys.modules if name == "own_functions"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if not entry.endswith("tests/python")])
    with pytest.raises(supple.UsageError, match="`step` cannot be read in this process: .*own_functions"):
        pickle.loads(kept)


MASS = 0.8


def heavier(x: Any, u: Any, p: Any) -> Any:
    return batch_step(x, u / MASS, p)


def test_journals_know_the_functions_they_belong_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = {"stiffness": [0.1, 0.2]}

    def sweep(**functions: Any) -> list[Any]:
        task = cart_pole_model("numpy", **functions).task(**BALANCE)
        return list(task.sweep(grid, out=tmp_path / "sweep").table["information_bits"])

    first = sweep(step=heavier)
    assert sweep(step=heavier) == first
    with pytest.raises(supple.KeptError, match=r"another sweep(?s:.*)heavier"):
        sweep(step=batch_step)
    # A number that a function takes from its module is a part of it.
    monkeypatch.setitem(globals(), "MASS", 0.5)
    with pytest.raises(supple.KeptError, match=r"(?s)another sweep.*-MASS = 0\.8\n\+MASS = 0\.5"):
        sweep(step=heavier)


@pytest.mark.parametrize("backend", ["jax", "numpy", "recorded"])
def test_what_a_task_is_does_not_depend_on_the_process(backend: Any) -> None:
    task = cart_pole(backend)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(source_of, backend).result() == source_of(backend)
    assert task._recipe[1]["source"] == source_of(backend)


def source_of(backend: Any) -> str:
    return str(cart_pole(backend)._recipe[1]["source"])
