"""crocoddyl on any robot: the parts of one iteration, and nothing of a robot's damping, friction and springs.

    python benches/peers/crocoddyl_robot.py FILE.urdf [--steps 200] [--dt 0.001] [--reps 30]

The robot is fixed in the world, has gravity and a drive on every joint, and goes to 0.2 rad or m in all joints. Prints a
line of JSON for each of `calcDiff`, `backwardPass`, `forwardPass`, and their sum; times are of all steps.
"""
import argparse

from common import emit, timeit
import crocoddyl
import numpy as np
import pinocchio as pin


def reaching(file, steps, time_step):
    model = pin.buildModelFromUrdf(file)
    state = crocoddyl.StateMultibody(model)
    actuation = crocoddyl.ActuationModelFull(state)
    start = np.concatenate([pin.neutral(model), np.zeros(model.nv)])
    goal = start.copy()
    goal[: model.nq] = pin.integrate(model, pin.neutral(model), np.full(model.nv, 0.2))

    def action(state_weight, control_weight, dt):
        costs = crocoddyl.CostModelSum(state, actuation.nu)
        residual = crocoddyl.ResidualModelState(state, goal, actuation.nu)
        costs.addCost("state", crocoddyl.CostModelResidual(state, residual), state_weight)
        if control_weight:
            effort = crocoddyl.ResidualModelControl(state, actuation.nu)
            costs.addCost("control", crocoddyl.CostModelResidual(state, effort), control_weight)
        dynamics = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, actuation, costs)
        return crocoddyl.IntegratedActionModelEuler(dynamics, dt)

    return crocoddyl.ShootingProblem(start, [action(1.0, 1e-4, time_step)] * steps, action(1e3, 0.0, 0.0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--dt", type=float, default=0.001)
    parser.add_argument("--reps", type=int, default=30)
    options = parser.parse_args()
    problem = reaching(options.file, options.steps, options.dt)
    problem.nthreads = 1
    size = {"steps": options.steps, "states": problem.x0.size, "version": crocoddyl.__version__}
    solver = crocoddyl.SolverFDDP(problem)
    states = [problem.x0] * (options.steps + 1)
    solver.solve(states, problem.quasiStatic(states[:-1]), 1, False)
    states, controls = solver.xs, solver.us
    problem.calc(states, controls)
    problem.calcDiff(states, controls)
    parts = {
        "calcDiff": lambda: problem.calcDiff(states, controls),
        "backwardPass": solver.backwardPass,
        "forwardPass": lambda: solver.forwardPass(1.0),
    }
    total = {"n": options.reps, "min_us": 0.0, "median_us": 0.0}
    for name, work in parts.items():
        stats = timeit(work, options.reps)
        emit("crocoddyl", name, stats, **size)
        for key in ("min_us", "median_us"):
            total[key] += stats[key]
    emit("crocoddyl", "iteration", total, **size)


if __name__ == "__main__":
    main()
