use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::value::RawValue;

/// Rows of `N` numbers over time: one row per frame, or a single one where nothing changes.
///
/// Numbers are rounded to seven digits of the largest one, which is invisible and keeps files small. In JSON it is a
/// list of lists (of plain numbers for `N = 1`) on one line; numbers that are not finite are `null` there.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track<const N: usize>(pub Vec<[f64; N]>);

impl<const N: usize> Track<N> {
    /// Rows, rounded; a single one where all are equal.
    #[must_use]
    pub fn new(mut rows: Vec<[f64; N]>) -> Self {
        round(rows.as_flattened_mut());
        if rows.windows(2).all(|pair| pair[0] == pair[1]) {
            rows.truncate(1);
        }
        Self(rows)
    }

    /// The row of a frame; `None` if there are no rows.
    #[must_use]
    pub fn at(&self, frame: usize) -> Option<&[f64; N]> {
        self.0.get(frame).or(self.0.last())
    }

    /// Whether it is the same at all times.
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.0.len() < 2
    }
}

impl<const N: usize> Serialize for Track<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = if N == 1 {
            serde_json::to_string(&self.0.iter().map(|row| row[0]).collect::<Vec<_>>())
        } else {
            serde_json::to_string(&self.0.iter().map(|row| &row[..]).collect::<Vec<_>>())
        };
        // Raw text stays on one line even if the rest of a file is indented.
        let raw = text.and_then(RawValue::from_string).map_err(serde::ser::Error::custom)?;
        raw.serialize(serializer)
    }
}

impl<'de, const N: usize> Deserialize<'de> for Track<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Row {
            Number(Option<f64>),
            Numbers(Vec<Option<f64>>),
        }
        let row = |row: Row| {
            let numbers = match row {
                Row::Number(number) => vec![number],
                Row::Numbers(numbers) => numbers,
            };
            let numbers: Vec<f64> = numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect();
            let found = numbers.len();
            numbers.try_into().map_err(|_| D::Error::custom(format!("a row has {found} numbers instead of {N}")))
        };
        Vec::<Row>::deserialize(deserializer)?.into_iter().map(row).collect::<Result<_, _>>().map(Self)
    }
}

/// Powers of ten up to this one are exact.
const EXACT_POWERS: usize = 22;

/// Rounds to seven digits of the largest number.
///
/// ```
/// let mut entries = [0.1 + 0.2];
/// supple_model::scene::round(&mut entries);
/// assert_eq!(entries, [0.3]);
/// ```
pub fn round(entries: &mut [f64]) {
    let finite = entries.iter().map(|entry| entry.abs()).filter(|entry| entry.is_finite());
    let largest = finite.fold(0.0, f64::max);
    if largest > 0.0 {
        // Decimal places; more than 300 would only be zeros of subnormal numbers.
        let digits = (6.0 - largest.log10().floor()).clamp(0.0, 300.0) as usize;
        // Round to the float nearest to the decimal number, which prints with the fewest digits: a quotient of exact numbers
        // is that float. Beyond the exact powers of ten, go through text instead.
        let power = (digits <= EXACT_POWERS).then(|| (0..digits).fold(1.0, |power, _| 10.0 * power));
        for entry in entries {
            let rounded = match power {
                Some(power) => (*entry * power).round_ties_even() / power,
                None => format!("{entry:.digits$}").parse().unwrap_or(*entry),
            };
            *entry = rounded + 0.0;
        }
    }
}
