//! The virtual sensor in readable form: which states it measures, how precisely and when.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;
use supple_kernels::math;

use supple_lqg::bound::VirtualSensor;

use supple_model::{Channel, time_of};
use supple_text::padded;

/// A sensor that attains the minimum with a Kalman filter and the optimal regulator.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SensorReport {
    /// How many numbers it measures, at most.
    pub rank: usize,
    /// How many at each decision, T of them.
    pub rank_per_step: Vec<usize>,
    /// Names of the states, n.
    pub states: Vec<String>,
    /// Their units, n; empty where they are not known.
    pub units: Vec<String>,
    /// The states that it measures, the one with the most bits first.
    pub measured: Vec<MeasuredState>,
    /// What it measures in each time window.
    pub windows: Vec<SensorWindow>,
    /// `C` at each decision, rank x n, T of them.
    pub measurement: Vec<Vec<Vec<f64>>>,
    /// The diagonal of `V` at each decision, rank, T of them.
    pub variances: Vec<Vec<f64>>,
    /// The Kalman gain at each decision, n x rank, T of them.
    pub gain: Vec<Vec<Vec<f64>>>,
}

/// The share of the information that concerns one state.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MeasuredState {
    /// The state.
    pub state: String,
    /// Its unit.
    pub unit: String,
    /// Bits over all decisions: those of each direction, divided among states by `c_i^2` times the state's variance.
    pub bits: f64,
}

/// What the sensor measures in one time window.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SensorWindow {
    /// Its first decision.
    pub first: usize,
    /// Its last one.
    pub last: usize,
    /// Time of the first one, s.
    pub from_s: f64,
    /// Time of the last one, s.
    pub until_s: f64,
    /// Bits over the window.
    pub bits: f64,
    /// Maximum number of scalars measured at a decision.
    pub rank: usize,
    /// The decision with the most bits.
    pub strongest: usize,
    /// What is measured at that decision, the direction with the most bits first.
    pub directions: Vec<Direction>,
}

/// A measured combination of states, independent of the others: their bits add up.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Direction {
    /// Its information, bits.
    pub bits: f64,
    /// Coefficients of the states, n; the dominant state has 1.
    pub coefficients: Vec<f64>,
    /// Unit of the combination, which is the unit of the dominant state.
    pub unit: String,
    /// The standard deviation of the noise, in this unit.
    pub deviation: f64,
    /// The measurement in words, with the states that matter, at most five.
    pub text: String,
}

/// Number of time windows.
const WINDOWS: usize = 5;

/// A state is named if its part of the standard deviation is at least this share of the largest part.
const COUNTS: f64 = 0.05;

/// Maximum number of states named in a combination.
const NAMED: usize = 5;

/// The report of virtual sensors; `predicted` are the covariances before each measurement.
pub(super) fn sensor_report(
    sensors: &[VirtualSensor],
    predicted: &Matrices,
    channels: &[Channel],
    time_step: f64,
) -> SensorReport {
    let steps = sensors.len();
    let directions: Vec<Vec<Direction>> =
        sensors.iter().enumerate().map(|(t, sensor)| directions(sensor, &square(predicted, t), channels)).collect();
    let ranks: Vec<usize> = sensors.iter().map(|sensor| sensor.rank).collect();
    let count = WINDOWS.min(steps);
    let window = |w: usize| window(&directions, &ranks, w * steps / count, (w + 1) * steps / count, time_step);
    SensorReport {
        rank: ranks.iter().copied().max().unwrap_or(0),
        states: channels.iter().map(|channel| channel.name.clone()).collect(),
        units: channels.iter().map(|channel| channel.unit.clone()).collect(),
        measured: measured(&directions, predicted, channels),
        windows: (0..count).map(window).collect(),
        measurement: sensors.iter().map(|sensor| entries(&sensor.measurement, sensor.rank)).collect(),
        variances: sensors.iter().map(|sensor| sensor.variances.clone()).collect(),
        gain: sensors.iter().map(|sensor| entries(&sensor.gain, channels.len())).collect(),
        rank_per_step: ranks,
    }
}

fn square(matrices: &Matrices, index: usize) -> DMatrix<f64> {
    DMatrix::from_fn(matrices.rows(), matrices.rows(), |i, j| matrices.get(index, i, j))
}

/// The first `rows` rows of a matrix as lists; empty if there are no columns.
fn entries(matrix: &Matrices, rows: usize) -> Vec<Vec<f64>> {
    (0..rows).map(|i| (0..matrix.cols()).map(|j| matrix.get(0, i, j)).collect()).collect()
}

/// The measurements, rotated so that the bits of the numbers add up: with noise of variance 1, `C P C'` is diagonal.
fn directions(sensor: &VirtualSensor, predicted: &DMatrix<f64>, channels: &[Channel]) -> Vec<Direction> {
    let (rank, n) = (sensor.rank, predicted.nrows());
    if rank == 0 {
        return Vec::new();
    }
    let scaled = DMatrix::from_fn(rank, n, |i, j| sensor.measurement.get(0, i, j) / sensor.variances[i].sqrt());
    let eigen = (&scaled * predicted * scaled.transpose()).symmetric_eigen();
    let turned = eigen.eigenvectors.transpose() * scaled;
    let direction = |i: usize| {
        let bits = 0.5 * math::ln_1p(eigen.eigenvalues[i].max(0.0)) / std::f64::consts::LN_2;
        describe(bits, &turned.row(i).iter().copied().collect::<Vec<_>>(), predicted, channels)
    };
    // A direction that carries no information has no finite deviation.
    let mut found: Vec<Direction> = (0..rank).map(direction).filter(|one| one.deviation.is_finite()).collect();
    found.sort_by(|a, b| b.bits.total_cmp(&a.bits));
    found
}

/// How much each state adds to the deviation of a combination.
fn parts(row: &[f64], predicted: &DMatrix<f64>) -> Vec<f64> {
    row.iter().enumerate().map(|(i, c)| c.abs() * predicted[(i, i)].max(0.0).sqrt()).collect()
}

fn describe(bits: f64, row: &[f64], predicted: &DMatrix<f64>, channels: &[Channel]) -> Direction {
    let parts = parts(row, predicted);
    let main = (0..row.len()).max_by(|&a, &b| parts[a].total_cmp(&parts[b])).unwrap_or(0);
    let coefficients: Vec<f64> = row.iter().map(|c| c / row[main]).collect();
    let mut counting: Vec<usize> = (0..row.len()).filter(|&i| parts[i] >= COUNTS * parts[main]).collect();
    counting.sort_by(|&a, &b| parts[b].total_cmp(&parts[a]));
    let unit = channels.get(main).map(|channel| channel.unit.clone()).unwrap_or_default();
    let deviation = row[main].abs().recip();
    let mut text = String::new();
    for (place, &i) in counting.iter().take(NAMED).enumerate() {
        let name = channels.get(i).map_or("", |channel| channel.name.as_str());
        let sign = if coefficients[i] < 0.0 { " - " } else { " + " };
        match place {
            0 => text.push_str(name),
            _ => text.push_str(&format!("{sign}{} {name}", padded(coefficients[i].abs(), 3))),
        }
    }
    if counting.len() > NAMED {
        text.push_str(" + ...");
    }
    Direction { bits, coefficients, unit, deviation, text }
}

/// Bits per state, divided in proportion to `c_i^2 P_ii`.
fn measured(directions: &[Vec<Direction>], predicted: &Matrices, channels: &[Channel]) -> Vec<MeasuredState> {
    let mut bits = vec![0.0; channels.len()];
    for (t, of_step) in directions.iter().enumerate() {
        for direction in of_step {
            let squares = direction.coefficients.iter().enumerate();
            let squares: Vec<f64> = squares.map(|(i, c)| c * c * predicted.get(t, i, i).max(0.0)).collect();
            let total: f64 = squares.iter().sum();
            for (bits, square) in bits.iter_mut().zip(&squares).filter(|_| total > 0.0) {
                *bits += direction.bits * square / total;
            }
        }
    }
    let state = |(channel, &bits): (&Channel, &f64)| MeasuredState {
        state: channel.name.clone(),
        unit: channel.unit.clone(),
        bits,
    };
    let mut found: Vec<MeasuredState> = channels.iter().zip(&bits).map(state).filter(|one| one.bits > 0.0).collect();
    found.sort_by(|a, b| b.bits.total_cmp(&a.bits));
    found
}

fn window(directions: &[Vec<Direction>], ranks: &[usize], first: usize, end: usize, time_step: f64) -> SensorWindow {
    let bits_at = |t: usize| directions[t].iter().map(|direction| direction.bits).sum::<f64>();
    let strongest = (first..end).max_by(|&a, &b| bits_at(a).total_cmp(&bits_at(b)).then(b.cmp(&a))).unwrap_or(first);
    SensorWindow {
        first,
        last: end - 1,
        from_s: time_of(first, time_step),
        until_s: time_of(end - 1, time_step),
        bits: (first..end).map(bits_at).sum(),
        rank: ranks[first..end].iter().copied().max().unwrap_or(0),
        strongest,
        directions: directions[strongest].clone(),
    }
}
