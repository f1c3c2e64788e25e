//! SDF files that are wrong, or ask for what is not supported.

/// What is wrong, the file, and its error.
pub const SDF: &[(&str, &str, &str)] = &[
    ("no version", "<sdf>\n<model name='m'/></sdf>", ""),
    ("a version that is none", "<sdf version='one'><model name='m'/></sdf>", ""),
    ("no model", "<sdf version='1.7'/>", ""),
    ("an empty world", "<sdf version='1.7'>\n<world name='w'/></sdf>", ""),
    (
        "several models",
        "<sdf version='1.7'><world name='w'>\n<model name='ground'/>\n<model name='robot'/><model name='cup'/></world></sdf>",
        "",
    ),
    ("two worlds", "<sdf version='1.7'><world name='v'/>\n<world name='w'/></sdf>", ""),
    ("a model without links", "<sdf version='1.9'>\n<model name='m'>\n</model></sdf>", ""),
    ("a model without a name", "<sdf version='1.7'>\n<model/></sdf>", ""),
    ("a model in a model", "<sdf version='1.9'>\n<model name='m'>\n<model name='n'/>\n</model></sdf>", ""),
    (
        "an included file",
        "<sdf version='1.9'>\n<model name='m'>\n<include><uri>model://arm</uri></include>\n</model></sdf>",
        "",
    ),
    (
        "a file included in the world",
        "<sdf version='1.7'><world name='w'>\n<include><uri>model://arm</uri></include></world></sdf>",
        "",
    ),
    ("a joint in the world", "<sdf version='1.7'><world name='w'>\n<joint name='j'/></world></sdf>", ""),
    ("a document type", "<!DOCTYPE sdf SYSTEM 'http://example.com/x.dtd'>\n<sdf version='1.7'/>", ""),
    (
        "a ball joint",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='ball'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a universal joint",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='universal'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a screw",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='screw'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a gearbox",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='gearbox'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a joint with two axes",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute2'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a type that is misspelt",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolut'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a joint without a type",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j'>\n<parent>a</parent><child>b</child></joint></model></sdf>",
        "",
    ),
    (
        "a joint without a child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent></joint></model></sdf>",
        "",
    ),
    (
        "a joint without a parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<child>a</child></joint></model></sdf>",
        "",
    ),
    (
        "an empty parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent> </parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "an unknown parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>c</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a child in another model",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>arm::c</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "the world as a child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>world</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a link that is its own parent",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>a</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a joint that is its own child",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'>\n<parent>a</parent>\n<child>j</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "a closed loop",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='fixed'><parent>a</parent>\n<child>b</child></joint>\n<joint name='k' type='fixed'><parent>b</parent>\n<child>a</child></joint>\n</model></sdf>",
        "",
    ),
    (
        "a link with two parents",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<link name='c'><inertial/></link>\n<joint name='j' type='fixed'><parent>a</parent>\n<child>c</child></joint>\n<joint name='k' type='fixed'><parent>b</parent>\n<child>c</child></joint>\n</model></sdf>",
        "",
    ),
    (
        "a joint without an axis",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n</joint>\n</model></sdf>",
        "",
    ),
    (
        "an axis without a direction",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<limit/></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "an axis of length 0",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 0</xyz></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "an axis in an unknown frame",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz expressed_in='c'>0 0 1</xyz></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "limits in the wrong order",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>1</lower>\n<upper>-1</upper></limit></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "a limit that is infinite on the wrong side",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>inf</lower></limit></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "a limit that is no number",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<limit><lower>none</lower></limit></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "negative damping",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<dynamics>\n<damping>-1</damping></dynamics></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "negative stiffness",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<dynamics>\n<spring_stiffness>-1</spring_stiffness></dynamics></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "an unknown joint that is followed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='k'/></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "a second axis that is followed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='j' axis='axis2'/></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "a joint that follows itself",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<joint name='j' type='revolute'>\n<parent>a</parent>\n<child>b</child>\n<axis>\n<xyz>0 0 1</xyz>\n<mimic joint='j'/></axis></joint>\n</model></sdf>",
        "",
    ),
    (
        "links in a circle of places",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><pose relative_to='b'/></link>\n<link name='b'><pose relative_to='c'/></link>\n<frame name='c' attached_to='a'/>\n</model></sdf>",
        "",
    ),
    (
        "a frame attached to itself",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f' attached_to='f'><pose relative_to='a'/></frame>\n</model></sdf>",
        "",
    ),
    (
        "a frame attached to what is unknown",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f' attached_to='aa'/>\n</model></sdf>",
        "",
    ),
    (
        "a place relative to what is unknown",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose relative_to='base'>0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "two links of one name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'/>\n<link name='a'/>\n</model></sdf>",
        "",
    ),
    (
        "two frames of one name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f'/>\n<frame name='f'/>\n</model></sdf>",
        "",
    ),
    ("a link called world", "<sdf version='1.9'>\n<model name='m'>\n<link name='world'/>\n</model></sdf>", ""),
    ("a link without a name", "<sdf version='1.9'>\n<model name='m'>\n<link/>\n</model></sdf>", ""),
    (
        "two poses",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0 0 0 0</pose>\n<pose>0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "a pose of three numbers",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "a pose that is no numbers",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose>0 0 0 0 0 x</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "a quaternion of length 0",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 0</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "a quaternion in degrees",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat_xyzw' degrees='true'>0 0 0 0 0 0 1</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "an unknown format of rotations",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<pose rotation_format='quat'>0 0 0 0 0 0 1</pose></link>\n</model></sdf>",
        "",
    ),
    (
        "a negative mass",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>-1</mass></inertial></link>\n</model></sdf>",
        "",
    ),
    (
        "moments that are not positive",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>1</mass><inertia><ixx>-1</ixx></inertia></inertial></link>\n</model></sdf>",
        "",
    ),
    (
        "a mass that is no number",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial>\n<mass>1 kg</mass></inertial></link>\n</model></sdf>",
        "",
    ),
    (
        "an inertia that is to be computed",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<inertial auto='true'/></link>\n</model></sdf>",
        "",
    ),
    (
        "a centre of mass in another frame",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<link name='c'><inertial>\n<pose relative_to='a'/></inertial></link>\n</model></sdf>",
        "",
    ),
    (
        "a flag that is none",
        "<sdf version='1.9'>\n<model name='m'>\n<static>maybe</static>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "",
    ),
    (
        "an unknown canonical link",
        "<sdf version='1.9'>\n<model name='m' canonical_link='c'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "",
    ),
    (
        "a canonical link that is none",
        "<sdf version='1.9'>\n<model name='m' canonical_link='f'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n<frame name='f'/>\n</model></sdf>",
        "",
    ),
    (
        "an unknown placement frame",
        "<sdf version='1.9'>\n<model name='m' placement_frame='c'>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "",
    ),
    (
        "a model placed in another frame",
        "<sdf version='1.9'>\n<model name='m'>\n<pose relative_to='table'/>\n<link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></sdf>",
        "",
    ),
    (
        "gravity of two numbers",
        "<sdf version='1.7'><world name='w'>\n<gravity>0 0</gravity><model name='m'><link name='a'><inertial/></link>\n<link name='b'><inertial/></link>\n</model></world></sdf>",
        "",
    ),
    (
        "a mesh in another folder",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<visual name='v'><geometry><mesh>\n<uri>file:///etc/passwd</uri></mesh></geometry></visual></link>\n</model></sdf>",
        "",
    ),
    (
        "a mesh without a name",
        "<sdf version='1.9'>\n<model name='m'>\n<link name='a'>\n<visual name='v'><geometry>\n<mesh/></geometry></visual></link>\n</model></sdf>",
        "",
    ),
    ("an element that is never closed", "<sdf version='1.7'>\n<model name='m'>", ""),
];
