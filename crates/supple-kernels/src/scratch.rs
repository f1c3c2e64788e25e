use crate::Scalar;

/// Memory that grows to the largest request and is then reused: typed buffers without allocation in the sweeps.
///
/// ```
/// use supple_kernels::Scratch;
///
/// let mut scratch = Scratch::new();
/// scratch.zeros::<f64>(100).fill(1.0);
/// assert_eq!(scratch.zeros::<f64>(3), [0.0; 3], "the same memory again");
/// ```
#[derive(Debug, Default)]
pub struct Scratch {
    lines: Vec<Line>,
    second: Option<Box<Scratch>>,
}

/// One cache line, aligned for the widest lanes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([u8; 64]);

impl Scratch {
    /// A scratch that has allocated nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A second scratch beside this one, to be [given back](Self::give_back) after use.
    pub fn take(&mut self) -> Box<Self> {
        self.second.take().unwrap_or_default()
    }

    /// Returns what [`Scratch::take`] lent, so that its memory is reused.
    pub fn give_back(&mut self, second: Box<Self>) {
        self.second = Some(second);
    }

    /// A buffer of `len` zeros of type `S`. Allocates only when it is larger than any before.
    #[inline(always)]
    pub fn zeros<S: Scalar>(&mut self, len: usize) -> &mut [S] {
        let start = self.room::<S>(len);
        for i in 0..len {
            // SAFETY: `lines` covers `len` values of `S`, its start is aligned for `S`, and `S: Copy` needs no drop.
            unsafe { start.add(i).write(S::zero()) };
        }
        // SAFETY: the first `len` values were just written, and the borrow of `self` keeps others away.
        unsafe { std::slice::from_raw_parts_mut(start, len) }
    }

    /// A buffer of `len` numbers with arbitrary old contents. Allocates as [`Scratch::zeros`] does.
    ///
    /// # Safety
    /// Every pattern of bits must be a valid `S`.
    #[inline(always)]
    pub(crate) unsafe fn leftovers<S: Scalar>(&mut self, len: usize) -> &mut [S] {
        let start = self.room::<S>(len);
        // SAFETY: `room` holds `len` values, whose bytes are initialised, and the caller says that any bytes will do.
        unsafe { std::slice::from_raw_parts_mut(start, len) }
    }

    /// The start of room for `len` values of `S`.
    #[inline(always)]
    fn room<S: Scalar>(&mut self, len: usize) -> *mut S {
        assert!(align_of::<S>() <= align_of::<Line>(), "a scalar is aligned to at most a cache line");
        let lines = (len * size_of::<S>()).div_ceil(size_of::<Line>());
        if self.lines.len() < lines {
            self.lines.resize(lines, Line([0; 64]));
        }
        self.lines.as_mut_ptr().cast::<S>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_cleared_and_reused() {
        let mut scratch = Scratch::new();
        let first = scratch.zeros::<f64>(20);
        assert_eq!(first, [0.0; 20]);
        first.fill(3.0);
        let place = first.as_ptr();
        let again = scratch.zeros::<f64>(13);
        assert_eq!((&*again, again.as_ptr()), (&[0.0; 13][..], place));
        assert!(scratch.zeros::<f64>(0).is_empty());
        assert_eq!(scratch.zeros::<f64>(1000), [0.0; 1000]);
    }

    #[test]
    fn a_second_scratch_is_lent_and_kept() {
        let mut scratch = Scratch::new();
        let mut second = scratch.take();
        let place = second.zeros::<f64>(100).as_ptr();
        scratch.give_back(second);
        let mut second = scratch.take();
        assert_eq!(second.lines.len(), 100 * size_of::<f64>() / size_of::<Line>() + 1, "its memory is there still");
        assert_eq!(second.zeros::<f64>(100).as_ptr(), place);
    }
}
