//! Texts that are no XML, or not what XML may be here.

/// The case, the text, and the error.
pub const NOT_XML: &[(&str, &str, &str)] = &[
    ("empty", "", "robot.urdf:1:1: the file is empty (a robot file is URDF, SDF or MJCF)"),
    (
        "blank",
        r#"
 
"#,
        "robot.urdf:1:1: the file is empty (a robot file is URDF, SDF or MJCF)",
    ),
    ("binary garbage", "\u{0}\u{1}\u{2}ELF\u{7f}", "robot.urdf:1:1: this is not XML: a robot file begins with `<`"),
    (
        "a task file",
        r#"[robot]
name = "arm"
"#,
        "robot.urdf:1:1: this is not XML: a robot file begins with `<`",
    ),
    ("a bracket alone", "<", "robot.urdf:1:2: this is not well-formed XML: invalid name token"),
    (
        "only a comment",
        r#"<!-- robot -->
"#,
        "robot.urdf:2:1: there is no element in this file",
    ),
    (
        "truncated between tags",
        r#"<robot name="r">
<link name="a">
<inertial>
"#,
        "robot.urdf:3:1: the file ends before element `inertial` is closed",
    ),
    (
        "truncated within a tag",
        r#"<robot name="r">
<link name="a"#,
        "robot.urdf:2:14: the file ends within a tag, a comment or a text",
    ),
    (
        "truncated within a comment",
        r#"<robot name="r">
<!-- a"#,
        "robot.urdf:2:7: this is not well-formed XML: expected '-->'",
    ),
    (
        "crossed tags",
        r#"<robot name="r">
<link name="a"></robot></link>"#,
        "robot.urdf:2:16: `robot` is closed here, but the innermost open element is `link`",
    ),
    (
        "two outermost elements",
        r#"<robot name="r"/>
<robot name="s"/>"#,
        "robot.urdf:2:1: content after the root element",
    ),
    (
        "an attribute given twice",
        r#"<robot name="r">
<link name="a" name="b"/>
</robot>"#,
        "robot.urdf:2:16: attribute `name` is given twice",
    ),
    (
        "an attribute without quotes",
        r#"<robot name="r">
<link name=a/>
</robot>"#,
        "robot.urdf:2:12: this is not well-formed XML: expected a quote not 'a'",
    ),
    (
        "an unknown entity",
        r#"<robot name="r">
<link name="&arm;"/>
</robot>"#,
        "robot.urdf:2:13: there is no entity `arm`",
    ),
    (
        "a control character",
        "<robot name=\"r\">\n<link name=\"a\u{1}\"/>\n</robot>",
        r#"robot.urdf:2:14: this is not well-formed XML: a non-XML character '\u{1}' found"#,
    ),
    (
        "a prefix not declared",
        r#"<robot name="r">
<link name="a"/>
<gz:sensor/>
</robot>"#,
        "robot.urdf:3:2: the prefix `gz` is not declared; `xmlns:gz` in an outer element declares it",
    ),
    (
        "entities that multiply",
        r#"<?xml version="1.0"?>
<!DOCTYPE robot [
<!ENTITY a "ha">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>
<robot name="&c;"/>"#,
        "robot.urdf:2:1: `<!DOCTYPE` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
    ),
    (
        "an external entity",
        r#"<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>
<robot name="&x;"/>"#,
        "robot.urdf:1:1: `<!DOCTYPE` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
    ),
    (
        "an external document type",
        r#"<?xml version="1.0"?>
<!DOCTYPE robot SYSTEM "http://example.com/robot.dtd">
<robot name="r"/>"#,
        "robot.urdf:2:1: `<!DOCTYPE` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
    ),
    (
        "another outermost element",
        r#"<?xml version="1.0"?>
<svg/>"#,
        "robot.urdf:2:1: svg: a robot file begins with `robot` (URDF), `sdf` (SDF) or `mujoco` (MJCF)",
    ),
    (
        "a macro file",
        r#"<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:include filename="a.xacro"/>
</robot>"#,
        "robot.urdf:2:1: xacro:include of robot `r`: this is a macro for the program xacro, not yet a robot (run `xacro robot.xacro > robot.urdf` first)",
    ),
    (
        "a macro file without its name space",
        r#"<robot name="r">
<xacro:arm/>
</robot>"#,
        "robot.urdf:2:2: this is a macro for the program xacro, not yet a robot (run `xacro robot.xacro > robot.urdf` first)",
    ),
    (
        "a value left to a macro",
        r#"<robot name="r">
<link name="a">
<inertial><mass value="${m}"/></inertial></link>
</robot>"#,
        "robot.urdf:3:24: mass of link `a`: this is a macro for the program xacro, not yet a robot (run `xacro robot.xacro > robot.urdf` first)",
    ),
    (
        "a file name left to a macro",
        r#"<robot name="r">
<link name="a"><visual><geometry>
<mesh filename="$(find arm)/a.stl"/></geometry></visual></link>
</robot>"#,
        "robot.urdf:3:17: mesh of link `a`: this is a macro for the program xacro, not yet a robot (run `xacro robot.xacro > robot.urdf` first)",
    ),
];
