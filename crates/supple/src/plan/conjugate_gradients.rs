//! Conjugate gradients within a ball.

use supple_kernels::rows;

/// A symmetric matrix that is never formed.
pub(crate) trait Operator {
    /// Why a product could not be taken.
    type Error;

    /// The product with a vector.
    ///
    /// # Errors
    /// Where it cannot be taken.
    fn times(&mut self, v: &[f64]) -> Result<Vec<f64>, Self::Error>;

    /// Multiplies a vector by a positive definite approximation of the inverse.
    fn precondition(&self, _v: &mut [f64]) {}
}

/// When a solve ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal {
    /// The residual, relative to that at 0.
    pub relative: f64,
    /// Maximum number of products.
    pub products: usize,
    /// Maximum length of the solution.
    pub radius: f64,
}

impl Goal {
    /// Without a ball.
    pub const fn free(relative: f64, products: usize) -> Self {
        Self { relative, products, radius: f64::INFINITY }
    }
}

/// A solution, and the residual it leaves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    pub x: Vec<f64>,
    pub residual: Vec<f64>,
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Solved {
    Converged,
    /// A direction of non-positive curvature was found. The solution follows it to the border; without a border it is that
    /// of the previous directions, or the first direction.
    NegativeCurvature,
    /// The solution is on the border.
    Border,
    MaxProducts,
}

/// Solves `H x = b` by preconditioned conjugate gradients, or minimises `1/2 x' H x - b' x` along their path within a ball
/// (Steihaug, 1983).
///
/// # Errors
/// Where a product cannot be taken.
pub(crate) fn conjugate_gradients<O: Operator>(
    operator: &mut O,
    b: &[f64],
    goal: Goal,
    Found { x, residual }: &mut Found,
) -> Result<Solved, O::Error> {
    x.clear();
    x.resize(b.len(), 0.0);
    residual.clear();
    residual.extend_from_slice(b);
    let mut z = residual.clone();
    operator.precondition(&mut z);
    let mut direction = z.clone();
    let mut size = rows::dot(residual, &z);
    let least = goal.relative * goal.relative * size;
    if size <= 0.0 {
        return Ok(Solved::Converged);
    }
    for product in 0..goal.products {
        let times = operator.times(&direction)?;
        let curvature = rows::dot(&direction, &times);
        let negative = curvature.is_nan() || curvature <= 0.0;
        let step = size / curvature;
        let border = to_border(x, &direction, goal.radius);
        if negative || step >= border {
            if border.is_finite() {
                advance(x, border, &direction);
                advance(residual, -border, &times);
            } else if product == 0 {
                x.copy_from_slice(&direction);
                advance(residual, -1.0, &times);
            }
            return Ok(if negative { Solved::NegativeCurvature } else { Solved::Border });
        }
        advance(x, step, &direction);
        advance(residual, -step, &times);
        z.copy_from_slice(residual);
        operator.precondition(&mut z);
        let next = rows::dot(residual, &z);
        if next <= least {
            return Ok(Solved::Converged);
        }
        let share = next / size;
        size = next;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
    }
    Ok(Solved::MaxProducts)
}

fn advance(x: &mut [f64], step: f64, direction: &[f64]) {
    x.iter_mut().zip(direction).for_each(|(x, d)| *x += step * d);
}

/// Distance from `x`, inside the ball, along a direction to the border; infinite if there is no border.
fn to_border(x: &[f64], direction: &[f64], radius: f64) -> f64 {
    if radius == f64::INFINITY {
        return f64::INFINITY;
    }
    let [square, along, inside] = [rows::dot(direction, direction), rows::dot(x, direction), rows::dot(x, x)];
    let root = (along * along + square * (radius * radius - inside).max(0.0)).sqrt();
    (root - along) / square
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::{Found, Goal, Operator, Solved, conjugate_gradients};

    /// A diagonal, with that of an inverse close to its own.
    struct Diagonal(Vec<f64>, Vec<f64>);

    impl Operator for Diagonal {
        type Error = Infallible;

        fn times(&mut self, v: &[f64]) -> Result<Vec<f64>, Infallible> {
            Ok(v.iter().zip(&self.0).map(|(v, d)| v * d).collect())
        }

        fn precondition(&self, v: &mut [f64]) {
            v.iter_mut().zip(&self.1).for_each(|(v, d)| *v *= d);
        }
    }

    fn solve(diagonal: &[f64], b: &[f64], radius: f64) -> (Solved, Found) {
        let mut operator = Diagonal(diagonal.to_vec(), vec![1.0; b.len()]);
        let (mut found, goal) = (Found::default(), Goal { relative: 1e-12, products: 20, radius });
        let Ok(solved) = conjugate_gradients(&mut operator, b, goal, &mut found);
        (solved, found)
    }

    #[test]
    fn systems_are_solved_and_what_is_left_is_told() {
        let (solved, found) = solve(&[1.0, 4.0, 9.0], &[1.0, 2.0, 3.0], f64::INFINITY);
        assert_eq!(solved, Solved::Converged);
        for (x, exact) in found.x.iter().zip([1.0, 0.5, 1.0 / 3.0]) {
            assert!((x - exact).abs() < 1e-12);
        }
        assert!(found.residual.iter().all(|r| r.abs() < 1e-11));
        // If the preconditioner is the exact inverse, one product suffices.
        let mut operator = Diagonal(vec![1.0, 4.0], vec![1.0, 0.25]);
        let mut found = Found::default();
        let goal = Goal::free(1e-12, 1);
        let Ok(solved) = conjugate_gradients(&mut operator, &[1.0, 2.0], goal, &mut found);
        assert_eq!((solved, found.x), (Solved::Converged, vec![1.0, 0.5]));
    }

    #[test]
    fn a_ball_ends_the_path_on_its_border() {
        for diagonal in [[1.0, 4.0, 9.0], [1.0, -2.0, 3.0], [-1.0, -1.0, -1.0]] {
            let b = [1.0, 2.0, 3.0];
            let (solved, found) = solve(&diagonal, &b, 0.3);
            assert!(matches!(solved, Solved::Border | Solved::NegativeCurvature));
            let length = found.x.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length - 0.3).abs() < 1e-12, "{length}");
            for ((x, r), (d, b)) in found.x.iter().zip(&found.residual).zip(diagonal.iter().zip(b)) {
                assert!((b - d * x - r).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn without_a_ball_negative_curvature_ends_the_path_where_it_is() {
        let (solved, found) = solve(&[-1.0, 2.0], &[1.0, 0.0], f64::INFINITY);
        assert_eq!((solved, found.x), (Solved::NegativeCurvature, vec![1.0, 0.0]));
    }
}
