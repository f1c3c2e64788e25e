//! Numbers of plots, packed: each array once in the page.

use std::collections::HashMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Points of a time series at most: more than a screen shows.
const MOST_POINTS: usize = 251;

/// Number of quantisation steps over the range of a curve: many more than a plot has pixels.
const STEPS: f64 = 8191.0;

/// A range counts as wide if it exceeds the range of the middle four fifths of its numbers by this factor.
const WIDE: f64 = 50.0;

/// All arrays of a page. Plots refer to them by index, as `{"a": index}`.
#[derive(Default)]
pub struct Arrays {
    packed: Vec<Value>,
    known: HashMap<String, usize>,
}

impl Arrays {
    /// A curve, quantised to 1/8191 of its range and delta-encoded: each difference to the previous is stored as 1 plus
    /// twice its size in steps, minus one if positive, in groups of 7 bits, lowest first; missing numbers are 0.
    pub fn curve(&mut self, values: &[f64]) -> Value {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let least = finite().fold(f64::INFINITY, f64::min);
        let most = finite().fold(f64::NEG_INFINITY, f64::max);
        let step = if most > least { (most - least) / STEPS } else { 0.0 };
        // Curves are stored exactly if their range overflows, if it is so small that the steps vanish, or if outliers
        // make it so wide that the steps would hide the other numbers.
        let lost = !step.is_finite() || (most > least && step < f64::MIN_POSITIVE) || few_are_far(values, most - least);
        if finite().next().is_some() && lost {
            return self.exact(values);
        }
        let least = if least.is_finite() { least } else { 0.0 };
        let (mut bytes, mut before) = (Vec::new(), 0i32);
        for value in values {
            if !value.is_finite() {
                bytes.push(0);
                continue;
            }
            let now = if step > 0.0 { ((value - least) / step).round() as i32 } else { 0 };
            let difference = now - before;
            before = now;
            let mut rest = 1 + 2 * difference.unsigned_abs() - u32::from(difference > 0);
            while rest > 127 {
                bytes.push((rest & 127) as u8 | 128);
                rest >>= 7;
            }
            bytes.push(rest as u8);
        }
        self.keep(json!({ "from": least, "step": step, "c": STANDARD.encode(bytes) }))
    }

    /// Numbers as they are.
    pub fn exact(&mut self, values: &[f64]) -> Value {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.keep(json!({ "f8": STANDARD.encode(bytes) }))
    }

    /// A grid by rows, in single precision.
    pub fn grid(&mut self, rows: &[Vec<f64>]) -> Value {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        let columns = rows.first().map_or(0, Vec::len);
        self.keep(json!({ "columns": columns, "f4": STANDARD.encode(bytes) }))
    }

    /// What the page carries.
    pub fn into_json(self) -> Value {
        Value::Array(self.packed)
    }

    fn keep(&mut self, packed: Value) -> Value {
        let next = self.packed.len();
        let index = *self.known.entry(packed.to_string()).or_insert(next);
        if index == next {
            self.packed.push(packed);
        }
        json!({ "a": index })
    }
}

/// Whether a few outliers, such as a run that diverges, make the range much wider than that of most numbers.
fn few_are_far(values: &[f64], range: f64) -> bool {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return false };
    let [low, middle, high] = [last / 10, last / 2, last - last / 10].map(|place| sorted[place]);
    // Most numbers are equal: if they are at the lower end, quantisation from there is exact.
    if high > low { range > WIDE * (high - low) } else { range > 0.0 && middle != sorted[0] }
}

/// Which entries of a series are drawn: all of a short one, evenly spread ones of a long one, and the last.
pub fn thinned(length: usize) -> Vec<usize> {
    if length <= MOST_POINTS {
        return (0..length).collect();
    }
    (0..MOST_POINTS).map(|i| i * (length - 1) / (MOST_POINTS - 1)).collect()
}

/// The entries of a series that are drawn.
pub fn thin(values: &[f64]) -> Vec<f64> {
    thinned(values.len()).into_iter().map(|index| values[index]).collect()
}

/// The entries that are drawn of one column of rows.
pub fn thin_column(rows: &[Vec<f64>], column: usize) -> Vec<f64> {
    let at = |index: usize| rows[index].get(column).copied().unwrap_or(f64::NAN);
    thinned(rows.len()).into_iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a curve as the page's script does.
    fn unpacked(arrays: &Arrays, index: usize) -> Vec<f64> {
        let packed = &arrays.packed[index];
        let (from, step) = (packed["from"].as_f64().unwrap(), packed["step"].as_f64().unwrap());
        let (mut values, mut number, mut shift, mut before) = (Vec::new(), 0u32, 0, 0i64);
        for byte in STANDARD.decode(packed["c"].as_str().unwrap()).unwrap() {
            number |= u32::from(byte & 127) << shift;
            shift += 7;
            if byte > 127 {
                continue;
            }
            let size = i64::from(number / 2);
            before += if number % 2 == 0 { size } else { -size };
            values.push(if number == 0 { f64::NAN } else { from + step * before as f64 });
            (number, shift) = (0, 0);
        }
        values
    }

    #[test]
    fn curves_are_within_half_a_step_and_keep_gaps() {
        let values = [-3.0, 0.123_456, f64::NAN, 1e3, 1e3, 999.9, -2.9];
        let mut arrays = Arrays::default();
        assert_eq!(arrays.curve(&values), json!({ "a": 0 }));
        let back = unpacked(&arrays, 0);
        assert_eq!(back.len(), values.len());
        for (value, back) in values.iter().zip(back) {
            assert!((value - back).abs() <= 0.5 * 1003.0 / STEPS + 1e-9 || value.is_nan() && back.is_nan());
        }
    }

    #[test]
    fn a_smooth_curve_takes_little_more_than_a_byte_by_number() {
        let values: Vec<f64> = (0..251).map(|i| (f64::from(i) / 40.0).sin()).collect();
        let mut arrays = Arrays::default();
        arrays.curve(&values);
        assert!(STANDARD.decode(arrays.packed[0]["c"].as_str().unwrap()).unwrap().len() < 500);
    }

    #[test]
    fn constants_and_nothing_at_all_can_be_packed() {
        for values in [vec![], vec![7.5; 3], vec![f64::NAN; 2]] {
            let mut arrays = Arrays::default();
            arrays.curve(&values);
            let back = unpacked(&arrays, 0);
            assert_eq!(back.len(), values.len());
            assert!(back.iter().zip(&values).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
        }
    }

    #[test]
    fn huge_ranges_are_kept_exactly() {
        let mut arrays = Arrays::default();
        arrays.curve(&[-1e308, 1e308]);
        assert!(arrays.packed[0]["f8"].is_string());
    }

    #[test]
    fn one_point_that_diverges_does_not_round_the_others_away() {
        let smooth: Vec<f64> = (0..100).map(|i| (f64::from(i) / 15.0).sin()).collect();
        let rests = [[0.3; 99].as_slice(), &[-1.0]].concat();
        for values in [[&smooth[..], &[1e27]].concat(), rests] {
            let mut arrays = Arrays::default();
            arrays.curve(&values);
            assert!(arrays.packed[0]["f8"].is_string(), "{values:?}");
        }
        let mut arrays = Arrays::default();
        arrays.curve(&[[0.0; 99].as_slice(), &[1e3]].concat());
        assert!(arrays.packed[0]["c"].is_string(), "an impulse");
    }

    #[test]
    fn equal_arrays_are_kept_once() {
        let mut arrays = Arrays::default();
        assert_eq!(arrays.curve(&[1.0, 2.0]), arrays.curve(&[1.0, 2.0]));
        assert_ne!(arrays.curve(&[1.0, 2.0]), arrays.curve(&[1.0, 3.0]));
    }

    #[test]
    fn long_series_keep_their_ends() {
        let kept = thinned(10_001);
        assert_eq!((kept.len(), kept[0], kept[250]), (251, 0, 10_000));
        assert_eq!(thinned(126), (0..126).collect::<Vec<_>>());
    }
}
