use crate::LANES;

/// The next multiple of [`LANES`] at or above `len`: the stride of a padded row.
///
/// Example: [`Matrices`].
#[must_use]
pub const fn padded(len: usize) -> usize {
    len.next_multiple_of(LANES)
}

/// A sequence of `count` matrices of one shape, row-major, in one buffer.
///
/// Each row is padded with zeros to a multiple of [`LANES`] numbers and starts on a cache line, so that kernels work
/// on whole rows. Kernels keep the padding zero.
///
/// A sequence of one matrix made by [`Matrices::constant`] stands for the same matrix at every index.
///
/// ```
/// use supple_kernels::{Matrices, padded};
///
/// let mut three = Matrices::zeros(3, 2, 2);
/// three.set(1, 0, 1, 5.0);
/// assert_eq!((three.get(1, 0, 1), three.stride()), (5.0, padded(2)));
/// assert_eq!(three.at(1)[..2], [0.0, 5.0], "its first row");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrices {
    count: usize,
    rows: usize,
    cols: usize,
    stride: usize,
    constant: bool,
    data: Vec<Line>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Line([f64; LANES]);

impl Matrices {
    /// `count` matrices of `rows` x `cols` zeros.
    #[must_use]
    pub fn zeros(count: usize, rows: usize, cols: usize) -> Self {
        let stride = padded(cols);
        let data = vec![Line([0.0; LANES]); count * rows * stride / LANES];
        Self { count, rows, cols, stride, constant: false, data }
    }

    /// One matrix of `rows` x `cols` zeros that stands at every index.
    #[must_use]
    pub fn constant(rows: usize, cols: usize) -> Self {
        Self { constant: true, ..Self::zeros(1, rows, cols) }
    }

    /// `count` vectors of length `len`, as matrices of one row.
    #[must_use]
    pub fn vectors(count: usize, len: usize) -> Self {
        Self::zeros(count, 1, len)
    }

    /// Vectors of length `len`, from rows of that length; the inverse of [`Matrices::to_rows`].
    ///
    /// # Panics
    /// If a row has another length.
    #[must_use]
    pub fn of_rows(rows: &[Vec<f64>], len: usize) -> Self {
        let mut out = Self::vectors(rows.len(), len);
        rows.iter().enumerate().for_each(|(index, row)| out.vector_mut(index).copy_from_slice(row));
        out
    }

    /// How many matrices there are; 1 where they are constant.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether one matrix stands at every index.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.constant
    }

    /// Rows of each.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns of each, without the padding.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// The number of entries from one row to the next, padding included.
    #[inline(always)]
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    #[inline(always)]
    fn start(&self, index: usize) -> usize {
        if self.constant { 0 } else { index * self.rows * self.stride }
    }

    /// All numbers, padding included.
    #[inline(always)]
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        // SAFETY: `Line` is `repr(C)` around `[f64; LANES]`, with size 64 and no padding.
        unsafe { std::slice::from_raw_parts(self.data.as_ptr().cast(), self.data.len() * LANES) }
    }

    /// All numbers, padding included, to write.
    #[inline(always)]
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        // SAFETY: as in `as_slice`, and the borrow is exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.data.as_mut_ptr().cast(), self.data.len() * LANES) }
    }

    /// Matrix `index` as padded rows.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, index: usize) -> &[f64] {
        let start = self.start(index);
        &self.as_slice()[start..start + self.rows * self.stride]
    }

    /// Matrix `index` as padded rows, to write.
    #[inline(always)]
    pub fn at_mut(&mut self, index: usize) -> &mut [f64] {
        let (start, len) = (self.start(index), self.rows * self.stride);
        &mut self.as_mut_slice()[start..start + len]
    }

    /// Matrices `index` and `index + 1`, the second to write.
    #[inline(always)]
    pub fn at_and_next_mut(&mut self, index: usize) -> (&[f64], &mut [f64]) {
        let len = self.rows * self.stride;
        let (head, tail) = self.as_mut_slice().split_at_mut((index + 1) * len);
        (&head[index * len..], &mut tail[..len])
    }

    /// Matrices `index`, to write, and `index + 1`.
    #[inline(always)]
    pub fn at_mut_and_next(&mut self, index: usize) -> (&mut [f64], &[f64]) {
        let len = self.rows * self.stride;
        let (head, tail) = self.as_mut_slice().split_at_mut((index + 1) * len);
        (&mut head[index * len..], &tail[..len])
    }

    /// Matrices `index` and `index + 1`, both to write.
    #[inline(always)]
    pub fn at_mut_pair(&mut self, index: usize) -> (&mut [f64], &mut [f64]) {
        let len = self.rows * self.stride;
        let (head, tail) = self.as_mut_slice().split_at_mut((index + 1) * len);
        (&mut head[index * len..], &mut tail[..len])
    }

    /// The first row of matrix `index` without padding: the vector, in a sequence of vectors.
    #[inline(always)]
    #[must_use]
    pub fn vector(&self, index: usize) -> &[f64] {
        &self.at(index)[..self.cols]
    }

    /// The first row of matrix `index` without padding, to write.
    #[inline(always)]
    pub fn vector_mut(&mut self, index: usize) -> &mut [f64] {
        let cols = self.cols;
        &mut self.at_mut(index)[..cols]
    }

    /// The rows of all matrices, one matrix after the other, without padding: of a sequence of vectors, the vectors.
    ///
    /// ```
    /// let mut two = supple_kernels::Matrices::zeros(2, 2, 1);
    /// two.set(1, 0, 0, 5.0);
    /// assert_eq!(two.to_rows(), [[0.0], [0.0], [5.0], [0.0]]);
    /// ```
    #[must_use]
    pub fn to_rows(&self) -> Vec<Vec<f64>> {
        (0..self.count()).flat_map(|index| self.rows_of(index).map(<[f64]>::to_vec)).collect()
    }

    /// The rows of matrix `index`, without padding.
    ///
    /// # Panics
    /// If there is no such matrix.
    ///
    /// ```
    /// let mut three = supple_kernels::Matrices::zeros(3, 2, 2);
    /// three.set(1, 1, 0, 5.0);
    /// assert!(three.rows_of(1).eq([[0.0, 0.0], [5.0, 0.0]]));
    /// ```
    #[must_use]
    pub fn rows_of(&self, index: usize) -> impl ExactSizeIterator<Item = &[f64]> {
        let (matrix, stride, cols) = (self.at(index), self.stride, self.cols);
        (0..self.rows).map(move |row| &matrix[row * stride..][..cols])
    }

    /// Entry (`row`, `col`) of matrix `index`.
    ///
    /// # Panics
    /// If there is no such entry.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, index: usize, row: usize, col: usize) -> f64 {
        self.check_column(col);
        self.at(index)[row * self.stride + col]
    }

    /// Sets entry (`row`, `col`) of matrix `index`.
    ///
    /// # Panics
    /// If there is no such entry.
    #[inline(always)]
    pub fn set(&mut self, index: usize, row: usize, col: usize, value: f64) {
        self.check_column(col);
        let stride = self.stride;
        self.at_mut(index)[row * stride + col] = value;
    }

    /// The padding of a row, or the next row, must not pass for entries.
    #[inline(always)]
    fn check_column(&self, col: usize) {
        assert!(col < self.cols, "there is no column {col}: a row has {}", self.cols);
    }

    /// Sets every number to 0.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.as_mut_slice().fill(0.0);
    }

    /// Copies the numbers of `other`, which must have the same shape; allocates nothing.
    pub fn copy_from(&mut self, other: &Self) {
        self.as_mut_slice().copy_from_slice(other.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_padded_and_aligned() {
        let mut m = Matrices::zeros(3, 2, 5);
        m.set(1, 1, 4, 7.0);
        assert_eq!(m.stride(), 8);
        assert_eq!(m.at(1)[12], 7.0);
        assert_eq!(m.at(1).as_ptr() as usize % 64, 0);
        assert_eq!(m.at_and_next_mut(0).1[12], 7.0);
        let mut constant = Matrices::constant(1, 1);
        constant.set(0, 0, 0, 3.0);
        assert_eq!(constant.get(41, 0, 0), 3.0);
    }

    #[test]
    #[should_panic(expected = "there is no column 7: a row has 5")]
    fn padding_is_not_read() {
        let _ = Matrices::zeros(1, 2, 5).get(0, 0, 7);
    }

    #[test]
    #[should_panic(expected = "there is no column 7: a row has 5")]
    fn padding_is_not_written() {
        Matrices::constant(2, 5).set(0, 0, 7, 1.0);
    }

    /// Three matrices of 2 x 3, entry (i, j) of number t being 100 t + 10 i + j + 1.
    fn numbered() -> Matrices {
        let mut m = Matrices::zeros(3, 2, 3);
        for (t, i, j) in (0..3).flat_map(|t| (0..6).map(move |k| (t, k / 3, k % 3))) {
            m.set(t, i, j, (100 * t + 10 * i + j + 1) as f64);
        }
        m
    }

    #[test]
    fn neighbours_are_lent_together() {
        let mut m = numbered();
        let whole: Vec<Vec<f64>> = (0..3).map(|t| m.at(t).to_vec()).collect();
        for t in 0..2 {
            let (one, next) = m.at_and_next_mut(t);
            assert_eq!((one, &*next), (&whole[t][..], &whole[t + 1][..]));
            let (one, next) = m.at_mut_and_next(t);
            assert_eq!((&*one, next), (&whole[t][..], &whole[t + 1][..]));
            let (one, next) = m.at_mut_pair(t);
            assert_eq!((&*one, &*next), (&whole[t][..], &whole[t + 1][..]));
        }
        m.at_and_next_mut(1).1[0] = -1.0;
        m.at_mut_and_next(0).0[0] = -2.0;
        m.at_mut_pair(0).1[0] = -3.0;
        assert_eq!([0, 1, 2].map(|t| m.get(t, 0, 0)), [-2.0, -3.0, -1.0]);
    }

    #[test]
    fn shapes_copies_and_rows() {
        let (m, mut other) = (numbered(), Matrices::zeros(3, 2, 3));
        assert_eq!((m.count(), m.rows(), m.cols(), m.stride(), m.is_constant()), (3, 2, 3, 8, false));
        let rows = (0..3).flat_map(|t| [0, 10].map(|i| [1, 2, 3].map(|j| f64::from(100 * t + i + j))));
        assert!(m.to_rows().into_iter().eq(rows));
        assert!(m.rows_of(1).eq([[101.0, 102.0, 103.0], [111.0, 112.0, 113.0]]));
        other.copy_from(&m);
        assert_eq!(other, m);
        other.clear();
        assert_eq!(other, Matrices::zeros(3, 2, 3));
        let constant = Matrices::constant(4, 9);
        assert_eq!((constant.count(), constant.rows(), constant.cols(), constant.stride()), (1, 4, 9, 16));
        assert!(constant.is_constant());
        assert_eq!((Matrices::zeros(0, 2, 3).to_rows().len(), Matrices::zeros(2, 3, 0).at(1).len()), (0, 0));
    }
}
