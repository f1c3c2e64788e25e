//! SDF files that are wrong, or ask for what is not supported.

/// What is wrong, the file, and its error.
pub const SDF: &[(&str, &str, &str)] = &[
    ("no version", "<sdf>\n<model name='m'/></sdf>", "robot.xml:1:1: sdf: attribute `version` is missing"),
    (
        "a version that is none",
        "<sdf version='one'><model name='m'/></sdf>",
        "robot.xml:1:15: sdf: a version is like `1.7`, and this one is `one`",
    ),
    ("no model", "<sdf version='1.7'/>", "robot.xml:1:1: sdf: there is no `model` in it"),
    ("an empty world", "<sdf version='1.7'>\n<world name='w'/></sdf>", "robot.xml:1:1: sdf: there is no `model` in it"),
    (
        "several models",
        "<sdf version='1.7'><world name='w'>\n<model name='ground'/>\n<model name='robot'/><model name='cup'/></world></sdf>",
        "robot.xml:3:1: model `robot`: there are 3 models: `ground`, `robot`, `cup` (keep the one that is the robot)",
    ),
    (
        "two worlds",
        "<sdf version='1.7'><world name='v'/>\n<world name='w'/></sdf>",
        "robot.xml:2:1: world `w`: only one `world` is allowed in a `sdf`; the first is at line 1",
    ),
    (
        "a model without links",
        "<sdf version='1.9'>\n<model name='m'>\n</model></sdf>",
        "robot.xml:1:1: sdf: the robot has no links",
    ),
    (
        "a model without a name",
        "<sdf version='1.7'>\n<model/></sdf>",
        "robot.xml:2:1: model: attribute `name` is missing",
    ),
    (
        "a model in a model",
        "<sdf version='1.9'>\n<model name='m'>\n<model name='n'/>\n</model></sdf>",
        "robot.xml:3:1: model `n`: models in models are not supported; write one model without them",
    ),
    (
        "an included file",
        "<sdf version='1.9'>\n<model name='m'>\n<include><uri>model://arm</uri></include>\n</model></sdf>",
        "robot.xml:3:1: include of model `m`: `include` is not supported: only one file is read (replace it by the included model, or remove it if the robot does not need it)",
    ),
    (
        "a file included in the world",
        "<sdf version='1.7'><world name='w'>\n<include><uri>model://arm</uri></include></world></sdf>",
        "robot.xml:2:1: include of world `w`: `include` is not supported: only one file is read (replace it by the included model, or remove it if the robot does not need it)",
    ),
    (
        "a joint in the world",
        "<sdf version='1.7'><world name='w'>\n<joint name='j'/></world></sdf>",
        "robot.xml:2:1: joint `j`: joints outside a model are not supported",
    ),
    (
        "a document type",
        "<!DOCTYPE sdf SYSTEM 'http://example.com/x.dtd'>\n<sdf version='1.7'/>",
        "robot.xml:1:1: `<!DOCTYPE` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
    ),
    (
        "a ball joint",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='ball'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `ball` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a universal joint",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='universal'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `universal` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a screw",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='screw'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `screw` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a gearbox",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='gearbox'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `gearbox` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a joint with two axes",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute2'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `revolute2` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a type that is misspelt",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolut'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:23: joint `j`: type `revolut` is not a type of joint; valid: `fixed`, `revolute`, `continuous`, `prismatic` (did you mean `revolute`?)",
    ),
    (
        "a joint without a type",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j'>\n<parent>a</parent><child>b</child></joint></model></sdf>",
        "robot.xml:5:1: joint `j`: attribute `type` is missing",
    ),
    (
        "a joint without a child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent></joint></model></sdf>",
        "robot.xml:5:1: joint `j`: a `child` element is missing",
    ),
    (
        "a joint without a parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<child>a</child></joint></model></sdf>",
        "robot.xml:5:1: joint `j`: a `parent` element is missing",
    ),
    (
        "an empty parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent> </parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:6:1: parent of joint `j`: it must not be empty",
    ),
    (
        "an unknown parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>c</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:6:9: parent of joint `j`: there is no link, joint or frame `c`; known: `__model__`, `a`, `b`, `j`",
    ),
    (
        "a child in another model",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>arm::c</child>\n</joint>\n</model></sdf>",
        "robot.xml:7:8: child of joint `j`: `arm::c` is in another model, and only this one is read",
    ),
    (
        "the world as a child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>world</child>\n</joint>\n</model></sdf>",
        "robot.xml:7:8: child of joint `j`: the world can only be the parent of a joint",
    ),
    (
        "a link that is its own parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>a</child>\n</joint>\n</model></sdf>",
        "robot.xml:7:8: child of joint `j`: link `a` is its own parent",
    ),
    (
        "a joint that is its own child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>j</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:1: joint `j`: frames are placed relative to each other in a cycle: `j`",
    ),
    (
        "a closed loop",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'><parent>a</parent>\n<child>b</child></joint>\n<joint name='k' type='fixed'><parent>b</parent>\n<child>a</child></joint>\n</model></sdf>",
        "robot.xml:3:1: link `a`: closed kinematic loop along `a`, `b`; a robot must be a tree",
    ),
    (
        "a link with two parents",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<link name='c'><inertial/></link>\n<joint name='j' type='fixed'><parent>a</parent>\n<child>c</child></joint>\n<joint name='k' type='fixed'><parent>b</parent>\n<child>c</child></joint>\n</model></sdf>",
        "robot.xml:9:8: child of joint `k`: link `c` is already the child of joint `j` (line 6); closed loops are not supported",
    ),
    (
        "a joint without an axis",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "robot.xml:5:1: joint `j`: a joint that moves must have an `axis`",
    ),
    (
        "an axis without a direction",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<limit/></axis></joint>\n</model></sdf>",
        "robot.xml:8:1: axis of joint `j`: a `xyz` element is missing",
    ),
    (
        "an axis of length 0",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 0</xyz></axis></joint>\n</model></sdf>",
        "robot.xml:8:1: axis of joint `j`: the axis must be non-zero; found 0 0 0",
    ),
    (
        "an axis in an unknown frame",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz expressed_in='c'>0 0 1</xyz></axis></joint>\n</model></sdf>",
        "robot.xml:9:20: xyz of joint `j`: there is no link, joint or frame `c`; known: `__model__`, `a`, `b`, `j`",
    ),
    (
        "limits in the wrong order",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>1</lower>\n<upper>-1</upper></limit></axis></joint>\n</model></sdf>",
        "robot.xml:10:8: lower of joint `j`: the lower limit 1 is greater than the upper limit -1",
    ),
    (
        "a limit that is infinite on the wrong side",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>inf</lower></limit></axis></joint>\n</model></sdf>",
        "robot.xml:10:1: limit of joint `j`: `lower` must not be inf",
    ),
    (
        "a limit that is not a number",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>none</lower></limit></axis></joint>\n</model></sdf>",
        "robot.xml:10:15: lower of joint `j`: its value holds `none`, which is not a number",
    ),
    (
        "negative damping",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<dynamics>\n<damping>-1</damping></dynamics></axis></joint>\n</model></sdf>",
        "robot.xml:11:1: damping of joint `j`: damping must be at least 0 and at most 1e30; found -1",
    ),
    (
        "negative stiffness",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<dynamics>\n<spring_stiffness>-1</spring_stiffness></dynamics></axis></joint>\n</model></sdf>",
        "robot.xml:5:1: joint `j`: stiffness must be at least 0 and at most 1e30; found -1",
    ),
    (
        "an unknown joint that is followed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='k'/></axis></joint>\n</model></sdf>",
        "robot.xml:10:15: mimic of joint `j`: there is no joint `k`; known: `j`",
    ),
    (
        "a second axis that is followed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='j' axis='axis2'/></axis></joint>\n</model></sdf>",
        "robot.xml:10:24: mimic of joint `j`: only one `axis` per joint is supported; `axis2` is not",
    ),
    (
        "a joint that follows itself",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='j'/></axis></joint>\n</model></sdf>",
        "robot.xml:10:15: mimic of joint `j`: a joint cannot follow itself",
    ),
    (
        "links in a circle of places",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><pose relative_to='b'/></link>\n<link name='b'><pose relative_to='c'/></link>\n<frame name='c' attached_to='a'/>\n</model></sdf>",
        "robot.xml:5:1: frame `c`: frames are placed relative to each other in a cycle: `c`, `a`, `b`",
    ),
    (
        "a frame attached to itself",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f' attached_to='f'><pose relative_to='a'/></frame>\n</model></sdf>",
        "robot.xml:5:1: frame `f`: frames are attached to each other in a cycle: `f`",
    ),
    (
        "a frame too far away",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f'><pose>1e200 0 0 0 0 0</pose></frame>\n</model></sdf>",
        "robot.xml:5:1: frame `f`: positions must be below 1e30 m",
    ),
    (
        "a frame attached to what is unknown",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f' attached_to='aa'/>\n</model></sdf>",
        "robot.xml:5:30: frame `f`: there is no link, joint or frame `aa`; known: `__model__`, `a`, `b`, `f` (did you mean `a`?)",
    ),
    (
        "a place relative to what is unknown",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose relative_to='base'>0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "robot.xml:4:20: pose of link `a`: there is no link, joint or frame `base`; known: `__model__`, `a`",
    ),
    (
        "two links of one name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'/>\n<link name='a'/>\n</model></sdf>",
        "robot.xml:4:13: link `a`: a link at line 3 has this name, too; names must differ",
    ),
    (
        "two frames of one name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f'/>\n<frame name='f'/>\n</model></sdf>",
        "robot.xml:6:14: frame `f`: a frame at line 5 has this name, too; names must differ",
    ),
    (
        "a frame called world",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'/>\n<frame name='world'/>\n</model></sdf>",
        "robot.xml:4:14: frame `world`: the name `world` is reserved for the world frame",
    ),
    (
        "a link without a name",
        "<sdf version='1.9'>\n<model name='m'>\n<link/>\n</model></sdf>",
        "robot.xml:3:1: link of model `m`: attribute `name` is missing",
    ),
    (
        "two poses",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0 0 0 0</pose>\n<pose>0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "robot.xml:5:1: pose of link `a`: only one `pose` is allowed in a `link`; the first is at line 4",
    ),
    (
        "a pose of three numbers",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0</pose></link>\n</model></sdf>",
        "robot.xml:4:7: pose of link `a`: its value must be 6 numbers, but has 3: `0 0 0`",
    ),
    (
        "a pose that is not a numbers",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0 0 0 x</pose></link>\n</model></sdf>",
        "robot.xml:4:7: pose of link `a`: its value holds `x`, which is not a number",
    ),
    (
        "a quaternion of length 0",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "robot.xml:4:35: pose of link `a`: the quaternion must be non-zero and finite when squared",
    ),
    (
        "a quaternion in degrees",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat_xyzw' degrees='true'>0 0 0 0 0 0 1</pose></link>\n</model></sdf>",
        "robot.xml:4:44: pose of link `a`: `degrees` does not apply to a quaternion",
    ),
    (
        "an unknown format of rotations",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat'>0 0 0 0 0 0 1</pose></link>\n</model></sdf>",
        "robot.xml:4:24: pose of link `a`: `rotation_format` is `quat`; valid: `euler_rpy`, `quat_xyzw` (did you mean `quat_xyzw`?)",
    ),
    (
        "a negative mass",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>-1</mass></inertial></link>\n</model></sdf>",
        "robot.xml:5:1: mass of link `a`: the mass must be at least 0; found -1",
    ),
    (
        "moments that are not positive",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>1</mass><inertia><ixx>-1</ixx></inertia></inertial></link>\n</model></sdf>",
        "robot.xml:5:15: inertia of link `a`: the principal moments of inertia must be at least 0, and are -1, 1 and 1",
    ),
    (
        "a mass that is not a number",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>1 kg</mass></inertial></link>\n</model></sdf>",
        "robot.xml:5:7: mass of link `a`: its value holds `kg`, which is not a number",
    ),
    (
        "an inertia that is to be computed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial auto='true'/></link>\n</model></sdf>",
        "robot.xml:4:17: inertial of link `a`: inertia is not computed from collision shapes (write out `mass` and `inertia`)",
    ),
    (
        "a centre of mass in another frame",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<link name='c'><inertial>\n<pose relative_to='a'/></inertial></link>\n</model></sdf>",
        "robot.xml:6:20: pose of link `c`: a centre of mass must be given in its own link, not in `a`",
    ),
    (
        "a flag that is none",
        "<sdf version='1.9'>\n<model name='m'>\n<static>maybe</static>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "robot.xml:3:9: static of model `m`: its value is `maybe`; valid: `true`, `false`, `1`, `0`, `True`, `False`",
    ),
    (
        "an unknown canonical link",
        "<sdf version='1.9'>\n<model name='m' canonical_link='c'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "robot.xml:2:33: model `m`: there is no link, joint or frame `c`; known: `__model__`, `a`, `b`",
    ),
    (
        "a canonical link that is none",
        "<sdf version='1.9'>\n<model name='m' canonical_link='f'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f'/>\n</model></sdf>",
        "robot.xml:2:33: model `m`: `f` is not a link",
    ),
    (
        "an unknown placement frame",
        "<sdf version='1.9'>\n<model name='m' placement_frame='c'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "robot.xml:2:34: model `m`: there is no link, joint or frame `c`; known: `__model__`, `a`, `b`",
    ),
    (
        "a model placed in another frame",
        "<sdf version='1.9'>\n<model name='m'>\n<pose relative_to='table'/>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "robot.xml:3:20: pose of model `m`: the pose of a model must be relative to the world, not to `table`",
    ),
    (
        "gravity of two numbers",
        "<sdf version='1.7'><world name='w'>\n<gravity>0 0</gravity><model name='m'><link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></world></sdf>",
        "robot.xml:2:10: gravity of world `w`: its value must be 3 numbers, but has 2: `0 0`",
    ),
    (
        "a mesh without a name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<visual name='v'><geometry>\n<mesh/></geometry></visual></link>\n</model></sdf>",
        "robot.xml:5:1: mesh of visual `v`: a `uri` element is missing",
    ),
    (
        "an element that is never closed",
        "<sdf version='1.7'>\n<model name='m'>",
        "robot.xml:2:1: the file ends before element `model` is closed",
    ),
];
