use supple_kernels::{Matrices, Scratch};
use supple_model::system::{Points, Times};

use super::ekf::ExtendedKalman;
use super::factors::NoiseFactors;
use super::filter::Filter;
use super::outcome::Outcome;
use super::truth::{Motion, PARTS, Truth, World};
use super::watch::{LimitShare, Reach, Watch};
use crate::controller::Controller;
use crate::plan::Plan;
use crate::problem::Task;

/// What a closed-loop run needs.
#[derive(Clone, Copy)]
pub(crate) struct LoopSetting<'a> {
    pub task: &'a Task,
    pub plan: &'a Plan,
    /// What the filter assumes; its noise excludes what varies with the state.
    pub believed: World<'a>,
    /// The true system.
    pub truth: Truth<'a>,
    /// Factors of the true noise, except for what varies with the state.
    pub factors: &'a NoiseFactors,
    /// The controller whose filter runs in place of the extended one.
    pub along: Option<&'a Controller>,
    /// The limits that are looked at.
    pub watch: Option<&'a Watch>,
}

impl<'a> LoopSetting<'a> {
    /// The filter of the controllers.
    pub fn filter(&self) -> Filter<'a> {
        let World { phi, noise } = self.believed;
        let task = self.task;
        let extended = ExtendedKalman { system: &*task.system, phi, noise, parts: 1, varying: &task.noise.varying };
        self.along.map_or(Filter::Extended(extended), Filter::AlongPlan)
    }

    /// Where the plant is another than the task's model, a filter of finer steps.
    pub fn knowing(&self) -> Option<Filter<'a>> {
        let Truth { system, phi, motion } = self.truth;
        let substeps = system.substeps().filter(|_| !matches!(motion, Motion::Own))?;
        // Its error falls linearly with its step length, and the bits that this adds quadratically; with sub-steps, each
        // of which takes time, half of the plant's steps suffice.
        let parts = if substeps == 1 { PARTS } else { PARTS / 2 };
        let (noise, varying) = (self.believed.noise, &self.task.noise.varying[..]);
        Some(Filter::Extended(ExtendedKalman { system, phi, noise, parts, varying }))
    }

    /// Moves all states of step `t` on, without noise, and looks at limits on the way.
    pub fn move_on(
        &self,
        t: usize,
        states: &Matrices,
        controls: &Matrices,
        next: &mut Matrices,
        outcomes: &mut [Outcome],
        scratch: &mut Scratch,
    ) {
        let Truth { system, phi, motion } = self.truth;
        let at = Points { states, controls, stages: states.count(), has_end: false, times: Times::At(t) };
        let parts = motion.parts();
        // What depends on the next state is that of the plant's own, shorter steps.
        let steps = if parts == 1 { 1 } else { parts * system.substeps().unwrap_or(1) };
        let mut look = |states: &Matrices, scratch: &mut Scratch| {
            if let Some(watch) = self.watch {
                let reached = outcomes.iter_mut().map(|outcome| &mut outcome.limits[..]);
                watch.look(self.truth, steps, Points { states, ..at }, false, reached, scratch);
            }
        };
        look(states, scratch);
        match motion {
            Motion::Own => system.step_all(at, phi, next, scratch),
            Motion::Plant(plant) => plant(t, states, controls, next),
            Motion::InParts(_) => {
                system.step_part(parts, at, phi, next, scratch);
                let mut from = next.clone();
                for _ in 1..parts {
                    from.copy_from(next);
                    look(&from, scratch);
                    system.step_part(parts, Points { states: &from, ..at }, phi, next, scratch);
                }
            }
        }
    }

    /// The limits of roll-outs with these outcomes; none if they were not looked at.
    pub fn limits(&self, outcomes: &[Outcome]) -> Vec<LimitShare> {
        let Some(watch) = self.watch else { return Vec::new() };
        let reached: Vec<&[Reach]> = outcomes.iter().map(|outcome| &outcome.limits[..]).collect();
        watch.shares(&reached, self.task.steps * self.truth.motion.parts() + 1)
    }
}
