//! What robots are as models.

use supple_kernels::Scalar;
use supple_lqg::Dimensions;

use super::Robot;
use super::integrator::Integrator;
use super::native::{Part, run};
use crate::Value;
use crate::channels::{Channel, Channels, Drive, Limit};
use crate::contacts::{Contact, ContactState};
use crate::model::bodies::Situation;
use crate::model::compliance::{CONTACT_FORCE, Element, FORCE_COMPONENTS, PENETRATION};
use crate::physics::{DependentJoint, FileSensor, Model, Point};
use crate::quantity::{Known, signals_for};
use crate::scene::Picture;

impl Robot {
    /// Names and units of the states. A motor uses those of its joint, and wall positions are in m. Other constants that
    /// compliance from other crates adds have no unit.
    fn state_channels(&self) -> Vec<Channel> {
        let [mut positions, mut rates, mut constants] = [const { Vec::new() }; 3];
        let mut moves = |slides: Option<bool>| {
            let (position, rate) = match slides {
                Some(true) => ("m", "m/s"),
                Some(false) => ("rad", "rad/s"),
                None => ("", ""),
            };
            positions.push(position);
            rates.push(rate);
        };
        (0..self.bodies.tree.dofs()).for_each(|dof| moves(Some(self.bodies.slides(dof))));
        for Element { kind, .. } in &self.compliance {
            (0..kind.coordinates()).for_each(|_| moves(kind.motor_of().map(|dof| self.bodies.slides(dof))));
            constants.extend((0..kind.constants()).map(|_| if kind.has_wall() { "m" } else { "" }));
        }
        let units = positions.into_iter().chain(rates).chain(constants);
        self.state_names().into_iter().zip(units).map(|(name, unit)| Channel::new(name, unit)).collect()
    }
}

impl Model for Robot {
    fn dimensions(&self) -> Dimensions {
        Dimensions {
            states: 2 * self.positions().1 + self.constants(),
            controls: self.drives.len(),
            measurements: self.sensors.iter().map(|sensor| sensor.quantity.len()).sum(),
        }
    }

    fn unknowns(&self) -> usize {
        self.positions().1
    }

    fn balance<S: Scalar>(&self, at: &Point<S>, residual: &mut [S]) {
        run(self, Part::Balance, at, residual);
    }

    fn mass<S: Scalar>(&self, at: &Point<S>, matrix: &mut [S]) {
        run(self, Part::Mass, at, matrix);
    }

    fn solution<S: Scalar>(&self, at: &Point<S>) -> Option<Vec<S>> {
        self.is_nonlinear().then(|| {
            let mut w = vec![S::zero(); self.unknowns()];
            run(self, Part::Solution, at, &mut w);
            w
        })
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        self.integrate(at.x, at.w, at.time_step, next);
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        let quantities: Vec<_> = self.sensors.iter().map(|sensor| &sensor.quantity).collect();
        let signals = signals_for(self, &quantities, at, &[]);
        let known = Known { signals: &signals, ..Known::NONE };
        let mut rest = y;
        for sensor in &self.sensors {
            let (own, others) = rest.split_at_mut(sensor.quantity.len());
            sensor.quantity.evaluate(at, &known, own);
            rest = others;
        }
    }

    fn signals(&self) -> Vec<String> {
        self.signal_names()
    }

    fn signal<S: Scalar>(&self, at: &Point<S>, out: &mut [S]) {
        run(self, Part::Signals, at, out);
    }

    fn signal_during<S: Scalar>(&self, at: &Point<S>, next: &[S], out: &mut [S]) {
        self.signal(at, out);
        self.move_drives_to_end(at, next, out);
    }

    fn frame_names(&self) -> Vec<String> {
        self.bodies.frame_names().into_iter().map(str::to_owned).collect()
    }

    fn motors(&self) -> Vec<(String, String)> {
        self.elastic_joints()
    }

    fn drives(&self) -> Vec<Drive> {
        self.drives.iter().map(|drive| self.described_drive(drive)).collect()
    }

    fn file_sensors(&self) -> Vec<FileSensor> {
        self.sensors_of_file()
    }

    fn joint_names(&self) -> Vec<String> {
        self.bodies.tree.joints().to_vec()
    }

    fn dependent_joints(&self) -> Vec<DependentJoint> {
        self.dependent.clone()
    }

    fn coupling_names(&self) -> Vec<String> {
        self.compliance.iter().map(|element| element.name.clone()).collect()
    }

    fn state_names(&self) -> Vec<String> {
        let own = |prefix: &'static str| {
            self.compliance.iter().flat_map(move |element| {
                let count = element.kind.coordinates();
                (0..count).map(move |_| format!("{prefix}.{}", element.name))
            })
        };
        let joints =
            |prefix: &'static str| self.bodies.tree.joints().iter().map(move |joint| format!("{prefix}.{joint}"));
        let constants = self
            .compliance
            .iter()
            .flat_map(|element| (0..element.kind.constants()).map(move |_| format!("c.{}", element.name)));
        joints("q").chain(own("q")).chain(joints("v")).chain(own("v")).chain(constants).collect()
    }

    fn channels(&self) -> Channels {
        Channels {
            states: self.state_channels(),
            controls: self.drives.iter().map(|drive| self.control_channel(drive)).collect(),
            measurements: Channel::distinct(self.sensors.iter().flat_map(|sensor| sensor.channels.clone()).collect()),
        }
    }

    fn limits(&self) -> Vec<Limit> {
        let (_, positions) = self.positions();
        let mut limits = Vec::new();
        for (dof, &joint) in self.bodies.tree.joint_indices().iter().enumerate() {
            let joint = &self.bodies.robot.joints[joint];
            let [lower, upper] = [joint.limits.lower, joint.limits.upper];
            let name = |what, by: &[String]| format!("{what} of joint `{}`{}", joint.name, of_followers(by));
            limits.push(Limit::state(name("position", &joint.narrowed.position), dof, lower, upper));
            let most = joint.limits.velocity;
            limits.push(Limit::state(name("velocity", &joint.narrowed.velocity), positions + dof, -most, most));
        }
        for (control, drive) in self.drives.iter().enumerate() {
            limits.extend(self.control_limits(control, drive));
        }
        limits.retain(|limit| limit.lower.is_finite() || limit.upper.is_finite());
        limits
    }

    fn contacts(&self) -> Vec<Contact> {
        let signals = Model::signals(self);
        let touching = self.compliance.iter().filter(|element| element.kind.is_contact());
        let of = |element: &Element| {
            let name = element.name.clone();
            let place = |what: &str| signals.iter().position(|signal| *signal == format!("{name}.{what}"));
            let components = FORCE_COMPONENTS.into_iter().filter_map(place).collect();
            Contact {
                force_signal: place(CONTACT_FORCE),
                component_signals: components,
                depth_signal: place(PENETRATION),
                name,
            }
        };
        touching.map(of).collect()
    }

    fn contact_states(&self, at: &Point<f64>) -> Vec<ContactState> {
        let now = Situation::of(&self.bodies, at);
        self.compliance.iter().filter_map(|element| element.kind.contact_state(&element.own(&now))).collect()
    }

    fn substeps(&self) -> Option<usize> {
        Some(self.substeps)
    }

    fn widened(&self, length: &Value, speed: &Value, lead: &Value) -> Option<Self> {
        let mut wide = Self { friction_widening: Some(speed.clone()), lead: Some(lead.clone()), ..self.clone() };
        let mut any = self.has_friction();
        for element in &mut wide.compliance {
            if let Some(kind) = element.kind.widened(length, speed) {
                element.kind = kind;
                any = true;
            }
        }
        any.then_some(wide)
    }

    /// Contacts are too stiff for longer steps, and friction is if it is explicit.
    fn endures_longer_steps(&self) -> bool {
        self.integrator == Integrator::Implicit && !self.compliance.iter().any(|element| element.kind.is_contact())
    }

    fn picture(&self, at: &Point<f64>) -> Option<Picture> {
        Some(self.draw(at))
    }

    fn landmarks<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        let mut entries = vec![S::zero(); 3 * self.landmark_count()];
        run(self, Part::Landmarks, at, &mut entries);
        entries.chunks_exact(3).map(|place| [place[0], place[1], place[2]]).collect()
    }
}

/// Whose limits those of a joint are, for its name; empty where they are its own.
fn of_followers(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => format!(" (from the limits of `{one}`, which follows it)"),
        several => format!(" (from the limits of `{}`, which follow it)", several.join("`, `")),
    }
}
