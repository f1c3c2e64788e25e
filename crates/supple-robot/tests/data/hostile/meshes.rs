//! Mesh files that a robot file must not reach.

/// What it is, the text, and the error.
pub const MESHES: &[(&str, &str, &str)] = &[
    (
        "out of the folder",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="../secret.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `../secret.stl` leads out of the robot file's folder (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "out of the folder from within",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="meshes/../../secret.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `meshes/../../secret.stl` leads out of the robot file's folder (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "out of the folder as Windows has it",
        "<robot name=\"r\">\n<link name=\"a\"><visual><geometry>\n<mesh filename=\"..\\..\\secret.stl\"/></geometry></visual></link>\n</robot>",
        r#"robot.urdf:3:17: mesh of link `a`: mesh `..\..\secret.stl` leads out of the robot file's folder (meshes are in the robot file's folder or in a declared package root)"#,
    ),
    (
        "from the top",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="/etc/passwd"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `/etc/passwd` leads out of the robot file's folder (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "a drive",
        "<robot name=\"r\">\n<link name=\"a\"><visual><geometry>\n<mesh filename=\"C:\\secret.stl\"/></geometry></visual></link>\n</robot>",
        r#"robot.urdf:3:17: mesh of link `a`: mesh `C:\secret.stl` must be relative, or begin with `package://`, `model://` or `file://` (meshes are in the robot file's folder or in a declared package root)"#,
    ),
    (
        "a file scheme",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="file:///etc/passwd"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `file:///etc/passwd` leads out of the robot file's folder (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "the net",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="http://example.com/a.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `http://example.com/a.stl` must be relative, or begin with `package://`, `model://` or `file://` (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "the net in capitals",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="HTTPS://example.com/a.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `HTTPS://example.com/a.stl` must be relative, or begin with `package://`, `model://` or `file://` (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "a package that is none",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="package://../secret.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `package://../secret.stl` must name a package and a file in it: `package://NAME/FILE` (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "a package without a file",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="package://arm"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: mesh `package://arm` must name a package and a file in it: `package://NAME/FILE` (meshes are in the robot file's folder or in a declared package root)",
    ),
    (
        "no name",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename=""/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: attribute `filename` is empty",
    ),
    (
        "a scale with two numbers",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="a.stl" scale="1 1"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:31: mesh of link `a`: `scale` must be 3 numbers, and has 2: `1 1`",
    ),
];
