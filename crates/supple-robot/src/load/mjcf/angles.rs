//! Doubts about the unit of angles: degrees in files in radians, and radians in files in degrees.

use supple_text::digits;

use super::super::degrees::{TURN, given, turns};
use super::super::xml::Element;
use super::reader::Reader;
use crate::JointKind;

/// Degrees beyond which whole numbers are no radians.
const HALF_TURN: f64 = 3.2;
/// Span of the range of a single hinge, up to which it may be in radians.
const SPAN: f64 = 7.0;

impl<'a> Reader<'a, '_> {
    /// Warns of angles that seem to be in another unit than that of the file.
    pub(super) fn doubt_angles(&mut self, root: Element<'a>) {
        if self.settings.angle != 1.0 {
            self.doubt_degrees();
            return;
        }
        self.doubt_ranges();
        let mut open: Vec<_> = root.all("default").chain(root.all("worldbody")).collect();
        while let Some(element) = open.pop() {
            open.extend(element.children());
            let Ok(Some(angles)) = element.numbers::<3>("euler") else { continue };
            if turns(angles) {
                self.parts.warnings.note("degrees of euler", element, || {
                    format!("`euler` = {} is rad, but looks like degrees", given(angles))
                });
            }
        }
    }

    /// Ranges of hinges in a file in radians.
    fn doubt_ranges(&mut self) {
        for joint in self.parts.joints.iter().filter(|joint| joint.own.kind == JointKind::Revolute) {
            let range = [joint.own.limits.lower, joint.own.limits.upper];
            // Drives of several turns have ranges of multiples of pi.
            if turns(range) && range.iter().all(|end| end.abs() <= 360.0 && end % 0.5 == 0.0) {
                self.parts
                    .warnings
                    .note("degrees", joint.at, || format!("`range` = {} is rad, but looks like degrees", given(range)));
            }
        }
    }

    /// Ranges of hinges in a file in degrees: they seem to be radians if none is wider than a turn would be in radians.
    fn doubt_degrees(&mut self) {
        let hinges = || self.parts.joints.iter().filter(|joint| joint.own.kind == JointKind::Revolute);
        let unit = self.settings.angle;
        let ranges: Vec<_> =
            hinges().map(|joint| [joint.own.limits.lower, joint.own.limits.upper].map(|end| end / unit)).collect();
        let small = ranges.iter().flatten().all(|end| end.abs() <= TURN);
        // Flexures of a few whole degrees are plausible.
        let whole = |end: f64| (end - end.round()).abs() < 1e-9;
        let plausible = ranges.iter().flatten().any(|&end| end.abs() > HALF_TURN && whole(end));
        let first = hinges().next().map(|joint| joint.at);
        let (Some(at), [[lower, upper], rest @ ..]) = (first, &ranges[..]) else { return };
        if small && !plausible && (!rest.is_empty() || upper - lower < SPAN) {
            let shown = [lower, upper].map(|end| digits((end * 1e9).round() * 1e-9)).join(" ");
            self.parts.warnings.note("radians", at, || {
                format!(
                    "`range` = {shown} is in degrees, but looks like rad, as do the ranges of all hinges; files in \
                     radians need `<compiler angle=\"radian\"/>`"
                )
            });
        }
    }
}
