//! A `joint`: a hinge or a slide, with its limits, spring and losses.

use supple_text::FileError;

use super::super::parts::{JointPart, Reference};
use super::super::words::shown;
use super::super::xml::Element;
use super::defaults::Values;
use super::known::check_attributes;
use super::reader::Reader;
use crate::{JointKind, Limits, Pose};

/// Words for whether a range is a limit.
const LIMITED: [(&str, Option<bool>); 3] = [("true", Some(true)), ("false", Some(false)), ("auto", None)];

/// A type of joint.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Type {
    Hinge,
    Slide,
    Ball,
    Free,
}

impl<'a> Reader<'a, '_> {
    /// A joint in `frame` of a body whose default class is `class`, between two links that coincide with the body.
    ///
    /// # Errors
    /// Where anything in it is wrong, or it is free or a ball.
    pub(super) fn joint(
        &mut self,
        at: Element<'a>,
        frame: &Pose,
        class: usize,
        name: &str,
        ends: [Reference<'a>; 2],
    ) -> Result<JointPart<'a>, FileError> {
        if at.tag() == "freejoint" {
            return Err(floating(at, name, |message| at.error(message)));
        }
        check_attributes(at, "joint", &mut self.parts.warnings);
        let values = self.classes.values(at, "joint", class)?;
        let kinds = [("hinge", Type::Hinge), ("slide", Type::Slide), ("ball", Type::Ball), ("free", Type::Free)];
        let kind = values.choice("type", &kinds)?.unwrap_or(Type::Hinge);
        let unit = match kind {
            Type::Hinge => self.settings.angle,
            Type::Slide => 1.0,
            Type::Free => return Err(floating(at, name, |message| values.error("type", message))),
            Type::Ball => {
                let message = format!("ball joints are not supported: joint {} is one", shown(name));
                let help = "use three hinges at the same position with different axes";
                return Err(values.error("type", message).with_help(help));
            }
        };
        let range = self.range(&values, "range", "limited")?.map(|range| range.map(|bound| bound * unit));
        let kind = match (kind, range) {
            (Type::Slide, _) => JointKind::Prismatic,
            (_, Some(_)) => JointKind::Revolute,
            (_, None) => JointKind::Continuous,
        };
        let [parent, child] = ends;
        let mut joint = JointPart::new(at, name, kind, parent, child);
        let anchor = frame.apply(values.numbers("pos")?.unwrap_or([0.0; 3]));
        (joint.own.origin, joint.own.child_pose) = (Pose::at(anchor), Pose::at(anchor.map(|entry| 0.0 - entry)));
        joint.own.axis = frame.rotate(values.numbers("axis")?.unwrap_or([0.0, 0.0, 1.0]));
        let number = |name| Ok(values.number(name)?.unwrap_or(0.0));
        (joint.own.reference, joint.own.rest) = (unit * number("ref")?, unit * number("springref")?);
        (joint.own.armature, joint.own.friction) = (number("armature")?, number("frictionloss")?);
        (joint.own.damping, joint.own.stiffness) = (linear(&values, "damping")?, linear(&values, "stiffness")?);
        if values.numbers("springdamper")?.is_some_and(|given: [f64; 2]| given != [0.0; 2]) {
            let message = "`springdamper` is not supported: it depends on the inertia of the whole robot";
            return Err(values.error("springdamper", message).with_help("give `stiffness` and `damping`"));
        }
        if let Some([lower, upper]) = range {
            joint.own.limits = Limits { lower, upper, ..joint.own.limits };
        }
        joint.own.limits.effort = self.effort(&values)?;
        Ok(joint)
    }

    /// A range, if it is a limit: if the attribute `limited` is true, or is not set and there is a range.
    ///
    /// # Errors
    /// If the range is empty, missing, or not declared as a limit although `autolimits` is off.
    pub(super) fn range(
        &self,
        values: &Values,
        name: &'static str,
        limited: &'static str,
    ) -> Result<Option<[f64; 2]>, FileError> {
        let range: Option<[f64; 2]> = values.numbers(name)?.filter(|range| *range != [0.0; 2]);
        match (values.choice(limited, &LIMITED)?.flatten(), range) {
            (Some(true), None) => Err(values.error(limited, format!("it is limited but has no `{name}`"))),
            (None, Some(_)) if !self.settings.autolimits => Err(values
                .error(name, format!("with `autolimits` off, `{name}` requires `{limited}`, \"true\" or \"false\""))),
            (Some(true) | None, Some([lower, upper])) if lower >= upper => {
                Err(values.error(name, format!("the first number of `{name}` must be less than the second")))
            }
            (Some(false), _) => Ok(None),
            (_, range) => Ok(range),
        }
    }

    /// The greatest torque or force of drives at a joint.
    fn effort(&mut self, values: &Values<'a, '_>) -> Result<f64, FileError> {
        let range = self.range(values, "actuatorfrcrange", "actuatorfrclimited")?;
        let Some([lower, upper]) = range else { return Ok(f64::INFINITY) };
        if lower != -upper {
            self.parts.warnings.note("effort", values.at, || {
                "its `actuatorfrcrange` is not symmetric; the greater bound is taken for both directions".to_owned()
            });
        }
        Ok(upper.abs().max(lower.abs()))
    }
}

/// The error about a joint that makes its body floating.
fn floating(at: Element, name: &str, error: impl Fn(String) -> FileError) -> FileError {
    let body = at.parent().and_then(|body| body.attribute("name")).filter(|body| !body.is_empty());
    let body = body.map_or_else(|| "its body".to_owned(), |body| format!("body {}", shown(body)));
    let message = format!("floating bases are not supported: joint {} lets {body} move freely", shown(name));
    error(message).with_help("remove the joint to fix the body in the world, or give it hinges and slides")
}

/// The linear coefficient of a polynomial, whose other coefficients must be 0.
pub(super) fn linear(values: &Values, name: &'static str) -> Result<f64, FileError> {
    let Some(found) = values.list(name)? else { return Ok(0.0) };
    match found[..] {
        [linear] | [linear, 0.0] | [linear, 0.0, 0.0] => Ok(linear),
        _ => Err(values.error(name, format!("only a linear `{name}` is supported: one number"))),
    }
}
