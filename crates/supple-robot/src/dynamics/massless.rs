//! Motions that move no inertia.

use std::fmt;

use super::Kinematics;
use super::mass::for_each_part;
use crate::{Numbers, Tree};

/// Pivots of the mass matrix below this fraction of its diagonal count as zero; rounding errors are about
/// 1e-15.
const SMALLEST_PIVOT: f64 = 1e-12;

/// The mass matrix is singular: some joints can be accelerated without force, as they move no inertia.
///
/// Example: [`check_inertia`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SingularMass {
    /// Names of the joints that can be accelerated together without force.
    pub joints: Vec<String>,
}

impl fmt::Display for SingularMass {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names = supple_text::quoted(&self.joints);
        match self.joints.len() {
            1 => write!(f, "joint {names} moves no inertia, so its acceleration is undefined"),
            _ => write!(
                f,
                "the joints {names} can move together without moving anything that has inertia, so their accelerations \
                 are not determined"
            ),
        }
    }
}

impl std::error::Error for SingularMass {}

/// Whether every motion of the robot moves inertia, at positions `q`, rad or m, of the degrees of freedom.
///
/// # Errors
/// If the mass matrix is singular, naming the joints that can move without moving any inertia.
///
/// # Panics
/// As [`Kinematics::of`].
///
/// ```
/// use supple_robot::{LinkNumbers, LoadOptions, Numbers, Tree, check_inertia, massless_joints};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, mut numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// assert!(check_inertia(&tree, &numbers, &[0.0]).is_ok());
///
/// // The same hinge without any inertia.
/// numbers.links[1] = LinkNumbers { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] };
/// let error = check_inertia(&tree, &numbers, &[0.0]).unwrap_err();
/// assert_eq!(error.joints, ["hinge"]);
/// assert_eq!(massless_joints(&tree, &numbers, &[0.0]), [0]);
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn check_inertia(tree: &Tree, numbers: &Numbers<f64>, q: &[f64]) -> Result<(), SingularMass> {
    let mut mass = Sparse::of(tree, numbers, q);
    let diagonal = mass.diagonal.clone();
    let Some(motion) = mass.massless() else { return Ok(()) };
    // In units in which each joint's own inertia is 1; in arbitrary units if it has none.
    let sizes: Vec<f64> = motion
        .iter()
        .zip(&diagonal)
        .map(|(rate, inertia)| rate.abs() * if *inertia > 0.0 { inertia.sqrt() } else { 1.0 })
        .collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let names = tree.joints().iter().zip(&sizes).filter(|(_, size)| **size > 1e-6 * largest);
    Err(SingularMass { joints: names.map(|(name, _)| name.clone()).collect() })
}

/// Degrees of freedom to lock so that every motion of the others moves inertia, in ascending order. From each
/// group of joints that together move no inertia, the last one is taken. Empty if [`check_inertia`] succeeds.
///
/// # Panics
/// As [`Kinematics::of`].
///
/// Example: [`check_inertia`].
#[must_use]
pub fn massless_joints(tree: &Tree, numbers: &Numbers<f64>, q: &[f64]) -> Vec<usize> {
    // Armature gives a joint its own inertia, so adding it excludes the joint from all remaining massless motions.
    let mut numbers = numbers.clone();
    let mut found = Vec::new();
    while let Err(singular) = check_inertia(tree, &numbers, q) {
        let is_named = |dof: &usize| singular.joints.contains(&tree.joints()[*dof]) && !found.contains(dof);
        let Some(dof) = (0..tree.dofs()).rev().find(is_named) else { break };
        numbers.joints[tree.joint_indices()[dof]].armature += 1.0;
        found.push(dof);
    }
    found.sort_unstable();
    found
}

/// A mass matrix without the entries that are always 0.
struct Sparse {
    diagonal: Vec<f64>,
    /// For every row, the columns before the diagonal in ascending order, with their entries.
    rows: Vec<Vec<(usize, f64)>>,
}

impl Sparse {
    fn of(tree: &Tree, numbers: &Numbers<f64>, q: &[f64]) -> Self {
        let mut diagonal = vec![0.0; tree.dofs()];
        let mut rows = vec![Vec::new(); tree.dofs()];
        for_each_part(tree, numbers, &Kinematics::at_rest(tree, numbers, q), |i, j, part| {
            if i == j {
                diagonal[i] += part;
            } else {
                rows[i.max(j)].push((i.min(j), part));
            }
        });
        for row in &mut rows {
            *row = merged(std::mem::take(row));
        }
        // Eliminating a row adds to all entries between its columns. The nearest row above gets those columns here
        // and passes them on. This matters only if joints follow others; otherwise the columns are a body's ancestors.
        for k in (0..rows.len()).rev() {
            let (above, row) = rows.split_at_mut(k);
            let Some((&(nearest, _), others)) = row[0].split_last() else { continue };
            let target = &mut above[nearest];
            if !has_columns(target, others) {
                target.extend(others.iter().map(|&(column, _)| (column, 0.0)));
                *target = merged(std::mem::take(target));
            }
        }
        Self { diagonal, rows }
    }

    /// A direction `x` with `M x = 0`, if there is one. Elimination runs from the last row to the first, `M = L' D L`
    /// with unit lower triangular `L`, and leaves `D` on the diagonal and `L` in the rows up to the first pivot that
    /// counts as zero.
    fn massless(&mut self) -> Option<Vec<f64>> {
        let least: Vec<f64> = self.diagonal.iter().map(|inertia| SMALLEST_PIVOT * inertia).collect();
        let size = least.len();
        let singular = (0..size).rev().find(|&k| {
            // Also false for NaN.
            let sound = self.diagonal[k] > least[k];
            if sound {
                self.eliminate(k);
            }
            !sound
        })?;
        // L x = the unit vector of that row, with zeros before it.
        let mut x = vec![0.0; size];
        x[singular] = 1.0;
        for row in singular + 1..size {
            x[row] = -self.rows[row].iter().map(|&(column, entry)| entry * x[column]).sum::<f64>();
        }
        Some(x)
    }

    /// Eliminates row `k` from the rows before it; the row itself then becomes row `k` of `L`.
    fn eliminate(&mut self, k: usize) {
        let mut row = std::mem::take(&mut self.rows[k]);
        let inverse = 1.0 / self.diagonal[k];
        for (count, &(i, entry)) in row.iter().enumerate() {
            let factor = entry * inverse;
            self.diagonal[i] -= factor * entry;
            let mut targets = self.rows[i].iter_mut();
            for &(j, other) in &row[..count] {
                if let Some((_, target)) = targets.find(|(column, _)| *column == j) {
                    *target -= factor * other;
                }
            }
        }
        for (_, entry) in &mut row {
            *entry *= inverse;
        }
        self.rows[k] = row;
    }
}

/// A row with its columns in ascending order, each once.
fn merged(mut row: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    row.sort_by_key(|&(column, _)| column);
    row.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    row
}

/// Whether a row has all columns of another; both in ascending order.
fn has_columns(row: &[(usize, f64)], others: &[(usize, f64)]) -> bool {
    let mut columns = row.iter().map(|&(column, _)| column);
    others.iter().all(|&(column, _)| columns.any(|other| other == column))
}
