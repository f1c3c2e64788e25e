use serde::Serialize;

/// A derivative compared with finite differences.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Which derivative.
    pub name: String,
    /// The worst difference of an entry, relative to the largest entry.
    pub error: f64,
    /// How large it may be.
    pub tolerance: f64,
    /// Where the worst entry is.
    pub place: String,
    /// The worst entry.
    pub analytic: f64,
    /// Its finite difference.
    pub numeric: f64,
    /// Whether the error is within the tolerance.
    pub passed: bool,
}

/// Collects entries of one derivative and keeps the worst.
pub(super) struct Worst {
    difference: f64,
    size: f64,
    place: String,
    analytic: f64,
    numeric: f64,
}

impl Worst {
    pub fn new() -> Self {
        Self { difference: -1.0, size: 0.0, place: String::new(), analytic: 0.0, numeric: 0.0 }
    }

    pub fn add(&mut self, analytic: f64, numeric: f64, place: impl FnOnce() -> String) {
        self.size = self.size.max(analytic.abs()).max(numeric.abs());
        let difference = (analytic - numeric).abs();
        if difference > self.difference || difference.is_nan() {
            (self.difference, self.analytic, self.numeric) = (difference, analytic, numeric);
            self.place = place();
        }
    }

    pub fn row(self, name: impl Into<String>, tolerance: f64) -> Row {
        let error = if self.difference <= 0.0 { 0.0 } else { self.difference / self.size.max(1e-12) };
        Row {
            name: name.into(),
            error,
            tolerance,
            place: self.place,
            analytic: self.analytic,
            numeric: self.numeric,
            passed: error <= tolerance,
        }
    }
}

/// The derivative at 0 of a function of one number, with several values: central differences at `step` and `step / 2`,
/// extrapolated (error of fourth order).
pub(super) fn derivative(step: f64, mut f: impl FnMut(f64) -> Vec<f64>) -> Vec<f64> {
    let mut central = |h: f64| -> Vec<f64> {
        f(h).into_iter().zip(f(-h)).map(|(above, below)| (above - below) / (2.0 * h)).collect()
    };
    let (coarse, fine) = (central(step), central(0.5 * step));
    coarse.into_iter().zip(fine).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
}

/// A step for finite differences about a number.
pub(super) fn step_at(value: f64) -> f64 {
    1e-6 * (1.0 + value.abs())
}
