//! Drives: plain ones, whose control is a torque or force, position and velocity drives, and the actuators of the robot's
//! file.

use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::{Actuator, Law};

use crate::{Point, Value};

/// A drive: one control.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    /// Index of the degree of freedom whose joint it drives.
    pub dof: usize,
    /// Index of the motor among the coordinates that compliance adds, if the joint is elastic.
    pub motor: Option<usize>,
    /// Joint torque per unit of drive force.
    pub gear: Value,
    /// Rotor inertia; reflected to the joint with `gear^2`.
    pub rotor: Value,
    /// The actuator; `None` if the control is the force itself.
    pub(super) actuator: Option<Servo>,
}

/// An actuator of the robot, defined by its file or by the task: `force = gain u + offset - kp l - kv l'`.
#[derive(Clone, Debug)]
pub(super) struct Servo {
    /// Index among the actuators of the robot.
    pub(super) index: usize,
    gain: Value,
    offset: f64,
    kp: Value,
    kv: Value,
}

/// The drive of a joint, or an actuator of the robot's file.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct DriveFile {
    /// Joint torque or force per unit of drive force; not 0; default: value in the file, or 1.
    pub(super) gear: Option<Value>,
    /// Rotor inertia, kg m²; reflected to the joint with `gear`²; at least 0.
    #[serde(default)]
    pub(super) rotor_inertia: Value,
    /// Stiffness of a position actuator, N m/rad or N/m; at least 0; default: value in the file. On a plain drive it makes
    /// the control the commanded position.
    pub(super) kp: Option<Value>,
    /// Damping of a position or velocity actuator, N m s/rad or N s/m; at least 0; default: value in the file. On a plain
    /// drive without `kp` it makes the control the commanded velocity.
    pub(super) kv: Option<Value>,
}

impl Drive {
    /// Torque or force on the joint, or on its motor, at a control, given position and rate of what it drives (theory,
    /// equation R.25).
    ///
    /// ```text
    /// tau = gear (gain u + offset - kp gear q - kv gear q')
    /// ```
    pub fn force<S: Scalar>(&self, at: &Point<S>, u: S, position: S, rate: S) -> S {
        let gear: S = at.value(&self.gear);
        let Some(Servo { gain, offset, kp, kv, .. }) = &self.actuator else { return gear * u };
        let mut force = at.value(gain) * u + *offset;
        for (coefficient, length) in [(kp, position), (kv, rate)] {
            if !coefficient.is_zero() {
                force -= at.value(coefficient) * gear * length;
            }
        }
        gear * force
    }
}

impl Drive {
    /// Whether its force depends on the motion that it drives, and resists it.
    pub fn resists(&self) -> bool {
        let negative = |value: &Value| matches!(value, Value::Number(number) if *number < 0.0);
        let of_motion = |servo: &Servo| !(servo.kp.is_zero() && servo.kv.is_zero());
        self.actuator.as_ref().is_some_and(|servo| of_motion(servo) && !negative(&servo.kp) && !negative(&servo.kv))
    }

    /// Decrease of its force per unit rate of the driven coordinate, with positions evaluated a time `lead`
    /// ahead: `gear^2 (kv + lead kp)`, N m s/rad or N s/m. `None` if the force does not resist motion.
    pub fn resistance<S: Scalar>(&self, at: &Point<S>, lead: S) -> Option<S> {
        let Servo { kp, kv, .. } = self.actuator.as_ref().filter(|_| self.resists())?;
        Some(at.value(&self.gear).square() * (at.value(kv) + lead * at.value(kp)))
    }
}

impl Servo {
    /// Its control law at these parameters, in the form used by robot files.
    pub(super) fn law(&self, at: &Point<f64>) -> Law {
        let [gain, kp, kv] = [&self.gain, &self.kp, &self.kv].map(|value| at.value(value));
        Law::new(gain, self.offset, kp, kv)
    }

    /// The actuator with this index, with the stiffness and damping that the task gives in place of its own.
    pub(super) fn new(index: usize, actuator: &Actuator, kp: Option<Value>, kv: Option<Value>) -> Self {
        let of = |given: Option<Value>, own: f64| given.unwrap_or(Value::Number(own));
        let [gain, kp, kv] = match actuator.law {
            Law::Motor { gain } => [gain, 0.0, 0.0].map(Value::Number),
            Law::Position { kp: own_kp, kv: own_kv } => {
                let kp = of(kp, own_kp);
                [kp.clone(), kp, of(kv, own_kv)]
            }
            Law::Velocity { kv: own } => {
                let kv = of(kv, own);
                [kv.clone(), Value::default(), kv]
            }
            Law::Affine { gain, kp, kv, .. } => [gain, kp, kv].map(Value::Number),
        };
        let offset = if let Law::Affine { offset, .. } = actuator.law { offset } else { 0.0 };
        Self { index, gain, offset, kp, kv }
    }
}
