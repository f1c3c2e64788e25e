"""The problems of `globalisation.py` for crocoddyl: the same dynamics, integration, costs and horizon.

crocoddyl's costs have a factor 1/2, and those of stages are multiplied by the time step: a weight w of a stage here is
2 w / dt there, and 2 w at the end. Robots without damping, friction, springs and elastic joints use crocoddyl's own
dynamics in C++; the others use `Resisted`, which is slower: it is in Python, with Pinocchio's derivatives.

    python planning_crocoddyl.py NAME [TRAJECTORY]

prints JSON: how the search for a plan ended, and the cost by crocoddyl of supple's plan in the file TRAJECTORY.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import crocoddyl
import numpy as np
import pinocchio as pin
from planning_problem import FRICTION_SMOOTHING, Cost, Passive, Problem
from planning_problems import problems

MOST_ITERATIONS = 1000


def fill(array: np.ndarray, values: np.ndarray) -> None:
    """Writes into crocoddyl's memory, where matrices with one column are vectors."""
    array[...] = values.reshape(array.shape)


class Drives(crocoddyl.ActuationModelAbstract):
    """Drives on some of the joints."""

    def __init__(self, state: crocoddyl.StateMultibody, columns: np.ndarray) -> None:
        super().__init__(state, columns.shape[1])
        self.columns = columns

    def calc(self, data, x, u=None) -> None:
        if u is not None:
            data.tau[:] = self.columns @ np.atleast_1d(u)

    def calcDiff(self, data, x, u=None) -> None:
        fill(data.dtau_du, self.columns)


class Resisted(crocoddyl.DifferentialActionModelAbstract):
    """A robot with passive and elastic joints: state (q, s, v, ds), s the motors of elastic joints."""

    def __init__(self, problem: Problem, model: pin.Model, stage: bool) -> None:
        self.model, self.data = model, model.createData()
        rigid, motors = model.nv, len(problem.elastic)
        self.count = rigid + motors
        super().__init__(crocoddyl.StateVector(2 * self.count), len(problem.drives))
        order = joint_order(model)
        self.elastic = [(order[e.joint], rigid + number, e) for number, e in enumerate(problem.elastic)]
        at_motor = {e.joint: rigid + number for number, e in enumerate(problem.elastic)}
        self.columns = np.zeros((self.count, self.nu))
        for number, joint in enumerate(problem.drives):
            self.columns[at_motor.get(joint, order[joint]), number] = 1.0
        resisting = [problem.passive.get(joint, Passive()) for joint in order]
        self.damping, self.friction, self.stiffness, self.rest = (
            np.array([getattr(entry, key) for entry in resisting])
            for key in ("damping", "friction", "stiffness", "rest")
        )
        self.by_x, self.target, self.by_u = self.weights(problem, order, stage)

    def weights(self, problem: Problem, order: dict[str, int], stage: bool):
        """Weights and targets of the states, and the weight of controls; of a stage by time, as crocoddyl counts."""
        weight, moment, by_u = np.zeros(2 * self.count), np.zeros(2 * self.count), 0.0
        for cost in problem.costs:
            factor = 2 * cost.weight / problem.time_step if stage else 2 * cost.final
            if cost.kind == "control":
                by_u += factor
                continue
            shift = {"joint_position": 0, "joint_velocity": self.count}[cost.kind]
            for joint, target in cost.target.items():
                weight[shift + order[joint]] += factor
                moment[shift + order[joint]] += factor * target
        return weight, np.divide(moment, weight, out=np.zeros_like(moment), where=weight > 0), by_u

    def forces(self, x, u):
        """Generalised forces, and their derivatives by positions and velocities."""
        n, rigid = self.count, self.model.nv
        position, speed = x[:n], x[n:]
        force, by_p, by_v = self.columns @ u, np.zeros((n, n)), np.zeros((n, n))
        v = speed[:rigid]
        size = np.sqrt(v**2 + FRICTION_SMOOTHING**2)
        force[:rigid] -= self.stiffness * (position[:rigid] - self.rest) + self.damping * v + self.friction * v / size
        on = np.arange(rigid)
        by_p[on, on] -= self.stiffness
        by_v[on, on] -= self.damping + self.friction * FRICTION_SMOOTHING**2 / size**3
        for j, s, e in self.elastic:
            torque = e.stiffness * (position[s] - position[j]) + e.damping * (speed[s] - speed[j])
            for row, sign in ((j, 1.0), (s, -1.0)):
                force[row] += sign * torque
                by_p[row, [s, j]] += sign * e.stiffness * np.array([1.0, -1.0])
                by_v[row, [s, j]] += sign * e.damping * np.array([1.0, -1.0])
            force[s] -= e.motor_damping * speed[s]
            by_v[s, s] -= e.motor_damping
        return force, by_p, by_v

    def calc(self, data, x, u=None) -> None:
        error = x - self.target
        data.cost = 0.5 * error @ (self.by_x * error)
        if u is None:
            return
        u = np.atleast_1d(u)
        data.cost += 0.5 * self.by_u * u @ u
        n, rigid = self.count, self.model.nv
        force = self.forces(x, u)[0]
        acceleration = pin.aba(self.model, self.data, x[:rigid], x[n : n + rigid], force[:rigid])
        motors = [force[s] / e.motor_inertia for _, s, e in self.elastic]
        data.xout[:] = np.concatenate([acceleration, motors])

    def calcDiff(self, data, x, u=None) -> None:
        data.Lx[:] = self.by_x * (x - self.target)
        data.Lxx[:, :] = np.diag(self.by_x)
        if u is None:
            return
        u = np.atleast_1d(u)
        fill(data.Lu, self.by_u * u)
        fill(data.Luu, self.by_u * np.eye(self.nu))
        n, rigid = self.count, self.model.nv
        force, by_p, by_v = self.forces(x, u)
        pin.computeABADerivatives(self.model, self.data, x[:rigid], x[n : n + rigid], force[:rigid])
        inverse = np.zeros((n, n))
        inverse[:rigid, :rigid] = np.triu(self.data.Minv) + np.triu(self.data.Minv, 1).T
        for _, s, e in self.elastic:
            inverse[s, s] = 1 / e.motor_inertia
        fx = np.hstack([inverse @ by_p, inverse @ by_v])
        fx[:rigid, :rigid] += self.data.ddq_dq
        fx[:rigid, n : n + rigid] += self.data.ddq_dv
        data.Fx[:, :] = fx
        fill(data.Fu, inverse @ self.columns)


def joint_order(model: pin.Model) -> dict[str, int]:
    """By joint its place among the velocities."""
    return {name: model.joints[number].idx_v for number, name in enumerate(model.names) if number > 0}


def residual(cost: Cost, state, model: pin.Model, controls: int):
    """The residual of a term, and the weights of its entries."""
    if cost.kind == "control":
        return crocoddyl.ResidualModelControl(state, controls), np.ones(controls)
    if cost.kind == "frame_point":
        frame = model.getFrameId(cost.frame, pin.FrameType.BODY)
        return crocoddyl.ResidualModelFrameTranslation(state, frame, np.array(cost.point), controls), np.ones(3)
    order, nv = joint_order(model), model.nv
    shift = {"joint_position": 0, "joint_velocity": nv}[cost.kind]
    target, weight = np.zeros(2 * nv), np.zeros(2 * nv)
    for joint, at in cost.target.items():
        target[shift + order[joint]], weight[shift + order[joint]] = at, 1.0
    return crocoddyl.ResidualModelState(state, target, controls), weight


def action(problem: Problem, model: pin.Model, stage: bool):
    """The differential action of a stage, or of the end."""
    if problem.is_resisted:
        return Resisted(problem, model, stage)
    state, order = crocoddyl.StateMultibody(model), joint_order(model)
    columns = np.zeros((model.nv, len(problem.drives)))
    for number, joint in enumerate(problem.drives):
        columns[order[joint], number] = 1.0
    drives = Drives(state, columns)
    costs = crocoddyl.CostModelSum(state, drives.nu)
    for number, cost in enumerate(problem.costs):
        weight = 2 * cost.weight / problem.time_step if stage else 2 * cost.final
        if weight > 0:
            of_joints, entries = residual(cost, state, model, drives.nu)
            activation = crocoddyl.ActivationModelWeightedQuad(entries)
            costs.addCost(f"{number}", crocoddyl.CostModelResidual(state, activation, of_joints), weight)
    return crocoddyl.DifferentialActionModelFreeFwdDynamics(state, drives, costs)


def shooting(problem: Problem, model: pin.Model):
    """crocoddyl's problem, and the names of the entries of its state."""
    order = joint_order(model)
    positions = [f"q.{joint}" for joint in order] + [f"q.motor_{e.joint}" for e in problem.elastic]
    states = positions + ["v" + name[1:] for name in positions]
    start = np.zeros(len(states))
    for joint, at in problem.start.items():
        start[order[joint]] = at
    for number, e in enumerate(problem.elastic):
        start[model.nv + number] = problem.start.get(e.joint, 0.0)
    running = crocoddyl.IntegratedActionModelEuler(action(problem, model, True), problem.time_step)
    if problem.effort_limits:
        most = np.array([model.effortLimit[order[joint]] for joint in problem.drives])
        running.u_lb, running.u_ub = -most, most
    end = crocoddyl.IntegratedActionModelEuler(action(problem, model, False), 0.0)
    return crocoddyl.ShootingProblem(start, [running] * problem.steps, end), states


def first_guess(problem: Problem, model: pin.Model, start: np.ndarray) -> np.ndarray:
    """Controls that hold the start where every joint has a drive of its own, and else none."""
    if set(problem.drives) != set(problem.joints) or problem.is_resisted:
        return np.zeros(len(problem.drives))
    order, data = joint_order(model), model.createData()
    hold = pin.rnea(model, data, start[: model.nv], np.zeros(model.nv), np.zeros(model.nv))
    most = np.array([model.effortLimit[order[joint]] for joint in problem.drives])
    hold = hold[[order[joint] for joint in problem.drives]]
    return np.clip(hold, -most, most) if problem.effort_limits else hold


def solved(problem: Problem, model: pin.Model) -> dict[str, object]:
    """How FDDP ends from a start that stands still, and its last state by name."""
    shoot, states = shooting(problem, model)
    solver = (crocoddyl.SolverBoxFDDP if problem.effort_limits else crocoddyl.SolverFDDP)(shoot)
    guess = first_guess(problem, model, shoot.x0)
    clock = time.perf_counter()
    done = solver.solve([shoot.x0] * (problem.steps + 1), [guess] * problem.steps, MOST_ITERATIONS, False)
    seconds = time.perf_counter() - clock
    status = "converged" if done else "max_iterations" if solver.iter + 1 >= MOST_ITERATIONS else "stalled"
    last = dict(zip(states, (float(entry) for entry in solver.xs[-1])))
    return {"status": status, "iterations": solver.iter, "cost": solver.cost, "seconds": seconds, "end": last}


def checked(problem: Problem, model: pin.Model, trajectory: dict[str, list]) -> dict[str, float]:
    """The cost by crocoddyl of supple's plan, and the largest difference of a state after one step."""
    shoot, states = shooting(problem, model)
    columns = [trajectory["state_names"].index(name) for name in states]
    xs = [np.array(row)[columns] for row in trajectory["states"]]
    us = [np.array(row) for row in trajectory["controls"]]
    cost = shoot.calc(xs, us)
    gap = max(np.abs(data.xnext - x).max() for data, x in zip(shoot.runningDatas, xs[1:]))
    return {"cost_there": float(cost), "gap": float(gap)}


def main() -> None:
    name, *trajectory = sys.argv[1:]
    problem = next(problem for problem in problems() if problem.name == name)
    model = pin.buildModelFromXML(problem.urdf)
    model.gravity.linear = np.array([0.0, 0.0, problem.gravity])
    found: dict[str, object] = {}
    if trajectory:
        found |= checked(problem, model, json.loads(Path(trajectory[0]).read_text()))
        print(json.dumps(found), flush=True)
    print(json.dumps(found | solved(problem, model)))


if __name__ == "__main__":
    main()
