//! Linear equations with the mass matrix.

// Loops over rows and columns by index read like the formulas.
#![allow(clippy::needless_range_loop)]

use std::fmt;

use supple_kernels::Scalar;

use super::{Kinematics, mass_matrix};
use crate::{Numbers, Tree};

/// Pivots of the mass matrix that are smaller than this part of its diagonal count as zero: rounding leaves about
/// 1e-15.
const SMALLEST_PIVOT: f64 = 1e-12;

/// Some joints can be accelerated without force: they move no inertia.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SingularMass {
    /// Names of the joints that such an acceleration moves.
    pub joints: Vec<String>,
}

impl fmt::Display for SingularMass {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names = supple_files::quoted(&self.joints);
        match self.joints.len() {
            1 => write!(f, "the joint {names} moves nothing that has inertia, so its acceleration is not determined"),
            _ => write!(
                f,
                "the joints {names} can move together without moving anything that has inertia, so their accelerations \
                 are not determined"
            ),
        }
    }
}

impl std::error::Error for SingularMass {}

/// `x` with `M x = b`, of a symmetric positive definite matrix `M`, by `M = L' D L` with unit lower triangular `L`,
/// which keeps the zeros of a mass matrix: Featherstone 2008, section 6.5. Only entries on and below the diagonal are
/// read.
///
/// # Panics
/// Where `mass` or `b` are of other sizes than each other.
pub fn solve<S: Scalar>(mass: Vec<Vec<S>>, b: &[S]) -> Vec<S> {
    let (lower, inverses, _) = factor(mass);
    let mut x = b.to_vec();
    for row in (0..x.len()).rev() {
        for column in 0..row {
            x[column] = x[column] - lower[row][column] * x[row];
        }
    }
    for row in 0..x.len() {
        x[row] = x[row] * inverses[row];
        for column in 0..row {
            x[row] = x[row] - lower[row][column] * x[column];
        }
    }
    x
}

/// `L` below the diagonal, the entries of `1 / D`, and those of `D`.
fn factor<S: Scalar>(mut mass: Vec<Vec<S>>) -> (Vec<Vec<S>>, Vec<S>, Vec<S>) {
    let size = mass.len();
    let mut inverses = vec![S::zero(); size];
    let mut pivots = vec![S::zero(); size];
    for k in (0..size).rev() {
        pivots[k] = mass[k][k];
        inverses[k] = mass[k][k].recip();
        for i in 0..k {
            let factor = mass[k][i] * inverses[k];
            for j in 0..=i {
                mass[i][j] = mass[i][j] - factor * mass[k][j];
            }
        }
        for i in 0..k {
            mass[k][i] = mass[k][i] * inverses[k];
        }
    }
    (mass, inverses, pivots)
}

/// Whether every motion of the robot moves inertia, at positions `q`, rad or m, of the degrees of freedom.
///
/// # Errors
/// Where the mass matrix is singular, naming the joints that can move without moving any inertia.
///
/// # Panics
/// As [`Kinematics::of`].
pub fn check_inertia(tree: &Tree, numbers: &Numbers<f64>, q: &[f64]) -> Result<(), SingularMass> {
    let mass = mass_matrix(tree, numbers, &Kinematics::at_rest(tree, numbers, q));
    let diagonal: Vec<f64> = (0..mass.len()).map(|i| mass[i][i]).collect();
    let Some(motion) = massless(mass, &diagonal) else { return Ok(()) };
    // In units in which each joint alone has inertia 1, or any where it has none.
    let sizes: Vec<f64> = motion
        .iter()
        .zip(&diagonal)
        .map(|(rate, inertia)| rate.abs() * if *inertia > 0.0 { inertia.sqrt() } else { 1.0 })
        .collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let names = tree.joints().iter().zip(&sizes).filter(|(_, size)| **size > 1e-6 * largest);
    Err(SingularMass { joints: names.map(|(name, _)| name.clone()).collect() })
}

/// A direction `x` with `M x = 0`, if there is one.
fn massless(mass: Vec<Vec<f64>>, diagonal: &[f64]) -> Option<Vec<f64>> {
    let (lower, _, pivots) = factor(mass);
    // The first pivot of the elimination, which runs from the last row to the first; those after it are not finite.
    let sound = |k: usize| pivots[k] > SMALLEST_PIVOT * diagonal[k];
    let singular = (0..pivots.len()).rev().find(|&k| !sound(k))?;
    // L x = the unit vector of that row, with zeros before it.
    let mut x = vec![0.0; pivots.len()];
    x[singular] = 1.0;
    for row in singular + 1..x.len() {
        x[row] = -(singular..row).map(|column| lower[row][column] * x[column]).sum::<f64>();
    }
    Some(x)
}
