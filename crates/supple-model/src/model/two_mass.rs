use serde::Deserialize;
use supple_kernels::Scalar;
use supple_lqg::Dimensions;

use super::file::PlainFile;
use crate::{Channel, Channels, Model, Point};

use crate::Value;
use crate::contacts::{Contact, ContactState};
use crate::document::Unfit;
use crate::parameters::Parameters;
use crate::scene::{ConnectionKind, Landmark, LandmarkKind, Picture, PlacedBody, PlacedConnection, Pose, Shape, Solid};

/// Two masses on a line, coupled by a spring; the second meets a wall of uncertain position.
///
/// A flexible joint with joint-torque sensing that comes into contact (paper, section V-A). State
/// `[x1, v1, x2, v2, xw]` (m, m/s, m, m/s, m), control `u` (N) on the first mass, explicit Euler:
///
/// ```text
/// x1+ = x1 + dt v1    v1+ = v1 + dt/m1 (u - b1 v1 - k1 (x1 - x2))
/// x2+ = x2 + dt v2    v2+ = v2 + dt/m2 (-b2 v2 + k1 (x1 - x2) - k2 (x2 - xw)_+)    xw+ = xw
/// y   = [x1, k1 (x2 - x1)]
/// ```
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(
        description = "Two masses on a line, coupled by a spring; the second meets a wall of uncertain position."
    )
)]
#[serde(deny_unknown_fields)]
pub struct TwoMass {
    /// Masses m1 and m2, kg.
    pub mass: [Value; 2],
    /// Damping b1 and b2 to the ground, N s/m.
    pub damping: [Value; 2],
    /// Stiffness k1 of the joint, and k2 of end-effector and wall in series, N/m.
    pub stiffness: [Value; 2],
    /// Length eps over which contact sets in, m: `(z)_+ = 1/2 (sqrt(z^2 + eps^2) + z)`. 0 is the hard switch.
    #[serde(default)]
    pub contact_smoothing: Value,
}

impl TwoMass {
    fn penetration<S: Scalar>(at: &Point<S>) -> S {
        at.x[2] - at.x[4]
    }

    /// `(x2 - xw)_+`, m, smoothed if `contact_smoothing` is above 0.
    fn pressed<S: Scalar>(&self, at: &Point<S>) -> S {
        let depth = Self::penetration(at);
        if self.contact_smoothing.is_zero() {
            depth.positive_part()
        } else {
            depth.smooth_positive_part(at.value(&self.contact_smoothing))
        }
    }
}

/// Length of a mass in pictures, relative to the wall distance, and rest length of the spring between them.
/// The model defines neither: its masses are points, both at 0 when at rest.
const DRAWN: [f64; 2] = [0.16, 0.3];

impl Model for TwoMass {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 5, controls: 1, measurements: 2 }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let &[x1, v1, x2, v2, xw] = at.x else { return };
        let ([m1, m2], [b1, b2], [k1, k2]) = (&self.mass, &self.damping, &self.stiffness);
        let coupling = at.value(k1) * (x1 - x2);
        let contact = at.value(k2) * self.pressed(at);
        let dt = at.time_step;
        next[0] = x1 + dt * v1;
        next[1] = v1 + dt / at.value(m1) * (at.u[0] - at.value(b1) * v1 - coupling);
        next[2] = x2 + dt * v2;
        next[3] = v2 + dt / at.value(m2) * (coupling - at.value(b2) * v2 - contact);
        next[4] = xw;
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0];
        y[1] = at.value(&self.stiffness[0]) * (at.x[2] - at.x[0]);
    }

    fn signals(&self) -> Vec<String> {
        ["contact_force", "penetration"].map(String::from).to_vec()
    }

    fn signal<S: Scalar>(&self, at: &Point<S>, out: &mut [S]) {
        let depth = Self::penetration(at);
        out[0] = at.value(&self.stiffness[1]) * depth;
        out[1] = depth;
    }

    fn contacts(&self) -> Vec<Contact> {
        vec![Contact {
            name: "wall".into(),
            force_signal: Some(0),
            component_signals: Vec::new(),
            depth_signal: Some(1),
        }]
    }

    /// The force is the physical one, which never pulls; the signal `contact_force` is `k2` times the depth, even if
    /// that is negative.
    fn contact_states(&self, at: &Point<f64>) -> Vec<ContactState> {
        let stiffness = at.value(&self.stiffness[1]);
        let force = stiffness * self.pressed(at);
        let (clearance, smoothing) = (-Self::penetration(at), at.value(&self.contact_smoothing));
        vec![ContactState { force, clearance, smoothing, stiffness, radius: 0.0, total_force: [-force, 0.0, 0.0] }]
    }

    fn state_names(&self) -> Vec<String> {
        ["x1", "v1", "x2", "v2", "xw"].map(String::from).to_vec()
    }

    fn channels(&self) -> Channels {
        let units = ["m", "m/s", "m", "m/s", "m"];
        Channels {
            states: self.state_names().into_iter().zip(units).map(|(name, unit)| Channel::new(name, unit)).collect(),
            controls: vec![Channel::new("u", "N")],
            measurements: vec![Channel::new("position of m1", "m"), Channel::new("force in the spring", "N")],
        }
    }

    /// Drawn along x. The second mass ends at `x2`, where it meets the wall; the first is a spring's length in front of it.
    fn picture(&self, at: &Point<f64>) -> Option<Picture> {
        let &[x1, _, x2, _, xw] = at.x else { return None };
        let size = if xw == 0.0 { 1.0 } else { xw.abs() };
        let [length, rest] = DRAWN.map(|share| share * size);
        let edges = Solid::Box { size: [length, 0.8 * length, 0.8 * length] };
        let body = |name: &str, end: f64| PlacedBody {
            name: name.into(),
            shapes: vec![Shape::at([-0.5 * length, 0.0, 0.0], edges)],
            meshes: Vec::new(),
            pose: Pose::at([end, 0.0, 0.0]),
        };
        let [along_spring, along_wall] =
            [at.value(&self.stiffness[0]) * (x1 - x2), -at.value(&self.stiffness[1]) * self.pressed(at)];
        let connection = |name: &str, kind, [from, to, force]: [f64; 3]| PlacedConnection {
            name: name.into(),
            kind,
            from: [from, 0.0, 0.0],
            to: [to, 0.0, 0.0],
            force: [force, 0.0, 0.0],
            torque: [0.0; 3],
        };
        let shift = length + rest;
        let wall = LandmarkKind::Wall { normal: [-1.0, 0.0, 0.0], touch: [xw, 0.0, 0.0] };
        let landmark = |name: &str, kind| Landmark { name: name.into(), kind };
        Some(Picture {
            size,
            bodies: vec![body("m1", x1 - shift), body("m2", x2)],
            connections: vec![
                connection("spring", ConnectionKind::Spring, [x1 - shift, x2 - length, along_spring]),
                connection("wall", ConnectionKind::Contact, [xw, x2, along_wall]),
            ],
            landmarks: vec![landmark("m2", LandmarkKind::Point), landmark("wall", wall)],
        })
    }

    fn landmarks<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        [at.x[2], at.x[4]].map(|along| [along, S::zero(), S::zero()]).to_vec()
    }
}

/// A key, its values, what is valid, and a check of the least possible value.
type Rule<'a> = (&'static str, &'a [Value], &'static str, fn(f64) -> bool);

impl PlainFile for TwoMass {
    const NAME: &'static str = "two_mass";

    fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let rules: [Rule; 4] = [
            ("mass", &self.mass, "must be above 0 kg", |least| least > 0.0),
            ("damping", &self.damping, "must be at least 0 N s/m", |least| least >= 0.0),
            ("stiffness", &self.stiffness, "must be at least 0 N/m", |least| least >= 0.0),
            ("contact_smoothing", std::slice::from_ref(&self.contact_smoothing), "must be at least 0 m", |least| {
                least >= 0.0
            }),
        ];
        for (key, values, valid, holds) in rules {
            for value in values {
                if let Some(least) = parameters.least(value).filter(|&least| !holds(least)) {
                    return Err(Unfit::new(key, format!("{valid}; {}", value.found(least))));
                }
            }
        }
        Ok(())
    }
}
