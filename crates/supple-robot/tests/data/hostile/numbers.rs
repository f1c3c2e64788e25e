//! Numbers that cannot be.

/// The case, the text, and the error.
pub const NUMBERS: &[(&str, &str, &str)] = &[
    (
        "a negative mass",
        r#"<robot name="r">
<link name="a"><inertial><mass value="-1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:26: mass of link `a`: the mass must be at least 0; found -1",
    ),
    (
        "a negative moment",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1"/>
<inertia ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:3:1: inertia of link `a`: the principal moments of inertia must be at least 0, and are -1, 1 and 1",
    ),
    (
        "a negative moment of a small link, too great for a warning",
        r#"<robot name="r">
<link name="a"><inertial><mass value="0.01"/>
<inertia ixx="-1e-6" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
</robot>"#,
        "robot.urdf:3:1: inertia of link `a`: the principal moments of inertia must be at least 0, and are -1e-6, 1e-5 and 1e-5",
    ),
    (
        "moments that are not positive semidefinite",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1"/>
<inertia ixx="1" ixy="2" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:3:1: inertia of link `a`: the principal moments of inertia must be at least 0, and are -1, 1 and 3 (the products of inertia are invalid; correct them or set them to 0)",
    ),
    (
        "a mass that is not a number",
        r#"<robot name="r">
<link name="a"><inertial><mass value="NaN"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:39: mass of link `a`: `value` holds `NaN`, which is not finite",
    ),
    (
        "an infinite mass",
        r#"<robot name="r">
<link name="a"><inertial><mass value="inf"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:39: mass of link `a`: `value` holds `inf`, which is not finite",
    ),
    (
        "a mass beyond all numbers",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1e999"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:39: mass of link `a`: `value` holds `1e999`, which is not finite",
    ),
    (
        "a huge mass",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1e300"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:26: mass of link `a`: the mass must be below 1e30 kg; found 1e300 (numbers of robot files are in kg, m and s; check the unit and the exponent)",
    ),
    (
        "a word for a mass",
        r#"<robot name="r">
<link name="a"><inertial><mass value="heavy"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:39: mass of link `a`: `value` holds `heavy`, which is not a number",
    ),
    (
        "a comma for a point",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1,5"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:39: mass of link `a`: `value` holds `1,5`, which is not a number",
    ),
    (
        "no mass",
        r#"<robot name="r">
<link name="a"><inertial><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>"#,
        "robot.urdf:2:16: inertial of link `a`: a `mass` element is missing",
    ),
    (
        "a moment missing",
        r#"<robot name="r">
<link name="a"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"/></inertial></link>
</robot>"#,
        "robot.urdf:3:1: inertia of link `a`: attribute `izz` is missing",
    ),
    (
        "two inertials",
        r#"<robot name="r">
<link name="a">
<inertial/>
<inertial/></link>
</robot>"#,
        "robot.urdf:4:1: inertial of link `a`: only one `inertial` is allowed in a `link`; the first is at line 3",
    ),
    (
        "a place with two numbers",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="1 2"/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `xyz` must be 3 numbers, but has 2: `1 2`",
    ),
    (
        "a place with four numbers",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="1 2 3 4"/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `xyz` must be 3 numbers, but has 4: `1 2 3 4`",
    ),
    (
        "a place with no numbers",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz=""/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `xyz` must be 3 numbers, but is empty",
    ),
    (
        "a place that is infinite",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="0 0 -inf"/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `xyz` holds `-inf`, which is not finite",
    ),
    (
        "a huge place",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="0 0 1e200"/></joint>
</robot>"#,
        "robot.urdf:4:1: joint `j`: positions must be below 1e30 m; found 1e200 (numbers of robot files are in kg, m and s; check the unit and the exponent)",
    ),
    (
        "a turn in words",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin rpy="0 0 pi"/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `rpy` holds `pi`, which is not a number",
    ),
    (
        "a very long word",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin rpy="xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"/></joint>
</robot>"#,
        "robot.urdf:5:14: origin of joint `j`: `rpy` holds `xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...`, which is not a number",
    ),
    (
        "an axis of length 0",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<axis xyz="0 0 0"/></joint>
</robot>"#,
        "robot.urdf:5:1: axis of joint `j`: the axis must be non-zero; found 0 0 0",
    ),
    (
        "an axis without numbers",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<axis/></joint>
</robot>"#,
        "robot.urdf:5:1: axis of joint `j`: attribute `xyz` is missing",
    ),
    (
        "two origins",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin/>
<origin/></joint>
</robot>"#,
        "robot.urdf:6:1: origin of joint `j`: only one `origin` is allowed in a `joint`; the first is at line 5",
    ),
    (
        "negative damping",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<dynamics damping="-0.1"/></joint>
</robot>"#,
        "robot.urdf:5:20: dynamics of joint `j`: damping must be at least 0 and at most 1e30; found -0.1",
    ),
    (
        "negative friction",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><dynamics friction="-2e-9"/></joint>
</robot>"#,
        "robot.urdf:4:90: dynamics of joint `j`: friction must be at least 0 and at most 1e30; found -2e-9",
    ),
    (
        "negative effort",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><limit effort="-1" velocity="1"/></joint>
</robot>"#,
        "robot.urdf:4:85: limit of joint `j`: effort must be at least 0; found -1",
    ),
    (
        "limits that cross",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/>
<limit lower="1" upper="-1" effort="1" velocity="1"/></joint>
</robot>"#,
        "robot.urdf:5:15: limit of joint `j`: the lower limit 1 is greater than the upper limit -1",
    ),
    (
        "a revolute joint without limits",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:1: joint `j`: a revolute joint must have a `limit` with `lower`, `upper`, `effort` and `velocity` (use type `continuous` for a revolute joint without limits)",
    ),
    (
        "a prismatic joint without limits",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:1: joint `j`: a prismatic joint must have a `limit` with `lower`, `upper`, `effort` and `velocity`",
    ),
    (
        "a floating joint",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="floating"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:23: joint `j`: type `floating` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a planar joint",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="planar"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:23: joint `j`: type `planar` is not supported; valid: `fixed`, `revolute`, `continuous`, `prismatic`",
    ),
    (
        "a misspelt type",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolut"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:23: joint `j`: type `revolut` is not a type of joint; valid: `fixed`, `revolute`, `continuous`, `prismatic` (did you mean `revolute`?)",
    ),
    (
        "huge damping",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<dynamics damping="1e31"/></joint>
</robot>"#,
        "robot.urdf:5:20: dynamics of joint `j`: damping must be at least 0 and at most 1e30; found 1e31",
    ),
    (
        "a huge ratio",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><mimic joint="k" multiplier="1e300"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/></joint>
</robot>"#,
        "robot.urdf:5:1: joint `j`: positions, ratios and offsets must be below 1e30",
    ),
    (
        "negative velocity",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<limit effort="1" velocity="-1"/></joint>
</robot>"#,
        "robot.urdf:5:29: limit of joint `j`: velocity must be at least 0; found -1",
    ),
    (
        "no type",
        r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j"><parent link="a"/><child link="b"/></joint>
</robot>"#,
        "robot.urdf:4:1: joint `j`: attribute `type` is missing",
    ),
];
