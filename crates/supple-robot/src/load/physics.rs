//! Checks for impossible or suspicious numbers of links and joints.

use supple_text::{FileError, digits, short};

use super::moments::principal;
use super::parts::{Ends, JointPart, LinkPart, Parts};
use super::warnings::Warnings;
use super::words::{listed, shown};
use crate::{Inertia, JointKind, Limits};

/// Upper bound on numbers in m, kg and so on, such that products of a few of them stay finite.
pub(super) const GREATEST: f64 = 1e30;
/// Length below which an axis has no direction.
const SHORTEST_AXIS: f64 = 1e-9;
/// Negative principal moments attributed to rounding in a file, relative to the greatest one.
const ROUNDING: f64 = 1e-6;
/// Negative principal moments that are too small to matter, relative to the mass, m^2.
const NEGLIGIBLE: f64 = 1e-12;
/// Greatest negative principal moment that is accepted unchanged, with a warning, kg m^2: published robot files have such
/// moments for light links.
const TINY: f64 = 1e-6;
/// Advice if the moments of inertia would be valid without the products of inertia.
const WITHOUT_PRODUCTS: &str = "the products of inertia are invalid; correct them or set them to 0";
/// Advice where a number is too great.
const UNITS: &str = "numbers of robot files are in kg, m and s; check the unit and the exponent";
/// Greatest radius of gyration, and greatest distance within a link, that is not suspicious, m.
const WIDEST: f64 = 10.0;
/// Masses of links above this are probably in other units, kg.
const HEAVIEST: f64 = 1000.0;
/// Excess over the triangle inequality attributed to rounding in a file.
const EXCESS: f64 = 0.01;

/// The inertia of a link.
///
/// # Errors
/// If its mass is negative, a principal moment is negative by more than a tiny amount, or a number is too large.
pub(super) fn check_link(link: &LinkPart, warnings: &mut Warnings) -> Result<(), FileError> {
    let Some((inertia, at)) = &link.inertia else { return Ok(()) };
    let Inertia { mass, center, moment } = *inertia;
    let great = |numbers: &[f64]| numbers.iter().copied().find(|&number| !small(number));
    for (about, what, unit, great) in [
        ("mass", "the mass", "kg", great(&[mass])),
        ("origin", "coordinates of the centre of mass", "m", great(&center)),
        ("inertia", "moments of inertia", "kg m^2", great(moment.as_flattened())),
    ] {
        if let Some(number) = great {
            let message = format!("{what} must be below {GREATEST:e} {unit}; found {}", digits(number));
            return Err(at.error_about(about, message).with_help(UNITS));
        }
    }
    if mass < 0.0 {
        return Err(at.error_about("mass", format!("the mass must be at least 0; found {}", digits(mass))));
    }
    let (mut moments, _) = principal(moment);
    moments.sort_by(f64::total_cmp);
    let [least, middle, greatest] = moments;
    let said = || format!("{}, {} and {}", three(least), three(middle), three(greatest));
    if least < -(ROUNDING * greatest.abs()).max(NEGLIGIBLE * mass) {
        let message = || format!("the principal moments of inertia must be at least 0, and are {}", said());
        if least <= -TINY {
            let [xx, yy, zz] = [0, 1, 2].map(|i| moment[i][i]);
            let alone = xx >= 0.0 && yy >= 0.0 && zz >= 0.0 && xx <= yy + zz && yy <= xx + zz && zz <= xx + yy;
            let error = at.error_about("inertia", message());
            return Err(if alone && mass > 0.0 { error.with_help(WITHOUT_PRODUCTS) } else { error });
        }
        warnings.note("negative moment", *at, || format!("{}; they are used as they are", message()));
    } else if greatest > (least + middle) * (1.0 + EXCESS) {
        warnings.note("triangle", *at, || {
            format!(
                "the principal moments of inertia {} are impossible: each must be at most the sum of the other two",
                said()
            )
        });
    }
    let gyration = (greatest / mass).sqrt();
    if mass > 0.0 && gyration > WIDEST {
        warnings.note("gyration", *at, || {
            format!(
                "its mass of {} kg has the moments of inertia of a body many metres in size (radius of gyration {} m); they \
                 must be in kg m^2, and lengths in m",
                three(mass),
                three(gyration)
            )
        });
    }
    let away = center.iter().map(|x| x * x).sum::<f64>().sqrt();
    if mass > 0.0 && away > WIDEST {
        warnings.note("far", *at, || {
            format!("its centre of mass is {} m away from the origin of the link; lengths must be in m", three(away))
        });
    }
    if mass > HEAVIEST {
        warnings.note("heavy", *at, || format!("its mass is {} kg; masses must be in kg", three(mass)));
    }
    if mass == 0.0 && greatest > 0.0 {
        warnings.note("no mass", *at, || "it has moments of inertia but no mass".to_owned());
    }
    Ok(())
}

/// The first three digits of a number.
fn three(number: f64) -> String {
    short(number, 3)
}

/// Whether a number is small enough for a robot.
fn small(number: f64) -> bool {
    number.abs() < GREATEST
}

/// Checks the numbers of a joint, normalises its axis, and drops numbers that its kind does not use.
///
/// # Errors
/// If a number is invalid.
pub(super) fn check_joint(joint: &mut JointPart, warnings: &mut Warnings) -> Result<(), FileError> {
    for pose in [&joint.own.origin, &joint.own.child_pose] {
        if let Some(number) = pose.position.into_iter().find(|&number| !small(number)) {
            let message = format!("positions must be below {GREATEST:e} m; found {}", digits(number));
            return Err(joint.at.error(message).with_help(UNITS));
        }
    }
    let away = joint.own.origin.position.iter().map(|x| x * x).sum::<f64>().sqrt();
    if away > WIDEST {
        warnings.note("far joint", joint.at, || {
            format!("it is {} m away from the origin of its parent link; lengths must be in m", three(away))
        });
    }
    if joint.own.kind == JointKind::Fixed {
        joint.own.axis = [1.0, 0.0, 0.0];
        joint.own.limits = Limits::default();
        (joint.own.damping, joint.own.friction, joint.own.armature, joint.own.stiffness) = (0.0, 0.0, 0.0, 0.0);
        (joint.own.reference, joint.own.rest) = (0.0, 0.0);
        return Ok(());
    }
    joint.own.axis = unit(joint.own.axis).ok_or_else(|| {
        let [x, y, z] = joint.own.axis.map(digits);
        joint.at.error_about("axis", format!("the axis must be non-zero; found {x} {y} {z}"))
    })?;
    for (name, number, greatest) in [
        ("damping", joint.own.damping, GREATEST),
        ("friction", joint.own.friction, GREATEST),
        ("armature", joint.own.armature, GREATEST),
        ("stiffness", joint.own.stiffness, GREATEST),
        ("velocity", joint.own.limits.velocity, f64::INFINITY),
        ("effort", joint.own.limits.effort, f64::INFINITY),
    ] {
        if !(0.0..=greatest).contains(&number) {
            let most = if greatest.is_finite() { format!(" and at most {greatest:e}") } else { String::new() };
            let message = format!("{name} must be at least 0{most}; found {}", digits(number));
            return Err(joint.at.error_about(name, message));
        }
    }
    let (ratio, offset) = joint.mimic.as_ref().map_or((0.0, 0.0), |mimic| (mimic.ratio, mimic.offset));
    if ![joint.own.reference, joint.own.rest, ratio, offset].into_iter().all(small) {
        return Err(joint.at.error(format!("positions, ratios and offsets must be below {GREATEST:e}")));
    }
    if joint.own.kind == JointKind::Continuous {
        (joint.own.limits.lower, joint.own.limits.upper) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    let Limits { lower, upper, .. } = joint.own.limits;
    if lower > upper {
        let (lower, upper) = (digits(lower), digits(upper));
        let message = format!("the lower limit {lower} is greater than the upper limit {upper}");
        return Err(joint.at.error_about("lower", message));
    }
    Ok(())
}

/// Treats limits of 0 as missing, with one warning: robot files have them where nobody entered a number. An effort of 0
/// is kept if other joints have a non-zero one: such a joint has no drive.
pub(super) fn without_zeros(parts: &mut Parts) {
    let moves = |joint: &JointPart| joint.own.kind != JointKind::Fixed;
    let has_effort = |joint: &JointPart| joint.own.limits.effort > 0.0;
    let keeps_efforts = parts.joints.iter().any(|joint| moves(joint) && has_effort(joint));
    let mut told: Vec<(&str, Vec<String>)> = Vec::new();
    let mut first = None;
    for (what, is_kept) in [("velocity", false), ("effort", keeps_efforts)] {
        let mut names = Vec::new();
        for joint in parts.joints.iter_mut().filter(|joint| !is_kept && moves(joint)) {
            let Limits { velocity, effort, .. } = &mut joint.own.limits;
            let limit = if what == "velocity" { velocity } else { effort };
            if *limit == 0.0 {
                *limit = f64::INFINITY;
                names.push(joint.own.name.clone());
                first = first.or(Some(joint.at));
            }
        }
        if !names.is_empty() {
            told.push((what, names));
        }
    }
    let Some(first) = first else { return };
    parts.warnings.say("limits of 0", first, || {
        let each = told.iter().map(|(what, names)| {
            format!("`{what}` of joint{} {}", if names.len() == 1 { "" } else { "s" }, listed(names))
        });
        format!("limits of 0 are treated as not set: {}", each.collect::<Vec<_>>().join(", "))
    });
}

/// A vector brought to length 1; `None` if it is too short.
fn unit(axis: [f64; 3]) -> Option<[f64; 3]> {
    let greatest = axis.iter().fold(0.0, |greatest: f64, entry| greatest.max(entry.abs()));
    if !(greatest > SHORTEST_AXIS && greatest.is_finite()) {
        return None;
    }
    // Scaled first: the squares of very great numbers are infinite.
    let scaled = axis.map(|entry| entry / greatest);
    let length = scaled.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    Some(scaled.map(|entry| entry / length))
}

/// Warns of independent moving joints that carry nothing with inertia, so that nothing resists their motion.
///
/// `places` is the index of each joint in the robot; each comes after those that carry it.
pub(super) fn warn_of_massless(
    links: &[LinkPart],
    joints: &[JointPart],
    ends: &[Ends],
    places: &[usize],
    warnings: &mut Warnings,
) {
    let heavy = |inertia: &Inertia| inertia.mass > 0.0 || inertia.moment.iter().flatten().any(|&moment| moment != 0.0);
    let mut carries: Vec<_> =
        links.iter().map(|link| link.inertia.as_ref().is_some_and(|(inertia, _)| heavy(inertia))).collect();
    let mut from_tips: Vec<_> = (0..joints.len()).collect();
    from_tips.sort_by_key(|&joint| std::cmp::Reverse(places[joint]));
    for joint in from_tips {
        carries[ends[joint].parent] |= carries[ends[joint].child] || joints[joint].own.armature > 0.0;
    }
    for (joint, ends) in joints.iter().zip(ends) {
        let free = joint.own.kind != JointKind::Fixed && joint.mimic.is_none();
        if free && !carries[ends.child] && joint.own.armature == 0.0 {
            let child = shown(&joint.child.name);
            warnings.note("massless", joint.at, || {
                format!("it moves link {child} and the links attached to it, none of which has inertia")
            });
        }
    }
}
