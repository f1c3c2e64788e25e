use std::collections::BTreeMap;

use super::choosing::Choosing;

/// Maximum number of catalogues for which all corners of the rounding are designed: 2 to this power.
const MOST_CORNERS: usize = 6;

/// Maximum number of catalogues for which two entries are changed at once; beyond it, one at a time.
const MOST_PAIRS: usize = 8;

/// How far a combination has been explored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Explored {
    /// Its neighbours are known.
    Neighbours,
    /// So are all that differ from it in one catalogue.
    Lines,
}

/// Rounds the design without catalogues to the entries around it, and explores from the best combination that is not yet
/// explored, again and again: first its neighbours, then all that differ from it in one catalogue. Designs at most `most`
/// combinations. Returns whether the best one was explored in full.
pub(super) fn explore(choosing: &mut Choosing, most: usize) -> bool {
    let lengths = choosing.lengths();
    let mut explored: BTreeMap<Vec<usize>, Explored> = BTreeMap::new();
    let mut next = corners(&choosing.around());
    // Where some are within the budget, others need not be designed.
    let cheapest = choosing.cheapest();
    let some_are_affordable = choosing.is_affordable(&cheapest);
    if some_are_affordable && !next.iter().any(|entries| choosing.is_affordable(entries)) {
        next = vec![cheapest];
    }
    let is_wanted = |choosing: &Choosing, entries: &[usize]| {
        !choosing.is_known(entries) && (!some_are_affordable || choosing.is_affordable(entries))
    };
    loop {
        next.retain(|entries| is_wanted(choosing, entries));
        next.truncate(most - choosing.tried());
        choosing.design_all(next, most);
        let unexplored = choosing.best_of(|entries| explored.get(entries) != Some(&Explored::Lines));
        match unexplored {
            Some(from) if choosing.tried() < most && !choosing.is_stopped() => {
                let (found, by) = match explored.get(&from) {
                    None => (neighbours(&from, &lengths), Explored::Neighbours),
                    Some(_) => (lines(&from, &lengths), Explored::Lines),
                };
                next = found;
                explored.insert(from, by);
            }
            _ => break,
        }
    }
    let best = choosing.best_of(|_| true);
    best.is_some_and(|best| {
        !lines(&best, &lengths).iter().chain(&neighbours(&best, &lengths)).any(|one| is_wanted(choosing, one))
    })
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

/// Combinations that differ in one catalogue, the nearest entries first.
fn lines(from: &[usize], lengths: &[usize]) -> Vec<Vec<usize>> {
    let longest = lengths.iter().copied().max().unwrap_or(0);
    let by = |distance: usize| {
        (0..from.len()).flat_map(move |place| {
            let ends = [from[place].checked_sub(distance), from[place].checked_add(distance)];
            ends.into_iter().flatten().filter(move |&to| to < lengths[place]).map(move |to| {
                let mut entries = from.to_vec();
                entries[place] = to;
                entries
            })
        })
    };
    (1..longest).flat_map(by).collect()
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
        assert_eq!(lines(&[0, 2], &[2, 4]), vec![vec![1, 2], vec![0, 1], vec![0, 3], vec![0, 0]]);
    }
}
