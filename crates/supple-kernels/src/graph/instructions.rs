//! Instructions as they are run.

use super::schedule::{ARITHMETIC, Kind, Step};

/// Instructions store slot numbers multiplied by this, so that no multiplication is needed to address slots.
pub(super) const SCALE: usize = 8;

/// Instructions of each arithmetic kind, in the order of the kinds, then some of one other kind: a processor predicts
/// the ends of such loops, but rarely an indirect jump with many targets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Round {
    pub arithmetic: [u32; ARITHMETIC.len()],
    pub other: Option<(Kind, u32)>,
}

/// The rounds of instructions in this order.
pub(super) fn rounds(steps: &[Step]) -> Vec<Round> {
    let mut rounds: Vec<Round> = Vec::new();
    // The kind after which the last round can continue.
    let mut from = None;
    for run in steps.chunk_by(|one, next| one.kind == next.kind) {
        let (kind, count) = (run[0].kind, run.len() as u32);
        if from.is_none_or(|from| from > kind) {
            rounds.push(Round::default());
        }
        let Some(round) = rounds.last_mut() else { continue };
        match kind.arithmetic() {
            Some(place) => round.arithmetic[place] = count,
            None => round.other = Some((kind, count)),
        }
        from = kind.arithmetic().map(|_| kind);
    }
    rounds
}

/// Instructions that run in sequence, once or repeatedly.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    /// The slots used by the instructions, in sequence: for the result and the operands, as many as the kind has.
    pub instructions: Vec<u32>,
    /// How many instructions of each kind there are, by rounds.
    pub rounds: Vec<Round>,
    /// How they are repeated, if they are.
    pub again: Option<Again>,
}

#[cfg(any(test, target_arch = "x86_64"))]
impl Part {
    /// The kinds of the instructions in the order in which they run, and how many of each follow one another.
    pub fn kinds(&self) -> impl Iterator<Item = (Kind, u32)> {
        let of_round = |round: &Round| ARITHMETIC.into_iter().zip(round.arithmetic).chain(round.other);
        self.rounds.iter().flat_map(of_round).filter(|&(_, count)| count > 0)
    }
}

/// How instructions are repeated: until the first of their variables is no longer above 0.
#[derive(Clone, Debug, Default)]
pub(super) struct Again {
    /// Slots of the variables, and of their initial values.
    pub start: Vec<(usize, usize)>,
    /// Slots of the variables that a run changes, and of their new values.
    pub next: Vec<(usize, usize)>,
    /// Maximum number of runs.
    pub most: usize,
}
