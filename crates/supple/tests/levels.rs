//! Every level of vector instructions gives the same numbers but for rounding, and the same bits each time.
#![allow(clippy::unwrap_used)]

mod common;

use common::shipped;
use supple::{EvaluateOptions, Level};

#[test]
fn levels_agree() {
    let problem = shipped("two_mass.toml");
    let options = EvaluateOptions { total_gradient: true, frozen_gradient: true, ..Default::default() };
    let numbers = || {
        let at = problem.evaluate(&common::starting_with(&problem, &[300.0, 300.0]), &options).unwrap();
        let task = &at.tasks[0];
        let gradient = task.gradient.as_ref().unwrap();
        let (total, frozen) = (gradient.total.as_ref().unwrap(), gradient.frozen.as_ref().unwrap());
        let mut all = vec![task.cost.expected, task.cost.parts.nominal, task.information.total_nats];
        for named in [&total.information_nats, &total.expected_cost, &frozen.information_nats] {
            all.extend(named.0.iter().map(|(_, value)| *value));
        }
        all
    };
    let mut first: Option<Vec<f64>> = None;
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        let found = numbers();
        assert_eq!(found, numbers(), "{level:?}: the same bits each time");
        let first = first.get_or_insert_with(|| found.clone());
        for (found, first) in found.iter().zip(first.iter()) {
            // Plans are converged to 1e-12; what is second order in them agrees further.
            assert!((found - first).abs() <= 1e-9 * first.abs(), "{level:?}: {found} against {first}");
        }
    }
}
