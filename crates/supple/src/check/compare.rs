use std::collections::BTreeSet;

use serde::Serialize;

use super::differences::Difference;

/// A derivative compared with finite differences.
///
/// Example: [`check`](crate::check::check()).
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Which derivative.
    pub name: String,
    /// The error of the worst entry compared with its tolerance, relative to the scale of that entry.
    pub error: f64,
    /// The largest error allowed: the tolerance of the derivative plus the uncertainty of the finite difference.
    pub tolerance: f64,
    /// Where the worst entry is.
    pub place: String,
    /// The worst entry.
    pub analytic: f64,
    /// Its finite difference.
    pub numeric: f64,
    /// Entries too small, relative to the rounding of their function, for an error of a thousandth to be detected.
    pub unresolved: Vec<String>,
    /// Entries without a finite difference: no point near the design could be evaluated.
    pub not_compared: Vec<String>,
    /// Whether every entry was compared, and is within its tolerance.
    pub passed: bool,
}

/// Relative error of an entry that a comparison must be able to detect.
pub const VISIBLE: f64 = 1e-3;

/// One entry of a derivative and its finite difference.
struct Entry {
    /// Entries of one group share a scale.
    group: usize,
    key: usize,
    analytic: f64,
    numeric: Option<Difference>,
}

impl Entry {
    fn size(&self) -> f64 {
        self.numeric.map_or(0.0, |numeric| numeric.value.abs()).max(self.analytic.abs())
    }
}

/// Entries of one derivative.
#[derive(Default)]
pub(super) struct Entries {
    list: Vec<Entry>,
    groups: usize,
}

impl Entries {
    /// Adds an entry to a group that shares one scale; its key identifies its position.
    pub fn add(&mut self, group: usize, key: usize, analytic: f64, numeric: Option<Difference>) {
        self.groups = self.groups.max(group + 1);
        self.list.push(Entry { group, key, analytic, numeric });
    }

    /// The comparison: an entry may differ by `tolerance` of the largest entry of its group, plus its finite
    /// difference's uncertainty. An entry fails only if it also was among the keys `contradicted` by earlier differences,
    /// if there were any; those that differences contradict still are left there.
    pub fn row(
        self,
        name: &str,
        tolerance: f64,
        contradicted: &mut Option<BTreeSet<usize>>,
        place: impl Fn(usize) -> String,
    ) -> Row {
        let mut scales = vec![0.0_f64; self.groups];
        for entry in &self.list {
            scales[entry.group] = scales[entry.group].max(entry.size());
        }
        let (mut unresolved, mut not_compared) = (Vec::new(), Vec::new());
        let mut compared: Vec<(f64, &Entry, Difference)> = Vec::new();
        for entry in &self.list {
            let scale = scales[entry.group];
            let Some(numeric) = entry.numeric else {
                not_compared.push(place(entry.key));
                continue;
            };
            let mut allowed = tolerance * scale + numeric.uncertainty;
            if scale > 0.0 && allowed > VISIBLE * scale {
                unresolved.push(place(entry.key));
                // If rounding is that large, its own size is just as uncertain.
                allowed += numeric.uncertainty;
            }
            let difference = (entry.analytic - numeric.value).abs();
            let share = if difference == 0.0 { 0.0 } else { difference / allowed };
            compared.push((share, entry, numeric));
        }
        let contradicts = |(share, ..): &&(f64, &Entry, Difference)| share.is_nan() || *share > 1.0;
        let now: BTreeSet<usize> = compared.iter().filter(contradicts).map(|(_, entry, _)| entry.key).collect();
        let failed = contradicted.take().map_or_else(|| now.clone(), |before| &before & &now);
        let is_judged = |key: &usize| if failed.is_empty() { !now.contains(key) } else { failed.contains(key) };
        let judged = compared.into_iter().filter(|(_, entry, _)| is_judged(&entry.key));
        let worst = judged.max_by(|(a, ..), (b, ..)| a.total_cmp(b));
        let passed = not_compared.is_empty() && failed.is_empty();
        *contradicted = Some(failed);
        let relative = |entry: &Entry, number: f64| match scales[entry.group] {
            0.0 => 0.0,
            scale => number / scale,
        };
        let (entry, numeric) = match worst {
            Some((_, entry, numeric)) => (Some(entry), numeric),
            None => (None, Difference { value: 0.0, uncertainty: 0.0 }),
        };
        let of =
            |number: fn(&Entry, Difference) -> f64| entry.map_or(0.0, |entry| relative(entry, number(entry, numeric)));
        Row {
            name: name.to_owned(),
            error: of(|entry, numeric| (entry.analytic - numeric.value).abs()),
            tolerance: tolerance + of(|_, numeric| numeric.uncertainty),
            place: entry.map_or_else(String::new, |entry| place(entry.key)),
            analytic: entry.map_or(0.0, |entry| entry.analytic),
            numeric: numeric.value,
            unresolved,
            not_compared,
            passed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of many entries, differences over every step contradicted another one by chance.
    #[test]
    fn an_entry_fails_if_all_differences_contradict_it() {
        let of = |wrong: &[usize], contradicted: &mut Option<BTreeSet<usize>>| {
            let mut entries = Entries::default();
            for key in 0..3 {
                let value = if wrong.contains(&key) { 2.0 } else { 1.0 };
                entries.add(key, key, 1.0, Some(Difference { value, uncertainty: 1e-9 }));
            }
            entries.row("", 1e-6, contradicted, |key| key.to_string())
        };
        let mut contradicted = None;
        let first = of(&[0, 1], &mut contradicted);
        assert!(!first.passed && (first.error - 0.5).abs() < 1e-12, "{first:?}");
        let second = of(&[1, 2], &mut contradicted);
        assert!(!second.passed && second.place == "1", "{second:?}");
        let third = of(&[0, 2], &mut contradicted);
        assert!(third.passed && third.place == "1" && third.error == 0.0, "{third:?}");
    }
}
