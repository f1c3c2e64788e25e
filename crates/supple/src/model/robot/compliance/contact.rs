use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::vector::{add, cross, dot, scale, sub};
use supple_robot::{Pose, WallShape, Wrench};

use super::{Compliance, ComplianceFile, ConnectionKind, Drawn, Names, Unfit, find};
use crate::model::robot::situation::{Forces, Own};
use crate::{Point, Value};

/// A point or sphere on a frame against a wall whose place is not known exactly. It adds the wall's place `c` along its
/// normal to the state, as a constant, m.
///
/// With depth `d = c - n'(p - point) + radius` of the sphere about the frame's origin `p`, velocity `v` of that origin,
/// and the part `v_t` along the wall of the velocity `v + w x (-radius n)` of the point that touches the wall, where `w` is
/// the angular velocity:
///
/// ```text
/// force = (stiffness (d)_+ - damping n'v s(d))_+      (z)_+ = 1/2 (sqrt(z^2 + smoothing^2) + z), s = d(d)_+/dd
/// friction = -friction force v_t / sqrt(|v_t|^2 + slip^2)
/// ```
///
/// The force acts at that point. A turn does not move it along the normal, so damping needs no more than `v`. Above,
/// the second `(.)_+` is smoothed over the force `stiffness smoothing`, so that the wall does not pull.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    frame: usize,
    normal: [f64; 3],
    point: [Value; 3],
    radius: Value,
    stiffness: Value,
    damping: Value,
    smoothing: Value,
    friction: Value,
    slip: Value,
}

/// A point or sphere on a frame against a wall of uncertain place.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link that the point or the sphere's centre is the origin of.
    frame: String,
    /// Normal of the wall in the world, out of the wall; of any length above 0; required without `geom`.
    normal: Option<[f64; 3]>,
    /// A point of the world from which the wall's place is counted along the normal, m; the origin where left out.
    point: Option<[Value; 3]>,
    /// Name of a plane or box of the robot's file that does not move, in place of `normal` and `point`.
    geom: Option<String>,
    /// Face of the box that is the wall; required for a box.
    face: Option<Face>,
    /// Radius of the sphere, m; 0 for a point.
    #[serde(default)]
    radius: Value,
    /// Stiffness, N/m; above 0.
    stiffness: Value,
    /// Damping along the normal while in contact, N s/m; at least 0.
    #[serde(default)]
    damping: Value,
    /// Depth over which contact sets in, m; above 0.
    smoothing: Value,
    /// Coefficient of friction; at least 0.
    #[serde(default)]
    friction: Value,
    /// Speed along the wall over which friction sets in, m/s; above 0.
    #[serde(default = "slow")]
    slip: Value,
}

/// A face of a box, by the direction of its outward normal in the axes of the box.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, schemars::JsonSchema)]
pub(crate) enum Face {
    /// Towards x.
    #[serde(rename = "+x")]
    PlusX,
    /// Against x.
    #[serde(rename = "-x")]
    MinusX,
    /// Towards y.
    #[serde(rename = "+y")]
    PlusY,
    /// Against y.
    #[serde(rename = "-y")]
    MinusY,
    /// Towards z.
    #[serde(rename = "+z")]
    PlusZ,
    /// Against z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl Face {
    /// Its axis, and whether it is against that.
    fn side(self) -> (usize, bool) {
        match self {
            Self::PlusX => (0, false),
            Self::MinusX => (0, true),
            Self::PlusY => (1, false),
            Self::MinusY => (1, true),
            Self::PlusZ => (2, false),
            Self::MinusZ => (2, true),
        }
    }
}

impl File {
    /// Normal and point of the wall: those given, or those of a geom of the robot's file.
    fn wall(&self, names: &Names) -> Result<([f64; 3], [Value; 3]), Unfit> {
        let Some(geom) = &self.geom else {
            let missing =
                || ("normal", "is missing: give the wall's `normal`, or a `geom` of the robot's file".into(), None);
            if self.face.is_some() {
                return Err(("face", "goes with `geom`, a box of the robot's file".into(), None));
            }
            return Ok((self.normal.ok_or_else(missing)?, self.point.unwrap_or_default()));
        };
        for (key, given) in [("normal", self.normal.is_some()), ("point", self.point.is_some())] {
            if given {
                let help = format!("leave `{key}` out, or `geom`");
                return Err((key, format!("`geom` gives the wall already: that of `{geom}`"), Some(help)));
            }
        }
        let walls: Vec<String> = names.robot.walls.iter().map(|wall| wall.name.clone()).collect();
        let wall = &names.robot.walls[find("geom", "plane or box that does not move", geom, &walls)?];
        let face = match (self.face, wall.shape) {
            (Some(face), _) => face,
            (None, WallShape::Plane) => Face::PlusZ,
            (None, WallShape::Box(_)) => {
                let message = format!("is missing: `{geom}` is a box; valid are `+x`, `-x`, `+y`, `-y`, `+z`, `-z`");
                return Err(("face", message, Some("the face that the robot touches, in the axes of the box".into())));
            }
        };
        let (axis, negative) = face.side();
        let (normal, point) = wall
            .face(axis, negative)
            .ok_or_else(|| ("face", format!("`{geom}` is a plane, whose one face is `+z`"), None))?;
        Ok((normal, point.map(Value::Number)))
    }
}

fn slow() -> Value {
    Value::Number(1e-2)
}

impl ComplianceFile for Contact {
    type File = File;

    fn build(file: File, names: &Names) -> Result<Self, Unfit> {
        let frame = names.frame("frame", &file.frame)?;
        let (normal, point) = file.wall(names)?;
        let length = dot(normal, normal).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return Err(("normal", format!("must have a length above 0; found {normal:?}"), None));
        }
        let File { radius, stiffness, damping, smoothing, friction, slip, .. } = file;
        let normal = normal.map(|entry| entry / length);
        Ok(Self { frame, normal, point, radius, stiffness, damping, smoothing, friction, slip })
    }
}

impl Contact {
    /// From the frame's origin to the point that touches the wall, in the axes of the frame.
    fn lever<S: Scalar>(&self, at: &Point<S>, pose: &Pose<S>) -> [S; 3] {
        pose.unrotate(scale(-at.value(self.radius), self.normal.map(S::constant)))
    }

    /// Depth, normal force and the whole force on the frame in the world (theory, equations R.14 and R.15).
    fn load<S: Scalar>(&self, own: &Own<S>) -> (S, S, [S; 3]) {
        let at = own.now.at;
        let (_, pose, twist) = own.now.frame(self.frame);
        let normal = self.normal.map(S::constant);
        let velocity = pose.rotate(twist.linear);
        let approach = dot(normal, velocity);
        let point = self.point.map(|value| at.value(value));
        let depth = own.constant() + at.value(self.radius) - dot(normal, sub(pose.position, point));
        let smoothing: S = at.value(self.smoothing);
        let pressed = depth.smooth_positive_part(smoothing);
        // The slope of the smooth positive part: 0 far away, 1 deep inside.
        let touching = (depth / (depth * depth + smoothing * smoothing).sqrt() + 1.0) * 0.5;
        let stiffness = at.value(self.stiffness);
        let force = stiffness * pressed - at.value(self.damping) * approach * touching;
        let force = if self.damping.is_zero() { force } else { force.smooth_positive_part(stiffness * smoothing) };
        let mut total = scale(force, normal);
        if !self.friction.is_zero() {
            let touch = pose.rotate(twist.at(self.lever(at, &pose)));
            let along = sub(touch, scale(approach, normal));
            let slip = at.value(self.slip);
            let speed = (dot(along, along) + slip * slip).sqrt();
            total = sub(total, scale(at.value(self.friction) * force / speed, along));
        }
        (depth, force, total)
    }
}

impl Compliance for Contact {
    fn constants(&self) -> usize {
        1
    }

    fn signals(&self) -> Vec<&'static str> {
        vec!["contact_force", "penetration", "force_x", "force_y", "force_z"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let (depth, force, total) = self.load(own);
        [vec![force, depth], total.to_vec()].concat()
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        let (_, _, total) = self.load(own);
        let (place, pose, _) = own.now.frame(self.frame);
        let force = pose.unrotate(total);
        forces.add(&place, Wrench { torque: cross(self.lever(own.now.at, &pose), force), force });
    }

    /// From the wall to the point that touches it.
    fn draw(&self, own: &Own<f64>) -> Drawn {
        let (depth, _, force) = self.load(own);
        let pose = own.now.pose(self.frame);
        let to = pose.apply(self.lever(own.now.at, &pose));
        let from = add(to, scale(depth, self.normal));
        Drawn { kind: ConnectionKind::Contact, from, to, force, torque: [0.0; 3] }
    }

    fn frames(&self) -> Vec<usize> {
        vec![self.frame]
    }

    fn wall<S: Scalar>(&self, own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
        let point = self.point.map(|value| own.now.at.value(value));
        Some((self.normal, add(point, scale(own.constant(), self.normal.map(S::constant)))))
    }

    fn rules(&self) -> Vec<(&'static str, Value, f64, bool)> {
        vec![
            ("radius", self.radius, 0.0, false),
            ("stiffness", self.stiffness, 0.0, true),
            ("damping", self.damping, 0.0, false),
            ("smoothing", self.smoothing, 0.0, true),
            ("friction", self.friction, 0.0, false),
            ("slip", self.slip, 0.0, true),
        ]
    }
}
