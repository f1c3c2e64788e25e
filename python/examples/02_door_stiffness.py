"""How stiff should the grip on a door be? Information and cost of tasks/iiwa_door.toml over equal stiffnesses.

Two tables: the sweep, and what it is made of: the parts of the nominal cost, and the information if positions had no
process noise. docs/paper.md says what they mean. Its twin in Rust is crates/supple/examples/02_door_stiffness.rs; both
print the same.
"""

from pathlib import Path

import supple
from supple.reports import TaskReport

# Stiffnesses along all three axes, N/m.
SWEEP = [1.0, 10.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5, 3e5, 1e6]
TASK = "tasks/iiwa_door.toml"


def parts(at: TaskReport) -> tuple[float, float, float]:
    """The nominal cost by what it is of, with the weights of the task file: angle of the door, velocities, torques."""
    target = -0.5 if at.name == "open" else -0.17
    angle = (at.trajectory.x[:, 7] - target) ** 2
    speed = (at.trajectory.x[:, 8:] ** 2).sum(axis=1)
    door = 15.0 * angle[:-1].sum() + 50.0 * angle[-1]
    velocities = 1e-5 * speed[:-1].sum() + 0.0125 * speed[-1]
    return door, velocities, 1e-5 * (at.trajectory.u**2).sum()


# Stiffnesses outside of the file's bounds too.
text = Path(TASK).read_text().replace("bounds = [1e3, 1e6]", "bounds = [1.0, 1e6]")
door = supple.loads(text, TASK)
quiet = supple.loads(text.replace('{ "q.*" = 1e-7,', '{ "q.*" = 0.0,'), TASK)


def equal(stiffness: float) -> dict[str, float]:
    """All three of the same stiffness."""
    return dict.fromkeys(door.parameters, stiffness)


evaluated = {stiffness: door.evaluate(at=equal(stiffness)) for stiffness in SWEEP}
for name in door.tasks:
    print(f"{name:<7}  stiffness  nominal  expected cost  DI, bits   bits/s  end angle")
    for stiffness in SWEEP:
        at = evaluated[stiffness].tasks[name]
        cost, information = at.cost, at.information
        end = at.trajectory.x[-1, 7]
        print(
            f"{stiffness:>18.0f} {cost.nominal:>8.3f} {cost.expected:>14.3f} {information.total_bits:>9.1f} "
            f"{information.bits_per_second:>8.0f} {end:>10.4f}"
        )
    print()
    print(f"{name:<7}  stiffness  of door  of velocities  of torques  DI without position noise")
    for stiffness in (1.0, 1e4, 1e6):
        of_door, velocities, torques = parts(evaluated[stiffness].tasks[name])
        bits = quiet.evaluate(at=equal(stiffness), trajectories=False).tasks[name].information.total_bits
        print(f"{stiffness:>18.0f} {of_door:>8.3f} {velocities:>14.3f} {torques:>11.3f} {bits:>26.1f}")
    print()
