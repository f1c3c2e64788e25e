//! Springs, dampers and friction in joints.

use supple_kernels::Scalar;

use crate::{Numbers, Tree};

/// The rates and positions at which resisting forces are evaluated: of the current state, or at the end of an implicit step.
///
/// A spring with stiffness `k` and a damper with coefficient `b` on a coordinate at `p` give the force
/// `-k (p + lead r) - b r`, with the rate `r` of the coordinate.
///
/// Example: [`passive_forces`].
#[derive(Clone, Copy, Debug)]
pub struct Resisted<'a, S> {
    /// Rates of the degrees of freedom that the forces are linear in, rad/s or m/s: those of the state, or those at the
    /// end of the step.
    pub rates: &'a [S],
    /// How far ahead the positions are taken, s: 0, or the step.
    pub lead: S,
}

/// The forces of springs, dampers and friction in the joints on the degrees of freedom, N m or N. For a joint at
/// position `p` with velocity `v`,
///
/// ```text
/// - stiffness (p - rest) - damping v - friction v / sqrt(v^2 + smoothing^2)
/// ```
///
/// `smoothing` is the velocity, rad/s or m/s, above which friction is nearly Coulomb friction; it must exceed 0.
///
/// # Panics
/// If `q` or `v` does not have one entry per degree of freedom, or `numbers` belongs to another robot.
///
/// ```
/// use supple_robot::{LoadOptions, Numbers, Resisted, Tree};
/// use supple_robot::{passive_forces, passive_forces_ahead, passive_resistance};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, mut numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// // A spring of 2 N m/rad and a damper of 0.5 N m s/rad in the hinge.
/// (numbers.joints[0].stiffness, numbers.joints[0].damping) = (2.0, 0.5);
/// let (q, v, smoothing) = ([0.3], [1.0], 0.01);
/// let now = passive_forces(&tree, &numbers, &q, &v, smoothing)[0];
/// assert!((now + 2.0 * 0.3 + 0.5).abs() < 1e-12);
///
/// // At the end of a step of 0.1 s.
/// let ahead = Resisted { rates: &v, lead: 0.1 };
/// let then = passive_forces_ahead(&tree, &numbers, &q, ahead, smoothing)[0];
/// assert!((then + 2.0 * 0.4 + 0.5).abs() < 1e-12);
/// let resistance = passive_resistance(&tree, &numbers, ahead, smoothing)[0];
/// assert!((resistance - (0.5 + 0.1 * 2.0)).abs() < 1e-12);
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn passive_forces<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, q: &[S], v: &[S], smoothing: S) -> Vec<S> {
    passive_forces_ahead(tree, numbers, q, Resisted { rates: v, lead: S::zero() }, smoothing)
}

/// The same forces at rates `r` that may differ from the velocities, with positions extrapolated by the time `lead`:
///
/// ```text
/// - stiffness (p + lead r - rest) - damping r - friction r / sqrt(r^2 + smoothing^2)
/// ```
///
/// # Panics
/// As [`passive_forces`].
///
/// Example: [`passive_forces`].
pub fn passive_forces_ahead<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    q: &[S],
    resisted: Resisted<S>,
    smoothing: S,
) -> Vec<S> {
    let lengths = (q.len(), resisted.rates.len());
    assert_eq!(lengths, (tree.dofs(), tree.dofs()), "wrong number of positions or velocities");
    let mut forces = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let rate = resisted.rates[body.dof] * body.ratio;
        let position = q[body.dof] * body.ratio + body.offset + resisted.lead * rate;
        let resisting = joint.stiffness * (position - joint.rest)
            + joint.damping * rate
            + joint.friction * (rate / friction_speed(rate, smoothing));
        forces[body.dof] -= resisting * body.ratio;
    }
    forces
}

/// Decrease of the forces of [`passive_forces_ahead`] per unit of each rate, N m s/rad or N s/m: never negative.
///
/// # Panics
/// As [`passive_forces`].
///
/// Example: [`passive_forces`].
pub fn passive_resistance<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, resisted: Resisted<S>, smoothing: S) -> Vec<S> {
    assert_eq!(resisted.rates.len(), tree.dofs(), "wrong number of velocities");
    let mut resistance = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let inverse = friction_speed(resisted.rates[body.dof] * body.ratio, smoothing).recip();
        let share = smoothing * inverse;
        let friction = joint.friction * inverse * (share * share);
        resistance[body.dof] +=
            (joint.damping + resisted.lead * joint.stiffness + friction) * (body.ratio * body.ratio);
    }
    resistance
}

/// `sqrt(v^2 + smoothing^2)`
fn friction_speed<S: Scalar>(v: S, smoothing: S) -> S {
    (v * v + smoothing * smoothing).sqrt()
}
