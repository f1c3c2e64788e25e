//! Numbers of plots, packed: each array once in the page.

use std::collections::HashMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Points of a time series at most: more than a screen shows.
const MOST_POINTS: usize = 251;

/// The step of 16 bits that stands for "no number".
const NONE: u16 = u16::MAX;

/// All arrays of a page. Plots refer to them by index, as `{"a": index}`.
#[derive(Default)]
pub struct Arrays {
    packed: Vec<Value>,
    known: HashMap<String, usize>,
}

impl Arrays {
    /// A curve, in steps of 1/65534 of its range: a hundredth of what a screen shows.
    pub fn curve(&mut self, values: &[f64]) -> Value {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let least = finite().fold(f64::INFINITY, f64::min);
        let most = finite().fold(f64::NEG_INFINITY, f64::max);
        let step = if most > least { (most - least) / f64::from(NONE - 1) } else { 0.0 };
        // Ranges that overflow, or are so small that their steps vanish, are kept as they are.
        if finite().next().is_some() && (!step.is_finite() || (most > least && step < f64::MIN_POSITIVE)) {
            return self.exact(values);
        }
        let least = if least.is_finite() { least } else { 0.0 };
        let packed = |value: &f64| match value.is_finite() {
            true if step > 0.0 => ((value - least) / step).round() as u16,
            true => 0,
            false => NONE,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| packed(value).to_le_bytes()).collect();
        self.keep(json!({ "from": least, "step": step, "u2": STANDARD.encode(bytes) }))
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

    fn unpacked(arrays: Arrays, index: usize) -> Vec<f64> {
        let packed = &arrays.packed[index];
        let bytes = STANDARD.decode(packed["u2"].as_str().unwrap()).unwrap();
        let (from, step) = (packed["from"].as_f64().unwrap(), packed["step"].as_f64().unwrap());
        let steps = bytes.chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        steps.map(|s| if s == NONE { f64::NAN } else { from + step * f64::from(s) }).collect()
    }

    #[test]
    fn curves_are_within_half_a_step_and_keep_gaps() {
        let values = [-3.0, 0.123_456, f64::NAN, 1e3];
        let mut arrays = Arrays::default();
        assert_eq!(arrays.curve(&values), json!({ "a": 0 }));
        for (value, back) in values.iter().zip(unpacked(arrays, 0)) {
            assert!((value - back).abs() <= 0.5 * 1003.0 / 65534.0 + 1e-9 || value.is_nan() && back.is_nan());
        }
    }

    #[test]
    fn constants_and_nothing_at_all_can_be_packed() {
        for values in [vec![], vec![7.5; 3], vec![f64::NAN; 2]] {
            let mut arrays = Arrays::default();
            arrays.curve(&values);
            let back = unpacked(arrays, 0);
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
