//! Which sensors to buy: sets of candidates, what they are worth, and how far from the best set one can be (theory,
//! section N).
//!
//! A trajectory planned without noise does not depend on the sensors, so that one linearisation serves every set: sensors
//! are rows of `C` with their noise.

mod branch;
mod candidates;
mod choose;
mod plant;
mod relax;
mod sight;

use crate::Error;

pub use branch::Searched;
pub use candidates::{Candidate, join_correlated};
pub use choose::{Chosen, Goal, Limits, Rule};
pub use plant::Plant;
pub use relax::Relaxation;
pub use sight::Worth;

use sight::{Memory, Sight, Weights};

/// Candidates for the sensors of one plant or several.
///
/// ```
/// use supple_lqg::sensors::{Candidate, Goal, Limits, Selection, Plant};
/// use supple_lqg::{Knots, LinearQuadratic, Noise, Policy, Regularisation, constant, solve_riccati};
///
/// // A frictionless mass, and two sensors: an exact one of its position and a cheap one of its velocity.
/// let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0], [0.0, 1.0]]);
/// let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
/// let knots = Knots::linear(50, plant)?;
/// let diagonal = |first: f64, second: f64| constant(&[[first, 0.0], [0.0, second]]);
/// let noise =
///     Noise { initial: diagonal(0.01, 0.01), process: diagonal(1e-6, 1e-4), measurement: diagonal(1e-5, 1e-2) };
/// let mut policy = Policy::zeros(knots.dimensions, 50);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
///
/// let candidate = |name: &str, price, row| Candidate { name: name.into(), price, rows: vec![row] };
/// let candidates = vec![candidate("position", 5.0, 0), candidate("velocity", 1.0, 1)];
/// let value = &policy.value_of_information;
/// let plant = Plant { knots: &knots, noise: &noise, value, fixed: 0.0, weight: 1.0 };
/// let selection = Selection::new(candidates, &[plant])?;
/// let one = Limits { count: Some(1), ..Limits::default() };
/// let best = selection.greedy(Goal::LeastCost, one)?;
/// assert_eq!(selection.candidates[best.sensors[0]].name, "position");
///
/// // A bound without a search, and the best set by a search.
/// let relaxation = selection.bound(Goal::LeastCost, one)?;
/// assert!(relaxation.bound <= best.worth.cost && relaxation.weights.len() == 2);
/// let found = selection.branch_and_bound(Goal::LeastCost, one, 1000, &mut || true)?;
/// assert!(found.proved && found.chosen.sensors == best.sensors && best.rule.is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Selection {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    sights: Vec<Sight>,
    /// Weight of each plant's information.
    weights: Vec<f64>,
}

impl Selection {
    /// Candidates for plants whose measurements include all of theirs. Measurements that belong to no candidate are always
    /// made.
    ///
    /// # Errors
    /// Where a candidate's row does not exist or belongs to another too, its price is negative or not finite, the arrays of a
    /// plant do not fit each other, noise is not positive definite or shared by two candidates, the value of information is
    /// indefinite, or the expected cost without candidates is not finite.
    pub fn new(candidates: Vec<Candidate>, plants: &[Plant]) -> Result<Self, Error> {
        if let Some(candidate) = candidates.iter().find(|candidate| !(0.0..f64::INFINITY).contains(&candidate.price)) {
            return Err(Error::SensorPrice { sensor: candidate.name.clone(), price: candidate.price });
        }
        let sights = plants.iter().map(|plant| {
            let count = plant.knots.dimensions.measurements;
            let mut owners = vec![None; count];
            for (index, candidate) in candidates.iter().enumerate() {
                for &row in &candidate.rows {
                    let sensor = &candidate.name;
                    let missing = || Error::MissingMeasurement { sensor: sensor.clone(), row, count };
                    let owner: &mut Option<usize> = owners.get_mut(row).ok_or_else(missing)?;
                    if let Some(other) = owner.replace(index) {
                        let [first, second] = [other, index].map(|at| candidates[at].name.clone());
                        return Err(Error::SharedMeasurement { row, first, second });
                    }
                }
            }
            Sight::new(*plant, owners)
        });
        let sights = sights.collect::<Result<Vec<_>, _>>()?;
        let weights = plants.iter().map(|plant| plant.weight).collect();
        let selection = Self { candidates, sights, weights };
        let none = selection.worth(&vec![false; selection.candidates.len()]);
        match none.cost.is_finite() && none.information.is_finite() {
            true => Ok(selection),
            false => Err(Error::NotFinite { what: "the expected cost without the candidate sensors", step: 0 }),
        }
    }

    /// What a set of candidates is worth, in addition to the sensors that are always there: the sum of the plants' expected
    /// costs, and the weighted sum of their information. `chosen` has one entry per candidate.
    ///
    /// # Panics
    /// If it has not.
    #[must_use]
    pub fn worth(&self, chosen: &[bool]) -> Worth {
        self.check_one_each(chosen.len());
        let z: Vec<f64> = chosen.iter().map(|&one| f64::from(u8::from(one))).collect();
        self.worth_with(&z, &mut self.memory(false))
    }

    /// The same with weights from 0 to 1, and its derivatives by them: a candidate with the weight `z` has `1 / z` times
    /// its noise. Both expected cost and information are returned, the derivatives in this order.
    ///
    /// # Panics
    /// If there is not one weight per candidate.
    #[must_use]
    pub fn relaxed(&self, z: &[f64]) -> (Worth, [Vec<f64>; 2]) {
        self.check_one_each(z.len());
        let mut memory = self.memory(true);
        let mut worth = Worth::default();
        let gradients = [(1.0, 0.0), (0.0, 1.0)].map(|(cost, information)| {
            let mut gradient = vec![0.0; z.len()];
            worth = self.gradient(z, Weights { cost, information }, &mut memory, &mut gradient);
            gradient
        });
        (worth, gradients)
    }

    fn check_one_each(&self, found: usize) {
        let count = self.candidates.len();
        assert!(found == count, "there must be one entry per candidate: {count}, not {found}");
    }

    fn memory(&self, gradients: bool) -> Vec<Memory> {
        self.sights.iter().map(|sight| sight.memory(gradients)).collect()
    }

    /// How much rounding may change the information.
    fn rounding(&self) -> f64 {
        self.sights.iter().zip(&self.weights).map(|(sight, weight)| weight * sight.rounding()).sum()
    }

    fn worth_with(&self, z: &[f64], memory: &mut [Memory]) -> Worth {
        let each = self.sights.iter().zip(memory).map(|(sight, memory)| sight.worth(z, memory));
        self.sum(each)
    }

    fn sum(&self, each: impl Iterator<Item = Worth>) -> Worth {
        let mut sum = Worth::default();
        for (worth, weight) in each.zip(&self.weights) {
            // Even a plant that has no weight must have a filter.
            if worth == Worth::NONE {
                return Worth::NONE;
            }
            sum.cost += worth.cost;
            sum.information += weight * worth.information;
        }
        sum
    }

    /// Adds the gradient of `of.cost` times the cost and `of.information` times the information.
    fn gradient(&self, z: &[f64], of: Weights, memory: &mut [Memory], gradient: &mut [f64]) -> Worth {
        let tasks = self.sights.iter().zip(memory).zip(&self.weights);
        let each = tasks.map(|((sight, memory), weight)| {
            let of = Weights { cost: of.cost, information: weight * of.information };
            sight.gradient(z, of, memory, gradient)
        });
        self.sum(each)
    }

    /// Total price of the candidates in a set, each by its index in [`Selection::candidates`].
    ///
    /// # Panics
    /// If an index is not that of a candidate.
    #[must_use]
    pub fn price(&self, sensors: &[usize]) -> f64 {
        sensors.iter().fold(0.0, |sum, &one| sum + self.candidates[one].price)
    }
}
