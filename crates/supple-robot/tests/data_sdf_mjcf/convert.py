"""Writes one arm as `arm.urdf` and in several ways as `arm_*.sdf`. Run in this folder; needs `numpy`."""
import numpy as np

R = lambda axis, a: np.array({
    "x": [[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]],
    "y": [[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]],
    "z": [[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]}[axis])


def pose(x, y, z, r, p, w):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R("z", w) @ R("y", p) @ R("x", r), [x, y, z]
    return T


def six(T):
    A = T[:3, :3]
    rpy = [np.arctan2(A[2, 1], A[2, 2]), -np.arcsin(A[2, 0]), np.arctan2(A[1, 0], A[0, 0])]
    return " ".join(repr(float(v) + 0.0) for v in [*T[:3, 3], *rpy])


def seven(T):
    A = T[:3, :3]
    w = np.sqrt(1 + np.trace(A)) / 2
    xyz = [(A[2, 1] - A[1, 2]) / (4 * w), (A[0, 2] - A[2, 0]) / (4 * w), (A[1, 0] - A[0, 1]) / (4 * w)]
    return " ".join(repr(float(v)) for v in [*T[:3, 3], *xyz, w])


def words(v):
    return " ".join(repr(float(x)) for x in v)


# Joint frame in the parent, axis in the joint frame, limits lower, upper, effort, velocity.
JOINTS = [
    ("shoulder", "revolute", "base", "upper", (0.1, 0, 0.4, 0.3, -0.2, 0.5), (0, 0.6, 0.8), (-1.5, 2, 40, 3)),
    ("elbow", "continuous", "upper", "lower", (0.3, 0.05, 0, -0.4, 0.1, 1.2), (1, 0, 0), (None, None, 20, 5)),
    ("slide", "prismatic", "lower", "finger", (0.25, 0, 0.02, 0.2, 0.7, -0.3), (0, 0, 1), (-0.01, 0.05, 8, 1)),
    ("other", "prismatic", "lower", "thumb", (0.25, 0, -0.02, 0, 0, 3), (0, 1, 0), (-0.1, 0.1, 8, 1)),
    ("tip", "fixed", "finger", "nail", (0, 0, 0.03, 0.1, 0.2, 0.3), None, None),
]
DYNAMICS = {"shoulder": (0.7, 0.1), "elbow": (0.4, 0)}
# Centre of mass and axes in the link, mass, moments xx yy zz xy xz yz.
LINKS = {
    "base": ((0, 0, 0.1, 0, 0, 0), 4, (0.1, 0.1, 0.05, 0, 0, 0)),
    "upper": ((0.15, 0.01, 0, 0.2, 0.3, -0.1), 2.5, (0.01, 0.04, 0.045, 0.001, -0.002, 0.003)),
    "lower": ((0.1, 0, 0.02, 0, 0, 0.4), 1.5, (0.004, 0.02, 0.021, 0, 0, 0.001)),
    "finger": ((0, 0, 0.015, 0, 0, 0), 0.1, (1e-5, 1e-5, 4e-6, 0, 0, 0)),
    "thumb": ((0, 0.015, 0, 0, 0, 0), 0.12, (1e-5, 4e-6, 1e-5, 0, 0, 0)),
    "nail": ((0, 0, 0.001, 0, 0, 0), 0.01, (1e-7, 1e-7, 1e-7, 0, 0, 0)),
}
ENTRIES = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]


def urdf():
    out = ['<?xml version="1.0"?>', '<robot name="arm">']
    for name, (com, mass, moments) in LINKS.items():
        inertia = " ".join(f'{key}="{value}"' for key, value in zip(ENTRIES, moments))
        out.append(f'  <link name="{name}"><inertial><origin xyz="{words(com[:3])}" rpy="{words(com[3:])}"/>'
                   f'<mass value="{mass}"/><inertia {inertia}/></inertial></link>')
    for name, kind, parent, child, origin, axis, limits in JOINTS:
        out.append(f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>')
        out.append(f'    <origin xyz="{words(origin[:3])}" rpy="{words(origin[3:])}"/>')
        if axis:
            lower, upper, effort, velocity = limits
            bounds = "" if lower is None else f'lower="{lower}" upper="{upper}" '
            out.append(f'    <axis xyz="{words(axis)}"/><limit {bounds}effort="{effort}" velocity="{velocity}"/>')
        if name in DYNAMICS:
            out.append('    <dynamics damping="{}" friction="{}"/>'.format(*DYNAMICS[name]))
        if name == "other":
            out.append('    <mimic joint="slide" multiplier="-1.5" offset="0.02"/>')
        out.append("  </joint>")
    return "\n".join(out + ["</robot>"]) + "\n"


def link(name, place):
    com, mass, moments = LINKS[name]
    inertia = "".join(f"<{key}>{value}</{key}>" for key, value in zip(ENTRIES, moments))
    return (f'    <link name="{name}">{place}\n      <inertial><pose>{words(com)}</pose><mass>{mass}</mass>'
            f"<inertia>{inertia}</inertia></inertial>\n    </link>")


def joint(name, kind, parent, child, limits, place, axis, mimic=""):
    text = [f'    <joint name="{name}" type="{kind}">{place}<parent>{parent}</parent><child>{child}</child>']
    if axis:
        lower, upper, effort, velocity = limits
        bounds = "" if lower is None else f"<lower>{lower}</lower><upper>{upper}</upper>"
        text.append(f"      <axis>{axis}<limit>{bounds}<effort>{effort}</effort><velocity>{velocity}</velocity></limit>")
        if name in DYNAMICS:
            text.append("        <dynamics><damping>{}</damping><friction>{}</friction></dynamics>".format(*DYNAMICS[name]))
        text.append(f"      {mimic}</axis>")
    return "\n".join(text + ["    </joint>"])


MIMIC = '<mimic joint="slide"><multiplier>-1.5</multiplier><offset>0.035</offset><reference>-0.01</reference></mimic>'
IN_MODEL = {"base": pose(0.5, -0.2, 0.1, 0.4, 0.3, -0.6)}
for _, _, parent, child, origin, _, _ in JOINTS:
    IN_MODEL[child] = IN_MODEL[parent] @ pose(*origin)
PLACED = pose(1, 2, 3, 0.3, -0.5, 0.7)
# The base's own place, which URDF has not: the world is fixed to it.
BASE = PLACED @ IN_MODEL["base"]


def in_model():
    """Version 1.6: all links in the model's frame, and some axes, too. The base is fixed in the world by a joint."""
    out = ['<?xml version="1.0"?>', '<sdf version="1.6">', '  <model name="arm">', f"    <pose>{six(PLACED)}</pose>"]
    out += [link(name, f"<pose>{six(IN_MODEL[name])}</pose>") for name in reversed(LINKS)]
    out.append(joint("world/base", "fixed", "world", "base", None, "", None))
    for name, kind, parent, child, _, axis, limits in reversed(JOINTS):
        text = axis and f"<xyz>{words(axis)}</xyz><use_parent_model_frame>0</use_parent_model_frame>"
        if name in ("elbow", "slide"):
            turned = words(IN_MODEL[child][:3, :3] @ axis)
            text = f"<xyz>{turned}</xyz><use_parent_model_frame>true</use_parent_model_frame>"
        place = f"<pose>{words((0, 0, 0.01, 0, 0, 0))}</pose>" if name == "slide" else ""
        out.append(joint(name, kind, parent, child, limits, place, text, MIMIC if name == "other" else ""))
    return "\n".join(out + ["  </model>", "</sdf>"]) + "\n"


def relative():
    """Version 1.11, in a world: joints in their parents, links in their joints, through frames and other formats."""
    place = pose(0.2, 0.1, 0, 0.1, 0, 0.5)
    out = ['<?xml version="1.0"?>', '<sdf version="1.11">', '<world name="default">', "  <gravity>0 0 -9.8</gravity>",
           '  <physics type="ode"/>', '  <model name="arm" placement_frame="base" canonical_link="upper">',
           f'    <pose degrees="false" rotation_format="quat_xyzw">{seven(BASE)}</pose>']
    out.append(f'    <frame name="mount" attached_to="base"><pose>{six(place)}</pose></frame>')
    out.append(f'    <frame name="on_elbow" attached_to="elbow"/>')
    out.append(f'    <frame name="tool" attached_to="on_elbow"><pose relative_to="nail">0 0 0.5 0 0 0</pose></frame>')
    out.append(link("base", f"<pose>{six(IN_MODEL['base'])}</pose>"))
    for name, kind, parent, child, origin, axis, limits in JOINTS:
        T = pose(*origin)
        turn = pose(0, 0, 0, 0.3, 0, -0.8)
        if name == "elbow":
            # The joint's frame is turned against its child.
            text = f'<xyz expressed_in="lower">{words(axis)}</xyz>'
            out.append(joint(name, kind, parent, child, limits, f'<pose relative_to="upper">{six(T @ turn)}</pose>', text))
            degrees = [float(v) for v in six(np.linalg.inv(turn)).split()]
            degrees = words([*degrees[:3], *np.rad2deg(degrees[3:])])
            out.append(link(child, f'<pose relative_to="elbow" degrees="true">{degrees}</pose>'))
            continue
        at, to = (parent, T)
        if name == "shoulder":
            at, to = "mount", np.linalg.inv(place) @ T
        if name == "slide":
            at, to = "__model__", IN_MODEL[child]
        text = axis and f"<xyz>{words(axis)}</xyz>"
        if name == "slide":
            turned = words((IN_MODEL["upper"][:3, :3].T @ IN_MODEL[child][:3, :3]) @ axis)
            text = f'<xyz expressed_in="upper">{turned}</xyz>'
        carrier = "mount" if name == "shoulder" else "on_elbow" if parent == "lower" else parent
        place_text = f'<pose relative_to="{at}" rotation_format="quat_xyzw">{seven(to)}</pose>'
        out.append(joint(name, kind, carrier, child, limits, place_text, text, MIMIC if name == "other" else ""))
        out.append(link(child, f'<pose relative_to="{name}"/>'))
    return "\n".join(out + ["  </model>", "</world>", "</sdf>"]) + "\n"


def at_base():
    """Version 1.8: the base at the origin of the world, and nothing that says that it is attached."""
    out = ['<sdf version="1.8">', '  <model name="arm">', link("base", "")]
    for name, kind, parent, child, origin, axis, limits in JOINTS:
        out.append(link(child, f'<pose relative_to="{parent}">{words(origin)}</pose>'))
        text = axis and f"<xyz>{words(axis)}</xyz>"
        out.append(joint(name, kind, parent, child, limits, "", text, MIMIC if name == "other" else ""))
    return "\n".join(out + ["  </model>", "</sdf>"]) + "\n"


for name, text in [("arm.urdf", urdf()), ("arm_in_model.sdf", in_model()), ("arm_relative.sdf", relative()),
                   ("arm_at_base.sdf", at_base())]:
    open(name, "w").write(text)
print(words(BASE[:3].flatten()))
