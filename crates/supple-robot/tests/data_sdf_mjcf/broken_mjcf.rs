//! MJCF files that are wrong, or ask for what is not supported.

/// What is wrong, the file, and its error.
pub const MJCF: &[(&str, &str, &str)] = &[
    (
        "no world",
        "<mujoco/>",
        "robot.xml:1:1: mujoco: there is no `worldbody` in it (this file contains settings only; load the file that includes it)",
    ),
    (
        "a file that includes another",
        "<mujoco>\n<worldbody/>\n<include file='other.xml'/></mujoco>",
        "robot.xml:3:16: include: the included file `other.xml` does not exist (files are looked for in the folder of the outermost file, and in that of the file that includes them)",
    ),
    (
        "a document type",
        "<!DOCTYPE mujoco [<!ENTITY a 'b'>]>\n<mujoco><worldbody/></mujoco>",
        "robot.xml:1:1: `<!DOCTYPE` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
    ),
    (
        "a ball joint",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j' type='ball'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:23: joint `j`: ball joints are not supported: joint `j` is one (use three hinges at the same position with different axes)",
    ),
    (
        "a ball joint of a class",
        "<mujoco><default>\n<default class='ball'>\n<joint type='ball'/></default></default>\n<worldbody>\n<body name='a'>\n<joint name='j' class='ball'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:3:14: joint: ball joints are not supported: joint `j` is one (use three hinges at the same position with different axes)",
    ),
    (
        "a free joint",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j' type='free'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:23: joint `j`: floating bases are not supported: joint `j` lets body `a` move freely (remove the joint to fix the body in the world, or give it hinges and slides)",
    ),
    (
        "a freejoint",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<freejoint name='floating'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:1: freejoint `floating`: floating bases are not supported: joint `floating` lets body `a` move freely (remove the joint to fix the body in the world, or give it hinges and slides)",
    ),
    (
        "an unknown type",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint type='hinged'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:14: joint of body `a`: `type` is `hinged`; valid: `hinge`, `slide`, `ball`, `free` (did you mean `hinge`?)",
    ),
    (
        "no mass",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: inertial of body `a`: attribute `mass` is missing",
    ),
    (
        "no centre of mass",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: inertial of body `a`: attribute `pos` is missing",
    ),
    (
        "a negative mass",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' mass='-1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:29: inertial of body `a`: the mass must be at least 0; found -1",
    ),
    (
        "negative moments",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' mass='1' diaginertia='1 1 -1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: inertial of body `a`: the principal moments of inertia must be at least 0, and are -1, 1 and 1",
    ),
    (
        "moments that are not positive",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' mass='1' fullinertia='1 1 1 2 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: inertial of body `a`: the principal moments of inertia must be at least 0, and are -1, 1 and 3 (the products of inertia are invalid; correct them or set them to 0)",
    ),
    (
        "moments given twice",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' mass='1' diaginertia='1 1 1' fullinertia='1 1 1 0 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:65: inertial of body `a`: give either `diaginertia` or `fullinertia`, not both",
    ),
    (
        "full moments in other axes",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<inertial pos='0 0 0' mass='1' euler='0 0 1' fullinertia='1 1 1 0 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:59: inertial of body `a`: `fullinertia` is in the body's axes and excludes an orientation",
    ),
    (
        "two inertials",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: inertial of body `a`: a body may have only one `inertial`; the first is at line 4",
    ),
    (
        "an inertial of the world",
        "<mujoco>\n<worldbody>\n<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</worldbody></mujoco>",
        "robot.xml:3:1: inertial: `inertial` must be inside a body, not in the world",
    ),
    (
        "a joint of the world",
        "<mujoco>\n<worldbody>\n<joint/>\n</worldbody></mujoco>",
        "robot.xml:3:1: joint: joints must be inside a body, not in the world",
    ),
    (
        "an unknown class",
        "<mujoco><default><default class='strong'/></default>\n<worldbody>\n<body name='a'>\n<joint class='strnog'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:15: joint of body `a`: there is no class `strnog`; known: `main`, `strong` (did you mean `strong`?)",
    ),
    (
        "an unknown childclass",
        "<mujoco>\n<worldbody>\n<body childclass='x'/>\n</worldbody></mujoco>",
        "robot.xml:3:19: body: there is no class `x`; known: `main`",
    ),
    (
        "a class twice",
        "<mujoco><default><default class='a'/>\n<default class='a'/></default>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:17: default: there is another class `a`, at line 1",
    ),
    (
        "a class in itself",
        "<mujoco><default><default class='a'>\n<default class='a'/></default></default>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:17: default: there is another class `a`, at line 1",
    ),
    (
        "a class called as the outermost",
        "<mujoco><default><default class='main'/></default>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:34: default: there is another class `main`",
    ),
    (
        "a class without a name",
        "<mujoco><default>\n<default/></default>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:1: default: attribute `class` is missing",
    ),
    (
        "a named outermost class",
        "<mujoco><default class='robot'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:25: default: the outermost class is `main`, and cannot be called `robot` (enclose it in a `default` without a class)",
    ),
    (
        "an element twice in a class",
        "<mujoco><default><joint/>\n<joint/></default>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:1: joint: only one `joint` is allowed in a `default`; the first is at line 1",
    ),
    (
        "an unknown joint that follows",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='jj' joint2='j'/></equality></mujoco>",
        "robot.xml:7:16: joint: there is no joint `jj`; known: `j` (did you mean `j`?)",
    ),
    (
        "an unknown joint that is followed",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j' joint2='k'/></equality></mujoco>",
        "robot.xml:7:27: joint: there is no joint `k`; known: `j`",
    ),
    (
        "a joint that follows none",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j'/></equality></mujoco>",
        "robot.xml:7:1: joint: `joint2` is missing, which locks joint `j` (remove the joint, as it does not move)",
    ),
    (
        "a joint that follows itself",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j' joint2='j'/></equality></mujoco>",
        "robot.xml:7:16: joint: a joint cannot follow itself",
    ),
    (
        "a joint that follows two",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><joint name='k'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j' joint2='k'/>\n<joint joint1='j' joint2='k'/></equality></mujoco>",
        "robot.xml:8:16: joint: joint `j` already follows another, at line 7",
    ),
    (
        "joints that follow each other",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><joint name='k'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j' joint2='k'/>\n<joint joint1='k' joint2='j'/></equality></mujoco>",
        "robot.xml:7:1: joint: mimic joints form a cycle: `j`, `k`",
    ),
    (
        "a relation that is not linear",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/><joint name='k'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<joint joint1='j' joint2='k' polycoef='0 1 2'/></equality></mujoco>",
        "robot.xml:7:40: joint: only a linear relation is supported: the last three of five coefficients must be 0",
    ),
    (
        "a weld",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<weld body1='a'/></equality></mujoco>",
        "robot.xml:7:1: weld: `weld` closes a loop of bodies, which is not supported (to plan without it, remove it or set `active=\"false\"`)",
    ),
    (
        "a connection",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<connect name='loop' body1='a' anchor='0 0 0'/></equality></mujoco>",
        "robot.xml:7:1: connect `loop`: `connect` closes a loop of bodies, which is not supported (to plan without it, remove it or set `active=\"false\"`)",
    ),
    (
        "tendons that are equal",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody><equality>\n<tendon tendon1='a'/></equality></mujoco>",
        "robot.xml:7:1: tendon: an equality of type `tendon` is not supported (where it couples two joints, write an equality of type `joint`; to plan without it, remove it or set `active=\"false\"`)",
    ),
    (
        "a quaternion of length 0",
        "<mujoco>\n<worldbody>\n<body quat='0 0 0 0'/>\n</worldbody></mujoco>",
        "robot.xml:3:13: body: the quaternion must be non-zero and finite when squared",
    ),
    (
        "an axis of length 0",
        "<mujoco>\n<worldbody>\n<body axisangle='0 0 0 90'/>\n</worldbody></mujoco>",
        "robot.xml:3:18: body: the axis must have a direction: its length is 0",
    ),
    (
        "a z axis of length 0",
        "<mujoco>\n<worldbody>\n<body zaxis='0 0 0'/>\n</worldbody></mujoco>",
        "robot.xml:3:14: body: the z axis must have a direction: its length is 0",
    ),
    (
        "parallel axes",
        "<mujoco>\n<worldbody>\n<body xyaxes='1 0 0 2 0 0'/>\n</worldbody></mujoco>",
        "robot.xml:3:15: body: the y axis must not be 0, nor parallel to the x axis",
    ),
    (
        "two orientations",
        "<mujoco>\n<worldbody>\n<body quat='1 0 0 0' euler='0 0 0'/>\n</worldbody></mujoco>",
        "robot.xml:3:29: body: give the orientation once, not by `quat`, `euler`",
    ),
    (
        "too few numbers",
        "<mujoco>\n<worldbody>\n<body pos='1 2'/>\n</worldbody></mujoco>",
        "robot.xml:3:12: body: `pos` must be 3 numbers, but has 2: `1 2`",
    ),
    (
        "too many numbers",
        "<mujoco>\n<worldbody>\n<body euler='1 2 3 4'/>\n</worldbody></mujoco>",
        "robot.xml:3:14: body: `euler` must be 3 numbers, but has 4: `1 2 3 4`",
    ),
    (
        "no number",
        "<mujoco>\n<worldbody>\n<body pos='1 2 x'/>\n</worldbody></mujoco>",
        "robot.xml:3:12: body: `pos` holds `x`, which is not a number",
    ),
    (
        "numbers with commas",
        "<mujoco>\n<worldbody>\n<body pos='1, 2, 3'/>\n</worldbody></mujoco>",
        "robot.xml:3:12: body: `pos` holds `1,`, which is not a number",
    ),
    (
        "an infinite number",
        "<mujoco>\n<worldbody>\n<body pos='1 2 inf'/>\n</worldbody></mujoco>",
        "robot.xml:3:12: body: `pos` holds `inf`, which is not finite",
    ),
    (
        "a number too great",
        "<mujoco>\n<worldbody>\n<body pos='1 2 1e40'/>\n</worldbody></mujoco>",
        "robot.xml:3:1: body: positions must be below 1e30 m; found 1e40 (numbers of robot files are in kg, m and s; check the unit and the exponent)",
    ),
    (
        "an unknown unit of angles",
        "<mujoco><compiler angle='degrees'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:26: compiler: `angle` is `degrees`; valid: `radian`, `degree` (did you mean `degree`?)",
    ),
    (
        "a misspelt unit of angles",
        "<mujoco><compiler meshdir='m' angel='radian'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:38: compiler: attribute `angel` is not known; valid: `angle`, `coordinate`, `eulerseq`, `autolimits`, `inertiafromgeom`, `inertiagrouprange`, `balanceinertia`, `boundmass`, `boundinertia`, `settotalmass` and 16 more (did you mean `angle`?)",
    ),
    (
        "a setting that is like no other",
        "<mujoco>\n<compiler qq='1'/><worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:15: compiler: attribute `qq` is not known; valid: `angle`, `coordinate`, `eulerseq`, `autolimits`, `inertiafromgeom`, `inertiagrouprange`, `balanceinertia`, `boundmass`, `boundinertia`, `settotalmass` and 16 more",
    ),
    (
        "an unknown sequence of axes",
        "<mujoco><compiler eulerseq='xyw'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:29: compiler: `eulerseq` must be three letters of `xyzXYZ`; found `xyw`",
    ),
    (
        "global coordinates",
        "<mujoco><compiler coordinate='global'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:31: compiler: global coordinates are not supported, nor are they by MuJoCo since version 2.3.4",
    ),
    (
        "a total mass",
        "<mujoco><compiler settotalmass='5'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:2:1: worldbody: `settotalmass` requires bodies with mass",
    ),
    (
        "a negative bound",
        "<mujoco><compiler boundmass='-5'/>\n<worldbody>\n\n</worldbody></mujoco>",
        "robot.xml:1:30: compiler: `boundmass` must be at least 0; found -5",
    ),
    (
        "an empty range",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint range='90 -90'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:15: joint of body `a`: the first number of `range` must be less than the second",
    ),
    (
        "an empty range of a class",
        "<mujoco><default>\n<joint range='1 1'/></default>\n<worldbody>\n<body name='a'>\n<joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:2:15: joint: the first number of `range` must be less than the second",
    ),
    (
        "limits without a range",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint limited='true'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:17: joint of body `a`: it is limited but has no `range`",
    ),
    (
        "a range that is not said to limit",
        "<mujoco><compiler autolimits='false'/>\n<worldbody>\n<body name='a'>\n<joint range='0 1'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:15: joint of body `a`: with `autolimits` off, `range` requires `limited`, \"true\" or \"false\"",
    ),
    (
        "an axis of a joint of length 0",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint axis='0 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:14: joint of body `a`: the axis must be non-zero; found 0 0 0",
    ),
    (
        "negative damping",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint damping='-1'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:17: joint of body `a`: damping must be at least 0 and at most 1e30; found -1",
    ),
    (
        "damping that is not linear",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint damping='1 2'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:17: joint of body `a`: only a linear `damping` is supported: one number",
    ),
    (
        "a spring by its frequency",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint springdamper='1 1'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:22: joint of body `a`: `springdamper` is not supported: it depends on the inertia of the whole robot (give `stiffness` and `damping`)",
    ),
    (
        "two joints of one name",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint name='j'/>\n<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:14: joint `j`: there is another joint `j`, at line 4; names must differ",
    ),
    (
        "two bodies of one name",
        "<mujoco>\n<worldbody>\n<body name='a'/>\n<body name='a'/>\n</worldbody></mujoco>",
        "robot.xml:4:13: body `a`: there is another link `a`, at line 3; names must differ",
    ),
    (
        "a body called world",
        "<mujoco>\n<worldbody>\n<body name='world'/>\n</worldbody></mujoco>",
        "robot.xml:3:13: body `world`: there is another link `world`, at line 2; names must differ",
    ),
    (
        "a mesh that gives the mass",
        "<mujoco><asset><mesh name='m' file='m.obj'/></asset>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom name='g' type='mesh' mesh='m'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:1: geom `g`: the mass of its body would follow from this mesh, and meshes are not read (give the body an `inertial`, or the geom the mass 0)",
    ),
    (
        "an unknown mesh",
        "<mujoco>\n<worldbody>\n<geom type='mesh' mesh='m'/>\n</worldbody></mujoco>",
        "robot.xml:3:25: geom: there is no mesh `m` in `asset`",
    ),
    (
        "a shell",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom size='1' shellinertia='true'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:30: geom of body `a`: the inertia of shells is not computed (give the body an `inertial`)",
    ),
    (
        "a size of 0",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom type='box' size='1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:24: geom of body `a`: number 3 of `size` must be positive; found 0",
    ),
    (
        "too many sizes",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom size='1 1 1 1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:13: geom of body `a`: `size` is at most 3 numbers, and has 4",
    ),
    (
        "a negative mass of a geom",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom size='1' mass='-1'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:22: geom of body `a`: `mass` must be at least 0; found -1",
    ),
    (
        "a place given twice",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom type='capsule' size='1' fromto='0 0 0 1 0 0' pos='1 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:39: geom of body `a`: give the position once: either `fromto` or `pos`",
    ),
    (
        "two ends in one",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom type='capsule' size='1' fromto='1 0 0 1 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:39: geom of body `a`: the points of `fromto` must differ",
    ),
    (
        "a sphere between two points",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<joint/>\n<geom size='1' fromto='0 0 0 1 0 0'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:5:24: geom of body `a`: `fromto` requires a `capsule`, `cylinder`, `box` or `ellipsoid`; found `sphere`",
    ),
    (
        "two sites of one name",
        "<mujoco>\n<worldbody>\n<site name='s'/>\n<body><site name='s'/></body>\n</worldbody></mujoco>",
        "robot.xml:4:19: site `s`: there is another site of this name, at line 3",
    ),
    (
        "a site too far away",
        "<mujoco>\n<worldbody>\n<site name='s' pos='1e31 0 0'/>\n</worldbody></mujoco>",
        "robot.xml:3:1: site `s`: positions must be below 1e30 m",
    ),
    (
        "bodies that are multiplied",
        "<mujoco>\n<worldbody>\n<replicate count='5'>\n<body/></replicate>\n</worldbody></mujoco>",
        "robot.xml:3:1: replicate: `replicate` is not supported (write the whole model out, for example with MuJoCo's `mj_saveLastXML`)",
    ),
    (
        "a composite",
        "<mujoco>\n<worldbody>\n<body name='a'>\n<composite type='cable'/>\n</body>\n</worldbody></mujoco>",
        "robot.xml:4:1: composite of body `a`: `composite` is not supported (write the whole model out, for example with MuJoCo's `mj_saveLastXML`)",
    ),
    (
        "an actuator of nothing",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor name='m'/></actuator></mujoco>",
        "robot.xml:6:1: motor `m`: it acts on nothing (name the joint that it drives: `joint`)",
    ),
    (
        "an actuator of an unknown joint",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='jj'/></actuator></mujoco>",
        "robot.xml:6:15: motor: there is no joint `jj`; known: `j`, `k` (did you mean `j`?)",
    ),
    (
        "two actuators of a name",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor name='m' joint='j'/>\n<motor name='m' joint='k'/></actuator></mujoco>",
        "robot.xml:7:14: motor `m`: there is another actuator of this name, at line 6",
    ),
    (
        "an actuator of an unknown class",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' class='x'/></actuator></mujoco>",
        "robot.xml:6:25: motor: there is no class `x`; known: `main`",
    ),
    (
        "a gear that is not a number",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' gear='x'/></actuator></mujoco>",
        "robot.xml:6:24: motor: `gear` holds `x`, which is not a number",
    ),
    (
        "an endless gear",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' gear='inf'/></actuator></mujoco>",
        "robot.xml:6:24: motor: `gear` holds `inf`, which is not finite",
    ),
    (
        "too long a gear",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' gear='1 2 3 4 5 6 7'/></actuator></mujoco>",
        "robot.xml:6:24: motor: `gear` must have at most 6 numbers; found 7",
    ),
    (
        "a control range upside down",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' ctrlrange='1 -1'/></actuator></mujoco>",
        "robot.xml:6:29: motor: the first number of `ctrlrange` must be less than the second",
    ),
    (
        "a control range of three",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' ctrlrange='1 2 3'/></actuator></mujoco>",
        "robot.xml:6:29: motor: `ctrlrange` must be 2 numbers, but has 3: `1 2 3`",
    ),
    (
        "a limit of the force without a range",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' forcelimited='true'/></actuator></mujoco>",
        "robot.xml:6:32: motor: it is limited but has no `forcerange`",
    ),
    (
        "an unknown word for limited",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<motor joint='j' ctrllimited='yes'/></actuator></mujoco>",
        "robot.xml:6:31: motor: `ctrllimited` is `yes`; valid: `true`, `false`, `auto`",
    ),
    (
        "negative damping of an actuator",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<position joint='j' kv='-1'/></actuator></mujoco>",
        "robot.xml:6:25: position: `kv` must be at least 0; found -1",
    ),
    (
        "a stiffness of a position actuator that pushes away",
        "<mujoco>\n<worldbody>\n<body name='a'><inertial mass='1' pos='0 0 0' diaginertia='1 1 1'/><joint name='j'/></body>\n</worldbody>\n<actuator>\n<position joint='j' kp='-20'/>\n</actuator></mujoco>",
        "robot.xml:6:25: position: `kp` must be at least 0; found -20",
    ),
    (
        "damping of an actuator twice",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<position joint='j' kv='1' dampratio='1'/></actuator></mujoco>",
        "robot.xml:6:39: position: give either `kv` or `dampratio`, not both",
    ),
    (
        "too many numbers of a gain",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<general joint='j' gainprm='1 2 3 4 5 6 7 8 9 10 11'/></actuator></mujoco>",
        "robot.xml:6:29: general: `gainprm` is at most 10 numbers, and has 11",
    ),
    (
        "an unknown gain",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<general joint='j' gaintype='fix'/></actuator></mujoco>",
        "robot.xml:6:30: general: `gaintype` is `fix`; valid: `fixed`, `affine`, `muscle`, `user`, `dcmotor` (did you mean `fixed`?)",
    ),
    (
        "a range that is not there to inherit",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<position joint='k' inheritrange='1'/></actuator></mujoco>",
        "robot.xml:6:35: position: its joint has no range to inherit",
    ),
    (
        "a range by itself and inherited",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<actuator>\n<position joint='j' inheritrange='1' ctrlrange='0 1'/></actuator></mujoco>",
        "robot.xml:6:35: position: give either `ctrlrange` or `inheritrange`, not both",
    ),
    (
        "a sensor of an unknown joint",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<jointpos name='s' joint='x'/></sensor></mujoco>",
        "robot.xml:6:27: jointpos `s`: there is no joint `x`; known: `j`, `k`",
    ),
    (
        "a sensor of no joint",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<jointpos name='s'/></sensor></mujoco>",
        "robot.xml:6:1: jointpos `s`: attribute `joint` is missing",
    ),
    (
        "a sensor of an unknown site",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<framepos objtype='site' objname='x'/></sensor></mujoco>",
        "robot.xml:6:35: framepos: there is no site `x`; there are none",
    ),
    (
        "a sensor of an unknown body",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<framequat objtype='xbody' objname='b'/></sensor></mujoco>",
        "robot.xml:6:37: framequat: there is no body `b`; known: `a`, `a/j`, `world`",
    ),
    (
        "a sensor of an unknown kind of thing",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<framequat objtype='link' objname='a'/></sensor></mujoco>",
        "robot.xml:6:21: framequat: `objtype` is `link`; valid: `body`, `xbody`, `geom`, `site`, `camera`",
    ),
    (
        "a sensor of an unknown actuator",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<actuatorpos actuator='m'/></sensor></mujoco>",
        "robot.xml:6:24: actuatorpos: there is no actuator `m`; there are none",
    ),
    (
        "two sensors of a name",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<sensor>\n<jointpos name='s' joint='j'/>\n<touch name='s'/></sensor></mujoco>",
        "robot.xml:7:14: touch `s`: there is another sensor of this name, at line 6",
    ),
    (
        "too many positions",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<keyframe>\n<key qpos='1 2 3'/></keyframe></mujoco>",
        "robot.xml:6:12: key: `qpos` has 3 numbers, and the robot has 2 moving joints",
    ),
    (
        "too many controls",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<keyframe>\n<key name='h' ctrl='1'/></keyframe></mujoco>",
        "robot.xml:6:21: key `h`: `ctrl` has 1 numbers, and the robot has 0 actuators",
    ),
    (
        "a velocity that is not a number",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<keyframe>\n<key qvel='1 nan'/></keyframe></mujoco>",
        "robot.xml:6:12: key: `qvel` holds `nan`, which is not finite",
    ),
    (
        "two keyframes of a name",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n</worldbody>\n<keyframe>\n<key name='h'/>\n<key name='h'/></keyframe></mujoco>",
        "robot.xml:7:12: key `h`: there is another keyframe `h`, at line 6",
    ),
    (
        "a box without size",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body><geom name='box' type='box'/>\n</worldbody>\n</mujoco>",
        "robot.xml:3:135: geom `box`: number 1 of `size` must be positive; found 0",
    ),
    (
        "two walls of a name",
        "<mujoco>\n<worldbody>\n<body name='a'><joint name='j' range='-1 1'/><joint name='k' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body><geom name='p' type='plane'/><geom name='p' type='plane'/>\n</worldbody>\n</mujoco>",
        "robot.xml:2:1: worldbody: there are two geoms `p`, at lines 3 and 3",
    ),
];
