use supple_kernels::{Matrices, Scratch};
use supple_lqg::Dimensions;
use supple_model::Trajectory;
use supple_model::system::{
    Adjoints, Constraints, Curvature, CurvatureProducts, Points, RollOut, System, Variation, add_excess,
};

/// A system with the terms that limits add to its cost (theory, equations P.20 to P.22).
pub(super) struct Augmented<'a> {
    pub system: &'a dyn System,
    pub limits: &'a dyn Constraints,
    /// Multipliers `mu` of the excesses, vectors of length q of all steps and the end.
    pub multipliers: &'a Matrices,
    /// Penalties `rho`, q of them; none for the Lagrangian, with the curvature of the cost alone.
    pub penalties: Option<&'a [f64]>,
    /// How far each limit is widened; empty for the given limits.
    pub widened: &'a [f64],
}

/// How far the numbers of a system exceed limits that are widened, as [`Constraints::excesses_at`].
pub(super) fn excesses_beyond(
    limits: &dyn Constraints,
    widened: &[f64],
    at: Points,
    phi: &[f64],
    ends: usize,
    scratch: &mut Scratch,
) -> Matrices {
    let mut excesses = limits.excesses_at(at, phi, ends, scratch);
    for t in 0..excesses.count() {
        excesses.vector_mut(t).iter_mut().zip(widened).for_each(|(excess, by)| *excess -= by);
    }
    excesses
}

/// The slope of what the augmented Lagrangian adds for an excess, `max(0, mu + rho e)`.
fn slope(multiplier: f64, rho: f64, excess: f64) -> f64 {
    (multiplier + rho * excess).max(0.0)
}

/// What it adds: `(max(0, mu + rho e)^2 - mu^2) / (2 rho)`.
fn penalty(multiplier: f64, rho: f64, excess: f64) -> f64 {
    let slope = slope(multiplier, rho, excess);
    (slope - multiplier) * (slope + multiplier) / (2.0 * rho)
}

impl Augmented<'_> {
    fn excesses(&self, at: Points, phi: &[f64], scratch: &mut Scratch) -> Matrices {
        excesses_beyond(self.limits, self.widened, at, phi, self.multipliers.cols(), scratch)
    }

    /// What limits add to the cost of a trajectory.
    pub fn penalties_of(&self, trajectory: &Trajectory, phi: &[f64], scratch: &mut Scratch) -> f64 {
        let Some(penalties) = self.penalties else { return 0.0 };
        let excesses = self.excesses(trajectory.points(), phi, scratch);
        (0..excesses.count())
            .flat_map(|t| excesses.vector(t).iter().zip(self.multipliers.vector(t)).zip(penalties))
            .map(|((&excess, &multiplier), &rho)| penalty(multiplier, rho, excess))
            .sum()
    }

    /// Slopes of the terms that limits add, by each excess: the multipliers for which the Lagrangian has the gradient of the
    /// augmented one.
    pub fn slopes(&self, at: Points, phi: &[f64], scratch: &mut Scratch) -> Matrices {
        let mut slopes = self.multipliers.clone();
        if let Some(penalties) = self.penalties {
            let excesses = self.excesses(at, phi, scratch);
            for i in 0..at.count() {
                let parts = excesses.vector(i).iter().zip(penalties);
                for (multiplier, (&excess, &rho)) in slopes.vector_mut(i).iter_mut().zip(parts) {
                    *multiplier = slope(*multiplier, rho, excess);
                }
            }
        }
        slopes
    }

    /// Adds the contribution of limits to the cost's slopes and second derivatives.
    fn add_limits(&self, at: Points, phi: &[f64], curvature: Curvature, out: &mut Matrices, scratch: &mut Scratch) {
        let slopes = self.slopes(at, phi, scratch);
        if slopes.as_slice().iter().all(|slope| *slope == 0.0) {
            return;
        }
        let joint = self.system.dimensions().joint();
        let mut jacobians = Matrices::zeros(at.count(), slopes.cols(), joint);
        self.limits.excess_jacobians(at, phi, &slopes, &mut jacobians, scratch);
        let stride = out.stride();
        for i in 0..at.count() {
            for (row, &slope) in slopes.vector(i).iter().enumerate().filter(|(_, slope)| **slope > 0.0) {
                let gradient = &jacobians.at(i)[row * jacobians.stride()..][..joint];
                let rho = self.penalties.map_or(0.0, |penalties| penalties[row]);
                add_excess(out.at_mut(i), stride, gradient, slope, rho);
            }
        }
        if curvature == Curvature::Exact && self.penalties.is_some() {
            self.limits.add_excess_curvature(at, phi, &slopes, out, scratch);
        }
    }
}

/// Only roll-outs and derivatives of the cost differ from the system without limits. It plans all steps, starting at step 0.
impl System for Augmented<'_> {
    fn dimensions(&self) -> Dimensions {
        self.system.dimensions()
    }

    fn state_names(&self) -> Vec<String> {
        self.system.state_names()
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        self.system.depends_on(parameters)
    }

    fn step(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]) {
        self.system.step(t, x, u, phi, next);
    }

    fn observe(&self, t: usize, x: &[f64], phi: &[f64], y: &mut [f64]) {
        self.system.observe(t, x, phi, y);
    }

    fn stage_cost(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64 {
        self.system.stage_cost(t, x, u, phi, scratch)
    }

    fn final_cost(&self, x: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64 {
        self.system.final_cost(x, phi, scratch)
    }

    fn roll_out(&self, law: RollOut, phi: &[f64], out: &mut Trajectory, scratch: &mut Scratch) -> f64 {
        let cost = self.system.roll_out(law, phi, out, scratch);
        if cost.is_finite() { cost + self.penalties_of(out, phi, scratch) } else { cost }
    }

    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        self.system.dynamics_jacobians(at, phi, out, scratch);
    }

    fn measurement_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        self.system.measurement_jacobians(at, phi, out, scratch);
    }

    fn cost_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        // Limits contribute to entries that the system itself leaves at 0.
        out.clear();
        self.system.cost_quadratics(at, phi, curvature, out, scratch);
        self.add_limits(at, phi, curvature, out, scratch);
    }

    fn lagrangian_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        out.clear();
        self.system.lagrangian_quadratics(at, phi, costates, out, scratch);
        self.add_limits(at, phi, Curvature::Exact, out, scratch);
    }

    fn add_dynamics_curvature(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        self.system.add_dynamics_curvature(at, phi, costates, out, scratch);
    }

    fn has_costly_curvature(&self) -> bool {
        self.system.has_costly_curvature()
    }

    fn curvature_products<'a>(
        &'a self,
        at: Points<'a>,
        phi: &'a [f64],
        costates: &'a Matrices,
        scratch: &mut Scratch,
    ) -> Option<CurvatureProducts<'a>> {
        self.system.curvature_products(at, phi, costates, scratch)
    }

    fn has_smooth_gauss_newton(&self) -> bool {
        self.system.has_smooth_gauss_newton()
    }

    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: Adjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        self.system.contract(at, phi, adjoints, joint, parameters, scratch);
    }

    fn add_parameter_gradient(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        self.system.add_parameter_gradient(at, phi, costates, variation, parameters, scratch);
    }
}
