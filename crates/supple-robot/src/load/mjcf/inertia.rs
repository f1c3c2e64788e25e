//! The inertia of a body: from its `inertial`, or the sum over its geoms.

use supple_text::FileError;

use super::super::moments::{diagonal_matrix, principal, turned};
use super::super::xml::Element;
use super::defaults::Values;
use super::geom::{Mass, Solid};
use super::orientation::pose;
use super::reader::{Items, Reader};
use super::settings::{FromGeoms, Settings};
use crate::Inertia;
use crate::pose::{add, scale, sub};

impl<'a> Reader<'a, '_> {
    /// The inertia of a body with its element; `None` if its mass is 0. `counts` tells whether the inertia matters:
    /// if the body can move, or the total mass is prescribed.
    ///
    /// # Errors
    /// Where it is not valid, or a mesh would have to be read for a body that moves.
    pub(super) fn inertia(
        &mut self,
        body: Element<'a>,
        items: &Items<'a>,
        counts: bool,
    ) -> Result<Option<(Inertia, Element<'a>)>, FileError> {
        let written = match items.inertial {
            Some(at) => Some((self.written(at)?, at)),
            None => None,
        };
        let from_geoms = match self.settings.from_geoms {
            FromGeoms::Always => true,
            FromGeoms::WhereMissing => written.is_none(),
            FromGeoms::Never => false,
        };
        let summed = if from_geoms { self.summed(items, counts)? } else { None };
        let (inertia, at) = match (summed, written) {
            (Some(inertia), _) => (inertia, body),
            (None, Some(written)) => written,
            (None, None) => (Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] }, body),
        };
        let inertia = bounded(inertia, self.settings);
        let has_any = inertia.mass != 0.0 || inertia.moment != [[0.0; 3]; 3];
        Ok(has_any.then_some((inertia, at)))
    }

    /// Scales masses and moments of all bodies to the total mass given by the compiler settings.
    ///
    /// # Errors
    /// Where the bodies have no mass.
    pub(super) fn scale_masses(&mut self, world: Element<'a>) -> Result<(), FileError> {
        let Some(total) = self.settings.total_mass else { return Ok(()) };
        let inertias = || self.parts.links.iter().filter_map(|link| link.inertia.as_ref());
        let mass: f64 = inertias().map(|(inertia, _)| inertia.mass).sum();
        if mass <= 0.0 {
            return Err(world.error("`settotalmass` requires bodies with mass"));
        }
        let factor = total / mass;
        for (inertia, _) in self.parts.links.iter_mut().filter_map(|link| link.inertia.as_mut()) {
            inertia.mass *= factor;
            inertia.moment = inertia.moment.map(|row| scale(factor, row));
        }
        Ok(())
    }

    /// An `inertial` element.
    fn written(&mut self, at: Element) -> Result<Inertia, FileError> {
        at.required("pos")?;
        let mass = at.required_number("mass")?;
        let (diagonal, full) = (at.numbers::<3>("diaginertia")?, at.numbers::<6>("fullinertia")?);
        let frame = pose(&Values::own(at), self.settings)?;
        let moment = match (diagonal, full) {
            (Some(_), Some(_)) => {
                return Err(at.error_at("fullinertia", "give either `diaginertia` or `fullinertia`, not both"));
            }
            (None, Some(_)) if at.attributes().any(|name| super::known::ORIENTATIONS.contains(&name)) => {
                return Err(
                    at.error_at("fullinertia", "`fullinertia` is in the body's axes and excludes an orientation")
                );
            }
            (None, Some([xx, yy, zz, xy, xz, yz])) => [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
            (diagonal, None) => {
                if diagonal.is_none() {
                    self.parts.warnings.note("point", at, || {
                        "it has neither `diaginertia` nor `fullinertia`, and is taken as a point".to_owned()
                    });
                }
                turned(frame.rotation, diagonal_matrix(diagonal.unwrap_or([0.0; 3])))
            }
        };
        Ok(Inertia { mass, center: frame.position, moment })
    }

    /// The sum over a body's geoms; `None` if they contribute none.
    fn summed(&mut self, items: &Items<'a>, counts: bool) -> Result<Option<Inertia>, FileError> {
        let mut solids = Vec::new();
        for &(at, frame, class) in &items.geoms {
            match self.solid(at, &frame, class)? {
                Mass::Known(solid) => solids.push(solid),
                Mass::None => {}
                Mass::OfMesh if counts => {
                    let message = "the mass of its body would follow from this mesh, and meshes are not read";
                    let help = "give the body an `inertial`, or the geom the mass 0";
                    return Err(at.error(message).with_help(help));
                }
                Mass::OfMesh => {
                    self.parts.warnings.note("mass of mesh", at, || {
                        "the mass of its body would follow from this mesh, and meshes are not read: as the body does not move, \
                         it only lacks in the robot's mass and centre of mass"
                            .to_owned()
                    });
                    return Ok(None);
                }
            }
        }
        Ok(sum(&solids))
    }
}

/// The inertia of solids as one body.
///
/// ```text
/// m = sum m_i   c = sum m_i c_i / m   I = sum I_i + m_i (|d|^2 - d d'),  d = c_i - c
/// ```
fn sum(solids: &[Solid]) -> Option<Inertia> {
    let mass: f64 = solids.iter().map(|solid| solid.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let weighted = solids.iter().fold([0.0; 3], |sum, solid| add(sum, scale(solid.mass, solid.pose.position)));
    let center = scale(1.0 / mass, weighted);
    let mut moment = [[0.0; 3]; 3];
    for Solid { mass, pose, moments } in solids {
        let own = turned(pose.rotation, diagonal_matrix(*moments));
        let d = sub(pose.position, center);
        let squared: f64 = d.iter().map(|d| d * d).sum();
        for (i, row) in moment.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let diagonal = if i == j { squared } else { 0.0 };
                *entry += own[i][j] + mass * (diagonal - d[i] * d[j]);
            }
        }
    }
    Some(Inertia { mass, center, moment })
}

/// Applies the bounds of the compiler settings to an inertia: least mass, least principal moments, and, with
/// `balanceinertia`, the mean of the principal moments if one exceeds the sum of the others. A body without its
/// own centre of mass gets its mass at its origin.
fn bounded(inertia: Inertia, settings: &Settings) -> Inertia {
    let mut inertia = inertia;
    // Negative values are reported as errors later, and are not raised to a bound.
    if (0.0..settings.least_mass).contains(&inertia.mass) {
        inertia.mass = settings.least_mass;
    }
    if settings.least_moment == 0.0 && !settings.balance {
        return inertia;
    }
    let (moments, axes) = principal(inertia.moment);
    if moments.iter().any(|&moment| moment < 0.0) {
        return inertia;
    }
    if moments.iter().any(|&moment| moment < settings.least_moment) {
        inertia.moment = turned(axes, diagonal_matrix(moments.map(|moment| moment.max(settings.least_moment))));
    }
    let [a, b, c] = moments.map(|moment| moment.max(settings.least_moment));
    if settings.balance && (a + b < c || a + c < b || b + c < a) {
        inertia.moment = diagonal_matrix([(a + b + c) / 3.0; 3]);
    }
    inertia
}
