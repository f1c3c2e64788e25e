//! Mesh files that a robot file must not reach: the robot loads without them.

/// The case, the text, and the warning.
pub const LEFT_OUT: &[(&str, &str, &str)] = &[
    (
        "out of the folder",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="../secret.stl"/></geometry></visual></link>
</robot>"#,
        "mesh `../secret.stl` is left out: it is outside the robot file's folder and all package roots (line 3)",
    ),
    (
        "out of the folder from within",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="meshes/../../secret.stl"/></geometry></visual></link>
</robot>"#,
        "mesh `meshes/../../secret.stl` is left out: it is outside the robot file's folder and all package roots (line 3)",
    ),
    (
        "out of the folder as Windows has it",
        "<robot name=\"r\">\n<link name=\"a\"><visual><geometry>\n<mesh filename=\"..\\..\\secret.stl\"/></geometry></visual></link>\n</robot>",
        r#"mesh `..\..\secret.stl` is left out: it is outside the robot file's folder and all package roots (line 3)"#,
    ),
    (
        "from the top",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="/etc/passwd"/></geometry></visual></link>
</robot>"#,
        "mesh `/etc/passwd` is left out: it is outside the robot file's folder and all package roots (line 3)",
    ),
    (
        "a drive",
        "<robot name=\"r\">\n<link name=\"a\"><visual><geometry>\n<mesh filename=\"C:\\secret.stl\"/></geometry></visual></link>\n</robot>",
        r#"mesh `C:\secret.stl` is left out: it must be relative, or begin with `package://`, `model://` or `file://` (line 3)"#,
    ),
    (
        "a file scheme",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="file:///etc/passwd"/></geometry></visual></link>
</robot>"#,
        "mesh `file:///etc/passwd` is left out: it is outside the robot file's folder and all package roots (line 3)",
    ),
    (
        "the net",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="http://example.com/a.stl"/></geometry></visual></link>
</robot>"#,
        "mesh `http://example.com/a.stl` is left out: it must be relative, or begin with `package://`, `model://` or `file://` (line 3)",
    ),
    (
        "the net in capitals",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="HTTPS://example.com/a.stl"/></geometry></visual></link>
</robot>"#,
        "mesh `HTTPS://example.com/a.stl` is left out: it must be relative, or begin with `package://`, `model://` or `file://` (line 3)",
    ),
    (
        "a package that is none",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="package://../secret.stl"/></geometry></visual></link>
</robot>"#,
        "mesh `package://../secret.stl` is left out: it must name a package and a file in it: `package://NAME/FILE` (line 3)",
    ),
    (
        "a package without a file",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="package://arm"/></geometry></visual></link>
</robot>"#,
        "mesh `package://arm` is left out: it must name a package and a file in it: `package://NAME/FILE` (line 3)",
    ),
];

/// The case, the text, and the error.
pub const MESHES: &[(&str, &str, &str)] = &[(
    "no name",
    r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename=""/></geometry></visual></link>
</robot>"#,
    "robot.urdf:3:17: mesh of link `a`: attribute `filename` is empty",
)];
