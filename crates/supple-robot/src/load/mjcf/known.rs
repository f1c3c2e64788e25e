//! Names of attributes that MJCF defines, so that unknown ones, which are usually typos, can be reported.

use supple_text::FileError;

use super::super::warnings::Warnings;
use super::super::words::{listed, near, shown};
use super::super::xml::Element;

/// Ways to give an orientation.
pub(super) const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

const BODY: &str = "name childclass pos quat axisangle xyaxes zaxis euler mocap gravcomp sleep simple fuse user";
const FRAME: &str = "name childclass pos quat axisangle xyaxes zaxis euler";
const INERTIAL: &str = "pos quat mass diaginertia axisangle xyaxes zaxis euler fullinertia";
const FREE: &str = "name group align";
const JOINT: &str = "name class type group pos axis springdamper limited actuatorfrclimited solreflimit solimplimit \
    solreffriction solimpfriction stiffness range actuatorfrcrange actuatorgravcomp margin ref springref armature \
    damping frictionloss user";
const GEOM: &str = "name class type contype conaffinity condim group priority size material friction mass density \
    shellinertia solmix solref solimp margin gap surfacevel adhesion fromto pos quat axisangle xyaxes zaxis euler \
    hfield mesh fitscale rgba fluidshape fluidcoef user";
const SITE: &str = "name class type group pos quat axisangle xyaxes zaxis euler material size fromto rgba user";
const MESH: &str = "name class content_type file vertex normal texcoord face refpos refquat scale smoothnormal \
    maxhullvert inertia builtin params material";
const ACTUATOR: &str = "name class group ctrllimited forcelimited ctrlrange forcerange lengthrange gear cranklength \
    joint jointinparent tendon slidersite cranksite site refsite user armature damping delay interp nsample";
const GENERAL: &str = "body actdim actearly actlimited actrange biasprm biastype dynprm dyntype ffrange gainprm \
    gaintype inheritrange input velrange";
const POSITION: &str = "kp kv dampratio timeconst inheritrange";
const SENSOR: &str = "name joint actuator objtype objname reftype refname cutoff delay interp interval noise nsample \
    user";
const KEY: &str = "name time qpos qvel act ctrl mpos mquat plastic";
/// Kinds of actuators.
pub(super) const ACTUATORS: &str = "general motor position velocity intvelocity orientation pid damper cylinder \
    muscle adhesion dcmotor plugin";
/// Kinds of sensors.
pub(super) const SENSORS: &str = "touch accelerometer velocimeter gyro force torque magnetometer camprojection \
    rangefinder jointpos jointvel tendonpos tendonvel actuatorpos actuatorvel actuatorfrc jointactuatorfrc \
    tendonactuatorfrc ballquat ballangvel jointlimitpos jointlimitvel jointlimitfrc tendonlimitpos tendonlimitvel \
    tendonlimitfrc framepos framequat framexaxis frameyaxis framezaxis framelinvel frameangvel framelinacc \
    frameangacc subtreecom subtreelinvel subtreeangmom insidesite distance normal fromto contact e_potential \
    e_kinetic clock tactile user plugin";
const EQUALITY: &str = "name class active solref solimp joint1 joint2 polycoef";
const COMPILER: &str = "angle coordinate eulerseq autolimits inertiafromgeom inertiagrouprange balanceinertia \
    boundmass boundinertia settotalmass meshdir assetdir strippath texturedir fitaabb discardvisual usethread \
    fusestatic saveinertial alignfree conflict convexhull exactmeshinertia passthrough \
    savecanonical savecompiled";

/// The known attributes of an element. `equality` stands for the joints in it.
pub(super) fn attributes(tag: &str) -> impl Iterator<Item = &'static str> {
    let known = match tag {
        "body" => BODY,
        "frame" => FRAME,
        "inertial" => INERTIAL,
        "freejoint" => FREE,
        "joint" => JOINT,
        "geom" => GEOM,
        "site" => SITE,
        "mesh" => MESH,
        "equality" => EQUALITY,
        "compiler" => COMPILER,
        "actuator" | "motor" | "general" | "position" | "velocity" => ACTUATOR,
        "sensor" => SENSOR,
        "key" => KEY,
        _ => "",
    };
    let more = match tag {
        "actuator" | "general" => GENERAL,
        "position" => POSITION,
        "velocity" => "kv",
        _ => "",
    };
    known.split_ascii_whitespace().chain(more.split_ascii_whitespace())
}

/// Rejects unknown attributes where they could change the meaning of the whole file, such as its units.
///
/// # Errors
/// The first of them, with what is known.
pub(super) fn require_attributes(at: Element, tag: &str) -> Result<(), FileError> {
    let known: Vec<_> = attributes(tag).collect();
    let Some(name) = at.attributes().find(|name| !known.contains(name)) else { return Ok(()) };
    let error = at.error_at(name, format!("attribute {} is not known; valid: {}", shown(name), listed(&known)));
    Err(FileError { help: near(name, &known), ..error })
}

/// Warns of attributes of an element that are not known; `tag` as for [`attributes`].
pub(super) fn check_attributes(at: Element, tag: &str, warnings: &mut Warnings) {
    warnings.unknown_attributes(at, tag, &attributes(tag).collect::<Vec<_>>());
}
