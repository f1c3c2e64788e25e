use super::choosing::Choosing;

/// Maximum number of catalogues for which all corners of the rounding are designed: 2 to this power.
const MOST_CORNERS: usize = 6;

/// Maximum number of catalogues for which two entries are changed at once; beyond it, one at a time.
const MOST_PAIRS: usize = 8;

/// Rounds the design without catalogues to the entries around it, and moves to the best of all neighbours as long as
/// that is better. Designs at most `most` combinations. Returns whether it completed: no neighbour is better.
pub(super) fn descend(choosing: &mut Choosing, most: usize) -> bool {
    let around = choosing.around();
    let lengths = choosing.lengths();
    let mut next = corners(&around);
    loop {
        next.retain(|entries| !choosing.is_known(entries));
        let room = most.saturating_sub(choosing.tried());
        let cut = next.len() > room;
        next.truncate(room);
        let before = choosing.best();
        let all = choosing.tried() + next.len();
        choosing.design_all(next, all);
        let best = choosing.best();
        match best {
            _ if choosing.is_stopped() => return false,
            Some(best) if Some(&best) != before.as_ref() => next = neighbours(&best, &lengths),
            // Nothing better: the search is complete, unless some neighbours were left out.
            _ => return !cut && before.is_some(),
        }
        if cut {
            return false;
        }
    }
}

/// The roundings of a design, the nearest first: all of them or, for many catalogues, the nearest and those that differ from
/// it in one entry.
fn corners(around: &[[usize; 2]]) -> Vec<Vec<usize>> {
    let pick = |other: &dyn Fn(usize) -> bool| -> Vec<usize> {
        around.iter().enumerate().map(|(place, sides)| sides[usize::from(other(place))]).collect()
    };
    let mut corners: Vec<Vec<usize>> = if around.len() <= MOST_CORNERS {
        (0..1_usize << around.len()).map(|bits| pick(&|place| bits >> place & 1 == 1)).collect()
    } else {
        let ones = (0..around.len()).map(|one| pick(&|place| place == one));
        [pick(&|_| false)].into_iter().chain(ones).collect()
    };
    let mut seen = std::collections::BTreeSet::new();
    corners.retain(|corner| seen.insert(corner.clone()));
    corners
}

/// Combinations that differ by one place in one catalogue, or in two if there are few catalogues.
fn neighbours(from: &[usize], lengths: &[usize]) -> Vec<Vec<usize>> {
    let moved = |from: &[usize], place: usize, by: isize| -> Option<Vec<usize>> {
        let to = from[place].checked_add_signed(by).filter(|&to| to < lengths[place])?;
        let mut entries = from.to_vec();
        entries[place] = to;
        Some(entries)
    };
    let moves = |from: &[usize], places: std::ops::Range<usize>| -> Vec<Vec<usize>> {
        places.flat_map(|place| [-1, 1].map(|by| moved(from, place, by))).flatten().collect()
    };
    let mut found = moves(from, 0..from.len());
    if from.len() <= MOST_PAIRS {
        for first in 0..from.len() {
            for entries in moves(from, first..first + 1) {
                found.extend(moves(&entries, first + 1..from.len()));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_all_and_different() {
        let found = corners(&[[2, 1], [0, 0], [4, 5]]);
        assert_eq!(found, [[2, 0, 4], [1, 0, 4], [2, 0, 5], [1, 0, 5]]);
        let many = corners(&[[1, 2]; 7]);
        assert_eq!(many.len(), 8);
        assert_eq!(many[0], [1; 7]);
    }

    #[test]
    fn neighbours_stay_in_their_catalogues() {
        let found = neighbours(&[0, 2], &[3, 3]);
        assert_eq!(found, vec![vec![1, 2], vec![0, 1], vec![1, 1]]);
        assert_eq!(neighbours(&[1; 9], &[3; 9]).len(), 18);
    }
}
