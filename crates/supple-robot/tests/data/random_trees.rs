//! Random trees, written as URDF and read back.

use proptest::prelude::*;
use supple_robot::{JointKind, Limits, LoadOptions, Pose, Robot, parse};

/// A joint and the link that it carries, at random.
#[derive(Clone, Debug)]
struct Part {
    parent: prop::sample::Index,
    kind: JointKind,
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
    limits: [f64; 4],
    forces: [f64; 2],
    /// Masses of points, and where they are: their inertia is that of some body.
    points: Vec<(f64, [f64; 3])>,
    turn: [f64; 3],
    /// By what the joints are shuffled.
    place: u32,
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-10.0..10.0)
}

fn part() -> impl Strategy<Value = Part> {
    const KINDS: &[JointKind] = &[JointKind::Fixed, JointKind::Revolute, JointKind::Continuous, JointKind::Prismatic];
    let axis = vector().prop_filter("has a direction", |axis| axis.iter().any(|entry| entry.abs() > 1e-3));
    let shape = (any::<prop::sample::Index>(), prop::sample::select(KINDS), vector(), vector(), axis);
    let numbers = (prop::array::uniform4(0.0..100.0), prop::array::uniform2(0.0..10.0));
    let body = (prop::collection::vec((0.01..5.0, vector()), 0..4), vector(), any::<u32>());
    (shape, numbers, body).prop_map(|((parent, kind, xyz, rpy, axis), (limits, forces), (points, turn, place))| Part {
        parent,
        kind,
        xyz,
        rpy,
        axis,
        limits,
        forces,
        points,
        turn,
        place,
    })
}

/// `sum m (r'r - r r')`
fn moment(points: &[(f64, [f64; 3])]) -> [[f64; 3]; 3] {
    let entry = |i: usize, j: usize| {
        let term = |(mass, r): &(f64, [f64; 3])| {
            let square = if i == j { r.iter().map(|x| x * x).sum() } else { 0.0 };
            mass * (square - r[i] * r[j])
        };
        points.iter().map(term).sum()
    };
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)))
}

/// Numbers as an attribute holds them: read back, they are the same.
fn spaced(numbers: [f64; 3]) -> String {
    numbers.map(|number| number.to_string()).join(" ")
}

/// The elements of link and joint `i`, counted from 1.
fn written(i: usize, part: &Part) -> [String; 2] {
    let Part { xyz, rpy, axis, turn, .. } = part;
    let [xx, xy, xz, yy, yz, zz] = {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = moment(&part.points);
        [xx, xy, xz, yy, yz, zz]
    };
    let mass: f64 = part.points.iter().map(|(mass, _)| mass).sum();
    let inertia = format!("<inertia ixx='{xx}' ixy='{xy}' ixz='{xz}' iyy='{yy}' iyz='{yz}' izz='{zz}'/>");
    let origin = |xyz: &[f64; 3], rpy: &[f64; 3]| format!("<origin xyz='{}' rpy='{}'/>", spaced(*xyz), spaced(*rpy));
    let inertial = match part.points.len() {
        0 => String::new(),
        _ => format!("<inertial>{}<mass value='{mass}'/>{inertia}</inertial>", origin(xyz, turn)),
    };
    let kind = format!("{:?}", part.kind).to_lowercase();
    let ends = format!("<parent link='l{}'/><child link='l{i}'/>", part.parent.index(i));
    let [lower, range, velocity, effort] = part.limits;
    let upper = lower + range;
    let limit = format!("<limit lower='{lower}' upper='{upper}' velocity='{velocity}' effort='{effort}'/>");
    let [damping, friction] = part.forces;
    let rest = format!("<axis xyz='{}'/><dynamics damping='{damping}' friction='{friction}'/>{limit}", spaced(*axis));
    let joint = format!("<joint name='j{i}' type='{kind}'>{ends}{}{rest}</joint>", origin(xyz, rpy));
    [format!("<link name='l{i}'>{inertial}</link>"), joint]
}

/// Whether two numbers are the same but for rounding of numbers as great as `size`.
fn near(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 1e-13 * size.max(1e-300)
}

/// The joint `i` and its link, as they were read.
fn compare(robot: &Robot, i: usize, part: &Part) -> Result<(), TestCaseError> {
    let at = robot.joint(&format!("j{i}")).unwrap();
    let (joint, link) = (&robot.joints[at], &robot.links[at + 1]);
    prop_assert_eq!(&link.name, &format!("l{i}"));
    prop_assert_eq!(&robot.links[joint.parent].name, &format!("l{}", part.parent.index(i)));
    prop_assert!(joint.parent <= at);
    prop_assert_eq!(joint.kind, part.kind);
    prop_assert_eq!(joint.origin, Pose::from_rpy(part.xyz, part.rpy));
    if part.kind != JointKind::Fixed {
        let length = part.axis.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        prop_assert!((0..3).all(|k| near(joint.axis[k] * length, part.axis[k], length)));
        prop_assert_eq!([joint.damping, joint.friction], part.forces);
        let [lower, range, velocity, effort] = part.limits;
        let upper = lower + range;
        let bounds =
            if part.kind == JointKind::Continuous { (f64::NEG_INFINITY, f64::INFINITY) } else { (lower, upper) };
        let expected = Limits { lower: bounds.0, upper: bounds.1, velocity, effort };
        prop_assert_eq!(joint.limits, expected);
    }
    prop_assert_eq!(link.inertia.is_some(), !part.points.is_empty());
    let Some(inertia) = link.inertia else { return Ok(()) };
    prop_assert_eq!(inertia.center, part.xyz);
    // Points turned, and not their moments.
    let turn = Pose::from_rpy([0.0; 3], part.turn);
    let points: Vec<_> = part.points.iter().map(|(mass, r)| (*mass, turn.rotate(*r))).collect();
    let expected = moment(&points);
    let size = expected.iter().flatten().fold(0.0_f64, |size, entry| size.max(entry.abs()));
    prop_assert!((0..9).all(|k| near(inertia.moment[k / 3][k % 3], expected[k / 3][k % 3], 10.0 * size)));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_tree_reads_back_as_it_was_written(parts in prop::collection::vec(part(), 0..30)) {
        let mut elements = vec![(0, "<link name='l0'/>".to_owned())];
        for (i, part) in parts.iter().enumerate() {
            let [link, joint] = written(i + 1, part);
            elements.push((part.place, link));
            elements.push((part.place.rotate_left(16), joint));
        }
        elements.sort_by_key(|(place, _)| *place);
        let elements: Vec<_> = elements.into_iter().map(|(_, element)| element).collect();
        let text = format!("<robot name='random'>\n{}\n</robot>", elements.join("\n"));
        let robot = parse(&text, "robot.urdf", &LoadOptions::default()).unwrap();
        prop_assert_eq!((robot.links.len(), robot.joints.len()), (parts.len() + 1, parts.len()));
        prop_assert_eq!(&robot.links[0].name, "l0");
        for (i, part) in parts.iter().enumerate() {
            compare(&robot, i + 1, part)?;
        }
    }
}
