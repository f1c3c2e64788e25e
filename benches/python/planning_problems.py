"""The problems of `globalisation.py`: by family, each a function that lists its problems."""

from __future__ import annotations

import math
from collections.abc import Iterable

from planning_problem import Contact, Cost, Elastic, Goal, Passive, Problem, entries, table
from planning_robots import Robot, cart_pole, chain, public, shipped, slides


def position(target: dict[str, float], weight: float, final: float) -> Cost:
    """A cost of joint positions."""
    return Cost("joint_position", weight, final, target=target)


def velocity(joints: Iterable[str], weight: float, final: float) -> Cost:
    """A cost of joint velocities, whose target is 0."""
    return Cost("joint_velocity", weight, final, target=dict.fromkeys(joints, 0.0))


def control(weight: float) -> Cost:
    """A cost of controls."""
    return Cost("control", weight)


def point(frame: str, target: tuple[float, ...], weight: float, final: float) -> Cost:
    """A cost of where a link's origin is."""
    return Cost("frame_point", weight, final, frame=frame, point=target)


def press(contact: str, force: float, weight: float, final: float) -> Cost:
    """A cost of a contact's force."""
    return Cost("contact_force", weight, final, frame=contact, point=(force,))


def swing_ups() -> list[Problem]:
    """A pole on a cart from hanging to upright, without a guess."""
    target = {"cart": 0.0, "j1": math.pi}
    goals = (Goal(0.1, {"j1": math.pi}), Goal(0.2, {"cart": 0.0}), Goal(0.5, at_rest=True))

    def posed(name: str, steps: int, dt: float, *, running: float = 0.01, **more: object) -> Problem:
        robot = cart_pole(effort=more.pop("effort", 1e3))
        costs = (
            position({"j1": math.pi}, running, 500.0),
            position({"cart": 0.0}, running, 100.0),
            velocity(target, 0.1 * running, 50.0),
            control(1e-4),
        )
        return Problem(name, robot.urdf, robot.joints, steps, dt, costs, goals, actuated=("cart",), **more)

    return [
        posed("cartpole_1.5s", 75, 0.02),
        posed("cartpole_3s", 150, 0.02),
        posed("cartpole_5s", 250, 0.02),
        posed("cartpole_end_only", 150, 0.02, running=0.0),
        posed("cartpole_limits", 150, 0.02, effort=12.0, effort_limits=True),
        posed("cartpole_fine", 1000, 0.003),
    ]


def pendulums() -> list[Problem]:
    """One and two rods of 1 kg and 0.5 m from hanging to upright."""
    dt = 0.01

    def posed(name: str, robot: Robot, steps: int, weights: tuple[float, float], **more: object) -> Problem:
        target = dict.fromkeys(robot.joints, 0.0) | {"j1": math.pi}
        running, end = weights
        costs = (position(target, running, end), velocity(target, 0.1 * running, 0.1 * end), control(1e-4))
        goals = (Goal(0.1, target), Goal(0.5, at_rest=True))
        return Problem(name, robot.urdf, robot.joints, steps, dt, costs, goals, **more)

    one, two = chain(1), chain(2)
    # Holding a rod level takes 2.45 N m; the first of two, 9.8 N m.
    weak_one, weak_two = chain(1, effort=1.2), chain(2, effort=6.0)
    usual = (0.01, 1000.0)
    return [
        posed("pendulum_1s", one, 100, usual),
        posed("pendulum_5s", one, 500, usual),
        posed("pendulum_limits", weak_one, 400, usual, effort_limits=True),
        posed("double_full", two, 200, usual),
        posed("double_full_limits", weak_two, 300, usual, effort_limits=True),
        posed("double_full_stage", two, 300, (1.0, 1000.0)),
        posed("acrobot", two, 300, usual, actuated=("j2",)),
        posed("pendubot", two, 300, usual, actuated=("j1",)),
        posed("acrobot_end_only", two, 300, (0.0, 1000.0), actuated=("j2",)),
    ]


REACH = {
    # Weights of position and velocity, in every stage and at the end, and of controls.
    "usual": ((1.0, 1e4), (0.1, 100.0), 1e-4),
    "end": ((0.01, 1e5), (1e-4, 1e3), 1e-6),
    "costly": ((1.0, 1e5), (0.1, 1e3), 1e-3),
}


def reach(name: str, robot: Robot, ways: tuple[list[float], list[float]], weights: str = "usual", **more) -> Problem:
    """All joints go from one place to another under gravity."""
    start, target = (dict(zip(robot.joints, way)) for way in ways)
    (stage, end), (speed, rest), effort = REACH[weights]
    costs = (position(target, stage, end), velocity(target, speed, rest), control(effort))
    goals = (Goal(0.05, target), Goal(0.5, at_rest=True))
    sizes = {"steps": 200, "time_step": 2e-3} | more
    return Problem(name, robot.urdf, robot.joints, costs=costs, goals=goals, start=start, **sizes)


def touch(name: str, robot: Robot, start: list[float], place: tuple[str, tuple[float, ...]], **more) -> Problem:
    """The origin of a link goes to a place under gravity."""
    frame, target = place
    costs = (point(frame, target, 10.0, 1e5), velocity(robot.joints, 0.01, 100.0), control(1e-4))
    goals = (Goal(0.01, frame=frame, point=target), Goal(0.5, at_rest=True))
    sizes = {"steps": 200, "time_step": 2e-3} | more
    start = dict(zip(robot.joints, start))
    return Problem(name, robot.urdf, robot.joints, costs=costs, goals=goals, start=start, **sizes)


UR5 = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
UR5_WAY = ([0.0, -1.2, 1.5, -0.3, 0.5, 0.0], [0.6, -0.8, 1.1, -0.2, 0.7, 0.2])


def ur5s() -> list[Problem]:
    """A UR5."""
    robot = public("ur_description/urdf/ur5_robot.urdf", UR5)
    start, far = UR5_WAY[0], [1.8, -2.4, -0.9, 1.2, -1.0, 1.5]
    return [
        reach("ur5_joints", robot, UR5_WAY),
        reach("ur5_joints_end", robot, UR5_WAY, "end"),
        reach("ur5_joints_costly", robot, UR5_WAY, "costly"),
        reach("ur5_far", robot, (start, far), steps=500),
        reach("ur5_limits", robot, (start, far), steps=500, effort_limits=True),
        reach("ur5_upright", robot, ([0.0, -1.57, 0.0, 0.0, 0.0, 0.0], [0.3, -1.4, 0.2, 0.1, 0.1, 0.0]), steps=1000),
        touch("ur5_point", robot, start, ("ee_link", (0.492, 0.545, 0.179))),
        touch("ur5_point_far", robot, start, ("ee_link", (-0.4, -0.3, 0.5)), steps=500),
    ]


def arms() -> list[Problem]:
    """Panda, Kinova, iiwa, and the left arm of Talos."""
    panda = public("panda_description/urdf/panda.urdf", [f"panda_joint{number}" for number in range(1, 8)])
    kinova = public("kinova_description/robots/kinova.urdf", [f"j2s6s200_joint_{number}" for number in range(1, 7)])
    iiwa = shipped("iiwa14_door.urdf", [f"iiwa_joint_{number}" for number in range(1, 8)])
    names = [f"arm_left_{number}_joint" for number in range(2, 8)] + ["gripper_left_joint"]
    talos = public("talos_data/robots/talos_left_arm.urdf", names)
    of_panda = ([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8], [0.5, 0.1, 0.2, -1.6, 0.1, 1.8, 0.6])
    of_kinova = ([0.0, 2.9, 1.3, 4.2, 1.4, 0.0], [0.5, 2.6, 1.6, 4.0, 1.6, 0.3])
    of_iiwa = ([0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0], [0.5, 0.3, -0.3, -1.5, 0.4, 1.0, 0.2])
    of_talos = ([0.3, 0.0, -0.5, 0.0, 0.0, 0.0, -0.3], [0.6, 0.3, -0.9, 0.3, 0.2, 0.2, -0.5])
    return [
        reach("panda_joints", panda, of_panda),
        reach("panda_joints_end", panda, of_panda, "end"),
        reach("panda_long", panda, of_panda, steps=1000, time_step=1e-3),
        touch("panda_point", panda, of_panda[0], ("panda_hand", (0.459, 0.391, 0.576))),
        reach("kinova_joints", kinova, of_kinova),
        touch("kinova_point", kinova, of_kinova[0], ("j2s6s200_end_effector", (-0.238, -0.041, 0.654))),
        reach("iiwa_joints", iiwa, of_iiwa),
        touch("iiwa_point", iiwa, of_iiwa[0], ("iiwa_link_7", (0.517, 0.161, 0.603))),
        reach("talos_joints", talos, of_talos),
        touch("talos_point", talos, of_talos[0], ("arm_left_7_link", (0.21, 0.445, -0.291))),
    ]


def chains() -> list[Problem]:
    """Rods that hang on one another: lifted to the side by all drives, or turned by the first one only."""
    problems = []
    for count in (3, 6, 10):
        robot = chain(count, length=0.3)
        bent = [math.pi / 2, *[0.2] * (count - 1)]
        problems.append(reach(f"chain{count}_all", robot, ([0.0] * count, bent), steps=200, time_step=5e-3))
        # The first rod is turned and the others hang from it again.
        target = dict(zip(robot.joints, [0.5, -0.5, *[0.0] * (count - 2)]))
        costs = (position(target, 0.01, 100.0), velocity(target, 1e-3, 10.0), control(1e-4))
        goals = (Goal(0.1, target), Goal(0.5, at_rest=True))
        one = Problem(f"chain{count}_one", robot.urdf, robot.joints, 400, 5e-3, costs, goals, actuated=("j1",))
        problems.append(one)
    upright = [math.pi, 0.0, 0.0]
    leaning = [math.pi - 0.3, 0.2, -0.2]
    six = chain(6, length=0.3)
    problems += [
        reach("chain3_upright", chain(3, length=0.3), (leaning, upright), steps=600, time_step=5e-3),
        reach("chain6_up", six, ([0.0] * 6, [math.pi, *[0.0] * 5]), steps=300, time_step=5e-3),
    ]
    return problems


def compliant() -> list[Problem]:
    """Elastic joints, damping, friction, stiff springs and bushings."""
    two, level = chain(2), ([0.0, 0.0], [1.2, 0.4])

    def motors(stiffness: float, damping: float) -> tuple[Elastic, ...]:
        return tuple(Elastic(joint, stiffness, damping, 0.1, 0.5) for joint in two.joints)

    def passive(joints: Iterable[str], **numbers: float) -> dict[str, Passive]:
        return {joint: Passive(**numbers) for joint in joints}

    ur5 = public("ur_description/urdf/ur5_robot.urdf", UR5)
    three, five = slides(3), slides(5)
    shift = {"s1": 0.2, "s2": 0.0, "s3": 0.0}
    row = dict.fromkeys(five.joints, 0.0) | {"s1": 0.1}
    sliding = (position(shift, 1.0, 1e5), velocity(shift, 1e-2, 1e3), control(1e-4))
    rowing = (position(row, 1.0, 1000.0), velocity(row, 1e-2, 10.0), control(1e-5))
    arrived = (Goal(0.02, shift), Goal(0.1, at_rest=True))
    springs = passive(("s2", "s3"), stiffness=2e5, damping=10.0)
    soft = passive(five.joints[1:], stiffness=500.0, damping=0.5)
    return [
        reach("elastic_soft", two, level, steps=500, elastic=motors(30.0, 0.1)),
        reach("elastic_stiff", two, level, steps=500, elastic=motors(1e4, 1.0)),
        reach("damped_arm", two, level, steps=500, passive=passive(two.joints, damping=20.0)),
        reach("friction_arm", two, level, steps=500, passive=passive(two.joints, friction=5.0)),
        reach("friction_ur5", ur5, UR5_WAY, passive=passive(UR5, friction=3.0, damping=0.5)),
        reach("spring_arm", two, level, steps=500, passive=passive(two.joints, stiffness=200.0)),
        Problem("slides_stiff", three.urdf, three.joints, 500, 1e-3, sliding, arrived, ("s1",), passive=springs),
        Problem("slides_soft", five.urdf, five.joints, 400, 5e-3, rowing, (Goal(0.02, row),), ("s1",), passive=soft),
        bushing("bushing_soft", 2e3),
        bushing("bushing_stiff", 1e5),
    ]


def bushing(name: str, stiffness: float) -> Problem:
    """A stage on x and z carries a peg in a bushing, whose tip goes to a place under gravity; the robot is that of
    models/peg_on_wall.urdf."""
    joints = ["stage_x", "stage_z", "peg_x", "peg_z", "peg_tilt"]
    robot, target = shipped("peg_on_wall.urdf", joints), (0.05, 0.0, -0.15)
    compliance = table(
        "[[model.compliance]]",
        [
            'kind = "bushing"',
            *entries(
                {
                    "name": "coupling",
                    "frame_a": "gripper",
                    "frame_c": "peg",
                    "stiffness": [stiffness] * 3,
                    "damping": [20.0] * 3,
                    "torsional_stiffness": [20.0] * 3,
                    "torsional_damping": [0.1] * 3,
                }
            ),
        ],
    )
    costs = (point("tip", target, 10.0, 1e5), velocity(joints, 0.01, 10.0), control(1e-5))
    goals = (Goal(0.003, frame="tip", point=target), Goal(0.1, at_rest=True))
    drives = ("stage_x", "stage_z")
    return Problem(name, robot.urdf, robot.joints, 400, 1e-3, costs, goals, drives, compliance=compliance)


# Where the tip of two rods of 0.5 m is along x at -0.8 and 0.9 rad, m.
WALL = 0.5 * (math.sin(0.8) - math.sin(0.1))


def contacts() -> list[Problem]:
    """Pressing against walls, from touch or from a distance: for supple only."""
    one, two = slides(1), chain(2)
    force = Goal(0.5, frame="wall", point=(10.0,))
    at_rest = Goal(0.1, at_rest=True)

    def slide(name: str, gap: float, costs: tuple[Cost, ...], stiffness: float = 1e4, radius: float = 0.0) -> Problem:
        wall = Contact("wall", "m1", (-1.0, 0.0, 0.0), (gap + radius, 0.0, 0.0), stiffness, radius)
        all_costs = (*costs, velocity(["s1"], 1e-2, 10.0), control(1e-4))
        return Problem(name, one.urdf, one.joints, 500, 1e-3, all_costs, (force, at_rest), contacts=(wall,))

    def arm(name: str, start: dict[str, float], radius: float, friction: float) -> Problem:
        # The tip of two rods comes along x.
        wall = Contact("wall", "tip", (-1.0, 0.0, 0.0), (WALL + radius, 0.0, 0.0), 1e4, radius, friction)
        costs = (press("wall", 10.0, 0.01, 1.0), velocity(two.joints, 1e-2, 10.0), control(1e-4))
        goals = (force, Goal(0.5, at_rest=True))
        return Problem(name, two.urdf, two.joints, 500, 1e-3, costs, goals, start=start, contacts=(wall,))

    def corner(name: str, start: dict[str, float], friction: float) -> Problem:
        # The tip of two rods presses on a wall along x and on a floor along z at once.
        tip = (WALL, 0.0, -0.5 * (math.cos(0.8) + math.cos(0.1)))
        sides = [("wall", (-1.0, 0.0, 0.0)), ("floor", (0.0, 0.0, 1.0))]
        both = tuple(Contact(side, "tip", normal, tip, 1e4, 0.0, friction) for side, normal in sides)
        forces = (press("wall", 10.0, 0.01, 1.0), press("floor", 5.0, 0.01, 1.0))
        goals = (force, Goal(0.5, frame="floor", point=(5.0,)), Goal(0.5, at_rest=True))
        costs = (*forces, velocity(two.joints, 1e-2, 10.0), control(1e-4))
        return Problem(name, two.urdf, two.joints, 500, 1e-3, costs, goals, start=start, contacts=both)

    def squeeze(name: str, gap: float) -> Problem:
        # Two sliders in a row, each on a wall of its own, push away from one another.
        row = slides(2)
        left = Contact("wall", "m1", (1.0, 0.0, 0.0), (-gap, 0.0, 0.0), 1e4)
        right = Contact("far", "m2", (-1.0, 0.0, 0.0), (gap, 0.0, 0.0), 1e4)
        forces = (press("wall", 10.0, 0.01, 1.0), press("far", 10.0, 0.01, 1.0))
        goals = (force, Goal(0.5, frame="far", point=(10.0,)), at_rest)
        costs = (*forces, velocity(row.joints, 1e-2, 10.0), control(1e-4))
        return Problem(name, row.urdf, row.joints, 500, 1e-3, costs, goals, contacts=(left, right))

    pressing, coming = press("wall", 10.0, 0.01, 1.0), position({"s1": 0.1}, 10.0, 0.0)
    touching, apart = {"j1": -0.8, "j2": 0.9}, {"j1": -0.6, "j2": 0.6}
    return [
        slide("press_touching", 0.0, (pressing,)),
        slide("press_sphere", 0.0, (pressing,), radius=0.05),
        slide("press_apart", 0.1, (pressing,)),
        slide("press_apart_guided", 0.1, (pressing, coming)),
        slide("press_stiff", 0.0, (pressing,), stiffness=1e6),
        slide("press_soft", 0.0, (pressing,), stiffness=500.0),
        arm("arm_presses_point", touching, 0.0, 0.0),
        arm("arm_presses_friction", touching, 0.0, 0.5),
        arm("arm_presses_sphere", touching, 0.03, 0.3),
        arm("arm_presses_apart", apart, 0.0, 0.3),
        corner("corner_touching", touching, 0.0),
        corner("corner_friction", touching, 0.3),
        corner("corner_apart", {"j1": -0.9, "j2": 1.2}, 0.0),
        squeeze("squeeze_touching", 0.0),
        squeeze("squeeze_apart", 0.02),
    ]


def problems() -> list[Problem]:
    """All problems."""
    families = (swing_ups, pendulums, ur5s, arms, chains, compliant, contacts)
    return [problem for family in families for problem in family()]
