//! Symmetric matrices of values.

use supple_text::digits;

use super::Value;

/// Relative tolerance for asymmetry, as a fraction of the largest number in the matrix: it allows for the rounding errors
/// of products such as `G G'`.
const ROUNDING: f64 = 1e-12;

/// An entry of a square matrix that differs from its mirror image by more than rounding, or is a different parameter
/// or expression.
///
/// Example: [`symmetrise`].
#[derive(Clone, Debug, PartialEq)]
pub struct Asymmetry {
    /// Its row, counted from 0; greater than its column.
    pub row: usize,
    /// Its column, counted from 0.
    pub column: usize,
    /// The entry itself.
    pub entry: Value,
    /// Its mirror image, in row `column` and column `row`.
    pub mirrored: Value,
}

impl Asymmetry {
    /// The error message: what is valid, and both entries in words, given the names of the parameters.
    #[must_use]
    pub fn message(&self, names: &[String]) -> String {
        let Self { row, column, entry, mirrored } = self;
        let shown = |value: &Value| match value {
            Value::Number(number) => digits(*number),
            Value::Parameter(parameter) => match names.get(parameter.index()) {
                Some(name) => format!("`{name}`"),
                None => format!("parameter {}", parameter.index()),
            },
            Value::Expression(_) => "an expression".to_owned(),
        };
        let [entry, mut mirrored] = [entry, mirrored].map(shown);
        if entry == mirrored {
            mirrored = "another one".to_owned();
        }
        format!("must be symmetric up to rounding: [{row}][{column}] is {entry}, and [{column}][{row}] is {mirrored}")
    }
}

/// Makes a square matrix exactly symmetric if its numbers are symmetric up to rounding, by averaging each pair.
///
/// # Errors
/// The first entry below the diagonal that differs from its mirror image.
///
/// ```
/// use supple_model::Value;
/// use supple_model::value::symmetrise;
///
/// let mut rows = [[1.0, 2.0], [3.0, 1.0]].map(|row| row.map(Value::Number).to_vec());
/// let found = symmetrise(&mut rows).err().map(|asymmetry| (asymmetry.row, asymmetry.column));
/// assert_eq!(found, Some((1, 0)), "3 is not 2");
/// ```
pub fn symmetrise(rows: &mut [Vec<Value>]) -> Result<(), Asymmetry> {
    let number = |value: &Value| if let Value::Number(number) = value { number.abs() } else { 0.0 };
    let largest = rows.iter().flatten().map(number).fold(0.0, f64::max);
    let below_diagonal = (0..rows.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    for (i, j) in below_diagonal {
        match (&rows[i][j], &rows[j][i]) {
            (below, above) if below == above => {}
            (Value::Number(below), Value::Number(above)) if (below - above).abs() <= ROUNDING * largest => {
                let mean = 0.5 * below + 0.5 * above;
                [rows[i][j], rows[j][i]] = [mean; 2].map(Value::Number);
            }
            (entry, mirrored) => {
                let (entry, mirrored) = (entry.clone(), mirrored.clone());
                return Err(Asymmetry { row: i, column: j, entry, mirrored });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::parameters::{Parameter, Parameters};

    fn numbers(rows: &[[f64; 2]; 2]) -> Vec<Vec<Value>> {
        rows.iter().map(|row| row.iter().copied().map(Value::Number).collect()).collect()
    }

    fn place(rows: &mut [Vec<Value>]) -> Result<(), (usize, usize)> {
        symmetrise(rows).map_err(|found| (found.row, found.column))
    }

    #[test]
    fn both_entries_that_differ_are_named_with_their_values() {
        let mut parameters = Parameters::default();
        let names = ["a", "b"].map(str::to_owned);
        let [a, b] = names.clone().map(|name| Value::from(parameters.declare(Parameter::new(name, 1.0, [0.5, 2.0]))));
        let message = |below: Value, above: Value| {
            let one = || Value::Number(1.0);
            symmetrise(&mut [vec![one(), above], vec![below, one()]]).unwrap_err().message(&names)
        };
        let valid = "must be symmetric up to rounding: ";
        let said = message(Value::Number(0.25), Value::Number(-1e-7));
        assert_eq!(said, format!("{valid}[1][0] is 0.25, and [0][1] is -1e-7"));
        let said = message(a.squared(), b.squared());
        assert_eq!(said, format!("{valid}[1][0] is an expression, and [0][1] is another one"));
        assert_eq!(message(a, b), format!("{valid}[1][0] is `a`, and [0][1] is `b`"));
    }

    #[test]
    fn rounding_is_removed_and_more_is_refused() {
        let ulp = 0.3_f64.next_up();
        let mut rows = numbers(&[[1.0, 0.3], [ulp, 2.0]]);
        assert_eq!(symmetrise(&mut rows), Ok(()));
        assert_eq!(rows[0][1], rows[1][0]);
        let mut small = numbers(&[[1.0, 0.0], [1e-17, 0.0]]);
        assert_eq!(symmetrise(&mut small), Ok(()), "relative to the largest entry");
        assert_eq!(place(&mut numbers(&[[1.0, 0.3], [0.3 + 1e-11, 2.0]])), Err((1, 0)));
        assert_eq!(place(&mut numbers(&[[1.0, 0.3], [f64::NAN, 2.0]])), Err((1, 0)));
    }

    #[test]
    fn parameters_must_be_the_same() {
        let parameter = |index| Value::Parameter(crate::ParameterHandle::at(index));
        let mut rows = vec![vec![Value::Number(1.0), parameter(0)], vec![parameter(0), Value::Number(1.0)]];
        assert_eq!(symmetrise(&mut rows), Ok(()));
        rows[1][0] = parameter(1);
        assert_eq!(place(&mut rows), Err((1, 0)));
    }
}
