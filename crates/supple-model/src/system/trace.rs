use supple_kernels::graph::{Node, depends, jacobian};
use supple_kernels::{Ldl, Scalar};

use crate::cost::Cost;
use crate::physics::solved;
use crate::quantity::{Known, Quantity, signals_for};
use crate::{Model, Point, Value};

/// Numbers of the sources that programs read.
pub(super) mod source {
    pub const STATE: usize = 0;
    pub const CONTROL: usize = 1;
    /// Costates, of the next step.
    pub const COSTATE: usize = 2;
    /// The next state, for costs that take it; these have no costates.
    pub const NEXT: usize = 2;
    /// Adjoints of the knots.
    pub const DYNAMICS: usize = 3;
    pub const MEASUREMENT: usize = 4;
    pub const COST: usize = 5;
    /// Variation of `z`, and of the costates of the next step.
    pub const VARIATION: usize = 6;
    pub const COSTATE_VARIATION: usize = 7;
}

/// All variables of a model, and its functions recorded.
pub(super) struct Trace<'a, M> {
    pub model: &'a M,
    /// Time step of the task.
    pub time_step: &'a Value,
    /// `z = (x, u)`.
    pub z: Vec<Node>,
    /// The next state, if costs take it, and which of its entries they depend on.
    next: Option<(Vec<Node>, Vec<usize>)>,
    pub phi: Vec<Node>,
}

/// `sum a_i b_i`
pub(super) fn dot(a: impl IntoIterator<Item = Node>, b: impl IntoIterator<Item = Node>) -> Node {
    a.into_iter().zip(b).fold(Node::zero(), |sum, (a, b)| a.mul_add(b, sum))
}

/// Column `j` of a matrix.
pub(super) fn column(matrix: &[Vec<Node>], j: usize) -> impl Iterator<Item = Node> + '_ {
    matrix.iter().map(move |row| row[j])
}

/// Entries of a vector that a program reads.
pub(super) fn entries(source: usize, len: usize) -> Vec<Node> {
    (0..len).map(|i| Node::entry(source, i)).collect()
}

/// The residual of every cost at a point.
pub(super) fn residuals<M: Model, S: Scalar>(
    model: &M,
    costs: &[Cost],
    at: &Point<S>,
    next: Option<&[S]>,
) -> Vec<Vec<S>> {
    let quantities: Vec<&Quantity> = costs.iter().map(|cost| &cost.quantity).collect();
    let values = values(model, &quantities, at, next);
    costs.iter().zip(values).map(|(cost, values)| cost.residual(values, at)).collect()
}

/// The numbers of every quantity at a point, with the next state where it is known.
pub(super) fn values<M: Model, S: Scalar>(
    model: &M,
    quantities: &[&Quantity],
    at: &Point<S>,
    known: Option<&[S]>,
) -> Vec<Vec<S>> {
    let needs_next = quantities.iter().any(|quantity| quantity.needs_next());
    let next = match known {
        Some(known) => known.to_vec(),
        None if needs_next => next(model, at),
        None => Vec::new(),
    };
    let signals = signals_for(model, quantities, at, &next);
    let early = signals_early(model, quantities, at);
    let known = Known { signals: &signals, next: &next, early: &early };
    quantities.iter().map(|quantity| quantity.values(at, &known)).collect()
}

/// The signals during the first sub-step if any of these quantities takes such; else empty.
fn signals_early<M: Model, S: Scalar>(model: &M, quantities: &[&Quantity], at: &Point<S>) -> Vec<S> {
    if !quantities.iter().any(|quantity| quantity.needs_signals_early()) {
        return Vec::new();
    }
    let at = Point { time_step: of_substep(model, at.time_step), ..*at };
    let mut signals = vec![S::zero(); model.signals().len()];
    model.signal_during(&at, &step_solved(model, &at), &mut signals);
    signals
}

/// The next state after all sub-steps, solving for their unknowns on the way, with all derivatives.
fn next<M: Model, S: Scalar>(model: &M, at: &Point<S>) -> Vec<S> {
    let time_step = of_substep(model, at.time_step);
    let mut x = at.x.to_vec();
    for _ in 0..substeps(model) {
        x = step_solved(model, &Point { x: &x, time_step, ..*at });
    }
    x
}

/// The next state after a single sub-step.
fn step_solved<M: Model, S: Scalar>(model: &M, at: &Point<S>) -> Vec<S> {
    let w = solved(model.solution(at), model.unknowns(), |w| {
        let with = Point { w, ..*at };
        let mut residual = vec![S::zero(); w.len()];
        model.balance(&with, &mut residual);
        (mass(model, &with), residual)
    });
    let mut next = vec![S::zero(); at.x.len()];
    model.step(&Point { w: &w, ..*at }, &mut next);
    next
}

/// Number of integration steps into which a model divides a time step.
pub(super) fn substeps<M: Model>(model: &M) -> usize {
    model.substeps().unwrap_or(1).max(1)
}

/// The length of each sub-step.
fn of_substep<M: Model, S: Scalar>(model: &M, time_step: S) -> S {
    match substeps(model) {
        1 => time_step,
        count => time_step / count as f64,
    }
}

/// `r_w` at the unknowns of a point.
fn mass<M: Model, S: Scalar>(model: &M, at: &Point<S>) -> Vec<Vec<S>> {
    let count = at.w.len();
    let mut matrix = vec![S::zero(); count * count];
    model.mass(at, &mut matrix);
    matrix.chunks(count.max(1)).map(<[S]>::to_vec).collect()
}

impl<'a, M: Model> Trace<'a, M> {
    /// The variables of a model at a stage, or at the end, where there is no control.
    pub fn new(model: &'a M, time_step: &'a Value, parameters: usize, last: bool) -> Self {
        let size = model.dimensions();
        let mut z = entries(source::STATE, size.states);
        // At the end the control is 0, but remains a variable, unlike other zeros.
        let control = |i| if last { Node::zero().opaque() } else { Node::entry(source::CONTROL, i) };
        z.extend((0..size.controls).map(control));
        Self { model, time_step, z, next: None, phi: (0..parameters).map(Node::parameter).collect() }
    }

    /// The same with the next state as an input. Those of its entries that some functions of it depend on become variables.
    pub fn given_next(self, functions: impl FnOnce(&Self) -> Vec<Node>) -> Self {
        let next = entries(source::NEXT, self.model.dimensions().states);
        let given = Self { next: Some((next.clone(), Vec::new())), ..self };
        let functions = functions(&given);
        let counts = |i: &usize| depends(&functions, next[*i]);
        let counting = (0..next.len()).filter(counts).collect();
        Self { next: Some((next, counting)), ..given }
    }

    fn given(&self) -> Option<&[Node]> {
        self.next.as_ref().map(|(next, _)| &next[..])
    }

    /// Entries of the next state that are variables; none unless it is an input.
    pub fn counting(&self) -> &[usize] {
        self.next.as_ref().map_or(&[], |(_, counting)| counting)
    }

    /// `z`, and the entries of the next state that are variables.
    pub fn with_next(&self) -> Vec<Node> {
        let next = self.next.iter().flat_map(|(next, counting)| counting.iter().map(|&i| next[i]));
        self.z.iter().copied().chain(next).collect()
    }

    /// The next state after a step of integration, its unknowns solved for, with all derivatives.
    pub fn solved_step(&self) -> Vec<Node> {
        step_solved(self.model, &self.substep(&[]))
    }

    /// The point at which everything except the dynamics is evaluated.
    fn point(&self) -> Point<'_, Node> {
        let (x, u) = self.z.split_at(self.model.dimensions().states);
        Point { x, u, phi: &self.phi, time_step: self.time_step.resolve(&self.phi), w: &[] }
    }

    /// A step of integration with these unknowns: one of those into which the model divides a time step.
    fn substep<'b>(&'b self, w: &'b [Node]) -> Point<'b, Node> {
        let at = self.point();
        Point { time_step: of_substep(self.model, at.time_step), w, ..at }
    }

    fn balance(&self, w: &[Node]) -> Vec<Node> {
        let mut residual = vec![Node::zero(); w.len()];
        self.model.balance(&self.substep(w), &mut residual);
        residual
    }

    /// `F` and `r` of a step of integration, at given unknowns.
    pub fn at(&self, w: &[Node]) -> (Vec<Node>, Vec<Node>) {
        let mut next = vec![Node::zero(); self.model.dimensions().states];
        self.model.step(&self.substep(w), &mut next);
        (next, self.balance(w))
    }

    /// `f` of an integration step, with the equation that defines its unknowns.
    pub fn dynamics(&self) -> Dynamics {
        self.dynamics_with(|w| self.mass(w))
    }

    /// The same for derivatives of `r`: these contain the mass matrix, so it is taken from there at no extra cost.
    pub fn dynamics_to_linearise(&self) -> Dynamics {
        self.dynamics_with(|w| jacobian(&self.balance(w), w))
    }

    /// The same with the mass matrix at given unknowns.
    fn dynamics_with(&self, mass: impl Fn(&[Node]) -> Vec<Vec<Node>>) -> Dynamics {
        let still: Vec<Node> = (0..self.model.unknowns()).map(|_| Node::zero().opaque()).collect();
        if let Some(w) = self.model.solution(&self.substep(&still)) {
            let w: Vec<Node> = w.into_iter().map(Node::opaque).collect();
            let (next, residual) = self.at(&w);
            return Dynamics { next, residual, factor: Ldl::new(&mass(&w)), w };
        }
        let factor = Ldl::new(&mass(&still));
        let zeros = vec![Node::zero(); still.len()];
        let w = factor.solve(self.balance(&zeros)).into_iter().map(|w| (-w).opaque()).collect::<Vec<_>>();
        let (next, residual) = self.at(&w);
        Dynamics { next, residual, factor, w }
    }

    /// `r_w` at given unknowns.
    pub fn mass(&self, w: &[Node]) -> Vec<Vec<Node>> {
        mass(self.model, &self.substep(w))
    }

    /// `g`
    pub fn measurement(&self) -> Vec<Node> {
        let mut y = vec![Node::zero(); self.model.dimensions().measurements];
        self.model.observe(&self.point(), &mut y);
        y
    }

    /// The numbers of every quantity.
    pub fn values(&self, quantities: &[&Quantity]) -> Vec<Vec<Node>> {
        values(self.model, quantities, &self.point(), self.given())
    }

    /// Where the landmarks are.
    pub fn landmarks(&self) -> Vec<[Node; 3]> {
        self.model.landmarks(&self.point())
    }

    /// The residual of every cost.
    pub fn residuals(&self, costs: &[Cost]) -> Vec<Vec<Node>> {
        residuals(self.model, costs, &self.point(), self.given())
    }

    /// The cost `l`, of a stage or of the end: of the task and the model's own.
    pub fn cost(&self, costs: &[Cost], last: bool) -> Node {
        let terms = costs.iter().zip(self.residuals(costs)).filter(|(cost, _)| !cost.weights(last).are_zero());
        let sum = terms.fold(Node::zero(), |sum, (cost, r)| sum + cost.of_residual(&r, &self.phi, last));
        sum + self.own_norm(&self.own_residual(last), last)
    }

    /// The residual of the model's own cost; empty where it has none.
    pub fn own_residual(&self, last: bool) -> Vec<Node> {
        let count = self.model.own_cost(last).map_or(0, |cost| cost.residuals);
        let mut residual = vec![Node::zero(); count];
        self.model.own_residual(&self.point(), last, &mut residual);
        residual
    }

    /// The model's own cost, given the residual.
    pub fn own_norm(&self, residual: &[Node], last: bool) -> Node {
        self.model.own_norm(residual, &self.phi, self.time_step.resolve(&self.phi), last)
    }
}

/// The dynamics `f(z; phi) = F(z, w; phi)` with unknowns `w(z; phi)` such that `r(z, w; phi) = 0`, `r_w = M` (theory,
/// equation U.1).
///
/// In derivatives of `F` and `r`, `w` is an independent variable. Along `z_j` it changes by `W_j = -M^-1 r_{z_j}`,
/// and `f` by `F_{z_j} + F_w W_j` (theory, equations U.2 and U.3).
pub(super) struct Dynamics {
    /// `F` at the unknowns.
    pub next: Vec<Node>,
    /// `r` at the unknowns: 0, but with derivatives.
    pub residual: Vec<Node>,
    factor: Ldl<Node>,
    pub w: Vec<Node>,
}

/// The derivatives of the dynamics' parts.
pub(super) struct Linearised {
    /// `F_z` and `F_w`.
    pub f_z: Vec<Vec<Node>>,
    pub f_w: Vec<Vec<Node>>,
    /// `r_z`
    pub r_z: Vec<Vec<Node>>,
    /// `W_j` of every variable of `z`.
    pub directions: Vec<Vec<Node>>,
}

impl Dynamics {
    /// `-M^-1 b`
    pub fn respond(&self, b: Vec<Node>) -> Vec<Node> {
        if b.iter().all(|b| b.is_zero()) { b } else { self.factor.solve(b).into_iter().map(|x| -x).collect() }
    }

    /// The variables `z` and `w` in one list.
    pub fn variables(&self, z: &[Node]) -> Vec<Node> {
        z.iter().chain(&self.w).copied().collect()
    }

    /// All derivatives by `z` and `w`.
    pub fn linearise(&self, z: &[Node]) -> Linearised {
        let variables = self.variables(z);
        let split = |rows: Vec<Vec<Node>>| -> (Vec<_>, Vec<_>) {
            rows.into_iter().map(|row| (row[..z.len()].to_vec(), row[z.len()..].to_vec())).unzip()
        };
        let (f_z, f_w) = split(jacobian(&self.next, &variables));
        let (r_z, _) = split(jacobian(&self.residual, &variables));
        let directions = (0..z.len()).map(|j| self.respond(column(&r_z, j).collect())).collect();
        Linearised { f_z, f_w, r_z, directions }
    }

    /// `-M^-1 F_w' lambda`: how much each unit of `r` changes `lambda' f` (theory, equation U.4).
    pub fn multipliers(&self, f_w: &[Vec<Node>], lambda: &[Node]) -> Vec<Node> {
        self.respond((0..self.w.len()).map(|l| dot(column(f_w, l), lambda.iter().copied())).collect())
    }
}
