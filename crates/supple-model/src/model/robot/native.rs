//! Makes robot functions available over any scalar, although they involve compliance whose concrete kind is erased.

use supple_kernels::Scalar;
use supple_kernels::graph::{Function, Node, call};

use super::Robot;
use crate::Point;
use crate::model::compliance::Native;

/// One of these functions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// The residual that defines the unknowns.
    Balance,
    /// The mass matrix, by rows.
    Mass,
    /// The unknowns, if the equation is not linear in them.
    Solution,
    /// All signals.
    Signals,
    /// The positions of landmarks, three numbers each.
    Landmarks,
}

struct Of<'a> {
    robot: &'a Robot,
    part: Part,
}

/// Evaluates a function of a robot at a point.
pub(super) fn run<S: Scalar>(robot: &Robot, part: Part, at: &Point<S>, out: &mut [S]) {
    call(&Of { robot, part }, &[at.x, at.u, at.phi, &[at.time_step], at.w], out);
}

impl Of<'_> {
    fn evaluate<S: Native>(&self, inputs: &[&[S]], out: &mut [S]) {
        let &[x, u, phi, &[time_step], w] = inputs else { return };
        let (robot, at) = (self.robot, Point { x, u, phi, time_step, w });
        match self.part {
            Part::Balance => {
                out.copy_from_slice(&robot.unbalanced(&robot.stepping(&at, at.w), at.w));
            }
            Part::Mass => out.copy_from_slice(&robot.inertia(&robot.stepping(&at, at.w)).concat()),
            Part::Solution => out.copy_from_slice(&robot.sliding(&at)),
            Part::Signals => out.copy_from_slice(&robot.signal_values(&at)),
            Part::Landmarks => out.copy_from_slice(&robot.mark(&at).concat()),
        }
    }
}

impl Function for Of<'_> {
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
        self.evaluate(inputs, outputs);
    }
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
        self.evaluate(inputs, outputs);
    }
}
