mod equipment;

use std::fmt::Write;

use supple_robot::{Joint, JointKind, Robot, Tree};

use super::planning::Planning;
use super::words::{name, number, vector};
use crate::tables::{Rows, align_right, table};

/// Levels of the tree that are drawn; what hangs deeper stands at the last one, with the name of what carries it.
const LEVELS: usize = 20;
/// What each column of the list of joints is, and whether it holds numbers.
const COLUMNS: [(&str, bool); 15] = [
    ("", true),
    ("joint", false),
    ("kind", false),
    ("axis", false),
    ("lower", true),
    ("upper", true),
    ("speed", true),
    ("effort", true),
    ("damping", true),
    ("friction", true),
    ("armature", true),
    ("stiffness", true),
    ("rest", true),
    ("reference", true),
    ("follows", false),
];

/// The page of `supple robot` without a state, from what is called `source`.
pub fn robot_page(robot: &Robot, tree: &Tree, gravity: [f64; 3], source: &str, verbose: bool) -> String {
    let mass: f64 = robot.links.iter().filter_map(|link| link.inertia).map(|inertia| inertia.mass).sum();
    let (links, moving) = (robot.links.len(), tree.bodies().len());
    let mut page = format!("{}: {}, {}", name(&robot.name), count(links, "link"), count(moving, "moving joint"));
    if tree.has_mimic() {
        let _ = write!(page, " ({} independent)", tree.dofs());
    }
    let _ = writeln!(page, ", {} kg\n", number(mass));
    page.push_str(&link_table(robot).trimmed());
    if moving > 0 {
        page.push_str("\nMoving joints in the order of --q, --v and --tau; SI units and radians\n\n");
        page.push_str(&joint_table(robot, tree).trimmed());
        for joint in tree.joint_indices().iter().map(|&joint| &robot.joints[joint]) {
            for (what, by) in [("positions", &joint.narrowed.position), ("speed", &joint.narrowed.velocity)] {
                if let [_, ..] = by[..] {
                    let by: Vec<_> = by.iter().map(|by| name(by)).collect();
                    let follow = if by.len() == 1 { "follows" } else { "follow" };
                    let (joint, by) = (name(&joint.name), by.join(", "));
                    let _ = writeln!(page, "The limits of {joint} on {what} are those of {by}, which {follow} it.");
                }
            }
        }
    }
    if !robot.frames.is_empty() {
        page.push_str("\nFrames besides those of links\n\n");
        page.push_str(&frame_table(robot).trimmed());
    }
    page.push_str(&equipment::equipment(robot, tree));
    let said = robot
        .gravity
        .map_or_else(|| format!("not given in the {source}"), |said| format!("{} in the {source}", vector(said)));
    let _ = writeln!(page, "\nGravity, m/s^2: {said}; dynamics use {}", vector(gravity));
    page.push_str(&Planning::of(robot).text(robot));
    let mut warnings = if verbose { robot.every_warning.clone() } else { robot.warnings.clone() };
    warnings.extend(missing_meshes(robot, verbose));
    if !warnings.is_empty() {
        page.push_str("\nWarnings\n");
        warnings.iter().for_each(|warning| page.extend(["- ", warning, "\n"]));
    }
    page
}

/// What to say of meshes that are not where the file says: one line, or one for each.
fn missing_meshes(robot: &Robot, verbose: bool) -> Vec<String> {
    let meshes = robot.links.iter().flat_map(|link| &link.meshes);
    let mut missing: Vec<String> =
        meshes.filter(|mesh| !mesh.path.is_file()).map(|mesh| mesh.path.display().to_string()).collect();
    missing.sort();
    missing.dedup();
    match missing.len() {
        0 => Vec::new(),
        count if verbose || count == 1 => missing.iter().map(|path| format!("mesh not found: {path}")).collect(),
        count => {
            let shown = missing.iter().take(3).map(String::as_str).collect::<Vec<_>>().join(", ");
            let rest = if count > 3 { format!(" and {} more", count - 3) } else { String::new() };
            vec![format!("{count} meshes not found: {shown}{rest}")]
        }
    }
}

fn count(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The tree of links, with their masses and the joints that carry them.
fn link_table(robot: &Robot) -> Rows {
    let mut carried = vec![Vec::new(); robot.links.len()];
    for (index, joint) in robot.joints.iter().enumerate() {
        carried[joint.parent].push(index);
    }
    let mut table = table(&["link", "mass, kg", "carried by", ""]);
    let mass = |link: usize| robot.links[link].inertia.map_or_else(|| "-".into(), |inertia| number(inertia.mass));
    let root = &robot.links[0].name;
    table.add_row([name(root), mass(0), "fixed in the world".into()]);
    // Joints still to show, the next one last, with what is drawn before them and their level.
    let push = |stack: &mut Vec<_>, link: usize, before: &str, level: usize| {
        let last = carried[link].last().copied();
        stack.extend(carried[link].iter().rev().map(|&joint| (joint, Some(joint) == last, before.to_owned(), level)));
    };
    let mut stack = Vec::new();
    push(&mut stack, 0, "", 1);
    while let Some((index, last, before, level)) = stack.pop() {
        let (joint, link) = (&robot.joints[index], index + 1);
        let mut shown = format!("{before}{}{}", if last { "└─ " } else { "├─ " }, name(&robot.links[link].name));
        if level > LEVELS {
            let _ = write!(shown, " on {}", name(&robot.links[joint.parent].name));
        }
        table.add_row([shown, mass(link), name(&joint.name), kind(joint).into()]);
        let inner = if level < LEVELS { format!("{before}{}", if last { "   " } else { "│  " }) } else { before };
        push(&mut stack, link, &inner, level + 1);
    }
    align_right(&mut table, 1..2);
    table
}

fn kind(joint: &Joint) -> &'static str {
    match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
    }
}

/// The degrees of freedom, numbered, and then the joints that follow them. Columns that say nothing are left out.
fn joint_table(robot: &Robot, tree: &Tree) -> Rows {
    let numbered = tree.joint_indices().iter().enumerate().map(|(dof, &joint)| (Some(dof + 1), joint));
    let followers = tree.bodies().iter().map(|body| body.joint).filter(|joint| robot.joints[*joint].mimic.is_some());
    let all = numbered.chain(followers.map(|joint| (None, joint)));
    let rows: Vec<_> = all.map(|(place, joint)| joint_row(robot, place, &robot.joints[joint])).collect();
    let used: Vec<_> = (0..COLUMNS.len()).filter(|&column| rows.iter().any(|row| !row[column].is_empty())).collect();
    let header: Vec<_> = used.iter().map(|&column| COLUMNS[column].0).collect();
    let mut table = table(&header);
    for row in &rows {
        table.add_row(used.iter().map(|&column| row[column].as_str()));
    }
    for (place, &column) in used.iter().enumerate() {
        if COLUMNS[column].1 {
            align_right(&mut table, place..place + 1);
        }
    }
    table
}

/// The entries of [`COLUMNS`]; empty where there is nothing to say.
fn joint_row(robot: &Robot, place: Option<usize>, joint: &Joint) -> [String; COLUMNS.len()] {
    let some = |value: f64| if value == 0.0 { String::new() } else { number(value) };
    let limit = |value: f64| if value.is_finite() { number(value) } else { String::new() };
    let rest = if joint.stiffness > 0.0 { number(joint.rest) } else { String::new() };
    let follows = joint.mimic.map_or_else(String::new, |mimic| {
        let ratio = if mimic.ratio == 1.0 { String::new() } else { format!("{} ", number(mimic.ratio)) };
        let sign = if mimic.offset < 0.0 { "-" } else { "+" };
        let offset =
            if mimic.offset == 0.0 { String::new() } else { format!(" {sign} {}", number(mimic.offset.abs())) };
        format!("{ratio}{}{offset}", name(&robot.joints[mimic.joint].name))
    });
    [
        place.map_or_else(String::new, |place| place.to_string()),
        name(&joint.name),
        kind(joint).into(),
        axis(joint.axis),
        limit(joint.limits.lower),
        limit(joint.limits.upper),
        limit(joint.limits.velocity),
        limit(joint.limits.effort),
        some(joint.damping),
        some(joint.friction),
        some(joint.armature),
        some(joint.stiffness),
        rest,
        some(joint.reference),
        follows,
    ]
}

/// An axis by name, where it is that of a coordinate.
fn axis(axis: [f64; 3]) -> String {
    let along = |entry: usize| (0..3).all(|i| i == entry || axis[i].abs() < 1e-9);
    match (0..3).find(|&entry| along(entry)) {
        Some(entry) => format!("{}{}", if axis[entry] < 0.0 { "-" } else { "" }, ["x", "y", "z"][entry]),
        None => vector(axis.map(|entry| (entry * 1e3).round() * 1e-3)),
    }
}

/// Named frames: where they are in their links.
fn frame_table(robot: &Robot) -> Rows {
    let mut table = table(&["frame", "on link", "at x y z, m"]);
    for frame in &robot.frames {
        table.add_row([name(&frame.name), name(&robot.links[frame.link].name), vector(frame.pose.position)]);
    }
    table
}
