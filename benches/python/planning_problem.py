"""What a planning problem of `globalisation.py` is, and the task file and robot file that pose it to supple."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

# The key that says how contacts dissipate energy, and the length over which they set in: see `Contact.text`.
DISSIPATION = "dissipation"
CONTACT_SMOOTHING = 1e-4
# Speed over which Coulomb friction sets in, rad/s or m/s; the default of task files.
FRICTION_SMOOTHING = 0.01


@dataclass(frozen=True)
class Cost:
    """A term of the cost, with the weight of every stage (not multiplied by the time step) and that of the end.

    Attributes:
        kind: The kind as in task files: `joint_position`, `joint_velocity`, `control`, `frame_point`, `contact_force`.
        weight: Weight in every stage.
        final: Weight at the end.
        target: By joint the position or velocity to reach; empty for `control` and points.
        frame: The link of a point, or the name of a contact.
        point: The place to reach, m; or the force, N.
    """

    kind: str
    weight: float
    final: float = 0.0
    target: dict[str, float] = field(default_factory=dict)
    frame: str = ""
    point: tuple[float, ...] = ()

    def text(self) -> str:
        """Its table in the task file."""
        lines = [f'kind = "{self.kind}"', f"weight = {self.weight!r}"]
        if self.kind != "control":
            lines.append(f"final_weight = {self.final!r}")
        if self.target:
            lines += [f"select = {names(self.target)}", f"target = {json.dumps(list(self.target.values()))}"]
        if self.kind == "frame_point":
            lines += [f'frame = "{self.frame}"', f"target = {json.dumps(self.point)}"]
        if self.kind == "contact_force":
            lines += [f'contact = "{self.frame}"', f"target = {self.point[0]!r}"]
        return table("[[tasks.costs]]", lines)


@dataclass(frozen=True)
class Goal:
    """What a solution must reach at its end, by physics and not by cost.

    Attributes:
        tolerance: The largest error, in the unit of what is reached.
        joints: By joint the position to reach, rad or m.
        at_rest: Whether it is the speeds of all joints that are to be 0.
        frame: The link whose origin is to reach `point`, m; or the contact that is to press with that force, N.
        point: See `frame`.
    """

    tolerance: float
    joints: dict[str, float] = field(default_factory=dict)
    at_rest: bool = False
    frame: str = ""
    point: tuple[float, ...] = ()


@dataclass(frozen=True)
class Passive:
    """What resists in a joint: damping, Coulomb friction, and a spring with its rest position; SI units."""

    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True)
class Elastic:
    """A spring and damper between a joint and its motor; SI units."""

    joint: str
    stiffness: float
    damping: float
    motor_inertia: float
    motor_damping: float

    def text(self) -> str:
        """Its table in the task file."""
        numbers = {key: value for key, value in vars(self).items() if key != "joint"}
        return table(
            "[[model.compliance]]",
            ['kind = "elastic_joint"', *entries({"name": f"motor_{self.joint}", "joint": self.joint, **numbers})],
        )


@dataclass(frozen=True)
class Contact:
    """A point or sphere on a link against a wall; SI units."""

    name: str
    frame: str
    normal: tuple[float, float, float]
    point: tuple[float, float, float]
    stiffness: float
    radius: float = 0.0
    friction: float = 0.0
    dissipation: float = 0.0

    def text(self) -> str:
        """Its table in the task file: the one place that knows the keys of contacts."""
        return table(
            "[[model.compliance]]",
            [
                'kind = "contact"',
                *entries(
                    {
                        "name": self.name,
                        "frame": self.frame,
                        "normal": self.normal,
                        "point": self.point,
                        "radius": self.radius,
                        "stiffness": self.stiffness,
                        DISSIPATION: self.dissipation,
                        "smoothing": CONTACT_SMOOTHING,
                        "friction": self.friction,
                    }
                ),
            ],
        )

    def force(self, place: tuple[float, ...]) -> float:
        """The force along the normal at rest, N, with the frame at a place."""
        depth = self.radius - sum(e * (x - p) for e, x, p in zip(self.normal, place, self.point))
        t = min(max(1.0 + depth / CONTACT_SMOOTHING, 0.0), 2.0)
        rounded = CONTACT_SMOOTHING * t**4 * (t**2 - 6.0 * t + 10.0) / 32.0
        return self.stiffness * (rounded + max(depth - CONTACT_SMOOTHING, 0.0))


@dataclass(frozen=True)
class Problem:
    """A planning problem.

    Attributes:
        name: Its name.
        urdf: The text of the robot's file. Joints that move have neither damping nor friction in it.
        joints: Names of the joints that move.
        steps: Time steps.
        time_step: Their length, s.
        costs: The terms of the cost.
        goals: What a solution must reach.
        actuated: Names of the joints with a drive; all where empty.
        start: By joint the first position; 0 where left out.
        effort_limits: Whether controls must keep the efforts of the robot's file.
        passive: What resists, by joint.
        elastic: Elastic joints.
        contacts: Contacts; supple only.
        compliance: Other tables of compliance; supple only.
        gravity: Acceleration along z, m/s^2.
    """

    name: str
    urdf: str
    joints: tuple[str, ...]
    steps: int
    time_step: float
    costs: tuple[Cost, ...]
    goals: tuple[Goal, ...]
    actuated: tuple[str, ...] = ()
    start: dict[str, float] = field(default_factory=dict)
    effort_limits: bool = False
    passive: dict[str, Passive] = field(default_factory=dict)
    elastic: tuple[Elastic, ...] = ()
    contacts: tuple[Contact, ...] = ()
    compliance: str = ""
    gravity: float = -9.81

    @property
    def has_twin(self) -> bool:
        """Whether crocoddyl can be asked the same."""
        return not self.contacts and not self.compliance

    @property
    def is_resisted(self) -> bool:
        """Whether something in joints resists or is elastic."""
        return bool(self.passive or self.elastic)

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of the joints with a drive, in the order of the controls."""
        return self.actuated or self.joints

    def write(self, folder: Path) -> Path:
        """Writes the robot's file and the task file; gives the path of the latter."""
        robot, task = folder / f"{self.name}.urdf", folder / f"{self.name}.toml"
        robot.write_text(self.urdf)
        task.write_text(self.text(robot.name))
        return task

    def text(self, robot: str) -> str:
        """The task file."""
        start = {f"q.{joint}": at for joint, at in self.start.items()}
        # Motors start where their joints do.
        start |= {f"q.motor_{e.joint}": self.start.get(e.joint, 0.0) for e in self.elastic}
        initial = {"q.*": 1e-6, "v.*": 1e-6} | ({"c.*": 1e-8} if self.contacts else {})
        position = {"kind": "joint_position", "select": self.joints, "variance": 1e-6}
        velocity = {"kind": "joint_velocity", "select": self.joints, "variance": 1e-4}
        model = {"kind": "robot", "file": robot, "gravity": [0.0, 0.0, self.gravity], "actuated": self.drives}
        parts = [
            table("[model]", [*entries(model), f"friction_smoothing = {FRICTION_SMOOTHING!r}"]),
            *(table(f'[model.joints."{joint}"]', entries(vars(passive))) for joint, passive in self.passive.items()),
            *(part.text() for part in (*self.elastic, *self.contacts)),
            *([self.compliance] if self.compliance else []),
            table("[[model.sensors]]", entries(position)),
            table("[[model.sensors]]", entries(velocity)),
            table(
                "[[tasks]]",
                [
                    'name = "task"',
                    f"steps = {self.steps}",
                    f"time_step = {self.time_step!r}",
                    f"initial_state = {inline(start)}",
                    *(["enforce_effort_limits = true"] if self.effort_limits else []),
                ],
            ),
            table(
                "[tasks.noise]",
                [
                    f"initial = {inline(initial)}",
                    f"process = {inline({'q.*': 1e-9, 'v.*': 1e-6})}",
                ],
            ),
            *(cost.text() for cost in self.costs),
        ]
        return f'title = "{self.name}"\n\n' + "\n".join(parts)


def names(joints: object) -> str:
    """A list of names."""
    return json.dumps(list(joints), ensure_ascii=False)


def entries(keys: dict[str, object]) -> list[str]:
    """Lines with keys and their values."""
    return [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in keys.items()]


def inline(keys: dict[str, float]) -> str:
    """An inline table."""
    return "{ " + ", ".join(f'"{key}" = {value!r}' for key, value in keys.items()) + " }"


def table(header: str, lines: list[str]) -> str:
    """A table of the task file."""
    return "\n".join([header, *lines]) + "\n"
