//! From data to places on the page, and the ticks of axes.

use crate::figure::{Axis, Scale};
use crate::words;

/// A map from data to places along an axis.
#[derive(Clone, Copy, Debug)]
pub struct Mapping {
    scale: Scale,
    low: f64,
    factor: f64,
    from: f64,
}

impl Mapping {
    /// Maps the ends of an axis to two places.
    pub fn new(axis: &Axis, from: f64, to: f64) -> Self {
        let [low, high] = axis.range.map(|end| forward(axis.scale, end));
        Self { scale: axis.scale, low, factor: (to - from) / (high - low), from }
    }

    /// The place of a value; NaN where it has none.
    pub fn at(&self, value: f64) -> f64 {
        self.from + (forward(self.scale, value) - self.low) * self.factor
    }
}

fn forward(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log => value.ln(),
    }
}

/// A tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Its value.
    pub value: f64,
    /// What stands beside it; empty for one between others.
    pub text: String,
}

/// The ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// All of them, rising.
    pub ticks: Vec<Tick>,
    /// The power of ten that their texts are to be multiplied by.
    pub exponent: i32,
}

/// Ticks of which at most `most` have texts.
pub fn ticks(axis: &Axis, most: usize) -> Ticks {
    match axis.scale {
        Scale::Linear => linear(axis.range, most.max(2)),
        Scale::Log => logarithmic(axis.range, most.max(2)),
    }
}

/// The least of 1, 2, 5 times a power of ten that divides a length into at most `most` parts.
pub fn step(length: f64, most: usize) -> f64 {
    let least = length / most as f64;
    let power = 10f64.powf(least.log10().floor());
    let fits = |factor: &f64| factor * power >= least * (1.0 - 1e-9);
    [1.0, 2.0, 5.0].into_iter().find(fits).unwrap_or(10.0) * power
}

fn linear([low, high]: [f64; 2], most: usize) -> Ticks {
    let slack = 1e-9 * (high - low);
    let counted = |parts: usize| {
        let step = step(high - low, parts);
        let first = ((low - slack) / step).ceil();
        (step, first, ((high + slack) / step).floor() - first)
    };
    let fits = |(_, _, count): &(f64, f64, f64)| *count < most as f64;
    let (step, first, count) = (1..=2 * most).rev().map(counted).find(fits).unwrap_or_else(|| counted(1));
    let values: Vec<f64> = (0..=count.max(0.0) as usize).map(|i| (first + i as f64) * step).collect();
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let power = if largest > 0.0 { words::exponent_of(largest) } else { 0 };
    let exponent = if (-2..5).contains(&power) { 0 } else { power.div_euclid(3) * 3 };
    let unit = 10f64.powi(exponent);
    let digits = usize::try_from(-((step / unit).log10() + 1e-9).floor() as i32).unwrap_or(0);
    let tick = |value: f64| Tick { value, text: words::fixed(value / unit, digits) };
    Ticks { ticks: values.into_iter().map(tick).collect(), exponent }
}

/// Powers of ten, or more where they are few; unlabelled ticks at their multiples.
fn logarithmic([low, high]: [f64; 2], most: usize) -> Ticks {
    let inside = |value: &f64| *value >= low * (1.0 - 1e-9) && *value <= high * (1.0 + 1e-9);
    let decades = (low.log10().floor() as i32).max(-307)..=(high.log10().ceil() as i32).min(308);
    let at = |factors: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|power| factors.iter().map(move |factor| factor * 10f64.powi(power)));
        all.filter(inside).collect()
    };
    let sets: [&[f64]; 4] = [&[1.0, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let wide = high / low > 4.0;
    let chosen = sets.iter().map(|set| at(set)).find(|values| wide && values.len() <= most && values.len() >= 2);
    let mut labelled = chosen.unwrap_or_else(|| {
        let powers = if wide { at(&[1.0]) } else { Vec::new() };
        let every = powers.len().div_ceil(most).max(1);
        powers.into_iter().step_by(every).collect()
    });
    if labelled.len() < 2 {
        // Little more than one number: round numbers, as on a linear axis.
        labelled = linear([low, high], most).ticks.into_iter().map(|tick| tick.value).filter(|v| *v > 0.0).collect();
    }
    let mut ticks: Vec<Tick> = labelled.iter().map(|&value| Tick { value, text: words::typeset(value) }).collect();
    if (high / low).log10() < 8.0 {
        let near = |value: f64| labelled.iter().any(|other| (value / other - 1.0).abs() < 1e-6);
        let minor = at(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]).into_iter().filter(|value| !near(*value));
        ticks.extend(minor.map(|value| Tick { value, text: String::new() }));
        ticks.sort_by(|a, b| a.value.total_cmp(&b.value));
    }
    Ticks { ticks, exponent: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: Scale, range: [f64; 2], most: usize) -> Vec<String> {
        let ticks = ticks(&Axis::over("", "", scale, range), most);
        ticks.ticks.into_iter().map(|tick| tick.text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(texts(Scale::Linear, [0.0, 2.5], 6), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5"]);
        assert_eq!(texts(Scale::Linear, [-31.0, 12.0], 5), ["−30", "−20", "−10", "0", "10"]);
        assert_eq!(texts(Scale::Log, [50.0, 600.0], 5), ["50", "100", "200", "500"]);
        assert_eq!(texts(Scale::Log, [1e-8, 1.0], 5), ["10⁻⁸", "10⁻⁶", "10⁻⁴", "0.01", "1"]);
        assert_eq!(texts(Scale::Log, [200.0, 400.0], 4), ["200", "300", "400"]);
        let small = ticks(&Axis::over("", "", Scale::Linear, [0.0, 2e-4]), 3);
        assert_eq!((small.exponent, small.ticks[1].text.as_str()), (-6, "100"));
    }

    #[test]
    fn ends_of_an_axis_map_to_its_places() {
        let axis = Axis::over("", "", Scale::Log, [1.0, 100.0]);
        let map = Mapping::new(&axis, 20.0, 10.0);
        let places = [1.0, 10.0, 100.0].map(|value| (map.at(value) * 1e6).round() / 1e6);
        assert_eq!(places, [20.0, 15.0, 10.0]);
        assert!(!map.at(-1.0).is_finite());
    }
}
