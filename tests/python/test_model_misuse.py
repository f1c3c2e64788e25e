"""What is wrong with own models is said, by what and what to do; nothing hangs and no number is wrong."""

from __future__ import annotations

import itertools
import threading
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import supple

pytest.importorskip("jax")

import jax.numpy as jnp
from own_functions import (
    BALANCE,
    CART_POLE,
    PRESS,
    TWO_MASS,
    Counting,
    backend_of,
    batch_cost,
    batch_step,
    cart_pole,
    cart_pole_cost,
    cart_pole_model,
    cart_pole_step,
    two_mass_cost,
    two_mass_final_cost,
    two_mass_observe,
    two_mass_step,
    with_backend,
)

# An engine that waits for the interpreter while the interpreter waits for it would never end.
pytestmark = pytest.mark.timeout(120)

COARSE = jnp.array([0.02])


def made(backend: str, **functions: Any) -> supple.Task:
    return cart_pole_model(backend, **functions).task(**BALANCE)


WRONG: list[tuple[str, dict[str, Any], str]] = [
    (
        "jax",
        {"step": lambda x, u, p: x[:3]},
        r"`step` returned an array of the shape \(3,\).*must return the shape \(4,\)",
    ),
    ("jax", {"cost": lambda x, u, p: u}, r"`cost` returned an array of the shape \(1,\).*must return the shape \(\)"),
    ("jax", {"step": lambda x, u, p: x.astype(jnp.float32)}, r"`step` computes in float32.*jax_enable_x64"),
    (
        "jax",
        {"step": lambda x, u, p: cart_pole_step(x, u, p) * COARSE[0]},
        r"`step` computes in float32.*jax_enable_x64",
    ),
    ("jax", {"observe": lambda x, p: x[:2] if x[0] > 0 else -x[:2]}, r"`observe` cannot be traced by JAX.*jnp\.where"),
    (
        "jax",
        {"cost": lambda x, u, p: p.stifness * x[0]},
        r"`cost` cannot be traced.*no parameter `stifness`; valid: `stiff",
    ),
    ("jax", {"cost": lambda x, u, p: jnp.log(x[0])}, r"`cost` returned nan at x = .*must return finite numbers"),
    ("jax", {"step": lambda x, u, p: x + np.random.normal()}, r"`step` is not deterministic.*supple\.Noise"),
    ("numpy", {"step": lambda x, u, p: x[..., :3]}, r"`step` returned an array of the shape \(1, 3\).*\(1, 4\)"),
    ("numpy", {"cost": lambda x, u, p: x}, r"`cost` returned an array of the shape \(1, 4\).*the shape \(1,\)"),
    ("numpy", {"step": lambda x, u, p: x.astype(np.float32)}, r"`step` returned an array of float32.*float64"),
    (
        "numpy",
        {"step": lambda x, u, p: (1e6 * (x + 1.0)).astype(int)},
        r"`step` returned int64, which has no derivatives",
    ),
    ("numpy", {"step": lambda x, u, p: None}, r"`step` returned None.*is `return` missing"),
    ("numpy", {"step": lambda x, u, p: "x"}, r"`step` returned an array of <U1: it must return float64"),
    ("numpy", {"step": lambda x, u, p: x * np.nan}, r"`step` returned .*nan.* finite numbers"),
    ("numpy", {"step": lambda x, u, p: x + np.random.normal()}, r"`step` is not deterministic"),
    (
        "numpy",
        {"cost": lambda x, u, p: np.full(len(x), x.sum())},
        r"`cost` returned .* for point . of a batch.*x\[\.\.\., 0\]",
    ),
    ("numpy", {"step": lambda x, u, p: np.multiply(x, 0.5, out=x)}, r"`step` writes into its arguments"),
]


@pytest.mark.parametrize(("backend", "functions", "message"), WRONG, ids=[f"{b}-{m[:40]}" for b, _, m in WRONG])
def test_functions_that_do_not_fit_are_refused(backend: str, functions: dict[str, Any], message: str) -> None:
    with pytest.raises(supple.UsageError, match=f"(?s){message}"):
        made(backend, **functions)


def test_functions_for_neither_say_why() -> None:
    def step(x: Any, u: Any, p: Any) -> Any:
        return [float(x[0]), *x[1:]]

    with pytest.raises(supple.UsageError, match="(?s)neither in JAX nor.*In JAX: `step` cannot be traced.*In NumPy"):
        made("auto", step=step)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"initial_state": [0.0, 0.0, 0.0, 1j]}, "initial_state: 1j is neither a number nor the name of a parameter"),
        ({"initial_state": [0.0]}, "initial_state has 1 numbers: 4 are needed"),
        ({"initial_state": [0.0, 0.0, 0.0, "stifness"]}, "initial_state: no parameter `stifness`"),
        ({"initial_control": [0.0, 1.0]}, r"initial_control has rows of \[2\] numbers: 1 are needed"),
        (
            {"initial_control": [[0.0]] * 7},
            "initial_control: must be one row of 1 number, or 60 such rows; found 7 rows",
        ),
        ({"initial_control": [float("nan")]}, "initial_control: nan is not finite"),
        ({"steps": 0}, "steps=0: a whole number of at least 1"),
        (
            {"noise": supple.Noise([1.0], [1.0] * 4, [1.0] * 2)},
            "task `balance`: noise.initial: must have 4 variances; found 1",
        ),
        (
            {"noise": supple.Noise([1.0] * 4, [[1.0, 0.0]] * 4, [1.0] * 2)},
            "noise: process has 4 rows of .* must be square",
        ),
        (
            {"noise": supple.Noise([1.0] * 4, [1.0] * 4, [[1.0, 0.5], [0.0, 1.0]])},
            r"noise.measurement\[1\]\[0\]: must be symmetric",
        ),
        ({"control_bounds": [(1.0, -1.0)]}, r"control_bounds\[0\]: the lower bound exceeds the upper one"),
        ({"planning": {"tolerence": 1.0}}, "unknown field `tolerence`"),
        ({"bound": "cost"}, "cost"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(supple.UsageError, match=message):
        cart_pole("numpy", **changed)


def test_covariances_may_differ_from_their_transposes_by_rounding() -> None:
    V = np.array([[1.0, 0.3], [np.nextafter(0.3, 1.0), 2.0]])
    assert cart_pole("numpy", noise=supple.Noise([1.0] * 4, [1.0] * 4, V)).evaluate(rollouts=0).feasible is not None
    V[1, 0] += 1e-9
    with pytest.raises(
        supple.UsageError, match=r"measurement\[1\]\[0\]: must be symmetric up to rounding: \[1\]\[0\] is 0.3"
    ):
        cart_pole("numpy", noise=supple.Noise([1.0] * 4, [1.0] * 4, V))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"backend": "torch"}, "backend='torch'"),
        ({"step": 3}, "step=3 is not a function"),
        ({"states": ["x", "x", "v", "w"]}, "a name occurs twice"),
        ({"states": "xavw"}, "names in a list"),
        ({"controls": 0}, "there must be at least one"),
        ({"parameters": {"stiffness": 3.0}}, r"`stiffness` is 3.0: declare it as supple\.Parameter"),
    ],
)
def test_models_that_do_not_fit_are_refused(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(supple.UsageError, match=message):
        supple.Model(
            **{
                "step": batch_step,
                "observe": batch_step,
                "cost": batch_cost,
                **CART_POLE,
                "backend": "numpy",
                **changed,
            }
        )


class Words(Exception):
    """An exception of the user's own."""


def failing_after(calls: int, function: Callable[..., Any], fail: Callable[[Any], Any]) -> Callable[..., Any]:
    """A function that goes wrong after so many calls."""
    counter = itertools.count()

    def step(x: Any, u: Any, p: Any) -> Any:
        found = function(x, u, p)
        return fail(found) if next(counter) >= calls else found

    return step


def words(_: Any) -> Any:
    raise Words("my own words")


STUDIES: dict[str, Callable[[supple.Task], Any]] = {
    "evaluate": lambda task: task.evaluate(gradient="total", rollouts=40),
    "design": lambda task: task.design(starts=4),
    "sweep": lambda task: task.sweep({"stiffness": np.geomspace(0.05, 0.3, 20)}),
    "robustness": lambda task: task.robustness(["start"], vary={"angle_variance": [1e-4, 1e-3]}),
}


def prepared(fail: Callable[[Any], Any], more: int) -> supple.Task:
    """A task whose step goes wrong after the checks and so many calls more."""
    calls = itertools.count()

    def counted(x: Any, u: Any, p: Any) -> Any:
        next(calls)
        return batch_step(x, u, p)

    made("numpy", step=counted)
    return made("numpy", step=failing_after(next(calls) + more, batch_step, fail))


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize("more", [0, 200])
def test_exceptions_reach_the_user_as_they_were(study: str, more: int) -> None:
    task = prepared(words, more)
    with pytest.raises(Words, match="my own words") as caught:
        STUDIES[study](task)
    frames = [frame.name for frame in traceback.extract_tb(caught.value.__traceback__)]
    assert "words" in frames and "step" in frames
    # The next call is not disturbed by the last exception.
    with pytest.raises(Words):
        task.evaluate()


def test_shapes_that_change_later_are_refused() -> None:
    with pytest.raises(supple.UsageError, match=r"`step` returned an array of the shape \(\d+, 3\)"):
        prepared(lambda found: found[..., :3], 30).evaluate()


def test_numbers_that_end_in_derivatives_are_refused() -> None:
    with pytest.raises(
        supple.UsageError, match="`step` are NaN at step 0, where x = .*must be finite along a trajectory"
    ):
        # Roll-outs stay one point at a time; batches are derivatives.
        made("numpy", step=lambda x, u, p: np.where(len(x) > 1000, np.nan, batch_step(x, u, p))).evaluate()


def test_one_design_without_numbers_does_not_end_the_others() -> None:
    """As with tasks of files: such a point of a sweep has an error, and such a design of a search counts as infinite."""
    model = supple.Model(
        step=lambda x, u, p: np.stack(
            [x[..., 0] + 0.1 * x[..., 1] * np.sqrt(p.k - 1), x[..., 1] + 0.1 * u[..., 0]], -1
        ),
        observe=lambda x, p: x[..., :1],
        cost=lambda x, u, p: x[..., 0] ** 2 + 0.1 * u[..., 0] ** 2,
        states=["position", "speed"],
        controls=1,
        measurements=1,
        parameters={
            "k": supple.Parameter(2.0, bounds=(0.5, 8.0)),
            "r": supple.Parameter(1e-3, bounds=(1e-5, 1e-1), scale="log"),
        },
        backend="numpy",
    )
    noise = supple.Noise(initial=[1e-2] * 2, process=[0.0, 1e-3], measurement=["r"])
    task = model.task(steps=20, time_step=0.1, initial_state=[1.0, 0.0], initial_control=[0.0], noise=noise, bound=12.0)
    with np.errstate(invalid="ignore"):
        swept = task.sweep({"k": "0.5:8:4"})
        errors = list(swept.table["error"])
        assert "finite" in errors[0] and not any(errors[1:]), errors
        assert task.design(starts=4).feasible
        with pytest.raises(
            supple.UsageError, match=r"`step` are NaN at step 0, where .*, k = 0\.5, r = 0\.001: they must"
        ):
            task.evaluate(k=0.5)
    # Nothing is left over for the next call.
    assert np.isfinite(task.evaluate().information.bits)


def test_derivatives_that_do_not_exist_are_refused() -> None:
    def cost(x: Any, u: Any, p: Any) -> Any:
        return cart_pole_cost(x, u, p) + jnp.sqrt(x[2] ** 2)

    task = made("jax", cost=cost)
    with pytest.raises(supple.UsageError, match="derivatives of `cost` are NaN at step 0, where x = .*square roots"):
        task.evaluate()


def test_a_first_guess_into_nothing_is_refused() -> None:
    def step(x: Any, u: Any, p: Any) -> Any:
        found = batch_step(x, u, p)
        return np.where(x[..., :1] > -0.4, np.nan, found)

    with pytest.raises(supple.UsageError, match=r"`step` returned \[nan.*at step \d+ under the first guess"):
        cart_pole_model("numpy", step=step).task(**{**BALANCE, "initial_control": [20.0]})

    def cost(x: Any, u: Any, p: Any) -> Any:
        return jnp.where(x[0] > -0.4, jnp.nan, cart_pole_cost(x, u, p))

    with pytest.raises(supple.UsageError, match=r"`cost` returned nan at step \d+ under the first guess"):
        cart_pole_model("jax", cost=cost).task(**{**BALANCE, "initial_control": [20.0]})


class Watched(Counting):
    """A backend whose roll-outs are remembered by their costs."""

    def __init__(self, backend: Any) -> None:
        super().__init__(backend)
        self.costs: list[float] = []

    def roll_out(self, *arguments: Any) -> Any:
        found = self.backend.roll_out(*arguments)
        self.costs.append(found[2])
        return found


def test_trials_of_the_line_search_may_fail() -> None:
    def step(x: Any, u: Any, p: Any) -> Any:
        return jnp.where(jnp.abs(u[0]) > 200.0, jnp.nan, two_mass_step(x, u, p))

    model = supple.Model(
        step=step,
        observe=two_mass_observe,
        cost=two_mass_cost,
        final_cost=two_mass_final_cost,
        backend="jax",
        **TWO_MASS,
    )
    task = model.task(**PRESS)
    watched = Watched(backend_of(task))
    report = with_backend(task, watched).evaluate().tasks["press"]
    assert not np.isfinite(watched.costs).all(), "no trial failed"
    assert report.status == "converged" and report.trajectory is not None
    assert np.abs(report.trajectory.u).max() < 200.0


def test_models_that_call_the_package_themselves_do_not_hang() -> None:
    inner = cart_pole("numpy")
    often = iter(range(3))

    def step(x: Any, u: Any, p: Any) -> Any:
        if len(x) > 1000 and next(often, None) is not None:
            inner.evaluate(trajectories=False)
        return batch_step(x, u, p)

    assert made("numpy", step=step).evaluate(trajectories=False).tasks["balance"].status == "converged"


def test_tasks_are_used_from_several_threads() -> None:
    task = cart_pole("jax")
    found: list[float] = []
    threads = [threading.Thread(target=lambda: found.append(task.evaluate().information.bits)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and len(set(found)) == 1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: supple.Parameter(float("nan"), (0.0, 1.0)), "initial=nan: a finite number"),
        (lambda: supple.Parameter(0.5, (0.0, 1.0), scale="Log"), 'scale=\'Log\': valid: "linear", "log"'),  # type: ignore[arg-type]
        (lambda: with_options(bound=float("nan")), r"tasks\[0\]\.bound: must be a finite number"),
        (lambda: with_options(planning={"max_iter": 3}), r"planning\.max_iter: unknown field `max_iter`"),
        (lambda: made("jax").design(information="usd"), "information: unknown variant `usd`"),
        (lambda: made("jax").robustness({}, vary={"length": [1.0]}), "designs is empty: name at least one"),
    ],
)
def test_wrong_options_are_named(call: Callable[[], Any], message: str) -> None:
    """Errors named a column of the text that is passed between the languages, or nothing."""
    with pytest.raises(supple.UsageError, match=message):
        call()


def with_options(**options: Any) -> supple.Task:
    return cart_pole_model("jax").task(**(BALANCE | options))


def encoder(x: Any, p: Any) -> Any:
    """An angle with a resolution of 1 mrad."""
    return jnp.round(1e3 * x[:1]) / 1e3


def wrapped(x: Any, p: Any) -> Any:
    """An angle between -pi and pi."""
    return x[:1] - 2 * jnp.pi * jnp.round(x[:1] / (2 * jnp.pi))


@pytest.mark.parametrize(
    ("observe", "doubted"), [(encoder, True), (wrapped, False), (lambda x, p: jnp.sin(x[:1]), False)]
)
def test_derivatives_that_miss_jumps_are_told_in_every_result(observe: Any, doubted: bool) -> None:
    model = supple.Model(
        step=lambda x, u, p: jnp.array([x[0] + 0.05 * x[1], x[1] + 0.05 * (u[0] - p.k * x[0])]),
        observe=observe,
        cost=lambda x, u, p: (x[0] - 1) ** 2 + 0.01 * u[0] ** 2,
        parameters={"k": supple.Parameter(1.0, (0.1, 5.0))},
        states=2,
        controls=1,
        measurements=1,
    )
    noise = supple.Noise([1e-3, 1e-3], [0, 1e-3], [1e-3])
    task = model.task(steps=10, time_step=0.05, initial_state=[0, 0], initial_control=[0.0], noise=noise)
    found = task.evaluate()
    assert [("miss its jumps (`round`)" in warning) for warning in found.warnings] == [True] * doubted
    assert bool(task.design(starts=1).warnings) == doubted


def test_doubtful_roll_outs_and_rough_derivatives_are_warnings() -> None:
    model = supple.Model(
        step=lambda x, u, p: np.round(np.stack([x[..., 0] + 0.05 * x[..., 1], x[..., 1] + 0.05 * u[..., 0]], -1), 6),
        observe=lambda x, p: x[..., :1],
        cost=lambda x, u, p: (x[..., 0] - 1) ** 2 + 0.01 * u[..., 0] ** 2,
        parameters={"k": supple.Parameter(1.0, (0.1, 5.0))},
        states=2,
        controls=1,
        measurements=1,
        backend="numpy",
    )
    noise = supple.Noise([1e-3, 1e-3], [0, 1e-3], [1e-3])
    task = model.task(steps=20, time_step=0.05, initial_state=[0, 0], initial_control=[0.0], noise=noise)
    found = task.evaluate(rollouts=50)
    trust = found.tasks["task"].trust
    assert trust is not None and trust.verdict != "holds"
    assert len(found.warnings) == 1 + len(trust.reasons) and "relative error of" in found.warnings[0]


def test_a_parameter_that_nothing_reads_is_told(caplog: pytest.LogCaptureFixture) -> None:
    model = supple.Model(
        step=lambda x, u, p: x + 0.1 * p.gain * u,
        observe=lambda x, p: x,
        cost=lambda x, u, p: 0.01 * u @ u,
        final_cost=lambda x, p: x @ x,
        states=1,
        controls=1,
        measurements=1,
        parameters={
            "gain": supple.Parameter(1.0, bounds=(0.5, 2.0)),
            "variance": supple.Parameter(0.1, bounds=(0.01, 1.0)),
            "idle": supple.Parameter(3.0, bounds=(1.0, 20.0)),
        },
    )
    noise = supple.Noise(initial=[1e-2], process=[1e-4], measurement=["variance"])
    task = model.task(
        name="go", steps=20, time_step=0.1, initial_state=[1.0], initial_control=[0.0], noise=noise, bound=2.0
    )
    assert task.warnings == ["parameter `idle` is declared but never used"]
    assert task.warnings[0] in caplog.text
