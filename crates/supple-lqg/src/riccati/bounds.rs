use supple_kernels::Matrices;

/// Bounds on the controls of a plan, the same at every step: `lower <= u <= upper`, m each.
///
/// Example: [`solve_limited`](crate::solve_limited).
#[derive(Clone, Debug, PartialEq)]
pub struct ControlBounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl ControlBounds {
    /// Bounds of each control, `[lower, upper]` with `lower <= upper`; infinite where there is none.
    #[must_use]
    pub fn new(bounds: &[[f64; 2]]) -> Self {
        let (lower, upper) = bounds.iter().map(|&[lower, upper]| (lower, upper)).unzip();
        Self { lower, upper }
    }

    /// Whether there are controls within all of them.
    #[must_use]
    pub fn can_be_kept(&self) -> bool {
        self.lower.iter().zip(&self.upper).all(|(lower, upper)| lower <= upper)
    }

    /// The least values, m.
    #[must_use]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// The greatest values, m.
    #[must_use]
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Clamps the controls of one step to the bounds.
    pub fn clamp(&self, u: &mut [f64]) {
        for ((u, &lower), &upper) in u.iter_mut().zip(&self.lower).zip(&self.upper) {
            *u = u.max(lower).min(upper);
        }
    }

    /// Clamps the controls of all steps to the bounds.
    pub fn clamp_all(&self, controls: &mut Matrices) {
        for t in 0..controls.count() {
            self.clamp(controls.vector_mut(t));
        }
    }

    /// Whether controls are all inside or at the bounds.
    #[must_use]
    pub fn hold(&self, controls: &Matrices) -> bool {
        self.all(controls, |u, lower, upper| u >= lower && u <= upper)
    }

    /// Whether any control is at a bound, not counting controls whose two bounds are equal.
    #[must_use]
    pub fn are_met(&self, controls: &Matrices) -> bool {
        !self.all(controls, |u, lower, upper| lower == upper || u != lower && u != upper)
    }

    fn all(&self, controls: &Matrices, is: impl Fn(f64, f64, f64) -> bool) -> bool {
        let at = |t: usize| controls.vector(t).iter().zip(&self.lower).zip(&self.upper);
        (0..controls.count()).all(|t| at(t).all(|((&u, &lower), &upper)| is(u, lower, upper)))
    }

    /// The part of a cost's slope with respect to control `a` that a move could exploit: 0 if the control is at a bound and
    /// descent would lead outside.
    #[must_use]
    pub fn project(&self, a: usize, u: f64, slope: f64) -> f64 {
        let held = u <= self.lower[a] && slope > 0.0 || u >= self.upper[a] && slope < 0.0;
        if held { 0.0 } else { slope }
    }
}
