"""Linear problems from arrays and from state-space objects."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import supple

Array = NDArray[np.float64]

N = 20
FILE = f"""
[model]
kind = "linear"
A = [[1.0, 0.1], [-0.2, 0.9]]
B = [[0.0], [0.3]]
C = [[1.0, 0.0]]
[[tasks]]
name = "hold"
steps = {N}
time_step = 0.1
bound = 50.0
initial_state = [1.0, -0.5]
initial_control = [0.0]
noise = {{ initial = [0.1, 0.2], process = [[0.02, 0.01], [0.01, 0.03]], measurement = [0.05] }}
[[tasks.costs]]
kind = "quadratic"
Q = [[1.0, 0.3], [0.3, 0.7]]
R = [[0.2]]
final = [[5.0, 0.0], [0.0, 1.0]]
"""

#: The arrays of that file.
ARRAYS: dict[str, Any] = {
    "A": [[1.0, 0.1], [-0.2, 0.9]],
    "B": [[0.0], [0.3]],
    "C": [[1.0, 0.0]],
    "W": [[0.02, 0.01], [0.01, 0.03]],
    "V": [[0.05]],
    "X0": [0.1, 0.2],
    "Q": [[1.0, 0.3], [0.3, 0.7]],
    "R": [[0.2]],
    "QN": [[5.0, 0.0], [0.0, 1.0]],
    "x0": [1.0, -0.5],
}
OPTIONS: dict[str, Any] = {"time_step": 0.1, "bound": 50.0, "name": "hold"}


def made(**changes: Any) -> supple.Task:
    """The task of these arrays with some changed; those that are changed to ``None`` are left out."""
    given = {**ARRAYS, "N": N, **OPTIONS, **changes}
    return supple.linear(**{key: value for key, value in given.items() if value is not None})


def repeated(name: str) -> Array:
    """An array once for each step, or for each measurement."""
    return np.repeat(np.asarray(ARRAYS[name])[np.newaxis], N + 1 if name in "CV" else N, axis=0)


def report(task: supple.Task, **options: Any) -> Any:
    return task.evaluate(**options).tasks["hold"]


@pytest.fixture(scope="module")
def from_file(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path: Path = tmp_path_factory.mktemp("linear") / "task.toml"
    path.write_text(FILE)
    return report(supple.load(path))


def test_numbers_are_those_of_the_same_task_file(from_file: Any) -> None:
    each = {name: repeated(name) for name in "ABCWVQR"}
    for task in (made(), made(N=None, **each), made(A=repeated("A")), made(W=repeated("W"), V=repeated("V"))):
        found = report(task)
        assert found.information.per_step_nats.tolist() == from_file.information.per_step_nats.tolist()
        for part in ("belief", "process", "initial"):
            assert getattr(found.cost, part) == getattr(from_file.cost, part), part
        assert found.trajectory.K.tolist() == from_file.trajectory.K.tolist()
        assert found.cost.nominal == pytest.approx(from_file.cost.nominal, rel=1e-14)
        assert found.cost.bound == 50.0
        assert found.trajectory.t[-1] == pytest.approx(2.0)


def test_time_varying_filter_and_controller_are_those_of_textbooks() -> None:
    rng = np.random.default_rng(1)
    n, m, p = 3, 2, 2

    def spd(count: int, order: int) -> Array:
        factor = rng.normal(size=(count, order, order))
        return factor @ factor.transpose(0, 2, 1) + 0.3 * np.eye(order)

    A, B, C = rng.normal(size=(N, n, n)) / 2, rng.normal(size=(N, n, m)), rng.normal(size=(N + 1, p, n))
    W, V, X0, Q, R, QN = spd(N, n), spd(N + 1, p), spd(1, n)[0], spd(N, n), spd(N, m), spd(1, n)[0]
    task = supple.linear(A, B, C, W, V, X0, Q, R, QN=QN, x0=np.ones(n))
    found: Any = task.evaluate(rollouts=4000).tasks["linear"]

    gains, s = np.empty((N, m, n)), QN
    process = 0.0
    for t in reversed(range(N)):
        process += np.trace(s @ W[t])
        gains[t] = -np.linalg.solve(R[t] + B[t].T @ s @ B[t], B[t].T @ s @ A[t])
        s = Q[t] + A[t].T @ s @ (A[t] + B[t] @ gains[t])
    nats, P = [], X0
    for t in range(N + 1):
        innovation = C[t] @ P @ C[t].T + V[t]
        nats.append(0.5 * np.log(np.linalg.det(innovation) / np.linalg.det(V[t])))
        P = P - P @ C[t].T @ np.linalg.solve(innovation, C[t] @ P)
        if t < N:
            P = A[t] @ P @ A[t].T + W[t]

    assert np.allclose(found.trajectory.K, gains, rtol=1e-10, atol=1e-12)
    assert np.allclose(found.information.per_step_nats, nats, rtol=1e-10)
    assert found.cost.process == pytest.approx(process, rel=1e-11)
    assert found.cost.initial == pytest.approx(np.trace(s @ X0), rel=1e-11)
    assert found.cost.nominal == pytest.approx(np.ones(n) @ s @ np.ones(n), rel=1e-11)
    assert abs(found.monte_carlo.difference) < 4 * found.monte_carlo.cost_standard_error


def test_long_tasks_are_stationary_lqg_of_the_riccati_equations() -> None:
    linalg = pytest.importorskip("scipy.linalg")
    A, B, C, Q, R = (np.array(ARRAYS[name]) for name in "ABCQR")
    W, V = np.array(ARRAYS["W"]), np.array(ARRAYS["V"])
    S = linalg.solve_discrete_are(A, B, Q, R)
    P = linalg.solve_discrete_are(A.T, C.T, W, V)
    gain = -np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)
    innovation = C @ P @ C.T + V
    sigma = P - P @ C.T @ np.linalg.solve(innovation, C @ P)
    xi = gain.T @ (R + B.T @ S @ B) @ gain
    steps = 200
    found = report(made(N=steps, QN=S, X0=P, x0=[0.0, 0.0]))
    nats = 0.5 * np.log(np.linalg.det(innovation) / np.linalg.det(V))
    assert np.allclose(found.information.per_step_nats, nats, rtol=1e-10)
    assert found.information.bits_per_second == pytest.approx(nats / np.log(2) / 0.1, rel=1e-10)
    assert np.allclose(found.trajectory.K, gain, rtol=1e-9)
    assert found.cost.expected == pytest.approx(steps * np.trace(S @ W + xi @ sigma) + np.trace(S @ P), rel=1e-10)


def test_an_unstable_plant_with_a_mean_is_planned_over_a_long_horizon() -> None:
    task = supple.linear([[1.1]], [[1]], [[1]], [[1]], [[1]], [[1]], [[1]], [[1]], x0=[1e-3], N=4000)
    found = task.evaluate(rollouts=0)
    assert found.feasible and not found.warnings
    s = 0.5 * (1.21 + np.sqrt(1.21**2 + 4.0))
    assert found.tasks["linear"].cost.nominal == pytest.approx(1e-6 * s, rel=1e-9)


def test_a_plan_that_is_no_strict_minimum_says_why() -> None:
    task = supple.linear(
        [[1, 0.1], [0, 1]],
        [[0, 0], [0.1, 0.1]],
        [[1, 0]],
        1e-3 * np.eye(2),
        [[1e-3]],
        1e-2 * np.eye(2),
        np.eye(2),
        np.zeros((2, 2)),
        x0=[1, 0],
        N=5,
    )
    (warning,) = task.evaluate(rollouts=0).warnings
    assert "no strict minimum" in warning and "R + B'SB" in warning


def test_every_optional_term_counts() -> None:
    rng = np.random.default_rng(2)
    terms = {
        "c": rng.normal(size=(N, 2)),
        "d": rng.normal(size=(N + 1, 1)),
        "S": 0.1 * rng.normal(size=(2, 1)),
        "q": rng.normal(size=2),
        "r": rng.normal(size=(N, 1)),
        "qN": rng.normal(size=2),
    }
    found = report(made(**terms), rollouts=4000)
    x, u = found.trajectory.x, found.trajectory.u
    A, B, Q, R, QN = (np.array(ARRAYS[name]) for name in ("A", "B", "Q", "R", "QN"))
    assert np.allclose(x[1:], x[:-1] @ A.T + u @ B.T + terms["c"], rtol=1e-12, atol=1e-13)
    stages = np.einsum("ti,ij,tj->", x[:-1], Q, x[:-1]) + np.einsum("ti,ij,tj->", u, R, u)
    stages += 2 * np.einsum("ti,ij,tj->", x[:-1], terms["S"], u) + (x[:-1] @ terms["q"]).sum() + (u * terms["r"]).sum()
    assert found.cost.nominal == pytest.approx(stages + x[-1] @ QN @ x[-1] + terms["qN"] @ x[-1], rel=1e-12)
    # What is measured besides the state is known, and changes nothing: if the filter forgot it, runs would cost more.
    assert abs(found.monte_carlo.difference) < 4 * found.monte_carlo.cost_standard_error
    assert report(made(**{**terms, "d": None})).cost.expected == found.cost.expected


def test_controls_keep_their_bounds_and_channels_their_names() -> None:
    free = report(made())
    task = made(control_bounds=[(-0.1, np.inf)], states={"q": "m", "v": "m/s"}, controls=["force"], measurements=["q"])
    found = report(task)
    assert free.trajectory.u.min() < -0.1 <= found.trajectory.u.min()
    assert list(found.trajectory.measurements) == ["q"]
    assert found.trajectory.state_names == ["q", "v"] and found.trajectory.state_units == ["m", "m/s"]
    assert found.trajectory.control_names == ["force"]


def test_tasks_are_pickled_and_results_kept(tmp_path: Path) -> None:
    task = made()
    again = pickle.loads(pickle.dumps(task))
    assert report(again).trajectory.x.tolist() == report(task).trajectory.x.tolist()
    found = task.evaluate()
    found.save(tmp_path / "kept")
    assert supple.load_result(tmp_path / "kept").to_json() == found.to_json()
    assert task.parameters == {}


def test_tasks_stay_what_they_are_when_arrays_change() -> None:
    A = np.array(ARRAYS["A"])
    task = made(A=A)
    before = report(task).trajectory.x.tolist()
    A[:] = 0.0
    assert report(task).trajectory.x.tolist() == before
    assert report(pickle.loads(pickle.dumps(task))).trajectory.x.tolist() == before


def test_there_is_nothing_to_design() -> None:
    with pytest.raises(supple.SuppleError, match="design"):
        made().design(starts=1)


MISUSE: list[tuple[dict[str, Any], str]] = [
    ({"A": [1.0, 2.0]}, r"A has the shape \(2,\): it must be \(n, n\) or \(N, n, n\)"),
    ({"A": [[1.0, 2.0, 3.0]] * 2}, r"A has the shape \(2, 3\): it must be \(n, n\) = \(3, 3\)"),
    ({"A": [[1.0, 2.0], [3.0]]}, "A is no array: its rows have different lengths"),
    ({"A": np.eye(2) * 1j}, "A holds complex128: it must hold real numbers"),
    ({"A": [["a", "b"]] * 2}, "A holds <U1: it must hold real numbers"),
    ({"A": [[1.0, np.nan], [0.0, 1.0]]}, r"A\[0, 1\] is nan: it must be finite"),
    ({"A": np.ones((7, 2, 2))}, r"A has the length 7 along the time: it must be N = 20, as N = 20 by the argument N"),
    ({"A": np.ones((0, 2, 2))}, r"A has the shape \(0, 2, 2\)"),
    ({"N": None}, "say how many steps there are"),
    ({"N": 0}, "N=0: a whole number of at least 1"),
    ({"N": 2.5}, "N=2.5: a whole number of at least 1"),
    ({"B": [0.0, 0.3]}, r"B has the shape \(2,\): it must be \(n, m\) or \(N, n, m\)"),
    ({"B": [[0.0], [0.3], [1.0]]}, r"B has the shape \(3, 1\): it must be \(n, m\) = \(2, 1\)"),
    (
        {"C": np.ones((N, 1, 2))},
        r"C has the length 20 along the time: it must be N\+1 = 21, as N = 20 by the argument N",
    ),
    (
        {"A": np.ones((5, 2, 2)), "C": np.ones((5, 1, 2)), "N": None},
        r"must be N\+1 = 6, as N = 5 by the shape of A",
    ),
    ({"c": [1.0]}, r"c has the shape \(1,\): it must be \(n,\) = \(2,\), or \(N, n\) = \(N, 2\) for N steps"),
    ({"S": [[1.0, 2.0]]}, r"S has the shape \(1, 2\): it must be \(n, m\) = \(2, 1\)"),
    ({"qN": np.ones((3, 2))}, r"qN has the shape \(3, 2\): it must be \(n,\) = \(2,\)"),
    ({"x0": [1.0]}, r"x0 has the shape \(1,\): it must be \(n,\) = \(2,\)"),
    ({"W": [0.1]}, "W has 1 variances: it must have 2"),
    ({"W": [[1.0, 0.5], [0.4, 1.0]]}, r"W\[1\]\[0\]: must be symmetric; found 0.4, and 0.5 across the diagonal"),
    ({"W": [[1e-10, 0.0], [1e-11, 1.0]]}, r"W\[1\]\[0\]: must be symmetric; found 1e-11, and 0 across the diagonal"),
    ({"W": [[1.0, 2.0], [2.0, 1.0]]}, "W: must be positive semidefinite; its leading 2 x 2 block is not"),
    ({"W": -np.ones((N, 2, 2))}, r"W\[0\]: must be positive semidefinite; its leading 1 x 1 block is not"),
    ({"V": [0.0]}, "V: must be positive definite; its leading 1 x 1 block is not"),
    ({"X0": [-1.0, 1.0]}, "X0: must be positive semidefinite; its leading 1 x 1 block is not"),
    ({"X0": np.ones((N, 2, 2))}, r"X0 has the shape \(20, 2, 2\): it must be \(n, n\) = \(2, 2\)"),
    ({"R": [[-1.0]]}, "Q and R are not positive semidefinite: the least eigenvalue is -1"),
    ({"S": [[9.0], [9.0]]}, r"\[\[Q, S\], \[S', R\]\] is not positive semidefinite"),
    ({"QN": [[-1.0, 0.0], [0.0, 1.0]]}, "QN has the eigenvalue -1: it must be positive semidefinite"),
    ({"time_step": 0.0}, "time_step=0.0: a number above 0"),
    ({"time_step": "x"}, "time_step='x': a number"),
    ({"bound": np.inf}, "bound=inf: a finite number"),
    ({"control_bounds": [(0.0, 1.0), (0.0, 1.0)]}, "control_bounds has 2 pairs: there are 1 controls"),
    ({"control_bounds": [(np.nan, 1.0)]}, "a bound is nan; plus or minus infinity for none"),
    ({"states": ["q", ""]}, "states: '' is no name"),
    ({"name": "a\nb"}, r"name of the task: 'a\\nb' is no name: valid: text in one line, not empty"),
    ({"control_bounds": [(1.0, 0.0)]}, r"control_bounds\[0\]: the lower bound exceeds the upper one: \[1, 0\]"),
    ({"states": ["q"]}, "states has 1 names: there are 2 states"),
    ({"states": ["q", "q"]}, "a name occurs twice"),
    ({"planning": {"toleranze": 1.0}}, "toleranze"),
]


@pytest.mark.parametrize(("changes", "message"), MISUSE, ids=[message[:40] for _, message in MISUSE])
def test_misuse_says_what_is_wrong_and_what_is_valid(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(supple.UsageError, match=message):
        made(**changes)


def test_labelled_arrays_go_where_their_labels_belong() -> None:
    import pandas as pd

    states = {"position": "m", "speed": "m/s"}
    arrays = ARRAYS | {"states": states, "controls": ["force"], "measurements": ["encoder"], "N": N, "time_step": 0.1}
    plain = supple.linear(**arrays).evaluate(rollouts=0).tasks["linear"]
    turned = ["speed", "position"]
    frame = pd.DataFrame(ARRAYS["A"], index=list(states), columns=list(states)).loc[turned, turned]
    B = pd.DataFrame(ARRAYS["B"], index=list(states), columns=["force"]).loc[turned]
    C = pd.DataFrame(ARRAYS["C"], index=["encoder"], columns=list(states))[turned]
    x0 = pd.Series(ARRAYS["x0"], index=list(states))[turned]
    W = pd.DataFrame(ARRAYS["W"], index=list(states), columns=list(states)).loc[turned]
    labelled = arrays | {"A": frame, "B": B, "C": C, "W": W, "x0": x0}
    found = supple.linear(**labelled).evaluate(rollouts=0).tasks["linear"]
    assert found.cost.expected == plain.cost.expected
    assert found.information.total_bits == plain.information.total_bits
    # Without names, those of the first array.
    own = {key: value for key, value in labelled.items() if key not in ("states", "controls", "measurements")}
    own |= {"W": np.array(ARRAYS["W"])[::-1, ::-1], "Q": np.array(ARRAYS["Q"])[::-1, ::-1], "X0": np.array([0.2, 0.1])}
    own |= {"QN": np.array(ARRAYS["QN"])[::-1, ::-1]}
    task = supple.linear(**own)
    assert task.linearise().states.shape == (N + 1, 2)
    assert [channel["name"] for channel in task._native.channels("linear")["states"]] == turned
    assert task.evaluate(rollouts=0).tasks["linear"].cost.expected == pytest.approx(plain.cost.expected, rel=1e-12)
    with pytest.raises(
        supple.UsageError, match="W: its columns are labelled `a`, `b`, but the states are `position`, `speed`"
    ):
        supple.linear(**arrays | {"W": pd.DataFrame(ARRAYS["W"], index=list(states), columns=["a", "b"])})


def test_rounding_does_not_make_a_covariance_wrong() -> None:
    W = np.array(ARRAYS["W"])
    nearly = W + np.array([[0.0, 1e-17], [0.0, 0.0]])
    assert report(made(W=nearly)).cost.process == pytest.approx(report(made()).cost.process, rel=1e-14)
    wide = {"B": np.eye(2), "C": np.eye(2), "R": np.eye(2), "V": np.eye(2)}
    for name in ("W", "V", "X0", "Q", "R", "QN"):
        root = np.random.default_rng(3).normal(size=(2, 7))
        exact = 0.5 * (root @ root.T + (root @ root.T).T)
        off = exact + np.triu(np.spacing(np.abs(exact)), 1)
        assert off[0, 1] != off[1, 0]
        found, expected = (report(made(**{**wide, name: given})) for given in (off, exact))
        assert found.cost.expected == pytest.approx(expected.cost.expected, rel=1e-12), name
        assert found.information.total_nats == pytest.approx(expected.information.total_nats, rel=1e-12), name
        with pytest.raises(
            supple.UsageError, match=rf"{name}\[1\]\[0\]: must be symmetric; found .* across the diagonal"
        ):
            made(**{**wide, name: exact + np.triu(np.full((2, 2), 1e-9), 1)})
    thin = np.array([[1.0], [1.0 / 3.0]])
    assert report(made(W=thin @ thin.T)).information.total_nats > 0


# -- State-space objects ---------------------------------------------------------------------------------------------

OSCILLATOR = ([[0.0, 1.0], [-4.0, -0.4]], [[0.0], [2.0]], [[1.0, 0.0]], [[0.0]])
STEP = 0.05
COSTS: dict[str, Any] = {
    "W": [0.0, 1e-3],
    "V": [1e-2],
    "X0": [0.1, 0.1],
    "Q": np.eye(2),
    "R": [[0.1]],
    "x0": [1.0, 0.0],
}


def oscillator(time_step: float) -> tuple[Array, Array]:
    """The oscillator over a time step with its control held, by its eigenvalues."""
    A, B = np.array(OSCILLATOR[0]), np.array(OSCILLATOR[1])
    values, vectors = np.linalg.eig(A)
    held = (vectors @ np.diag(np.exp(values * time_step)) @ np.linalg.inv(vectors)).real
    return held, np.linalg.solve(A, held - np.eye(2)) @ B


def report_of(task: supple.Task) -> Any:
    return task.evaluate().tasks["linear"]


def expected() -> Any:
    A, B = oscillator(STEP)
    task = supple.linear(A, B, OSCILLATOR[2], **COSTS, N=N, time_step=STEP)
    return report_of(task)


def check(task: supple.Task) -> Any:
    found, wanted = report_of(task), expected()
    assert found.information.bits_per_second == pytest.approx(wanted.information.bits_per_second, rel=1e-12)
    assert found.cost.expected == pytest.approx(wanted.cost.expected, rel=1e-12)
    assert np.allclose(found.trajectory.x, wanted.trajectory.x, rtol=1e-10, atol=1e-12)
    return found


def test_systems_of_python_control() -> None:
    control = pytest.importorskip("control")
    labels = {"states": ["angle", "rate"], "inputs": ["torque"], "outputs": ["seen"]}
    continuous = control.ss(*OSCILLATOR, **labels)
    found = check(supple.from_state_space(continuous, **COSTS, N=N, time_step=STEP))
    assert found.trajectory.state_names == ["angle", "rate"]
    assert found.trajectory.control_names == ["torque"]
    assert list(found.trajectory.measurements) == ["seen"]
    other = supple.from_state_space(continuous, **COSTS, N=N, time_step=STEP, states=["a", "b"])
    assert report_of(other).trajectory.state_names == ["a", "b"]

    discrete = control.ss(*oscillator(STEP), *OSCILLATOR[2:], STEP)
    check(supple.from_state_space(discrete, **COSTS, N=N))
    unsaid = control.ss(*oscillator(STEP), *OSCILLATOR[2:], True)
    check(supple.from_state_space(unsaid, **COSTS, N=N, time_step=STEP))

    misuse: list[tuple[Any, dict[str, Any], str]] = [
        (continuous, {}, "the system is in continuous time: give time_step, s"),
        (unsaid, {}, "the system does not say its time step: give time_step, s"),
        (discrete, {"time_step": 0.1}, "time_step=0.1, but that of the system is 0.05: leave time_step out"),
        (control.ss(*OSCILLATOR, None), {"time_step": STEP}, "does not say whether its time is continuous"),
        (control.tf([1.0], [1.0, 2.0]), {"time_step": STEP}, r"it must be a control.StateSpace, .* control.ss\(sys\)"),
    ]
    for system, options, message in misuse:
        with pytest.raises(supple.UsageError, match=message):
            supple.from_state_space(system, **COSTS, N=N, **options)


def test_systems_of_scipy() -> None:
    signal = pytest.importorskip("scipy.signal")
    for kind in (signal.StateSpace, signal.lti):
        check(supple.from_state_space(kind(*OSCILLATOR), **COSTS, N=N, time_step=STEP))
    for kind in (signal.StateSpace, signal.dlti):
        check(supple.from_state_space(kind(*oscillator(STEP), *OSCILLATOR[2:], dt=STEP), **COSTS, N=N))
    unsaid = signal.dlti(*oscillator(STEP), *OSCILLATOR[2:])
    check(supple.from_state_space(unsaid, **COSTS, N=N, time_step=STEP))


def test_misuse_of_state_space_objects() -> None:
    signal = pytest.importorskip("scipy.signal")
    through = signal.StateSpace(*OSCILLATOR[:3], [[0.5]])
    with pytest.raises(supple.UsageError, match=r"D\[0, 0\] of the system is 0.5: it must be 0"):
        supple.from_state_space(through, **COSTS, N=N, time_step=STEP)
    with pytest.raises(supple.UsageError, match="time_step=-1.0: a number above 0, s"):
        supple.from_state_space(signal.StateSpace(*OSCILLATOR), **COSTS, N=N, time_step=-1.0)
    with pytest.raises(supple.UsageError, match="sys is a builtins.tuple: it must be a control.StateSpace"):
        supple.from_state_space(OSCILLATOR, **COSTS, N=N, time_step=STEP)
    with pytest.raises(supple.UsageError, match=r"W has 3 variances: it must have 2"):
        supple.from_state_space(signal.StateSpace(*OSCILLATOR), **{**COSTS, "W": [1.0] * 3}, N=N, time_step=STEP)
    unstable = signal.StateSpace([[1e6]], [[1.0]], [[1.0]], [[0.0]])
    with pytest.raises(supple.UsageError, match="system overflows"):
        supple.from_state_space(unstable, [1.0], [1.0], [1.0], [[1.0]], [[1.0]], N=N, time_step=1.0)


#: A plant that is kept where it is, with a control whose bounds do not let it act, or only one way.
UNSTABLE: dict[str, Any] = {
    "A": [[1.0, 0.1], [0.0, 1.1]],
    "C": [[1.0, 0.0]],
    "W": np.diag([1e-6, 1e-4]),
    "V": [[1e-3]],
    "X0": 1e-2 * np.eye(2),
    "Q": np.eye(2),
    "R": [[0.1]],
    "N": 30,
}


def test_a_control_between_equal_bounds_is_no_control() -> None:
    def found(push: float, bounds: list[tuple[float, float]] | None) -> supple.TaskReport:
        task = supple.linear(B=[[0.0], [push]], **UNSTABLE, control_bounds=bounds)
        (report,) = task.evaluate(rollouts=200).tasks.values()
        return report

    none, pinned = found(0.0, None), found(0.1, [(0.0, 0.0)])
    assert pinned.cost.expected == pytest.approx(none.cost.expected, rel=1e-12)
    assert pinned.information.used is not None and pinned.information.used.total_bits == 0.0
    assert pinned.monte_carlo is not None and none.monte_carlo is not None
    assert pinned.monte_carlo.cost_mean == pytest.approx(none.monte_carlo.cost_mean, rel=1e-12)


def test_feedback_that_bounds_cut_off_is_told() -> None:
    task = supple.linear(B=[[0.0], [0.1]], **UNSTABLE, control_bounds=[(0.0, np.inf)])
    (warning,) = task.evaluate(rollouts=0).warnings
    assert "lies at its bound at 29 of 30 steps" in warning or "lies at its bound at 30 of 30 steps" in warning


@pytest.mark.parametrize("offset", [0.0, 1.0, 20.0, 100.0])
def test_verdicts_do_not_depend_on_what_the_plan_costs(offset: float) -> None:
    """The cost of noise is 40 times what is expected, as a bound cuts the feedback off; the plan may cost far more than that."""
    jnp = pytest.importorskip("jax.numpy")
    model = supple.Model(
        step=lambda x, u, p: jnp.asarray(UNSTABLE["A"]) @ x + jnp.array([0.0, 0.1]) * u[0],
        observe=lambda x, p: x[:1],
        cost=lambda x, u, p: offset + x @ x + 0.1 * u[0] ** 2,
        final_cost=lambda x, p: x @ x,
        states=2,
        controls=1,
        measurements=1,
        parameters={},
    )
    noise = supple.Noise(initial=[0.01, 0.01], process=[1e-6, 1e-4], measurement=[1e-3])
    start: dict[str, Any] = {"initial_state": [0.0, 0.0], "initial_control": [0.0]}
    task = model.task(name="hold", steps=30, time_step=1.0, noise=noise, control_bounds=[(0.0, np.inf)], **start)
    trust = task.evaluate(rollouts=1000).tasks["hold"].trust
    assert trust is not None and trust.verdict != "holds"
