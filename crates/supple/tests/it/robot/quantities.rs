//! Quantities: every kind is a cost, a limit and a curve, and a sensor where it does not depend on the control; and the
//! numbers are those of mechanics.

use supple::Kinds;
use supple::{EvaluateOptions, Evaluation, QuantityCurve};

use crate::robot::arm::{Description, arm, compliance, sensor};
use crate::robot::examples;

fn evaluated(text: &str) -> Evaluation {
    let problem = supple_file::parse(text, "tests/data/task.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    problem.evaluate(&problem.parameters.initial(), &options).unwrap()
}

fn curves(at: &Evaluation) -> &[QuantityCurve] {
    &at.tasks[0].trajectory.as_ref().unwrap().quantities
}

/// The kind of the first cost, and the lines of its table but for those that only costs have.
fn quantity(costs: &str) -> (String, String) {
    let own = ["target", "position", "weight", "final_weight", "norm"];
    let table = costs.split("[[tasks.costs]]").nth(1).unwrap();
    let lines = table.lines().filter(|line| !own.iter().any(|key| line.starts_with(&format!("{key} ="))));
    let text = lines.collect::<Vec<_>>().join("\n");
    (text.split('"').nth(1).unwrap().to_owned(), text)
}

#[test]
fn every_quantity_is_a_cost_a_limit_and_a_curve() {
    let mut seen = Vec::new();
    for description in examples::of_costs() {
        let (kind, table) = quantity(&description.costs);
        if kind == "quadratic" {
            continue;
        }
        let followed = format!("[[tasks.limits]]{table}\nupper = -1e9\n[[tasks.curves]]{table}\n");
        let text = description.text() + &followed;
        let at = evaluated(&text);
        let of = |what: &str| curves(&at).iter().filter(|curve| curve.of == what).cloned().collect::<Vec<_>>();
        let (limits, shown) = (of("limit 1"), of("curve 1"));
        assert!(!shown.is_empty() && limits.len() == shown.len(), "{kind}");
        for (limit, shown) in limits.iter().zip(&shown) {
            assert_eq!((&limit.values, &limit.name, limit.upper), (&shown.values, &shown.name, Some(-1e9)), "{kind}");
            assert!([6, 7].contains(&shown.values.len()), "{kind}: {} numbers in 6 steps", shown.values.len());
            assert!(shown.values.iter().chain(&shown.run_values).all(|value| value.is_finite()), "{kind}");
            assert!(!shown.name.is_empty());
            let exceeded = |found: &&supple::LimitViolation| found.name == shown.name && found.limit == -1e9;
            let exceeded = at.tasks[0].limits_violated.iter().find(exceeded);
            let exceeded = exceeded.unwrap_or_else(|| panic!("{kind}: {} exceeds its limit", shown.name));
            let most = shown.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(exceeded.steps, shown.values.len(), "{kind}");
            assert!((exceeded.worst - most).abs() <= 1e-12 * (1.0 + most.abs()), "{kind}: {} {most}", exceeded.worst);
        }
        // Costs of states are shown as states.
        let weighed = of("cost 1");
        assert!(weighed.is_empty() || weighed.iter().zip(&shown).all(|(a, b)| a.values == b.values), "{kind}");
        seen.push(kind);
    }
    let missing: Vec<_> =
        Kinds::default().quantities().into_iter().filter(|kind| !seen.iter().any(|seen| seen == *kind)).collect();
    assert!(missing.is_empty(), "no example of {missing:?}");
}

/// The arm with curves, at short steps.
fn shown(description: Description, list: &str) -> Evaluation {
    let text = Description { time_step: "1e-4".into(), ..description.explicit() }.text();
    evaluated(&(text + list))
}

fn curve(keys: &str) -> String {
    format!("[[tasks.curves]]\n{keys}\n")
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs()))
}

#[test]
fn velocities_of_frames_are_rates_of_their_places() {
    let list = curve("kind = \"frame_point\"\nframe = \"tool\"")
        + &curve("kind = \"frame_velocity\"\nframe = \"tool\"\nselect = [\"vx\", \"vy\", \"vz\"]")
        + &curve("kind = \"frame_turn\"\nframe = \"tool\"")
        + &curve("kind = \"frame_velocity\"\nframe = \"base\"");
    let at = shown(arm(), &list);
    let all = curves(&at);
    for axis in 0..3 {
        let (place, rate) = (&all[axis].values, &all[3 + axis].values);
        for t in 0..5 {
            let mean = 0.5 * (rate[t] + rate[t + 1]);
            assert!(close((place[t + 1] - place[t]) / 1e-4, mean, 2e-3), "{axis} at {t}: {mean}");
        }
        assert!(rate.iter().any(|rate| rate.abs() > 1e-3));
        assert!(all[9 + axis].values.iter().all(|&rate| rate == 0.0), "the base does not move");
    }
    assert_eq!((all[3].name.as_str(), all[3].unit.as_str()), ("vx of tool", "m/s"));
    assert_eq!((all[12].name.as_str(), all[12].unit.as_str()), ("wx of base", "rad/s"));
}

#[test]
fn accelerations_and_powers_are_what_the_motion_says() {
    let list = curve("kind = \"joint_acceleration\"") + &curve("kind = \"power\"") + &curve("kind = \"control\"");
    let at = shown(arm(), &list);
    let (all, trajectory) = (curves(&at), at.tasks[0].trajectory.as_ref().unwrap());
    for joint in 0..3 {
        for t in 0..6 {
            let (now, next) = (&trajectory.states[t], &trajectory.states[t + 1]);
            let acceleration = (next[3 + joint] - now[3 + joint]) / 1e-4;
            assert!(close(all[joint].values[t], acceleration, 1e-9), "{}: {acceleration}", all[joint].name);
            let power = trajectory.controls[t][joint] * now[3 + joint];
            assert_eq!(all[3 + joint].values[t], power, "{}", all[3 + joint].name);
            assert_eq!(all[6 + joint].values[t], trajectory.controls[t][joint]);
        }
    }
    let units: Vec<&str> = all.iter().map(|curve| curve.unit.as_str()).collect();
    assert_eq!(units, ["rad/s^2", "rad/s^2", "m/s^2", "W", "W", "W", "N m", "N m", "N"]);
}

#[test]
fn the_centre_of_mass_is_the_mean_of_those_of_the_links() {
    // Frames at the centres of mass that `arm.urdf` gives, with its masses.
    let links =
        [("upper", 1.5, "[0.02, 0.01, 0.15]"), ("fore", 0.8, "[0.1, 0.0, 0.03]"), ("tip", 0.4, "[0.03, 0.0, 0.0]")];
    let mut frames = String::new();
    let mut list = curve("kind = \"center_of_mass\"");
    for (link, _, place) in links {
        frames += &format!("[model.frames.{link}_center]\non = \"{link}\"\nposition = {place}\n");
        list += &curve(&format!("kind = \"frame_point\"\nframe = \"{link}_center\""));
    }
    let at = shown(arm().with(&frames), &list);
    let all = curves(&at);
    for axis in 0..3 {
        for t in 0..7 {
            let moment: f64 = links.iter().enumerate().map(|(i, link)| link.1 * all[3 + 3 * i + axis].values[t]).sum();
            assert!(close(all[axis].values[t], moment / 2.7, 1e-14));
        }
    }
}

#[test]
fn what_springs_push_with_is_their_stiffness_times_their_deflection() {
    let bushing = "frame_a = \"base\"\nframe_c = \"upper\"\nstiffness = [80.0, 80.0, 80.0]\ndamping = [0.0, 0.0, 0.0]\n\
                   torsional_stiffness = [3.0, 2.0, 4.0]\ntorsional_damping = [0.0, 0.0, 0.0]";
    let spring = "joint = \"slide\"\nstiffness = 20.0\nrest = 0.05";
    let elastic = "joint = \"elbow\"\nstiffness = 30.0\nmotor_inertia = 0.05";
    let mut list = String::new();
    for name in ["mount", "return", "flexible"] {
        list += &curve(&format!("kind = \"coupling_force\"\ncoupling = \"{name}\""));
        list += &curve(&format!("kind = \"coupling_deflection\"\ncoupling = \"{name}\""));
    }
    let robot = arm()
        .with(&compliance("bushing", "mount", bushing))
        .with(&compliance("spring", "return", spring))
        .with(&compliance("elastic_joint", "flexible", elastic));
    let at = shown(robot, &list);
    let named = |name: &str| curves(&at).iter().find(|curve| curve.name == name).unwrap();
    for t in 0..7 {
        let at = |name: &str| named(name).values[t];
        assert!(close(at("return.torque"), -20.0 * at("return.deflection"), 1e-14));
        assert!(close(at("flexible.torque"), 30.0 * at("flexible.deflection"), 1e-14));
        // The half-way frame is turned from A; the length is the same.
        let length = |prefix: &str| {
            ["x", "y", "z"].map(|axis| at(&format!("mount.{prefix}_{axis}")).powi(2)).iter().sum::<f64>()
        };
        assert!(close(length("force").sqrt(), 80.0 * length("deflection").sqrt(), 1e-12));
    }
    let unit = |name: &str| named(name).unit.as_str();
    let units =
        ["mount.deflection_roll", "mount.deflection_x", "mount.force_x", "flexible.deflection", "flexible.torque"];
    assert_eq!(units.map(unit), ["rad", "m", "N", "rad", "N m"]);
}

#[test]
fn a_sensor_measures_what_a_curve_shows() {
    let list = curve("kind = \"center_of_mass\"") + &curve("kind = \"frame_velocity\"\nframe = \"tool\"");
    let sensing =
        sensor("center_of_mass", "variance = 1e-30") + &sensor("frame_velocity", "frame = \"tool\"\nvariance = 1e-30");
    let at = shown(arm().sensing(&sensing), &list);
    let trajectory = at.tasks[0].trajectory.as_ref().unwrap();
    for (index, curve) in curves(&at).iter().enumerate() {
        for (row, &value) in trajectory.sample.measurements.iter().zip(&curve.run_values) {
            assert!(close(row[index], value, 1e-12), "{}: {} is not {value}", curve.name, row[index]);
        }
        assert!(curve.run_values.len() == 7);
    }
}

#[test]
fn wrong_limits_and_curves_say_what_is_valid() {
    let error = |list: &str| {
        let text = arm().text() + list;
        supple_file::parse(&text, "tests/data/task.toml")
            .err()
            .unwrap_or_else(|| panic!("no error in {list}"))
            .to_string()
    };
    let limit = |keys: &str| error(&format!("[[tasks.limits]]\nkind = \"power\"\n{keys}\n"));
    assert!(limit("").contains("limits[0].upper: is missing: a limit requires `lower`, `upper`, or both"));
    assert!(limit("lower = 2.0\nupper = 1.0").contains("lower: must be at most `upper`, 1; found 2"));
    assert!(
        limit("upper = [1.0, 2.0]").contains("upper: must be one number, or 3 of them"),
        "{}",
        limit("upper = [1.0, 2.0]")
    );
    let unknown = limit("uper = 1.0");
    assert!(
        unknown.contains("unknown key `uper`; valid: `select`, `lower`, `upper`, `enforce` (did you mean `upper`?)"),
        "{unknown}"
    );
    assert!(
        limit("select = [\"wrist\"]\nupper = 1.0").contains("no drive `wrist`: it has `shoulder`, `elbow`, `slide`")
    );
    assert!(error("[[tasks.curves]]\nkind = \"powr\"\n").contains("found `powr` (did you mean `power`?)"));
    let weighed = error("[[tasks.curves]]\nkind = \"power\"\nweight = 1.0\n");
    assert!(
        weighed.contains("unknown key `weight`, expected") || weighed.contains("unknown key `weight`"),
        "{weighed}"
    );
    let contact = error("[[tasks.curves]]\nkind = \"clearance\"\n");
    assert!(contact.contains("the model has no contact"), "{contact}");
}
