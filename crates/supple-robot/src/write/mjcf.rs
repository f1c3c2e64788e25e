use super::bodies::Bodies;
use super::equipment::{actuators, followers, keys, sensors, walls};
use super::text::{Attributes, Text};
use crate::Robot;

/// A robot as text, and the parts that the text cannot express.
///
/// Example: [`mjcf`].
#[derive(Clone, Debug)]
pub struct Written {
    /// The text.
    pub text: String,
    /// What could not be written, one sentence each.
    pub warnings: Vec<String>,
}

/// A robot as MJCF, the format of MuJoCo: bodies with inertias, joints with limits, losses and springs, frames as sites,
/// joints that follow others, actuators, sensors, keyframes, walls, and visual shapes that need no mesh. Reading it again
/// gives the same dynamics.
///
/// A link without inertia and frames between two joints becomes part of a body with both joints, as MuJoCo rejects bodies
/// without inertia. Other inertias that MuJoCo rejects are replaced by the nearest valid ones, with a comment and a warning.
/// Visual meshes are left out.
///
/// ```
/// use supple_robot::{LoadOptions, Tree, mjcf};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let written = mjcf(&robot);
/// assert!(written.warnings.is_empty());
/// let again = supple_robot::parse(&written.text, "pendulum.xml", &LoadOptions::default())?;
/// assert_eq!(Tree::new(&again).joints(), ["hinge"]);
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[must_use]
pub fn mjcf(robot: &Robot) -> Written {
    let mut text = Text::default();
    text.open("mujoco", Attributes::default().text("model", &robot.name));
    let compiler = Attributes::default().text("angle", "radian").text("autolimits", "true");
    text.element("compiler", compiler.text("inertiafromgeom", "false"));
    if let Some(gravity) = robot.gravity {
        text.element("option", Attributes::default().numbers("gravity", &gravity));
    }
    let mut bodies = Bodies::of(robot);
    text.open("worldbody", Attributes::default());
    walls(robot, &mut text);
    bodies.write(&mut text);
    text.close();
    followers(robot, &mut text);
    actuators(robot, &mut text);
    sensors(robot, &mut text);
    keys(robot, &bodies.order, &mut text);
    let Bodies { mut warnings, .. } = bodies;
    let meshes: usize = robot.links.iter().map(|link| link.meshes.len()).sum();
    if meshes > 0 {
        warnings.push(format!("{meshes} visual mesh{} left out", if meshes == 1 { " is" } else { "es are" }));
    }
    warnings.extend(robot.omitted.iter().map(|one| format!("{} `{}` is left out: {}", one.what, one.name, one.why)));
    Written { text: text.finish(), warnings }
}
