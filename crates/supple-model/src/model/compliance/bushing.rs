use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::vector::{add, cross, dot, scale, sub};
use supple_robot::{Pose, Wrench};

use super::{Compliance, ComplianceFile, ConnectionKind, Drawn, Forces, Names, Own, Resistance, Rule, Unfit};
use crate::Value;

/// A spring and damper in six directions between the frames A and C, as defined by Drake's `LinearBushingRollPitchYaw`.
///
/// Frame B is half-way between A and C: at the midpoint of their origins, rotated from A by half the rotation to C. With
/// the position `p` of C's origin relative to A's, expressed in B, and the roll, pitch and yaw `q` of C in A:
///
/// ```text
/// force on C, at B's origin, in B:  f = -(stiffness p + damping p')      p' relative to B
/// torque on C:                      t = N' T,  T = -(torsional_stiffness q + torsional_damping q'),  q' = N w_AC
/// ```
///
/// and the opposite wrench on A. At a pitch of +-90 degrees the angle rates are singular and the torque is undefined.
#[derive(Clone, Debug)]
pub struct Bushing {
    a: usize,
    c: usize,
    stiffness: [Value; 3],
    damping: [Value; 3],
    torsional_stiffness: [Value; 3],
    torsional_damping: [Value; 3],
}

/// A spring and damper in six directions between two frames, like Drake's `LinearBushingRollPitchYaw`.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link A.
    frame_a: String,
    /// Name of the frame or link C.
    frame_c: String,
    /// Stiffness along the axes of the half-way frame, N/m; at least 0.
    stiffness: [Value; 3],
    /// Damping along them, N s/m; at least 0.
    damping: [Value; 3],
    /// Stiffness of roll, pitch and yaw of C in A, N m/rad; at least 0.
    torsional_stiffness: [Value; 3],
    /// Damping of their rates, N m s/rad; at least 0.
    torsional_damping: [Value; 3],
}

impl ComplianceFile for Bushing {
    type File = File;

    fn build(file: File, names: &Names) -> Result<Self, Unfit> {
        let (a, c) = (names.frame("frame_a", &file.frame_a)?, names.frame("frame_c", &file.frame_c)?);
        let File { stiffness, damping, torsional_stiffness, torsional_damping, .. } = file;
        Ok(Self { a, c, stiffness, damping, torsional_stiffness, torsional_damping })
    }
}

/// The half-way rotation of a rotation `R` by less than a half turn: `R_AB` with `R_AB R_AB = R`.
fn half<S: Scalar>(r: &[[S; 3]; 3]) -> Pose<S> {
    // The quaternion of R, (cos, v), from its trace 4 cos^2 - 1 and its skew part 4 cos v; then that of half the rotation.
    let trace = r[0][0] + r[1][1] + r[2][2];
    let cos = ((trace + 1.0) * 0.25).sqrt();
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let w = ((cos + 1.0) * 0.5).sqrt();
    let [x, y, z] = scale((cos * w).recip() * 0.125, skew);
    let one = S::one();
    let rotation = [
        [one - (y * y + z * z) * 2.0, (x * y - w * z) * 2.0, (x * z + w * y) * 2.0],
        [(x * y + w * z) * 2.0, one - (x * x + z * z) * 2.0, (y * z - w * x) * 2.0],
        [(x * z - w * y) * 2.0, (y * z + w * x) * 2.0, one - (x * x + y * y) * 2.0],
    ];
    Pose { rotation, position: [S::zero(); 3] }
}

/// `-(k x + d x')` per axis, with `x` evaluated at the end of an implicit step.
fn resist<S: Scalar>(own: &Own<S>, k: &[Value; 3], x: [S; 3], d: &[Value; 3], rate: [S; 3]) -> [S; 3] {
    let lead = own.lead();
    let mut out = [S::zero(); 3];
    for i in 0..3 {
        out[i] = -(own.value(&k[i]) * lead.mul_add(rate[i], x[i]) + own.value(&d[i]) * rate[i]);
    }
    out
}

/// Roll, pitch and yaw of a rotation, and the rows of the matrix `N` that gives their rates.
fn angles<S: Scalar>(r: &[[S; 3]; 3]) -> ([S; 3], [[S; 3]; 3]) {
    let level = (r[0][0] * r[0][0] + r[1][0] * r[1][0]).sqrt();
    let angles = [r[2][1].atan2(r[2][2]), (-r[2][0]).atan2(level), r[1][0].atan2(r[0][0])];
    let (cos_pitch, tan_pitch) = (level, -r[2][0] / level);
    let (cos_yaw, sin_yaw) = (r[0][0] / level, r[1][0] / level);
    let n = [
        [cos_yaw / cos_pitch, sin_yaw / cos_pitch, S::zero()],
        [-sin_yaw, cos_yaw, S::zero()],
        [cos_yaw * tan_pitch, sin_yaw * tan_pitch, S::one()],
    ];
    (angles, n)
}

impl Bushing {
    /// Torque and force on C in the axes of A, the force at the middle, and the position of C's origin in A.
    fn load<S: Scalar>(&self, own: &Own<S>) -> (Wrench<S>, [S; 3]) {
        let (pose_a, pose_c) = (own.pose(self.a), own.pose(self.c));
        let (twist_a, twist_c) = (own.frame_rates(self.a), own.frame_rates(self.c));
        let relative = pose_a.inverse().compose(&pose_c);
        let p = relative.position;
        // Velocities of C relative to A, in the axes of A.
        let w = sub(relative.rotate(twist_c.angular), twist_a.angular);
        let moved = sub(relative.rotate(twist_c.linear), twist_a.linear);
        let v = sub(moved, cross(twist_a.angular, p));

        let b = half(&relative.rotation);
        // The half-way frame rotates at half the angular velocity.
        let seen = sub(v, cross(scale(S::constant(0.5), w), p));
        let force = resist(own, &self.stiffness, b.unrotate(p), &self.damping, b.unrotate(seen));

        let (angles, n) = angles(&relative.rotation);
        let rates = n.map(|row| dot(row, w));
        let t = resist(own, &self.torsional_stiffness, angles, &self.torsional_damping, rates);
        let torque = add(add(scale(t[0], n[0]), scale(t[1], n[1])), scale(t[2], n[2]));
        (Wrench { torque, force: b.rotate(force) }, p)
    }
}

impl Compliance for Bushing {
    const NAME: &'static str = "bushing";

    fn signals(&self) -> Vec<&'static str> {
        vec!["torque_x", "torque_y", "torque_z", "force_x", "force_y", "force_z"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let (load, _) = self.load(own);
        [load.torque, load.force].concat()
    }

    fn deflections(&self) -> Vec<&'static str> {
        vec!["deflection_x", "deflection_y", "deflection_z", "deflection_roll", "deflection_pitch", "deflection_yaw"]
    }

    fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let relative = own.pose(self.a).inverse().compose(&own.pose(self.c));
        let shift = half(&relative.rotation).unrotate(relative.position);
        let (turns, _) = angles(&relative.rotation);
        [shift, turns].concat()
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        let (load, p) = self.load(own);
        let (pose_a, pose_c) = (own.pose(self.a), own.pose(self.c));
        let lever = cross(scale(S::constant(0.5), p), load.force);
        // On A at its origin: minus torque and force, with the force acting at the half-way point.
        let torque = add(load.torque, lever);
        forces.on_frame(own, self.a, Wrench { torque: scale(-S::one(), torque), force: scale(-S::one(), load.force) });
        // On C at its origin, half the distance from the half-way point.
        let relative = pose_a.inverse().compose(&pose_c);
        let torque = relative.unrotate(sub(load.torque, lever));
        forces.on_frame(own, self.c, Wrench { torque, force: relative.unrotate(load.force) });
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        let (pose_a, pose_c) = (own.pose(self.a), own.pose(self.c));
        let relative = pose_a.inverse().compose(&pose_c);
        let between = pose_a.compose(&half(&relative.rotation));
        let (_, n) = angles(&relative.rotation);
        let middle = scale(S::constant(0.5), add(pose_a.position, pose_c.position));
        // Velocity of A relative to C at the half-way point; its sign does not matter.
        let motions = own.point_motions(self.a, middle).into_iter().zip(own.point_motions(self.c, middle));
        let (shifts, turns): (Vec<_>, Vec<_>) =
            motions.map(|(a, c)| (sub(a.linear, c.linear), sub(a.angular, c.angular))).unzip();
        let axes = [0, 1, 2].map(|axis| between.rotation.map(|row| row[axis]));
        let rates = n.map(|row| pose_a.rotate(row));
        vec![
            own.resistances(&self.stiffness, &self.damping, axes, &shifts),
            own.resistances(&self.torsional_stiffness, &self.torsional_damping, rates, &turns),
        ]
    }

    fn draw(&self, own: &Own<f64>) -> Drawn {
        let (load, _) = self.load(own);
        let (a, c) = (own.pose(self.a), own.pose(self.c));
        let (force, torque) = (a.rotate(load.force), a.rotate(load.torque));
        Drawn { kind: ConnectionKind::Bushing, from: a.position, to: c.position, force, torque }
    }

    fn frames(&self) -> Vec<usize> {
        vec![self.a, self.c]
    }

    fn rules(&self) -> Vec<Rule<'_>> {
        [
            ("stiffness", &self.stiffness),
            ("damping", &self.damping),
            ("torsional_stiffness", &self.torsional_stiffness),
            ("torsional_damping", &self.torsional_damping),
        ]
        .into_iter()
        .flat_map(|(key, values)| values.iter().map(move |value| Rule::at_least(key, value, 0.0)))
        .collect()
    }
}
