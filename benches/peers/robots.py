"""Compares rigid-body dynamics with Pinocchio's on every URDF file of the example_robot_data package or given folders.

    python3 -m venv .venv && .venv/bin/pip install pin example-robot-data
    .venv/bin/python benches/peers/robots.py [FOLDER ...] [--binary PROGRAM] [--states 5] [--mimic]

Bases are fixed, also those of robots that walk. Joints that follow others are free, or follow with --mimic. The table
has by robot the worst error over random states of: the mass matrix, the bias (Coriolis, gravity, damping and friction),
the acceleration, poses of links, and their velocities; each relative to the largest entry, by state. The last column is
the condition of the mass matrix, scaled to a unit diagonal; accelerations are not determined where it is infinite, and
both programs have to find it so. The program ends with 1 where an error is above 1e-10.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import xml.etree.ElementTree as xml

import numpy as np
import pinocchio as pin

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOLERANCE = 1e-10
# Condition above which a mass matrix counts as singular.
SINGULAR = 1e12
# As in crates/supple-robot/examples/dynamics.rs.
SMOOTHING = 0.1


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--binary", help="the example `dynamics` of supple-robot; built where not given")
    parser.add_argument("--states", type=int, default=5)
    parser.add_argument("--mimic", action="store_true", help="joints follow others; only robots that have such joints")
    return parser.parse_args()


def robot_files(folders):
    if not folders:
        import example_robot_data

        folders = [pathlib.Path(example_robot_data.getModelPath("ur_description/urdf/ur5_robot.urdf"))]
    return sorted({file for folder in folders for file in folder.rglob("*.urdf")})


def built():
    command = ["cargo", "build", "--release", "-p", "supple-robot", "--example", "dynamics", "--message-format=json"]
    output = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    messages = [json.loads(line) for line in output.splitlines()]
    return next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "dynamics")


def supple(binary, file, states, mimic):
    """The lines that our program prints."""
    command = [binary, str(file), *([] if mimic else ["--independent-mimic"])]
    text = "\n".join(" ".join(repr(float(number)) for number in state) for state in states)
    run = subprocess.run(command, input=text, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(run.stderr.strip().splitlines()[0][:150])
    return [json.loads(line) for line in run.stdout.splitlines()]


def drags(file, model, mimic):
    """What brakes each moving joint: (degree of freedom, velocity by its velocity, damping, friction). Pinocchio keeps
    no damping of joints that follow others, so all of it comes from the file."""
    joints = {joint.get("name"): joint for joint in xml.parse(file).getroot().findall("joint")}
    found = []
    for name, joint in joints.items():
        ratio, dynamics = 1.0, joint.find("dynamics")
        if not model.existJointName(name) or dynamics is None:
            continue
        while mimic and (follows := joints[name].find("mimic")) is not None:
            ratio, name = ratio * float(follows.get("multiplier", 1)), follows.get("joint")
        numbers = [float(dynamics.get(key, 0)) for key in ("damping", "friction")]
        found.append((model.joints[model.getJointId(name)].idx_v, ratio, *numbers))
    return found


def configuration(model, joints, q):
    """Pinocchio's configuration: joints without limits are given by cosine and sine."""
    full = pin.neutral(model)
    for name, angle in zip(joints, q):
        joint = model.joints[model.getJointId(name)]
        at = joint.idx_q
        full[at : at + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
    return full


def peer(model, dragging, joints, links, q, v, tau, mimic):
    """What Pinocchio gives, in our order."""
    data = model.createData()
    order = [model.joints[model.getJointId(name)].idx_v for name in joints]
    q = configuration(model, joints, q)
    velocity, force = np.zeros(model.nv), np.zeros(model.nv)
    velocity[order], force[order] = v, tau
    passive = np.zeros(model.nv)
    for dof, ratio, damping, friction in dragging:
        rate = ratio * velocity[dof]
        passive[dof] += ratio * (damping * rate + friction * rate / np.sqrt(rate**2 + SMOOTHING**2))
    mass = pin.crba(model, data, q, pin.Convention.LOCAL) if mimic else pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    bias = pin.rnea(model, data, q, velocity, np.zeros(model.nv)) + passive
    acceleration = np.linalg.solve(mass, force - bias) if mimic else pin.aba(model, data, q, velocity, force - passive)
    pin.forwardKinematics(model, data, q, velocity)
    pin.updateFramePlacements(model, data)
    frames, velocities = [], []
    for link in links:
        frame = model.getFrameId(link, pin.FrameType.BODY)
        pose = data.oMf[frame]
        frames.append([*pose.rotation.flatten(), *pose.translation])
        twist = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        velocities.append([*twist.angular, *twist.linear])
    return {
        "mass": mass[np.ix_(order, order)],
        "bias": bias[order],
        "acceleration": acceleration[order],
        "frames": np.array(frames),
        "velocities": np.array(velocities),
    }


def relative(found, expected):
    return np.abs(np.array(found) - expected).max() / max(np.abs(expected).max(), 1e-300)


def errors(model, dragging, joints, links, state, ours, mimic):
    """Relative errors at one state, and the condition of the mass matrix scaled to a unit diagonal."""
    q, v, tau = np.split(np.array(state), 3)
    theirs = peer(model, dragging, joints, links, q, v, tau, mimic)
    row = {name: relative(ours[name], theirs[name]) for name in ("mass", "bias", "frames", "velocities")}
    mass = theirs["mass"]
    scale = 1 / np.sqrt(np.maximum(np.diag(mass), 1e-300))
    row["condition"] = np.linalg.cond(mass * np.outer(scale, scale))
    found, singular = ours["acceleration"], row["condition"] > SINGULAR
    if singular or found is None:
        row["acceleration"] = 0.0 if singular and found is None else np.inf
    else:
        row["acceleration"] = relative(found, theirs["acceleration"])
    return row


COLUMNS = ("mass", "bias", "acceleration", "frames", "velocities", "condition")


def compared(binary, file, states, mimic):
    """Number of degrees of freedom, and the worst of every column."""
    model = pin.buildModelFromUrdf(str(file), mimic)
    names = supple(binary, file, [], mimic)[0]
    joints, links = names["joints"], names["links"]
    if len(joints) != model.nv:
        raise RuntimeError(f"{len(joints)} degrees of freedom, {model.nv} in Pinocchio")
    random, n = np.random.default_rng(1), len(joints)
    drawn = [np.concatenate([random.uniform(-3, 3, n), random.uniform(-2, 2, n), random.uniform(-9, 9, n)])
             for _ in range(states)]
    if n == 0:
        raise RuntimeError("nothing moves")
    lines = supple(binary, file, drawn, mimic)[1:]
    dragging = drags(file, model, mimic)
    rows = [errors(model, dragging, joints, links, state, ours, mimic) for state, ours in zip(drawn, lines)]
    return n, [max(row[column] for row in rows) for column in COLUMNS]


def main():
    options = arguments()
    binary = options.binary or built()
    failed = 0
    print(f"{'robot':44} dofs  " + "  ".join(f"{column:>12}" for column in COLUMNS))
    for file in robot_files(options.folders):
        if options.mimic and "<mimic" not in file.read_text(errors="replace"):
            continue
        name = "/".join(file.parts[-3:])[-44:]
        try:
            dofs, worst = compared(binary, file, options.states, options.mimic)
        except (RuntimeError, ValueError) as error:
            print(f"{name:44} not compared: {str(error).splitlines()[0]}")
            continue
        bad = any(not error <= TOLERANCE for column, error in zip(COLUMNS, worst) if column != "condition")
        failed += bad
        print(f"{name:44} {dofs:4}  " + "  ".join(f"{error:12.1e}" for error in worst) + ("  WORSE" if bad else ""))
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
