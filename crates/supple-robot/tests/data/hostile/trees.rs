//! Links and joints that make no tree.

/// The case, the text, and the error.
pub const TREES: &[(&str, &str, &str)] = &[
    (
        "no links",
        r#"<robot name="r">

</robot>"#,
        "robot.urdf:1:1: robot `r`: the robot has no links",
    ),
    (
        "two roots",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:1: link `c`: two root links: this one and `a` (line 2); a robot must have one root",
    ),
    (
        "a loop apart",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="b"/><child link="c"/></joint>
<joint name="k" type="continuous"><parent link="c"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:3:1: link `b`: closed kinematic loop along `b`, `c`; a robot must be a tree",
    ),
    (
        "a loop alone",
        r#"<robot name="r">
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="b"/><child link="c"/></joint>
<joint name="k" type="continuous"><parent link="c"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:2:1: link `b`: closed kinematic loop along `b`, `c`; a robot must be a tree",
    ),
    (
        "a loop with a tail",
        r#"<robot name="r">
<link name="a"/>
<link name="d"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="b"/><child link="c"/></joint>
<joint name="k" type="continuous"><parent link="c"/><child link="b"/></joint>
<joint name="l" type="continuous"><parent link="c"/><child link="d"/></joint>
</robot>"#,
        "robot.urdf:4:1: link `b`: closed kinematic loop along `b`, `c`; a robot must be a tree",
    ),
    (
        "a link that is its own parent",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="b"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:66: child of joint `j`: link `b` is its own parent",
    ),
    (
        "a closed loop",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="continuous"><parent link="a"/><child link="c"/></joint>
<joint name="l" type="continuous"><parent link="b"/><child link="c"/></joint>
</robot>"#,
        "robot.urdf:7:66: child of joint `l`: link `c` is already the child of joint `k` (line 6); closed loops are not supported",
    ),
    (
        "a link name twice",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="a"/>
</robot>"#,
        "robot.urdf:4:13: link `a`: there is another link `a`, at line 2; names must differ",
    ),
    (
        "a joint name twice",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
<joint name="j" type="continuous"><parent link="a"/><child link="c"/></joint>
</robot>"#,
        "robot.urdf:6:14: joint `j`: there is another joint `j`, at line 5; names must differ",
    ),
    (
        "an unknown parent",
        r#"<robot name="r">
<link name="base"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="bse"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:49: parent of joint `j`: there is no link `bse`; known: `base`, `b` (did you mean `base`?)",
    ),
    (
        "an unknown child",
        r#"<robot name="r">
<link name="a"/>
<joint name="j" type="continuous"><parent link="a"/><child link="zzz"/></joint>
</robot>"#,
        "robot.urdf:3:66: child of joint `j`: there is no link `zzz`; known: `a`",
    ),
    (
        "a joint without a parent",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:1: joint `j`: a `parent` element is missing",
    ),
    (
        "a joint with two parents",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:48: parent of joint `j`: only one `parent` is allowed in a `joint`; the first is at line 4",
    ),
    (
        "a parent without a name",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:30: parent of joint `j`: attribute `link` is missing",
    ),
    (
        "a link without a name",
        r#"<robot name="r">
<link name="a"/>
<link/>
</robot>"#,
        "robot.urdf:3:1: link of robot `r`: attribute `name` is missing",
    ),
    (
        "a link with an empty name",
        r#"<robot name="r">
<link name="a"/>
<link name=" "/>
</robot>"#,
        "robot.urdf:3:13: link of robot `r`: attribute `name` is empty",
    ),
    (
        "a joint without a name",
        r#"<robot name="r">
<link name="a"/>
<joint type="fixed"/>
</robot>"#,
        "robot.urdf:3:1: joint of robot `r`: attribute `name` is missing",
    ),
    (
        "a robot without a name",
        r#"<robot>
<link name="a"/></robot>"#,
        "robot.urdf:1:1: robot: attribute `name` is missing",
    ),
    (
        "a joint that follows none there is",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><mimic joint="k"/></joint>
</robot>"#,
        "robot.urdf:4:84: mimic of joint `j`: there is no joint `k`; known: `j`",
    ),
    (
        "a joint that follows itself",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><mimic joint="j"/></joint>
</robot>"#,
        "robot.urdf:4:84: mimic of joint `j`: a joint cannot follow itself",
    ),
    (
        "joints that follow one another",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><mimic joint="k"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/><mimic joint="j"/></joint>
</robot>"#,
        "robot.urdf:5:70: mimic of joint `j`: mimic joints form a cycle: `j`, `k`",
    ),
    (
        "a joint that follows a fixed one",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><mimic joint="k"/></joint>
<joint name="k" type="fixed"><parent link="b"/><child link="c"/></joint>
</robot>"#,
        "robot.urdf:5:84: mimic of joint `j`: joint `k` is fixed and cannot be followed",
    ),
    (
        "ratios that multiply to a huge one",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<link name="d"/>
<link name="e"/>
<joint name="j0" type="continuous"><parent link="a"/><child link="b"/><mimic joint="j1" multiplier="1e20"/></joint>
<joint name="j1" type="continuous"><parent link="b"/><child link="c"/><mimic joint="j2" multiplier="1e20"/></joint>
<joint name="j2" type="continuous"><parent link="c"/><child link="d"/></joint>
</robot>"#,
        "robot.urdf:7:1: joint `j0`: the product of the mimic ratios along the chain must be below 1e30",
    ),
];
