//! Forces, inertia and steps of robots.

use supple_kernels::{Ldl, Scalar};
use supple_robot::{
    dry_friction, friction_resistance, inverse_dynamics, mass_matrix, passive_forces_ahead, passive_resistance,
    sliding_rate, sliding_share,
    vector::{dot, scale},
};

use super::drive::Drive;
use super::integrator::Integrator;
use super::{Point, Robot};
use crate::model::bodies::{Forces, Override, Situation, widened};
use crate::model::compliance::{DryFriction, Element, Native, Resistance};

impl Robot {
    /// Where everything is and how it moves, with forces that resist motion taken where the integrator takes them in a step
    /// with accelerations `a`.
    pub(super) fn stepping<'a, S: Native>(&'a self, at: &'a Point<'a, S>, a: &[S]) -> Situation<'a, S> {
        let mut now = Situation::of(&self.bodies, at);
        if self.integrator == Integrator::SemiImplicit {
            return now;
        }
        if self.has_friction() {
            now = self.sliding(now);
        }
        if self.compliance.iter().any(|element| element.kind.has_dry_friction()) {
            now = self.slipping(now);
        }
        now.at_end(a, self.sees_frames())
    }

    /// Whether any element of compliance asks for frames.
    fn sees_frames(&self) -> bool {
        self.compliance.iter().any(|element| !element.kind.frames().is_empty())
    }

    /// The same, with friction of joints that resists as at the rates to which it slows each degree of freedom in an implicit
    /// step (theory, equation R.23): at the rates of the beginning it would hold what breaks away within the step. First as
    /// if each moved alone; then among the others, with the friction that this gives them.
    fn sliding<'a, S: Native>(&self, mut now: Situation<'a, S>) -> Situation<'a, S> {
        let numbers = now.numbers.clone();
        let friction = dry_friction(&self.bodies.tree, &now.numbers);
        now.numbers.joints.iter_mut().for_each(|joint| joint.friction = S::zero());
        let still = vec![S::zero(); self.positions().1];
        now = now.at_end(&still, self.sees_frames());
        let (mut inertia, mut needed) = (self.inertia(&now), self.unbalanced(&now, &still));
        let (lead, smoothing) = (now.lead(), self.friction_speed(now.at));
        let alone = |(dof, &friction): (usize, &S)| {
            let mobility = lead / inertia[dof][dof];
            sliding_rate(now.v()[dof] - mobility * needed[dof], mobility * friction, smoothing)
        };
        let rates: Vec<S> = friction.iter().enumerate().map(alone).collect();

        let resistance = friction_resistance(&self.bodies.tree, &numbers, &rates, smoothing);
        for (dof, &resistance) in resistance.iter().enumerate() {
            inertia[dof][dof] += lead * resistance;
            needed[dof] += resistance * now.v()[dof];
        }
        let inertia = Ldl::new(&inertia);
        let (needed, mobilities) = (inertia.solve(needed), inertia.inverse_diagonal());
        let among_others = |(dof, &friction): (usize, &S)| {
            let rate = now.v()[dof] - lead * needed[dof];
            let mobility = lead * mobilities[dof];
            // Both without the friction of the degree of freedom itself.
            let share = S::one() - mobility * resistance[dof];
            sliding_rate(rate / share, mobility * friction / share, smoothing)
        };
        let rates = friction.iter().enumerate().map(among_others).collect();
        now.numbers = numbers;
        now.sliding_at(rates)
    }

    /// The same, with dry friction of compliance that resists as at the velocity to which it slows what slides along each
    /// surface in an implicit step, from the velocity that the step ends with if all surfaces are smooth (theory, equation
    /// R.24).
    fn slipping<'a, S: Native>(&self, now: Situation<'a, S>) -> Situation<'a, S> {
        let still = vec![S::zero(); self.positions().1];
        let now = now.on_smooth_surfaces().at_end(&still, self.sees_frames());
        let inertia = Ldl::new(&self.inertia(&now));
        let smooth: Vec<S> = inertia.solve(self.unbalanced(&now, &still)).into_iter().map(|a| -a).collect();
        let now = now.at_end(&smooth, self.sees_frames());
        let slowed = |DryFriction { limit, smoothing, velocity, motions }: DryFriction<S>| {
            let mut push: Vec<S> = motions.iter().map(|&motion| dot(motion, velocity)).collect();
            push.resize(still.len(), S::zero());
            let gained = inertia.solve(push.clone());
            let given = push.iter().zip(gained).fold(S::zero(), |sum, (&push, gained)| push.mul_add(gained, sum));
            let square = dot(velocity, velocity) + smoothing * smoothing;
            let loss = now.lead() * limit * given / square;
            scale(sliding_share(square.sqrt(), loss, smoothing), velocity)
        };
        let of = |element: &Element| element.kind.over::<S>().dry_friction(&element.own(&now)).map(slowed);
        let velocities = self.compliance.iter().map(of).collect();
        now.slipping_at(velocities)
    }

    /// All forces but those of inertia: on the degrees of freedom, on what compliance adds, and on links.
    pub(super) fn forces<S: Native>(&self, now: &Situation<S>) -> Forces<S> {
        let at = now.at;
        let (_, positions) = self.positions();
        let smoothing = self.friction_speed(at);
        let mut forces = Forces {
            generalised: passive_forces_ahead(
                &self.bodies.tree,
                &now.numbers,
                (now.q(), now.sliding()),
                now.resisted(),
                smoothing,
            ),
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

    /// The speed over which friction of joints sets in.
    pub(super) fn friction_speed<S: Scalar>(&self, at: &Point<S>) -> S {
        let own = at.value(self.friction_smoothing);
        self.friction_widening.map_or(own, |speed| widened(at, own, speed))
    }

    /// Whether any joint has friction.
    pub(super) fn has_friction(&self) -> bool {
        let given =
            |change: &Override| matches!(change, Override::Joint { friction: Some(value), .. } if !value.is_zero());
        self.bodies.robot.joints.iter().any(|joint| joint.friction != 0.0) || self.bodies.overrides.iter().any(given)
    }

    /// `M`, with the rotors and what compliance adds; in an implicit step with what resists the rates at its end.
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

    /// Adds how the forces at the end of a step fall with the accelerations (theory, equation R.21).
    pub(super) fn resist<S: Native>(&self, now: &Situation<S>, mass: &mut [Vec<S>]) {
        let (lead, smoothing) = (now.lead(), self.friction_speed(now.at));
        let (_, positions) = self.positions();
        let joints = passive_resistance(&self.bodies.tree, &now.numbers, now.sliding(), lead, smoothing);
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

    /// Place among all positions of what a drive acts on: its joint, or the motor of an elastic one.
    pub(super) fn driven(&self, drive: &Drive) -> usize {
        drive.motor.map_or(drive.dof, |motor| self.positions().0 + motor)
    }

    /// Inertias of rotors, felt at their joints or motors.
    pub(super) fn rotors<S: Scalar>(&self, at: &Point<S>) -> Vec<(usize, S)> {
        let felt = |drive: &Drive| {
            let place = self.driven(drive);
            (place, at.value(drive.gear).square() * at.value(drive.rotor))
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

    /// The next state after all sub-steps, each with accelerations of its own.
    pub(super) fn substep<S: Native>(&self, at: &Point<S>, next: &mut [S]) {
        let dt = at.time_step / self.substeps as f64;
        let mut x = at.x.to_vec();
        for _ in 0..self.substeps {
            let at = Point { x: &x, time_step: dt, ..*at };
            let zero = vec![S::zero(); self.positions().1];
            let now = self.stepping(&at, &zero);
            let a = Ldl::new(&self.inertia(&now)).solve(self.unbalanced(&now, &zero));
            let a: Vec<S> = a.into_iter().map(|a| -a).collect();
            self.integrate(&x, &a, dt, next);
            x.copy_from_slice(next);
        }
    }

    /// One step of Euler over `dt` from the state `x`, given the accelerations.
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
