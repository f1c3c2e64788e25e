//! Replaces inertias that MuJoCo rejects by the nearest ones that it accepts.

use supple_text::short;

use crate::Inertia;
use crate::load::moments::principal;

/// The least mass, kg, and moment of inertia, kg m^2, that MuJoCo accepts for a moving body: its `mjMINVAL`.
const LEAST: f64 = 1e-15;
/// The least principal moment that MuJoCo accepts in a full inertia matrix, kg m^2.
const LEAST_OF_MATRIX: f64 = 1e-14;
/// Small mass, kg, and moment of inertia, kg m^2, written for a moving body that has none.
const LITTLE: (f64, f64) = (1e-9, 1e-12);
/// Relative change of moments that is not reported: rounding of a flat body.
const ROUNDING: f64 = 1e-9;

/// An inertia by its principal moments, written instead of that of a link.
pub(super) struct Mended {
    pub mass: f64,
    pub center: [f64; 3],
    pub moments: [f64; 3],
    /// The rotation whose columns are the principal axes.
    pub axes: [[f64; 3]; 3],
    /// What was changed and why, to follow "link NAME"; `None` if only the notation changed.
    pub why: Option<String>,
}

/// Whether MuJoCo accepts a moving body with this inertia.
pub(super) fn is_solid(inertia: &Inertia) -> bool {
    inertia.mass >= LEAST && moments_of(inertia).0.iter().all(|&moment| moment >= LEAST)
}

/// The inertia to write for a link, if MuJoCo rejects its own; `moves` if the body has joints and no link fixed to
/// it provides the missing inertia.
pub(super) fn mended(inertia: Option<&Inertia>, moves: bool) -> Option<Mended> {
    let none = Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] };
    let given = match inertia {
        Some(inertia) => inertia,
        None if moves => &none,
        None => return None,
    };
    let (own, axes, is_diagonal) = moments_of(given);
    let (mut mass, mut moments) = (given.mass, own.map(|moment| moment.max(0.0)));
    let lacks = moves && !is_solid(given);
    if lacks {
        mass = if mass < LEAST { LITTLE.0 } else { mass };
        moments = moments.map(|moment| if moment < LEAST { LITTLE.1 } else { moment });
    }
    let before = moments;
    balance(&mut moments);
    let greatest = before.iter().fold(0.0_f64, |most, moment| most.max(*moment));
    let change = (0..3).map(|i| (moments[i] - before[i]).abs()).fold(0.0, f64::max);
    let negative = own.iter().any(|&moment| moment < -ROUNDING * greatest);
    let as_matrix = is_diagonal || (own.iter().all(|&moment| moment >= LEAST_OF_MATRIX) && !is_flat(own));
    if mass == given.mass && moments == own && as_matrix {
        return None;
    }
    let why = if change > ROUNDING * greatest || negative {
        let [of_file, written] = [own, moments].map(|three| three.map(|moment| short(moment, 3)).join(", "));
        Some(format!(
            "has the principal moments of inertia {of_file} kg m^2, which MuJoCo refuses, as none may be negative or above \
             the sum of the others; the nearest that it accepts are written: {written}"
        ))
    } else if lacks {
        let (what, little) = match (given.mass < LEAST, own.iter().any(|&moment| moment < LEAST)) {
            (true, false) => ("no mass", format!("{:e} kg is", LITTLE.0)),
            (true, true) => {
                ("no mass and no moments of inertia", format!("{:e} kg and {:e} kg m^2 are", LITTLE.0, LITTLE.1))
            }
            _ => ("moments of inertia of 0", format!("{:e} kg m^2 is", LITTLE.1)),
        };
        Some(format!("moves and has {what}, which MuJoCo refuses; {little} written instead"))
    } else {
        None
    };
    Some(Mended { mass, center: given.center, moments, axes, why })
}

/// Principal moments and their axes, and whether these are the link's own axes.
fn moments_of(inertia: &Inertia) -> ([f64; 3], [[f64; 3]; 3], bool) {
    let m = inertia.moment;
    if m[0][1] == 0.0 && m[0][2] == 0.0 && m[1][2] == 0.0 {
        return ([m[0][0], m[1][1], m[2][2]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], true);
    }
    let (moments, axes) = principal(m);
    (moments, axes, false)
}

/// Whether the greatest moment equals the sum of the others up to rounding.
fn is_flat(moments: [f64; 3]) -> bool {
    let greatest = moments.into_iter().fold(0.0, f64::max);
    2.0 * greatest > moments.iter().sum::<f64>() * (1.0 - 1e-12)
}

/// The nearest moments, in the least-squares sense, of which none exceeds the sum of the others.
fn balance(moments: &mut [f64; 3]) {
    let top = (0..3).fold(0, |top, i| if moments[i] > moments[top] { i } else { top });
    let [a, b] = [(top + 1) % 3, (top + 2) % 3];
    let excess = moments[top] - (moments[a] + moments[b]);
    if excess <= 0.0 {
        return;
    }
    moments[a] += excess / 3.0;
    moments[b] += excess / 3.0;
    moments[top] = (moments[top] - excess / 3.0).min(moments[a] + moments[b]);
}
