use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::vector::{add, cross, dot, scale, sub};
use supple_robot::{Pose, WallShape, Wrench};

use super::{
    Compliance, ComplianceFile, ConnectionKind, Drawn, DryFriction, Forces, Names, Own, Push, Resistance, Rule, Unfit,
    find, squares,
};
use crate::model::bodies::widened;
use crate::{Point, Value};

/// A point or sphere on a frame against a wall of uncertain position. It adds the wall's position `c` along its
/// normal to the state, as a constant, m.
///
/// With depth `d = c - n'(p - point) + radius` of the sphere about the frame's origin `p`, velocity `v` of that origin,
/// and the part `v_t` along the wall of the velocity `v + w x (-radius n)` of the point that touches the wall, where
/// `w` is the angular velocity:
///
/// ```text
/// force = stiffness (d)_+ (1 - dissipation n'v)_+        friction = -friction force v_t / sqrt(|v_t|^2 + slip^2)
/// ```
///
/// The first positive part is rounded off over `smoothing`, the second over 1/2: the force is exactly 0 at clearances
/// above `smoothing`, at any speed, and the wall never pulls (Hunt and Crossley 1975). It acts at the point that
/// touches. Rotation does not move that point along the normal, so dissipation depends only on `v`.
#[derive(Clone, Debug)]
pub struct Contact {
    frame: usize,
    normal: [f64; 3],
    point: [Value; 3],
    radius: Value,
    stiffness: Value,
    dissipation: Value,
    smoothing: Value,
    friction: Value,
    slip: Value,
    /// Used in planning: a length that widens and softens the contact, and a speed that widens the smoothing of its
    /// friction.
    widening: Option<(Value, Value)>,
}

/// A point or sphere on a frame in contact with a wall of uncertain position.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link whose origin is the point or the sphere's centre.
    frame: String,
    /// Outward normal of the wall in the world frame, of any non-zero length; required without `geom`.
    normal: Option<[f64; 3]>,
    /// World point from which the wall position is measured along the normal, m; default: the origin.
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
    /// Hunt-Crossley dissipation: relative increase of the normal force per unit of approach speed, s/m; at least 0.
    #[serde(default)]
    dissipation: Value,
    /// Clearance at which the force begins, and depth from which it is linear, m; above 0.
    smoothing: Value,
    /// Coefficient of friction; at least 0.
    #[serde(default)]
    friction: Value,
    /// Slip speed over which friction builds up, m/s; above 0. Only with `friction`; default: 0.01.
    slip: Option<Value>,
}

/// A face of a box, identified by its outward normal in the axes of the box.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Face {
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
    /// Its axis, and whether the normal points in the negative direction.
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
    /// Takes normal and point of the wall: those given, or those of a geom of the robot's file.
    fn wall(&mut self, names: &Names) -> Result<([f64; 3], [Value; 3]), Unfit> {
        let Some(geom) = &self.geom else {
            let missing = || Unfit::new("normal", "is missing: give `normal`, or name a `geom` of the robot file");
            if self.face.is_some() {
                return Err(Unfit::new("face", "requires `geom`, a box of the robot file"));
            }
            return Ok((self.normal.ok_or_else(missing)?, self.point.take().unwrap_or_default()));
        };
        for (key, given) in [("normal", self.normal.is_some()), ("point", self.point.is_some())] {
            if given {
                let unfit = Unfit::new(key, format!("the wall is already defined by `geom = {geom}`"));
                return Err(unfit.with_help(format!("remove `{key}` or `geom`")));
            }
        }
        let walls: Vec<String> = names.robot.walls.iter().map(|wall| wall.name.clone()).collect();
        let wall = &names.robot.walls[find("geom", "fixed plane or box", geom, &walls)?];
        let face = match (self.face, wall.shape) {
            (Some(face), _) => face,
            (None, WallShape::Plane) => Face::PlusZ,
            (None, WallShape::Box(_)) => {
                let message = format!("is missing: `{geom}` is a box; valid: `+x`, `-x`, `+y`, `-y`, `+z`, `-z`");
                let help = "the face in contact with the robot, in the box frame";
                return Err(Unfit::new("face", message).with_help(help));
            }
        };
        let (axis, negative) = face.side();
        let (normal, point) = wall
            .face(axis, negative)
            .ok_or_else(|| Unfit::new("face", format!("`{geom}` is a plane; its only face is `+z`")))?;
        Ok((normal, point.map(Value::Number)))
    }
}

/// The slip speed over which friction builds up if a task gives none, m/s.
const SLIP: f64 = 1e-2;

impl ComplianceFile for Contact {
    type File = File;

    fn build(mut file: File, names: &Names) -> Result<Self, Unfit> {
        let frame = names.frame("frame", &file.frame)?;
        let (normal, point) = file.wall(names)?;
        let length = dot(normal, normal).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return Err(Unfit::new("normal", format!("must be non-zero; found {normal:?}")));
        }
        let File { radius, stiffness, dissipation, smoothing, friction, slip, .. } = file;
        if slip.is_some() && friction.is_zero() {
            let unfit = Unfit::new("slip", "has no effect without friction");
            return Err(unfit.with_help("give `friction`, or leave out `slip`"));
        }
        let slip = slip.unwrap_or(Value::Number(SLIP));
        let normal = normal.map(|entry| entry / length);
        let widening = None;
        Ok(Self { frame, normal, point, radius, stiffness, dissipation, smoothing, friction, slip, widening })
    }
}

/// The forces of a contact, and their decrease with the rates.
struct Load<S> {
    /// At the beginning of the step, m.
    depth: S,
    /// Normal force on the frame, N.
    force: S,
    /// The normal force at the beginning of the step, N.
    pushed: S,
    /// The total force on the frame in the axes of the world, N.
    total: [S; 3],
    /// Its decrease per unit of velocity along the normal, N s/m.
    resistance: S,
    /// Friction along the wall; `None` if it is excluded.
    slide: Option<Slide<S>>,
}

/// Friction along a wall.
struct Slide<S> {
    /// Its greatest magnitude, N.
    limit: S,
    /// The velocity along the wall, m/s, at the rates at which resistive forces are evaluated.
    velocity: [S; 3],
    /// Norm of that velocity and the slip speed, `sqrt(|v|^2 + slip^2)`, m/s.
    speed: S,
}

impl Contact {
    /// From the frame's origin to the point that touches the wall, in the axes of the frame.
    fn lever<S: Scalar>(&self, at: &Point<S>, pose: &Pose<S>) -> [S; 3] {
        pose.unrotate(scale(-at.value(&self.radius), self.normal.map(S::constant)))
    }

    /// Stiffness and smoothing. A widened contact is also softer, so that the force at a given multiple of the
    /// smoothing length is the same.
    fn spring<S: Scalar>(&self, at: &Point<S>) -> (S, S) {
        let (stiffness, smoothing): (S, S) = (at.value(&self.stiffness), at.value(&self.smoothing));
        let Some((length, _)) = &self.widening else { return (stiffness, smoothing) };
        let wide = widened(at, smoothing, length);
        (stiffness * smoothing / wide, wide)
    }

    /// Its push, but for the motions of the robot.
    fn spring_and_damper<S: Scalar>(&self, own: &Own<S>) -> Push<S> {
        let at = own.at();
        let point = self.point.each_ref().map(|value| at.value(value));
        let outwards = dot(self.normal.map(S::constant), sub(own.pose(self.frame).position, point));
        let depth = own.constant() + at.value(&self.radius) - outwards;
        let (stiffness, smoothing) = self.spring(at);
        Push { depth, stiffness, smoothing, dissipation: at.value(&self.dissipation), motions: Vec::new() }
    }

    /// Depth and forces (theory, equations R.14, R.15, R.22 and R.23).
    fn load<S: Scalar>(&self, own: &Own<S>) -> Load<S> {
        let at = own.at();
        let (pose, normal) = (own.pose(self.frame), self.normal.map(S::constant));
        let (twist, twist_then) = (own.velocity(self.frame), own.frame_rates(self.frame));
        let [approach, approach_then] = [&twist, &twist_then].map(|twist| -dot(normal, pose.rotate(twist.linear)));
        let push = self.spring_and_damper(own);
        let (pushed, _) = push.at(S::zero(), approach);
        let (force, resistance) = push.at(own.lead(), approach_then);

        let mut total = scale(force, normal);
        let slide = (!self.friction.is_zero()).then(|| {
            let touch = pose.rotate(twist_then.at(self.lever(at, &pose)));
            let velocity = add(touch, scale(approach_then, normal));
            let speed = (dot(velocity, velocity) + self.slip_speed(at).square()).sqrt();
            Slide { limit: self.limit(at, pushed), velocity, speed }
        });
        if let Some(Slide { limit, velocity, speed }) = &slide {
            total = sub(total, scale(*limit / *speed, *velocity));
        }
        Load { depth: push.depth, force, pushed, total, resistance, slide }
    }

    /// Greatest friction force, given the normal force.
    fn limit<S: Scalar>(&self, at: &Point<S>, pushed: S) -> S {
        at.value(&self.friction) * pushed
    }

    /// The speed over which friction builds up; higher if the contact is widened.
    fn slip_speed<S: Scalar>(&self, at: &Point<S>) -> S {
        let own = at.value(&self.slip);
        self.widening.as_ref().map_or(own, |(_, speed)| widened(at, own, speed))
    }

    /// The motion of the touching point per unit rate of each degree of freedom.
    fn touch_motions<S: Scalar>(&self, own: &Own<S>) -> Vec<[S; 3]> {
        let pose = own.pose(self.frame);
        let touch = pose.apply(self.lever(own.at(), &pose));
        own.point_motions(self.frame, touch).into_iter().map(|motion| motion.linear).collect()
    }
}

impl Compliance for Contact {
    const NAME: &'static str = "contact";

    fn constants(&self) -> usize {
        1
    }

    fn signals(&self) -> Vec<&'static str> {
        vec!["contact_force", "penetration", "force_x", "force_y", "force_z"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let Load { depth, force, total, .. } = self.load(own);
        [vec![force, depth], total.to_vec()].concat()
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        if own.is_linear() {
            return;
        }
        let Load { total, .. } = self.load(own);
        let pose = own.pose(self.frame);
        let force = pose.unrotate(total);
        let torque = cross(self.lever(own.at(), &pose), force);
        forces.on_frame(own, self.frame, Wrench { torque, force });
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        if own.is_linear() {
            return Vec::new();
        }
        let Load { resistance, slide, .. } = self.load(own);
        let (pose, normal) = (own.pose(self.frame), self.normal.map(S::constant));
        let Some(Slide { limit, velocity, speed }) = slide else {
            let motions = own.point_motions(self.frame, pose.position);
            let inwards: Vec<[S; 1]> = motions.iter().map(|motion| [dot(normal, motion.linear)]).collect();
            return vec![own.spread([[resistance]], &inwards)];
        };
        let along = limit / speed;
        let mut block = squares(&[(resistance - along, normal), (-along / speed.square(), velocity)]);
        (0..3).for_each(|axis| block[axis][axis] += along);
        vec![own.spread(block, &self.touch_motions(own))]
    }

    fn pushes(&self) -> bool {
        true
    }

    fn push<S: Scalar>(&self, own: &Own<S>) -> Option<Push<S>> {
        let normal = self.normal.map(S::constant);
        let motions = own.point_motions(self.frame, own.pose(self.frame).position);
        let inwards = motions.into_iter().map(|motion| -dot(normal, motion.linear)).collect();
        Some(Push { motions: inwards, ..self.spring_and_damper(own) })
    }

    fn has_dry_friction(&self) -> bool {
        !self.friction.is_zero()
    }

    fn dry_friction<S: Scalar>(&self, own: &Own<S>) -> Option<DryFriction<S>> {
        let normal = self.normal.map(S::constant);
        let along = |motion: [S; 3]| sub(motion, scale(dot(motion, normal), normal));
        self.has_dry_friction().then(|| DryFriction {
            limit: self.limit(own.at(), self.load(own).pushed),
            smoothing: self.slip_speed(own.at()),
            motions: self.touch_motions(own).into_iter().map(along).collect(),
        })
    }

    fn widened(&self, length: &Value, speed: &Value) -> Option<Self> {
        Some(Self { widening: Some((length.clone(), speed.clone())), ..self.clone() })
    }

    /// From the wall to the touching point.
    fn draw(&self, own: &Own<f64>) -> Drawn {
        let Load { depth, total: force, .. } = self.load(own);
        let pose = own.pose(self.frame);
        let to = pose.apply(self.lever(own.at(), &pose));
        let from = add(to, scale(depth, self.normal));
        Drawn { kind: ConnectionKind::Contact, from, to, force, torque: [0.0; 3] }
    }

    fn ball(&self, own: &Own<f64>) -> Option<(usize, f64)> {
        let radius = own.value(&self.radius);
        (radius > 0.0).then_some((self.frame, radius))
    }

    fn frames(&self) -> Vec<usize> {
        vec![self.frame]
    }

    fn has_wall(&self) -> bool {
        true
    }

    fn wall<S: Scalar>(&self, own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
        let point = self.point.each_ref().map(|value| own.value(value));
        Some((self.normal, add(point, scale(own.constant(), self.normal.map(S::constant)))))
    }

    fn rules(&self) -> Vec<Rule<'_>> {
        vec![
            Rule::at_least("radius", &self.radius, 0.0),
            Rule::above("stiffness", &self.stiffness, 0.0)
                .with_help("the force per depth of both surfaces in series, N/m: such as 1e3 to 1e5"),
            Rule::at_least("dissipation", &self.dissipation, 0.0)
                .with_help("0 for an impact that loses no energy; the shipped tasks use 1 to 2 s/m"),
            Rule::above("smoothing", &self.smoothing, 0.0)
                .with_help("the clearance at which the force begins, m: such as 1e-3, or less for a shorter reach"),
            Rule::at_least("friction", &self.friction, 0.0)
                .with_help("the coefficient of friction, whichever way the contact slides: 0 for none, such as 0.3"),
            Rule::above("slip", &self.slip, 0.0)
                .with_help("the speed over which friction builds up, m/s: such as 0.01, the default"),
        ]
    }
}
