//! Symmetric matrices of values.

use super::Value;

/// Numbers of a symmetric matrix may differ from those across its diagonal by this share of its largest number: what
/// rounding leaves of products such as `G G'`.
const ROUNDING: f64 = 1e-12;

/// Makes a square matrix symmetric whose numbers are so but for rounding, by the means of each pair.
///
/// # Errors
/// Row and column of the first entry below the diagonal that differs from the one across it by more, or is another
/// parameter or expression.
pub fn symmetrise(rows: &mut [Vec<Value>]) -> Result<(), (usize, usize)> {
    let number = |value: &Value| if let Value::Number(number) = value { number.abs() } else { 0.0 };
    let largest = rows.iter().flatten().map(number).fold(0.0, f64::max);
    let below_diagonal = (0..rows.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    for (i, j) in below_diagonal {
        match (rows[i][j], rows[j][i]) {
            (below, above) if below == above => {}
            (Value::Number(below), Value::Number(above)) if (below - above).abs() <= ROUNDING * largest => {
                let mean = Value::Number(0.5 * below + 0.5 * above);
                (rows[i][j], rows[j][i]) = (mean, mean);
            }
            _ => return Err((i, j)),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(rows: &[[f64; 2]; 2]) -> Vec<Vec<Value>> {
        rows.iter().map(|row| row.iter().copied().map(Value::Number).collect()).collect()
    }

    #[test]
    fn rounding_is_removed_and_more_is_refused() {
        let ulp = 0.3_f64.next_up();
        let mut rows = numbers(&[[1.0, 0.3], [ulp, 2.0]]);
        assert_eq!(symmetrise(&mut rows), Ok(()));
        assert_eq!(rows[0][1], rows[1][0]);
        let mut small = numbers(&[[1.0, 0.0], [1e-17, 0.0]]);
        assert_eq!(symmetrise(&mut small), Ok(()), "relative to the largest entry");
        assert_eq!(symmetrise(&mut numbers(&[[1.0, 0.3], [0.3 + 1e-11, 2.0]])), Err((1, 0)));
        assert_eq!(symmetrise(&mut numbers(&[[1.0, 0.3], [f64::NAN, 2.0]])), Err((1, 0)));
    }

    #[test]
    fn parameters_must_be_the_same() {
        let parameter = |index| Value::Parameter(crate::ParameterHandle::at(index));
        let mut rows = vec![vec![Value::Number(1.0), parameter(0)], vec![parameter(0), Value::Number(1.0)]];
        assert_eq!(symmetrise(&mut rows), Ok(()));
        rows[1][0] = parameter(1);
        assert_eq!(symmetrise(&mut rows), Err((1, 0)));
    }
}
