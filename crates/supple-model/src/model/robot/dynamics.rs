//! Forces, inertia and steps of robots.

use supple_kernels::Scalar;
use supple_robot::{inverse_dynamics, mass_matrix, passive_forces_ahead, passive_resistance};

use super::Robot;
use super::drive::Drive;
use super::integrator::Integrator;
use super::sliding::{FreeStep, Rubbing, sliding_rates};
use crate::Point;
use crate::model::bodies::{Forces, Override, Situation, widened};
use crate::model::compliance::{DryFriction, Element, Native, Push, Resistance};

impl Robot {
    /// The situation at a point, with resistive forces evaluated where the integrator evaluates them in a step
    /// with accelerations `a`.
    pub(super) fn stepping<'a, S: Native>(&'a self, at: &'a Point<'a, S>, a: &[S]) -> Situation<'a, S> {
        let now = Situation::of(&self.bodies, at);
        if self.integrator == Integrator::SemiImplicit {
            return now;
        }
        let lead = self.lead.as_ref().map_or(at.time_step, |share| at.value(share) * at.time_step);
        now.ahead(lead, a, self.sees_frames())
    }

    /// Whether any element of compliance uses frames.
    fn sees_frames(&self) -> bool {
        self.compliance.iter().any(|element| !element.kind.frames().is_empty())
    }

    /// Whether forces at the end of the step depend nonlinearly on the accelerations: dry friction, and the push of contacts.
    pub(super) fn is_nonlinear(&self) -> bool {
        let in_compliance =
            || self.compliance.iter().any(|Element { kind, .. }| kind.pushes() || kind.has_dry_friction());
        self.integrator == Integrator::Implicit && (self.has_friction() || in_compliance())
    }

    /// The accelerations of an implicit step with dry friction and contacts (theory, equation R.23), exact to rounding.
    pub(super) fn sliding<S: Native>(&self, at: &Point<S>) -> Vec<S> {
        let still = vec![S::zero(); self.positions().1];
        let now = self.stepping(at, &still);
        let (rubbing, pushing) = (self.rubbing(&now), self.pushing(&now));
        let now = now.linear();
        let step = FreeStep {
            inertia: self.inertia(&now),
            needed: self.unbalanced(&now, &still),
            velocities: now.velocities().to_vec(),
            lead: now.lead(),
        };
        let rates = sliding_rates(&step, &rubbing, &pushing);
        rates.iter().zip(now.velocities()).map(|(&rate, &v)| (rate - v) / now.lead()).collect()
    }

    /// All dry friction: in joints, then in compliance.
    fn rubbing<S: Native>(&self, now: &Situation<S>) -> Vec<Rubbing<S>> {
        let (dofs, positions) = self.positions();
        let smoothing = self.friction_speed(now.at);
        let bodies = self.bodies.tree.bodies().iter().filter(|body| self.joint_has_friction(body.joint));
        let in_joints = bodies.map(|body| {
            let mut row = vec![S::zero(); positions];
            row[body.dof] = S::constant(body.ratio);
            Rubbing { limit: now.numbers.joints[body.joint].friction, smoothing, rows: vec![row] }
        });
        let of = |element: &Element| {
            let DryFriction { limit, smoothing, motions } = element.kind.over::<S>().dry_friction(&element.own(now))?;
            let along = |axis: usize| {
                let mut row = vec![S::zero(); positions];
                row[..dofs].iter_mut().zip(&motions).for_each(|(entry, motion)| *entry = motion[axis]);
                row
            };
            Some(Rubbing { limit, smoothing, rows: [0, 1, 2].map(along).to_vec() })
        };
        in_joints.chain(self.compliance.iter().filter_map(of)).collect()
    }

    /// The pushes of all contacts.
    fn pushing<S: Native>(&self, now: &Situation<S>) -> Vec<Push<S>> {
        let (_, positions) = self.positions();
        let of = |element: &Element| {
            let mut push = element.kind.over::<S>().push(&element.own(now))?;
            push.motions.resize(positions, S::zero());
            Some(push)
        };
        self.compliance.iter().filter_map(of).collect()
    }

    /// All forces except inertial ones: on degrees of freedom, on coordinates that compliance adds, and on links.
    pub(super) fn forces<S: Native>(&self, now: &Situation<S>) -> Forces<S> {
        let at = now.at;
        let (_, positions) = self.positions();
        let smoothing = self.friction_speed(at);
        let mut forces = Forces {
            generalised: passive_forces_ahead(&self.bodies.tree, &now.numbers, now.q(), now.resisted(), smoothing),
            wrenches: Vec::new(),
        };
        forces.generalised.resize(positions, S::zero());
        for (drive, &u) in self.drives.iter().zip(at.u) {
            let place = self.driven(drive);
            let (mut position, mut rate) = (at.x[place], at.x[positions + place]);
            if drive.resistance(at, now.lead()).is_some() {
                rate = now.rates()[place];
                position = now.lead().mul_add(rate, position);
            }
            forces.generalised[place] += drive.force(at, u, position, rate);
        }
        for element in &self.compliance {
            element.kind.over::<S>().apply(&element.own(now), &mut forces);
        }
        forces
    }

    /// The speed over which joint friction builds up.
    pub(super) fn friction_speed<S: Scalar>(&self, at: &Point<S>) -> S {
        let own = at.value(&self.friction_smoothing);
        self.friction_widening.as_ref().map_or(own, |speed| widened(at, own, speed))
    }

    /// Whether any joint has friction.
    pub(super) fn has_friction(&self) -> bool {
        (0..self.bodies.robot.joints.len()).any(|joint| self.joint_has_friction(joint))
    }

    fn joint_has_friction(&self, joint: usize) -> bool {
        let given = self.bodies.overrides.iter().rev().find_map(|change| match change {
            Override::Joint { joint: other, friction: Some(value), .. } if *other == joint => Some(value),
            _ => None,
        });
        let own = self.bodies.robot.joints[joint].friction != 0.0;
        given.map_or(own, |value| !value.is_zero())
    }

    /// `M`, with rotors and added coordinates; in an implicit step also the resistance to the rates at its end.
    pub(super) fn inertia<S: Native>(&self, now: &Situation<S>) -> Vec<Vec<S>> {
        let (dofs, positions) = self.positions();
        let mut mass = mass_matrix(&self.bodies.tree, &now.numbers, &now.kinematics);
        for row in &mut mass {
            row.resize(positions, S::zero());
        }
        mass.resize(positions, vec![S::zero(); positions]);
        for element in &self.compliance {
            for (i, inertia) in element.kind.over::<S>().inertias(now.at).into_iter().enumerate() {
                let place = dofs + element.coordinate + i;
                mass[place][place] += inertia;
            }
        }
        for (place, rotor) in self.rotors(now.at) {
            mass[place][place] += rotor;
        }
        if self.integrator == Integrator::Implicit {
            self.resist(now, &mut mass);
        }
        mass
    }

    /// Adds to `mass` the decrease of the forces at the end of a step per unit acceleration (theory, equation R.21).
    pub(super) fn resist<S: Native>(&self, now: &Situation<S>, mass: &mut [Vec<S>]) {
        let (lead, smoothing) = (now.lead(), self.friction_speed(now.at));
        let (_, positions) = self.positions();
        let joints = passive_resistance(&self.bodies.tree, &now.numbers, now.resisted(), smoothing);
        for (dof, resistance) in joints.into_iter().enumerate() {
            mass[dof][dof] += lead * resistance;
        }
        for drive in &self.drives {
            if let Some(resistance) = drive.resistance(now.at, lead) {
                let place = self.driven(drive);
                mass[place][place] += lead * resistance;
            }
        }
        for element in &self.compliance {
            for Resistance { block, rows } in element.kind.over::<S>().resistance(&element.own(now)) {
                let block: Vec<Vec<S>> =
                    block.iter().map(|row| row.iter().map(|&entry| lead * entry).collect()).collect();
                for i in 0..positions {
                    let dot = |weights: &Vec<S>| {
                        weights.iter().zip(&rows).fold(S::zero(), |sum, (&w, row)| w.mul_add(row[i], sum))
                    };
                    let weighed: Vec<S> = block.iter().map(dot).collect();
                    for j in 0..=i {
                        mass[i][j] =
                            weighed.iter().zip(&rows).fold(mass[i][j], |sum, (&w, row)| w.mul_add(row[j], sum));
                        mass[j][i] = mass[i][j];
                    }
                }
            }
        }
    }

    /// Index, among all positions, of the coordinate that a drive acts on: its joint, or the motor of an elastic joint.
    pub(super) fn driven(&self, drive: &Drive) -> usize {
        drive.motor.map_or(drive.dof, |motor| self.positions().0 + motor)
    }

    /// Inertias of rotors, reflected to their joints or motors.
    pub(super) fn rotors<S: Scalar>(&self, at: &Point<S>) -> Vec<(usize, S)> {
        let felt = |drive: &Drive| {
            let place = self.driven(drive);
            (place, at.value(&drive.gear).square() * at.value(&drive.rotor))
        };
        self.drives.iter().map(felt).collect()
    }

    /// `M a - forces`: 0 at the accelerations.
    pub(super) fn unbalanced<S: Native>(&self, now: &Situation<S>, a: &[S]) -> Vec<S> {
        let (dofs, positions) = self.positions();
        let forces = self.forces(now);
        let mut needed =
            inverse_dynamics(&self.bodies.tree, &now.numbers, &now.kinematics, &a[..dofs], &forces.wrenches);
        needed.resize(positions, S::zero());
        for element in &self.compliance {
            for (i, inertia) in element.kind.over::<S>().inertias(now.at).into_iter().enumerate() {
                let place = dofs + element.coordinate + i;
                needed[place] += inertia * a[place];
            }
        }
        for (place, rotor) in self.rotors(now.at) {
            needed[place] += rotor * a[place];
        }
        needed.iter().zip(&forces.generalised).map(|(&needed, &given)| needed - given).collect()
    }

    /// One semi-implicit Euler step over `dt` from the state `x`, given the accelerations.
    pub(super) fn integrate<S: Scalar>(&self, x: &[S], a: &[S], dt: S, next: &mut [S]) {
        let count = a.len();
        for i in 0..count {
            let velocity = x[count + i] + dt * a[i];
            next[count + i] = velocity;
            next[i] = x[i] + dt * velocity;
        }
        next[2 * count..].copy_from_slice(&x[2 * count..]);
    }
}
