//! Mimic joints, each traced to a joint that is not a mimic joint.

use supple_text::FileError;

use super::names::Names;
use super::parts::{JointPart, MimicPart};
use super::physics::GREATEST;
use super::warnings::Warnings;
use super::words::{listed, shown};
use crate::{JointKind, Limits, Mimic};

/// The mimic relation of each joint, by index in the file, with chains resolved so that no leader is a mimic joint itself.
///
/// ```text
/// a = r b + o,  b = s c + p   =>   a = r s c + (r p + o)
/// ```
///
/// A fixed joint follows nothing, whatever the file says: files that fix joints of a larger robot often keep the element.
///
/// # Errors
/// If a joint follows an unknown or fixed one, or, through a chain, itself.
pub(super) fn follow(
    joints: &[JointPart],
    names: &Names,
    warnings: &mut Warnings,
) -> Result<Vec<Option<Mimic>>, FileError> {
    let mut direct = vec![None; joints.len()];
    for (i, joint) in joints.iter().enumerate() {
        let Some(mimic) = &joint.mimic else { continue };
        if joint.own.kind == JointKind::Fixed {
            let followed = shown(&mimic.joint.name);
            warnings
                .note("fixed mimic", joint.at, || format!("it is fixed; its mimic relation to {followed} is ignored"));
            continue;
        }
        direct[i] = Some(leader(joints, i, mimic, names)?);
    }
    let mut resolved = vec![None; joints.len()];
    let mut done = vec![false; joints.len()];
    let mut visited = vec![usize::MAX; joints.len()];
    for start in 0..joints.len() {
        // Follows the chain of leaders up to a resolved joint, and then resolves the joints on the way back.
        let mut chain = Vec::new();
        let mut at = start;
        while !done[at] {
            if visited[at] == start {
                return Err(circle(joints, &chain, at));
            }
            visited[at] = start;
            chain.push(at);
            let Some(mimic) = direct[at] else { break };
            at = mimic.joint;
        }
        for joint in chain.into_iter().rev() {
            done[joint] = true;
            let Some(mimic) = direct[joint] else { continue };
            resolved[joint] = Some(match resolved[mimic.joint] {
                None => mimic,
                Some(Mimic { joint, ratio, offset }) => {
                    Mimic { joint, ratio: mimic.ratio * ratio, offset: mimic.ratio * offset + mimic.offset }
                }
            });
        }
    }
    for (joint, resolved) in joints.iter().zip(&resolved) {
        if resolved.is_some_and(|mimic| !(mimic.ratio.abs() < GREATEST && mimic.offset.abs() < GREATEST)) {
            return Err(joint
                .at
                .error(format!("the product of the mimic ratios along the chain must be below {GREATEST:e}")));
        }
    }
    Ok(resolved)
}

/// How much stricter a limit must be to replace another, relative to 1 plus its size: rounding of a file's digits.
const STRICTER: f64 = 1e-9;

/// Narrows the limits of joints that others follow to those that the followers' own limits leave them. Limits of a
/// follower that leave no range are reported, and not applied.
pub(super) fn narrow(joints: &mut [JointPart], mimics: &[Option<Mimic>], warnings: &mut Warnings) {
    for follower in 0..joints.len() {
        let Some(mimic) = mimics[follower].filter(|mimic| mimic.ratio != 0.0) else { continue };
        let (own, leader) = (&joints[follower], &joints[mimic.joint]);
        let (name, limits) = (own.own.name.clone(), leader.own.limits);
        let implied = implied(own.own.limits, mimic);
        let (lower, upper) = (limits.lower.max(implied.lower), limits.upper.min(implied.upper));
        let narrows = stricter(implied.lower, limits.lower, -1.0) || stricter(implied.upper, limits.upper, 1.0);
        if narrows && lower >= upper {
            warnings.note("range of a follower", own.at, || {
                format!(
                    "it follows {}, to which its own range leaves none; its range is ignored",
                    shown(&leader.own.name)
                )
            });
        }
        let leader = &mut joints[mimic.joint].own;
        if narrows && lower < upper {
            (leader.limits.lower, leader.limits.upper) = (lower, upper);
            if limits.lower <= implied.lower && implied.upper <= limits.upper {
                leader.narrowed.position.clear();
            }
            leader.narrowed.position.push(name.clone());
            if leader.kind == JointKind::Continuous {
                leader.kind = JointKind::Revolute;
            }
        }
        if stricter(implied.velocity, limits.velocity, 1.0) {
            leader.limits.velocity = implied.velocity;
            leader.narrowed.velocity = vec![name];
        }
    }
}

/// The limits of a joint that is followed, from those of the follower: `position = ratio * followed + offset`.
fn implied(limits: Limits, Mimic { ratio, offset, .. }: Mimic) -> Limits {
    let [a, b] = [limits.lower, limits.upper].map(|end| (end - offset) / ratio);
    Limits { lower: a.min(b), upper: a.max(b), velocity: limits.velocity / ratio.abs(), ..Limits::default() }
}

/// Whether a limit is stricter than another, by more than rounding; the sign is 1 for upper limits and -1 for lower ones.
fn stricter(limit: f64, than: f64, sign: f64) -> bool {
    limit.is_finite() && sign * (than - limit) > STRICTER * (1.0 + limit.abs())
}

/// The joint that is followed directly.
fn leader(joints: &[JointPart], follower: usize, mimic: &MimicPart, names: &Names) -> Result<Mimic, FileError> {
    let MimicPart { joint, ratio, offset } = mimic;
    let index = names.find(joint)?;
    let fail = |message: String| Err(joint.at.error_naming(&joint.name, message));
    if index == follower {
        return fail("a joint cannot follow itself".to_owned());
    }
    if joints[index].own.kind == JointKind::Fixed {
        return fail(format!("joint {} is fixed and cannot be followed", shown(&joint.name)));
    }
    Ok(Mimic { joint: index, ratio: *ratio, offset: *offset })
}

/// The error about a chain that leads back to `joint`.
fn circle(joints: &[JointPart], chain: &[usize], joint: usize) -> FileError {
    let around = chain.iter().skip_while(|&&other| other != joint);
    let names: Vec<_> = around.map(|&joint| joints[joint].own.name.as_str()).collect();
    let message = format!("mimic joints form a cycle: {}", listed(&names));
    joints[joint].mimic.as_ref().map_or(joints[joint].at, |mimic| mimic.joint.at).error(message)
}
