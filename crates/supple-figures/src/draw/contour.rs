//! Contours of quantities on grids: marching squares.

/// A place on the page.
pub type Place = (f64, f64);

/// No edge.
const NONE: u32 = u32::MAX;

/// A quantity with the places of its grid on the page.
pub struct Sheet<'a> {
    /// Abscissae.
    pub x: &'a [f64],
    /// Ordinates.
    pub y: &'a [f64],
    /// One row by ordinate.
    pub rows: &'a [Vec<f64>],
}

impl Sheet<'_> {
    /// The area where the quantity is at least `level`, as closed lines with the even-odd rule. At minus infinity, it is
    /// the area of all nodes that have a value.
    pub fn area(&self, level: f64) -> Vec<Vec<Place>> {
        // A rim of no width, below every level, closes the lines at the ends of the grid.
        Grid::new(self, level, 1).chains()
    }

    /// The lines on which the quantity is `level`; they end where the grid does.
    pub fn lines(&self, level: f64) -> Vec<Vec<Place>> {
        Grid::new(self, level, 0).chains()
    }
}

/// A grid with what is above the level.
struct Grid<'a> {
    sheet: &'a Sheet<'a>,
    level: f64,
    /// Nodes added on every side.
    rim: usize,
    width: usize,
    height: usize,
}

/// Sides of a cell.
#[derive(Clone, Copy)]
enum Side {
    Bottom,
    Right,
    Top,
    Left,
}

impl<'a> Grid<'a> {
    fn new(sheet: &'a Sheet<'a>, level: f64, rim: usize) -> Self {
        Self { sheet, level, rim, width: sheet.x.len() + 2 * rim, height: sheet.y.len() + 2 * rim }
    }

    fn value(&self, i: usize, j: usize) -> f64 {
        let row = j.checked_sub(self.rim).and_then(|j| self.sheet.rows.get(j));
        let value = row.and_then(|row| row.get(i.checked_sub(self.rim)?)).copied();
        value.filter(|value| !value.is_nan()).unwrap_or(f64::NEG_INFINITY)
    }

    fn above(&self, i: usize, j: usize) -> bool {
        let value = self.value(i, j);
        value >= self.level && value > f64::NEG_INFINITY
    }

    fn place(&self, i: usize, j: usize) -> Place {
        let along = |places: &[f64], index: usize| places[index.saturating_sub(self.rim).min(places.len() - 1)];
        (along(self.sheet.x, i), along(self.sheet.y, j))
    }

    /// The number of the edge that begins at a node and goes up or to the right.
    fn edge(&self, i: usize, j: usize, up: bool) -> u32 {
        u32::try_from(2 * (j * self.width + i) + usize::from(up)).unwrap_or(NONE)
    }

    fn side(&self, (i, j): (usize, usize), side: Side) -> u32 {
        match side {
            Side::Bottom => self.edge(i, j, false),
            Side::Right => self.edge(i + 1, j, true),
            Side::Top => self.edge(i, j + 1, false),
            Side::Left => self.edge(i, j, true),
        }
    }

    /// Where an edge crosses the level.
    fn crossing(&self, edge: u32) -> Place {
        let (node, up) = (edge as usize / 2, edge % 2 == 1);
        let (i, j) = (node % self.width, node / self.width);
        let (k, l) = if up { (i, j + 1) } else { (i + 1, j) };
        let (a, b) = (self.value(i, j), self.value(k, l));
        let part = (self.level - a) / (b - a);
        // Next to a node without a value, cut the edge in the middle.
        let part = if a.is_finite() && b.is_finite() && part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 };
        let (from, to) = (self.place(i, j), self.place(k, l));
        (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1))
    }

    /// From which to which side the level goes through a cell, with what is above it to the left.
    fn steps(&self, i: usize, j: usize) -> ([(Side, Side); 2], usize) {
        use Side::{Bottom, Left, Right, Top};
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        let case = corners.iter().enumerate().map(|(bit, &(i, j))| usize::from(self.above(i, j)) << bit).sum();
        let mean: f64 = corners.iter().map(|&(i, j)| self.value(i, j)).sum::<f64>() / 4.0;
        let joined = mean >= self.level && mean.is_finite();
        let one = |from, to| ([(from, to), (from, to)], 1);
        match case {
            1 => one(Bottom, Left),
            2 => one(Right, Bottom),
            3 => one(Right, Left),
            4 => one(Top, Right),
            5 if joined => ([(Bottom, Right), (Top, Left)], 2),
            5 => ([(Bottom, Left), (Top, Right)], 2),
            6 => one(Top, Bottom),
            7 => one(Top, Left),
            8 => one(Left, Top),
            9 => one(Bottom, Top),
            10 if joined => ([(Left, Bottom), (Right, Top)], 2),
            10 => ([(Right, Bottom), (Left, Top)], 2),
            11 => one(Right, Top),
            12 => one(Left, Right),
            13 => one(Bottom, Right),
            14 => one(Left, Bottom),
            _ => ([(Bottom, Bottom); 2], 0),
        }
    }

    /// The steps of all cells, joined: open lines first, then closed ones, each from the first cell on.
    fn chains(&self) -> Vec<Vec<Place>> {
        if self.width < 2 || self.height < 2 {
            return Vec::new();
        }
        let edges = 2 * self.width * self.height;
        let (mut next, mut entered) = (vec![NONE; edges], vec![false; edges]);
        let mut order = Vec::new();
        for j in 0..self.height - 1 {
            for i in 0..self.width - 1 {
                let (steps, count) = self.steps(i, j);
                for &(from, to) in &steps[..count] {
                    let (from, to) = (self.side((i, j), from), self.side((i, j), to));
                    next[from as usize] = to;
                    entered[to as usize] = true;
                    order.push(from);
                }
            }
        }
        let open = order.iter().filter(|&&edge| !entered[edge as usize]);
        let mut lines = Vec::new();
        for &first in open.chain(&order) {
            let mut line = Vec::new();
            let mut edge = first;
            while edge != NONE {
                line.push(self.crossing(edge));
                edge = std::mem::replace(&mut next[edge as usize], NONE);
            }
            // If the line was already drawn, only its first edge remains.
            if line.len() > 1 {
                lines.push(line);
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x^2 + y^2` on a square.
    fn bowl(nodes: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let x: Vec<f64> = (0..nodes).map(|i| -2.0 + 4.0 * i as f64 / (nodes - 1) as f64).collect();
        let rows = x.iter().map(|y| x.iter().map(|x| x * x + y * y).collect()).collect();
        (x, rows)
    }

    /// Twice the area that closed lines surround, holes taken away.
    fn area(lines: &[Vec<Place>]) -> f64 {
        let cross = |line: &Vec<Place>| {
            let pairs = line.iter().zip(line.iter().cycle().skip(1));
            pairs.map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>() / 2.0
        };
        lines.iter().map(cross).sum()
    }

    #[test]
    fn a_level_of_a_bowl_is_a_circle() {
        let (x, rows) = bowl(81);
        let sheet = Sheet { x: &x, y: &x, rows: &rows };
        let lines = sheet.lines(1.0);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].iter().all(|(x, y)| (x.hypot(*y) - 1.0).abs() < 1e-3));
        assert_eq!(lines[0].first(), lines[0].last());
        let open = sheet.lines(4.5);
        assert_eq!(open.len(), 4, "one arc at every corner");
    }

    #[test]
    fn areas_have_the_size_they_should() {
        let (x, mut rows) = bowl(81);
        let sheet = |rows: &Vec<Vec<f64>>, level| area(&Sheet { x: &x, y: &x, rows }.area(level));
        assert!((sheet(&rows, f64::NEG_INFINITY) - 16.0).abs() < 1e-9);
        assert!((sheet(&rows, 1.0) - (16.0 - std::f64::consts::PI)).abs() < 2e-2);
        assert_eq!(sheet(&rows, 9.0), 0.0);
        rows[40][40] = f64::NAN;
        let hole = 16.0 - sheet(&rows, f64::NEG_INFINITY);
        assert!((hole - 2.0 * 0.025f64.powi(2)).abs() < 1e-9, "half a cell around what is missing: {hole}");
    }

    #[test]
    fn saddles_leave_no_line_open() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let rows: Vec<Vec<f64>> = (0..4).map(|j| (0..4).map(|i| f64::from((i + j) % 2)).collect()).collect();
        let sheet = Sheet { x: &x, y: &x, rows: &rows };
        for level in [0.3, 0.5, 0.7] {
            assert!(sheet.area(level).iter().all(|line| line.first() == line.last()));
        }
    }
}
