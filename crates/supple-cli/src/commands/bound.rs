use supple_study::study::Work;

use crate::arguments::{Ask, BoundOptions, Subject};
use crate::failure::Failure;

/// `supple bound TASK`
impl Ask for BoundOptions {
    fn work(&self, _: &Subject) -> Result<Work, Failure> {
        let Self { cost, curve, stationary, .. } = *self;
        let (task, curve) = (self.name.clone(), curve.map(|points| points.0));
        Ok(Work::Bound(supple_study::bound::BoundOptions { task, cost, stationary, curve }))
    }
}
