//! Where a grid of numbers has a value: its level lines.

/// A level line as points, by place in the grid (column, row, as fractions) and the value of a second grid there. Lines
/// of two points each, by marching through the cells; a cell with a number missing has none.
pub fn level_line(grid: &[Vec<f64>], level: f64, other: &[Vec<f64>]) -> Vec<[[f64; 3]; 2]> {
    let mut lines = Vec::new();
    for row in 0..grid.len().saturating_sub(1) {
        for column in 0..grid[row].len().min(grid[row + 1].len()).saturating_sub(1) {
            let corners = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)];
            if corners.iter().any(|&(c, r)| !grid[r][c].is_finite()) {
                continue;
            }
            let crossings: Vec<[f64; 3]> = (0..4)
                .filter_map(|edge| crossing(grid, level, other, corners[edge], corners[(edge + 1) % 4]))
                .collect();
            match crossings[..] {
                [a, b] => lines.push([a, b]),
                // A saddle: the value at the middle of the cell decides which corners are connected.
                [a, b, c, d] => {
                    let middle = corners.iter().map(|&(c, r)| grid[r][c]).sum::<f64>() / 4.0;
                    let first_is_with_middle = (grid[row][column] >= level) == (middle >= level);
                    lines.extend(if first_is_with_middle { [[a, b], [c, d]] } else { [[d, a], [b, c]] });
                }
                _ => {}
            }
        }
    }
    lines
}

/// Where an edge crosses the level.
fn crossing(
    grid: &[Vec<f64>],
    level: f64,
    other: &[Vec<f64>],
    (c0, r0): (usize, usize),
    (c1, r1): (usize, usize),
) -> Option<[f64; 3]> {
    let (from, to) = (grid[r0][c0], grid[r1][c1]);
    if (from >= level) == (to >= level) {
        return None;
    }
    let share = (level - from) / (to - from);
    let between = |a: f64, b: f64| a + share * (b - a);
    let second = between(other[r0][c0], other[r1][c1]);
    Some([between(c0 as f64, c1 as f64), between(r0 as f64, r1 as f64), second])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_cut_in_a_straight_line() {
        // z = column + 2 row on 5 x 4 points; the level 3.5, where column + 2 row = 3.5.
        let plane: Vec<Vec<f64>> = (0..4).map(|r| (0..5).map(|c| f64::from(c + 2 * r)).collect()).collect();
        let other: Vec<Vec<f64>> = plane.iter().map(|row| row.iter().map(|z| 10.0 * z).collect()).collect();
        let lines = level_line(&plane, 3.5, &other);
        assert!(lines.len() >= 4);
        for [x, y, z] in lines.into_iter().flatten() {
            assert!((x + 2.0 * y - 3.5).abs() < 1e-12 && (z - 35.0).abs() < 1e-12);
        }
    }

    #[test]
    fn lines_leave_out_cells_without_numbers_and_split_saddles() {
        let hole = vec![vec![0.0, 2.0], vec![f64::NAN, 2.0]];
        assert!(level_line(&hole, 1.0, &hole).is_empty());
        let saddle = vec![vec![2.0, 0.0], vec![0.0, 2.0]];
        assert_eq!(level_line(&saddle, 0.9, &saddle).len(), 2);
        assert!(level_line(&saddle, 3.0, &saddle).is_empty());
    }
}
