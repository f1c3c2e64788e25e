//! Positions and orientations: `pos`, and one of `quat`, `axisangle`, `euler`, `xyaxes` and `zaxis`, or `fromto`.

use supple_kernels::math;
use supple_text::FileError;

use super::super::words::listed;
use super::super::xml::Element;
use super::defaults::Values;
use super::known::ORIENTATIONS;
use super::settings::Settings;
use crate::Pose;
use crate::pose::{add, cross, dot, scale, sub};

/// Length below which a vector counts as zero.
const SHORTEST: f64 = 1e-10;

/// The pose of an element in its body: `pos`, and its own orientation or, if it has none, that of its class.
///
/// # Errors
/// Where there are several orientations, or one is not valid.
pub(super) fn pose(values: &Values, settings: &Settings) -> Result<Pose, FileError> {
    let position = values.numbers("pos")?.unwrap_or([0.0; 3]);
    let own: Vec<_> = ORIENTATIONS.into_iter().filter(|name| values.at.attribute(name).is_some()).collect();
    if let [_, second, ..] = own[..] {
        let message = format!("give the orientation once, not by {}", listed(&own));
        return Err(values.at.error_at(second, message));
    }
    let found = match own[..] {
        [name] => Some((name, values.at)),
        _ => ORIENTATIONS.into_iter().find_map(|name| Some((name, values.holder(name)?))),
    };
    Ok(match found {
        Some((name, at)) => Pose { position, ..rotation(at, name, settings)? },
        None => Pose::at(position),
    })
}

/// The rotation in an attribute, at the origin.
fn rotation(at: Element, name: &str, settings: &Settings) -> Result<Pose, FileError> {
    let too_short = |what: &str| at.error_at(name, format!("{what} must have a direction: its length is 0"));
    match name {
        "quat" => {
            let quaternion = at.required_numbers(name)?;
            Pose::from_quaternion([0.0; 3], quaternion)
                .ok_or_else(|| at.error_at(name, "the quaternion must be non-zero and finite when squared"))
        }
        "axisangle" => {
            let [x, y, z, angle] = at.required_numbers(name)?;
            let axis = unit([x, y, z]).ok_or_else(|| too_short("the axis"))?;
            about(axis, angle * settings.angle).ok_or_else(|| at.error_at(name, "the angle is too large"))
        }
        "euler" => {
            let angles: [f64; 3] = at.required_numbers(name)?;
            Ok(settings.euler.iter().zip(angles).fold(Pose::IDENTITY, |turned, (turn, angle)| {
                let mut rpy = [0.0; 3];
                rpy[turn.axis] = angle * settings.angle;
                let next = Pose::from_rpy([0.0; 3], rpy);
                if turn.moving { turned.compose(&next) } else { next.compose(&turned) }
            }))
        }
        "xyaxes" => {
            let [x, y, z, u, v, w]: [f64; 6] = at.required_numbers(name)?;
            let x = unit([x, y, z]).ok_or_else(|| too_short("the x axis"))?;
            let y = [u, v, w];
            let y = unit(sub(y, scale(dot(x, y), x)))
                .ok_or_else(|| at.error_at(name, "the y axis must not be 0, nor parallel to the x axis"))?;
            let z = cross(x, y);
            Ok(Pose { rotation: [0, 1, 2].map(|row| [x[row], y[row], z[row]]), position: [0.0; 3] })
        }
        _ => {
            let axis: [f64; 3] = at.required_numbers(name)?;
            unit(axis).and_then(z_along).ok_or_else(|| too_short("the z axis"))
        }
    }
}

/// The pose of an element between the two points of `fromto`, with z pointing from the second to the first, and half
/// their distance; `None` if it has no `fromto`.
///
/// # Errors
/// If the points coincide, or `pos` is given too.
pub(super) fn between(values: &Values) -> Result<Option<(Pose, f64)>, FileError> {
    let Some([a, b, c, x, y, z]) = values.numbers("fromto")? else { return Ok(None) };
    let (from, to) = ([a, b, c], [x, y, z]);
    if values.numbers::<3>("pos")?.is_some_and(|position| position != [0.0; 3]) {
        return Err(values.error("fromto", "give the position once: either `fromto` or `pos`"));
    }
    let away = sub(from, to);
    let length = dot(away, away).sqrt();
    let turned = unit(away).and_then(z_along);
    let turned = turned.ok_or_else(|| values.error("fromto", "the points of `fromto` must differ"))?;
    Ok(Some((Pose { position: scale(0.5, add(from, to)), ..turned }, 0.5 * length)))
}

/// The smallest rotation that takes z to a direction.
fn z_along([x, y, z]: [f64; 3]) -> Option<Pose> {
    // The axis is z cross the direction.
    let axis = unit([-y, x, 0.0]).unwrap_or([1.0, 0.0, 0.0]);
    about(axis, math::atan2(math::hypot(x, y), z))
}

/// The rotation by an angle about an axis of length 1; `None` if the angle is too great.
fn about([x, y, z]: [f64; 3], angle: f64) -> Option<Pose> {
    let (sin, cos) = math::sin_cos(0.5 * angle);
    Pose::from_quaternion([0.0; 3], [cos, sin * x, sin * y, sin * z])
}

/// A vector brought to length 1; `None` if it is too short, or too long to square.
fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > SHORTEST && length.is_finite()).then(|| v.map(|entry| entry / length))
}
