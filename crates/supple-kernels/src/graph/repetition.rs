//! Repeated arithmetic, and what a program runs before and after it.

use super::node::{Node, Op, Repetition};
use super::schedule::behind;

/// For each operation, the repetition that it is part of: those that depend on its variables.
pub(super) fn bodies(ops: &[Op], repetitions: &[Repetition]) -> Vec<Option<usize>> {
    let mut bodies: Vec<Option<usize>> = vec![None; ops.len()];
    for (number, repetition) in repetitions.iter().enumerate() {
        repetition.variables.iter().for_each(|variable| bodies[variable.index()] = Some(number));
    }
    for i in 0..ops.len() {
        bodies[i] = bodies[i].or_else(|| ops[i].operands().find_map(|operand| bodies[operand.index()]));
    }
    bodies
}

/// Operations that a program runs in sequence, once or repeatedly.
#[derive(Debug)]
pub(super) struct Stage {
    /// Nodes that are read after this stage, or at its end, in the order in which they were recorded.
    pub ends: Vec<Node>,
    /// The number of the repetition, if the stage is one.
    pub repetition: Option<usize>,
}

/// The stages of a program for `ends`, in order: each repetition after everything that it reads and before everything that
/// reads its results. What several stages read is computed by the first of them.
pub(super) fn stages(ops: &[Op], repetitions: &[Repetition], ends: &[Node]) -> Vec<Stage> {
    if repetitions.is_empty() {
        return vec![Stage { ends: ends.to_vec(), repetition: None }];
    }
    let bodies = bodies(ops, repetitions);
    let begins = begins(ops, repetitions);
    let (mut runs, mut last) = (vec![false; repetitions.len()], 0);
    // The level of the repetitions before which each operation runs; `None` for unused operations.
    let mut level: Vec<Option<usize>> = vec![None; ops.len()];
    let mut reads: Vec<(Node, Option<Node>)> = ends.iter().map(|&end| (end, None)).collect();
    let end_level = begins.iter().map(|begin| begin + 1).max().unwrap_or(0);
    for end in ends {
        level[end.index()] = Some(end_level);
    }
    for i in (0..ops.len()).rev() {
        let Some(own) = level[i] else { continue };
        let mut read = |node: Node, from: Option<Node>, at: usize| {
            let node = behind(ops, node);
            let before = &mut level[node.index()];
            *before = Some(before.map_or(at, |before| before.min(at)));
            reads.push((node, from));
        };
        if let Op::Repeated { repetition, .. } = ops[i] {
            let number = repetition as usize;
            if !std::mem::replace(&mut runs[number], true) {
                repetitions[number].needs().for_each(|node| read(node, None, begins[number]));
            }
        }
        let at = bodies[i].map_or(own, |number| begins[number]);
        ops[i].operands().for_each(|operand| read(operand, Some(Node(i as u32)), at));
        last = last.max(own);
    }
    let stage = |node: Node| bodies[node.index()].map_or((None, level[node.index()]), |number| (Some(number), None));
    let mut kept = vec![false; ops.len()];
    for (node, from) in reads {
        kept[node.index()] |= from.is_none_or(|from| stage(from) != stage(node));
    }
    let of = |wanted| {
        let nodes = (0..ops.len()).map(|i| Node(i as u32));
        nodes.filter(|node| kept[node.index()] && !ops[node.index()].is_given() && stage(*node) == wanted).collect()
    };
    let mut stages = Vec::new();
    for level in 0..=last {
        stages.push(Stage { ends: of((None, Some(level))), repetition: None });
        for number in (0..repetitions.len()).filter(|&number| runs[number] && begins[number] == level) {
            stages.push(Stage { ends: of((Some(number), None)), repetition: Some(number) });
        }
    }
    stages.retain(|stage: &Stage| !stage.ends.is_empty() || stage.repetition.is_some());
    stages
}

/// For each repetition, the length of the chain of repetitions that it depends on.
fn begins(ops: &[Op], repetitions: &[Repetition]) -> Vec<usize> {
    let (mut after, mut begins) = (vec![0; ops.len()], vec![0; repetitions.len()]);
    for (i, &op) in ops.iter().enumerate() {
        let highest = |nodes: &mut dyn Iterator<Item = Node>| nodes.map(|node| after[node.index()]).max().unwrap_or(0);
        after[i] = match op {
            Op::Repeated { repetition, .. } => {
                begins[repetition as usize] = highest(&mut repetitions[repetition as usize].needs());
                begins[repetition as usize] + 1
            }
            op => highest(&mut op.operands()),
        };
    }
    begins
}
