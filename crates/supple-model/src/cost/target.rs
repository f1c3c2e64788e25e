use crate::Channel;

/// A number that a cost weighs, and what it should be.
///
/// ```
/// use supple_model::TwoMass;
/// use supple_model::cost::Cost;
/// use supple_model::quantity::{Control, State};
/// use supple_model::system::{Authored, System};
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// let costs = vec![Cost::new(State::new([1]), 4.0).with_targets([0.7]), Cost::new(Control::all(1), 0.01)];
/// let system = Authored::new(model, costs, 0.02, 0);
/// let targets = system.targets(&[]);
/// assert_eq!((targets[0].cost, targets[0].value, targets[0].in_final_cost), (0, 0.7, true));
/// assert_eq!((targets[1].cost, targets[1].value, targets[1].in_final_cost), (1, 0.0, false));
/// assert_eq!(system.weighed(&[0.1, 0.2, 0.0, 0.0, 0.0], &[9.0], &[]), [0.2, 9.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Index of the cost among those of the task, from 0.
    pub cost: usize,
    /// Name and unit of the number.
    pub channel: Channel,
    /// What it should be.
    pub value: f64,
    /// Whether the final cost weighs it.
    pub in_final_cost: bool,
    /// Whether it depends on the control, so that it has no value at the final step.
    pub depends_on_control: bool,
}
