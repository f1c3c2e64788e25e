"""crocoddyl (PyPI: crocoddyl) on the arm and the door of models/iiwa14_door.urdf: 16 states, 8 controls.

Times, by one step: `calcDiff`, the linearisation of dynamics and costs; `backwardPass`, the Riccati sweep on a random
linear-quadratic problem of 16 states and 7 controls; and, as a whole, `iteration` of SolverFDDP. The arm reaches for a
pose, without gravity; there is no coupling between arm and door.
"""
import argparse
import pathlib
import statistics
import time

from common import emit, timeit
import crocoddyl
import numpy as np
import pinocchio as pin

ROBOT = pathlib.Path(__file__).resolve().parents[2] / "models/iiwa14_door.urdf"
HAND = "iiwa_link_7"
START = np.array([0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0, 0.0])
GOAL = np.array([0.8, 0.3, -0.3, -1.5, 0.4, 1.0, 0.2, 0.0])
# Weights of pose, state and control: in every stage, and at the end.
STAGE = {"pose": 1.0, "state": 1e-2, "control": 1e-4}
END = {"pose": 1e2, "state": 1e-1}


class Stamps(crocoddyl.CallbackAbstract):
    """When each iteration ended, and how far it stepped."""

    def __init__(self):
        crocoddyl.CallbackAbstract.__init__(self)
        self.times, self.lengths = [time.perf_counter()], []

    def __call__(self, solver):
        self.times.append(time.perf_counter())
        self.lengths.append(solver.stepLength)


def reaching(steps, time_step):
    """The arm goes from START to the pose that its hand has at GOAL, and the door stays."""
    model = pin.buildModelFromUrdf(str(ROBOT))
    model.gravity.linear = np.zeros(3)
    data, hand = model.createData(), model.getFrameId(HAND)
    pin.framesForwardKinematics(model, data, GOAL)
    start = np.concatenate([START, np.zeros(model.nv)])
    state = crocoddyl.StateMultibody(model)
    actuation = crocoddyl.ActuationModelFull(state)
    residuals = {
        "pose": crocoddyl.ResidualModelFramePlacement(state, hand, data.oMf[hand].copy(), actuation.nu),
        "state": crocoddyl.ResidualModelState(state, start, actuation.nu),
        "control": crocoddyl.ResidualModelControl(state, actuation.nu),
    }

    def action(weights, dt):
        costs = crocoddyl.CostModelSum(state, actuation.nu)
        for name, weight in weights.items():
            costs.addCost(name, crocoddyl.CostModelResidual(state, residuals[name]), weight)
        dynamics = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, actuation, costs)
        return crocoddyl.IntegratedActionModelEuler(dynamics, dt)

    return crocoddyl.ShootingProblem(start, [action(STAGE, time_step)] * steps, action(END, 0.0))


def linear_quadratic(steps, states, controls):
    """A random linear-quadratic problem."""
    random = np.random.default_rng(0)
    a = np.eye(states) + 0.02 * random.standard_normal((states, states))
    b = 0.1 * random.standard_normal((states, controls))
    weights = np.eye(states), 0.1 * np.eye(controls), np.zeros((states, controls))
    affine = np.zeros(states), 0.1 * np.ones(states), np.zeros(controls)
    action = crocoddyl.ActionModelLQR(a, b, *weights, *affine)
    return crocoddyl.ShootingProblem(np.ones(states), [action] * steps, action)


def time_iterations(problem, solves):
    """Prints the times of all iterations of whole solves from rest; gives the last solver."""
    controls = [np.zeros(problem.runningModels[0].nu)] * problem.T
    states = list(problem.rollout(controls))
    times, lengths = [], []
    for _ in range(solves):
        solver, stamps = crocoddyl.SolverFDDP(problem), Stamps()
        solver.th_stop = 1e-6
        solver.setCallbacks([stamps])
        stamps.times = [time.perf_counter()]
        solver.solve(states, controls, 500, True)
        times += np.diff(stamps.times).tolist()
        lengths += stamps.lengths
    stats = {"n": len(times), "min_us": min(times) * 1e6, "median_us": statistics.median(times) * 1e6}
    emit("crocoddyl", "iteration", stats, steps=problem.T, full_steps=sum(length == 1.0 for length in lengths))
    return solver


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--dt", type=float, default=0.001)
    parser.add_argument("--reps", type=int, default=50)
    parser.add_argument("--solves", type=int, default=3)
    options = parser.parse_args()
    size = {"steps": options.steps, "version": crocoddyl.__version__}

    problem = reaching(options.steps, options.dt)
    problem.nthreads = 1
    solver = time_iterations(problem, options.solves)
    states, controls = solver.xs, solver.us
    problem.calc(states, controls)
    stats = timeit(lambda: problem.calcDiff(states, controls), options.reps, options.steps)
    emit("crocoddyl", "calcDiff", stats, **size)

    problem = linear_quadratic(options.steps, 16, 7)
    problem.nthreads = 1
    solver = crocoddyl.SolverFDDP(problem)
    states = [problem.x0] * (options.steps + 1)
    solver.solve(states, problem.quasiStatic(states[:-1]), 1, False)
    problem.calc(solver.xs, solver.us)
    problem.calcDiff(solver.xs, solver.us)
    emit("crocoddyl", "backwardPass", timeit(solver.backwardPass, options.reps, options.steps), **size)


if __name__ == "__main__":
    main()
