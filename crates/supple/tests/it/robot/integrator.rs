//! Implicit steps: of first order, never gaining energy from what resists motion, and bounded at any time step.

use supple::{EvaluateOptions, Problem};

use crate::common::reference::relative_error;
use crate::robot::arm::{Description, arm, compliance, cost, sensor, step, steps};
use crate::robot::examples;

/// A disc of 2 kg along x, 1.5 kg along y and 0.3 kg m^2 about z, with more in its model.
fn disc(more: &str, time_step: f64) -> Problem {
    let description = Description {
        model: format!("file = \"disc.urdf\"\ngravity = [0.0, 0.0, 0.0]\n{more}"),
        sensors: sensor("joint_position", "select = [\"turn\"]\nvariance = 1.0"),
        start: String::new(),
        costs: cost("control", "weight = 1.0"),
        time_step: format!("{time_step:?}"),
        ..arm()
    };
    description.problem()
}

/// Kinetic energy, J.
fn kinetic(x: &[f64]) -> f64 {
    0.5 * (2.0 * x[3] * x[3] + 1.5 * x[4] * x[4] + 0.3 * x[5] * x[5])
}

const TIME_STEPS: [f64; 7] = [1e-4, 1e-2, 0.3, 2.0, 50.0, 1e3, 1e6];
const VELOCITIES: [[f64; 3]; 4] = [[1.0, -0.5, 3.0], [1e-3, 2e-3, -1e-3], [-30.0, 10.0, 100.0], [0.0, 5.0, -2.0]];

/// What resists motion without storing energy, in every way that a robot has.
fn dampers() -> Vec<String> {
    let joints = ["x", "y", "turn"].map(|joint| format!("[model.joints.{joint}]\ndamping = 3.0\nfriction = 20.0\n"));
    let anchor = "[model.frames.anchor]\non = \"base\"\nposition = [0.3, 0.1, 0.0]\nrpy = [0.1, 0.2, 0.3]\n";
    let bushing = "frame_a = \"anchor\"\nframe_c = \"disc\"\nstiffness = [0.0, 0.0, 0.0]\ndamping = [90.0, 20.0, 5.0]\n\
                   torsional_stiffness = [0.0, 0.0, 0.0]\ntorsional_damping = [1.0, 2.0, 7.0]";
    vec![
        joints.concat(),
        compliance("spring", "damper", "joint = \"turn\"\nstiffness = 0.0\ndamping = 40.0"),
        format!("{anchor}{}", compliance("bushing", "damper", bushing)),
    ]
}

#[test]
fn what_resists_motion_never_adds_energy() {
    for more in dampers() {
        for time_step in TIME_STEPS {
            let problem = disc(&more, time_step);
            for velocity in VELOCITIES {
                let x = [[0.2, 0.1, -0.4], velocity].concat();
                let after = step(&problem, &x, &[0.0; 3], &[]);
                let (before, after) = (kinetic(&x), kinetic(&after));
                assert!(after <= before * (1.0 + 1e-12), "{time_step} s: {before} J became {after} J\n{more}");
            }
        }
    }
}

/// Friction along a wall that is pressed on takes energy too, however long the step.
#[test]
fn friction_of_a_contact_never_adds_energy_along_the_wall() {
    let wall = "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = 0.1\nstiffness = 1e5\nsmoothing = 1e-3\n\
                dissipation = 1.0\nfriction = 0.8\nslip = 1e-3";
    for time_step in TIME_STEPS {
        let problem = disc(&compliance("contact", "wall", wall), time_step);
        for velocity in VELOCITIES {
            let x = [vec![0.0, 0.09, 0.0], velocity.to_vec(), vec![0.0]].concat();
            let after = step(&problem, &x, &[0.0; 3], &[]);
            let along = |x: &[f64]| 0.5 * (2.0 * x[3] * x[3] + 0.3 * x[5] * x[5]);
            assert!(along(&after) <= along(&x) * (1.0 + 1e-12), "{time_step} s: {x:?} became {after:?}");
        }
    }
}

/// Springs and dampers of 200 rad/s, at up to 1e8 s, on all kinds of stretch: the explicit step is stable up to 0.01 s.
#[test]
fn stiff_systems_stay_bounded_at_a_million_times_the_stable_step() {
    let anchor = "[model.frames.anchor]\non = \"base\"\nposition = [0.0, 0.0, 0.0]\n";
    let bushing = "frame_a = \"anchor\"\nframe_c = \"disc\"\nstiffness = [80e3, 60e3, 1.0]\ndamping = [1.0, 2.0, 3.0]\n\
                   torsional_stiffness = [1.0, 1.0, 12e3]\ntorsional_damping = [1.0, 1.0, 0.1]";
    let springs = ["x", "y", "turn"]
        .map(|joint| compliance("spring", &format!("on_{joint}"), &format!("joint = \"{joint}\"\nstiffness = 60e3")));
    let elastic = "joint = \"turn\"\nstiffness = 12e3\ndamping = 1.0\nmotor_inertia = 0.1";
    let models = [
        springs.concat(),
        format!("{anchor}{}", compliance("bushing", "grip", bushing)),
        compliance("elastic_joint", "flexible", elastic),
    ];
    for more in &models {
        for time_step in [0.01, 1.0, 1e2, 1e4] {
            let problem = disc(more, time_step);
            let size = problem.tasks[0].system.dimensions();
            let mut x = vec![0.0; size.states];
            let positions = size.states / 2;
            x[..3].copy_from_slice(&[0.05, -0.02, 0.3]);
            for _ in 0..200 {
                x = step(&problem, &x, &[0.0; 3], &[]);
                assert!(x[..positions].iter().all(|p| p.abs() <= 0.5), "{time_step} s: {x:?}\n{more}");
            }
            assert!(x[positions..].iter().all(|v| v.abs() < 1.0), "{time_step} s: {x:?}\n{more}");
        }
    }
}

/// Dropped on a stiff wall with steps up to ten thousand times too long for an explicit one, a disc stays on it.
#[test]
fn a_contact_is_stable_at_any_time_step() {
    let wall = |stiffness: f64| {
        let keys = format!(
            "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = 0.1\nstiffness = {stiffness:?}\nsmoothing = 1e-3\n\
             dissipation = 0.5"
        );
        compliance("contact", "wall", &keys)
    };
    for (stiffness, time_step) in [(1e4, 1e-3), (1e6, 1e-2), (1e10, 1e-2), (1e8, 0.1)] {
        let problem = disc(&wall(stiffness), time_step);
        let mut x = vec![0.0, 0.12, 0.0, 0.0, 0.0, 0.0, 0.0];
        for _ in 0..4000 {
            // Its weight as the force of the drive along y.
            x = step(&problem, &x, &[0.0, -1.5 * 9.81, 0.0], &[]);
            assert!(x[1] < 0.5 && x[1] > -2.0, "{stiffness} N/m, {time_step} s: {x:?}");
        }
        let depth = 0.1 - x[1];
        // With far longer steps than a fall takes it keeps hopping, as far as it falls in a step.
        let rests = x[4].abs() < 1e-6 && depth.abs() < 1e-3 + 1.5 * 9.81 / stiffness;
        let hops = x[4].abs() <= 9.81 * time_step && depth.abs() <= 9.81 * time_step * time_step;
        assert!(if stiffness < 1e8 { rests } else { hops }, "{stiffness} N/m, {time_step} s: {x:?}");
    }
}

/// A body that leaves within one step is not held back.
#[test]
fn a_departing_body_is_never_pulled() {
    let wall = "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = 0.1\nstiffness = 1e5\nsmoothing = 1e-3\ndissipation = 0.3";
    for time_step in [1e-4, 1e-3, 1e-2, 0.1, 1.0] {
        let problem = disc(&compliance("contact", "wall", wall), time_step);
        for depth in [-9e-4, -2e-4, 0.0, 3e-4, 2e-3, 2e-2] {
            for speed in [1e-3, 0.1, 1.0, 10.0] {
                let x = [0.0, 0.1 - depth, 0.0, 0.0, speed, 0.0, 0.0];
                let after = step(&problem, &x, &[0.0; 3], &[])[4];
                assert!(after >= speed * (1.0 - 1e-12), "{time_step} s, depth {depth} m: {speed} became {after} m/s");
            }
        }
    }
}

/// Of the energy with which a body meets an elastic wall, long implicit steps take the share that docs/tasks.md tells.
#[test]
fn rebounds_lose_what_the_reference_says() {
    let (mass, stiffness) = (1.5_f64, 1e4);
    let omega = (stiffness / mass).sqrt();
    let wall = format!(
        "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = 0.1\nstiffness = {stiffness:?}\nsmoothing = 1e-5"
    );
    for time_step in [1e-3, 2.5e-4, 5e-5] {
        let problem = disc(&compliance("contact", "wall", &wall), time_step);
        let mut x = vec![0.0, 0.1 + 2e-4, 0.0, 0.0, -1.0, 0.0, 0.0];
        while x[4] < 0.0 || x[1] < 0.1 + 1e-4 {
            x = step(&problem, &x, &[0.0; 3], &[]);
        }
        let (lost, told) = (1.0 - x[4] * x[4], 1.0 - (-std::f64::consts::PI * omega * time_step).exp());
        assert!((lost - told).abs() < 0.02 + 0.1 * told, "{time_step} s: {lost}, told {told}");
    }
}

/// The error after a fixed time halves with the time step, for every kind of compliance.
#[test]
fn implicit_steps_are_of_first_order() {
    for description in examples::of_compliance() {
        let end = |count: usize| {
            let mut description = description.clone();
            description.time_step = format!("{:?}", 0.08 / count as f64);
            let problem = description.problem();
            let phi = problem.parameters.initial();
            let x: Vec<f64> = problem.tasks[0].initial_state.iter().map(|value| value.resolve(&phi)).collect();
            let u = vec![0.5; problem.tasks[0].system.dimensions().controls];
            steps(&problem, &x, &u, &phi, count)
        };
        let exact = end(1 << 15);
        let error = |count| relative_error(&end(count), &exact);
        for count in [64, 128, 256] {
            let ratio = error(count) / error(2 * count);
            assert!((1.85..2.15).contains(&ratio), "{count} steps: {ratio}\n{}", description.text());
        }
    }
}

/// Both integrators meet as steps become short.
#[test]
fn both_integrators_have_one_limit() {
    for description in examples::of_compliance() {
        let end = |integrator: &str, count: usize| {
            let mut description = description.clone();
            description.model.insert_str(0, &format!("integrator = \"{integrator}\"\n"));
            description.time_step = format!("{:?}", 0.04 / count as f64);
            let problem = description.problem();
            let phi = problem.parameters.initial();
            let x: Vec<f64> = problem.tasks[0].initial_state.iter().map(|value| value.resolve(&phi)).collect();
            steps(&problem, &x, &vec![0.5; problem.tasks[0].system.dimensions().controls], &phi, count)
        };
        let gap = |count| relative_error(&end("implicit", count), &end("semi_implicit", count));
        assert!(gap(4096) < 1e-3 && gap(4096) < 0.3 * gap(1024), "{} and {}", gap(1024), gap(4096));
    }
}

/// The positions after 0.2 s, at rest before, driven by constant efforts and a wave of efforts with 0.3 s.
fn driven<const N: usize>(problem: &Problem, time_step: f64, constant: [f64; N], wave: [f64; N]) -> Vec<f64> {
    let size = problem.tasks[0].system.dimensions();
    let count = (0.2 / time_step).round() as usize;
    let mut x = vec![0.0; size.states];
    for k in 0..count {
        let height = (std::f64::consts::TAU * k as f64 * time_step / 0.3).sin();
        let u: Vec<f64> = constant.iter().zip(wave).map(|(constant, wave)| constant + wave * height).collect();
        x = step(problem, &x, &u, &[]);
    }
    x.truncate(N);
    x
}

/// The table of docs/theory/robot.md: 30 N m on 0.3 kg m^2 is 1 N m on 0.01 kg m^2.
#[test]
fn a_joint_breaks_away_within_the_step_at_any_time_step() {
    let turn = "friction_smoothing = 1e-3\n[model.joints.turn]\nfriction = 30.0\n";
    for (time_step, expected) in [(1e-2, 0.1853), (1e-3, 0.1835), (1e-4, 0.1836)] {
        let turned = driven(&disc(turn, time_step), time_step, [0.0; 3], [0.0, 0.0, 45.0])[2];
        assert!((turned - expected).abs() < 5.1e-5, "{time_step} s: {turned} rad");
        assert!((turned - 0.1836).abs() < 0.01 * 0.1836, "{time_step} s: {turned} rad");
    }
}

/// The arm with dry friction in its joints, N m and N.
fn rubbing(friction: [f64; 3], integrator: &str, time_step: f64) -> Problem {
    let joints = ["shoulder", "elbow", "slide"].iter().zip(friction);
    let joints: String =
        joints.map(|(joint, friction)| format!("[model.joints.{joint}]\nfriction = {friction:?}\n")).collect();
    let model = format!("file = \"arm.urdf\"\nintegrator = \"{integrator}\"\ngravity = [0.0, 0.0, 0.0]\n{joints}");
    Description { model, time_step: format!("{time_step:?}"), ..arm() }.problem()
}

/// The same where joints move one another, beside explicit steps of 10 us: all slide; friction holds a loaded shoulder while
/// the elbow moves; all are loaded and held, and creep at less than the speed of smoothing.
#[test]
fn an_arm_with_dry_friction_moves_alike_at_long_and_short_time_steps() {
    let cases = [
        ([2.0, 2.0, 2.0], [0.0; 3], [4.0, 3.0, 3.0], 0.02),
        ([20.0, 0.5, 2.0], [12.0, 0.0, 0.0], [0.0, 1.5, 0.0], 0.02),
        ([20.0, 6.0, 2.0], [12.0, -4.0, 1.2], [0.0; 3], 0.0),
    ];
    for (friction, constant, wave, moves) in cases {
        let moved =
            |integrator, time_step| driven(&rubbing(friction, integrator, time_step), time_step, constant, wave);
        let fine = moved("semi_implicit", 1e-5);
        let farthest = fine.iter().fold(0.0, |far: f64, q| far.max(q.abs()));
        assert!(farthest > moves, "{fine:?}");
        for (time_step, share) in [(1e-2, 0.03), (2e-3, 0.008), (5e-4, 0.002)] {
            let found = moved("implicit", time_step);
            let error = found.iter().zip(&fine).fold(0.0, |far: f64, (q, fine)| far.max((q - fine).abs()));
            assert!(error < share * farthest, "{friction:?} {time_step} s: {found:?} and {fine:?}");
        }
    }
}

/// A leg that a floor holds: its joints cannot move alone. Friction of theirs that is taken for sliding at one state and for
/// sticking beside it makes modes that grow threefold in a step.
#[test]
fn friction_of_joints_that_a_wall_holds_makes_no_mode_that_grows() {
    let floor = "frame = \"foot\"\nnormal = [0.0, 0.0, 1.0]\nstiffness = 2e4\ndissipation = 0.5\nsmoothing = 1e-3\n\
                 friction = 0.8\nslip = 0.05";
    let landing = |time_step: f64, steps: usize| {
        let per_second = 500.0 * time_step;
        let weigh =
            |kind: &str, keys: &str, weight: f64| cost(kind, &format!("{keys}\nweight = {:?}", weight * per_second));
        Description {
            model: format!(
                "file = \"leg.urdf\"\nactuated = [\"hip\", \"knee\"]\n{}",
                compliance("contact", "floor", floor)
            ),
            sensors: sensor("joint_position", "select = [\"hip\", \"knee\"]\nvariance = 1e-6"),
            start: "\"q.slide\" = 0.36\n\"q.hip\" = 0.6\n\"q.knee\" = -1.2\n".into(),
            noise: "initial = { \"*\" = 1e-6 }\nprocess = { \"v.*\" = 1e-5 }\n".into(),
            costs: weigh("joint_position", "select = [\"slide\"]\ntarget = [0.3]", 500.0)
                + &weigh("frame_point", "frame = \"foot\"\naxes = [\"x\"]\ntarget = [0.0]", 100.0)
                + &weigh("joint_velocity", "", 0.1)
                + &weigh("control", "", 1e-3),
            time_step: format!("{time_step:?}"),
            steps,
            ..arm()
        }
        .problem()
    };
    let costs = [(2e-3, 400), (1e-3, 800)].map(|(time_step, steps)| {
        let task = landing(time_step, steps).evaluate(&[], &EvaluateOptions::default()).unwrap().tasks.remove(0);
        let (status, stability) = (&task.status, &task.stability);
        assert!(status.is_converged() && !stability.numerically_unstable, "{time_step} s: {status:?}, {stability:?}");
        assert!(stability.spectral_radius < 1.03, "{time_step} s: {stability:?}");
        task.cost.parts.nominal
    });
    assert!((costs[0] / costs[1] - 1.0).abs() < 0.02, "{costs:?}");
}

/// Where a disc that is pressed on a wall with 100 N is after 0.2 s, driven along the wall by a wave of 45 N and 0.3 s.
fn dragged(time_step: f64, integrator: &str, radius: f64) -> f64 {
    let wall = format!(
        "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = {radius:?}\nstiffness = 1e5\nsmoothing = 1e-4\n\
         dissipation = 1.0\nfriction = 0.3\nslip = 1e-3"
    );
    let more = format!("integrator = \"{integrator}\"\n{}", compliance("contact", "wall", &wall));
    let problem = disc(&more, time_step);
    let mut x = vec![0.0, radius - 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0];
    for k in 0..(0.2 / time_step).round() as usize {
        let wave = (std::f64::consts::TAU * k as f64 * time_step / 0.3).sin();
        x = step(&problem, &x, &[45.0 * wave, -100.0, 0.0], &[]);
    }
    x[0]
}

/// The table of docs/theory/robot.md, beside explicit steps of 10 us; a wheel of radius 0.1 m rolls and slips.
#[test]
fn a_body_on_a_wall_breaks_away_within_the_step_at_any_time_step() {
    for (time_step, expected) in [(1e-2, 0.02800), (1e-3, 0.02794), (1e-4, 0.02798)] {
        let moved = dragged(time_step, "implicit", 0.0);
        assert!((moved - expected).abs() < 5.1e-6, "{time_step} s: {moved} m");
    }
    for (radius, fine) in [(0.0, 0.02798), (0.1, 0.03586)] {
        let explicit = dragged(1e-5, "semi_implicit", radius);
        assert!((explicit - fine).abs() < 5.1e-6, "{explicit} m");
        for time_step in [1e-2, 1e-3, 1e-4] {
            let moved = dragged(time_step, "implicit", radius);
            assert!((moved - fine).abs() < 0.01 * fine, "{time_step} s, radius {radius} m: {moved} m");
        }
    }
}

/// The force of a wall in one step is what its motion leaves over of the drives: never a pull, whatever draws the body away.
#[test]
fn walls_never_pull_at_any_time_step() {
    let wall = |name: &str, normal: &str, point: &str, more: &str| {
        let keys = format!(
            "frame = \"disc\"\nnormal = {normal}\npoint = {point}\nstiffness = 1e4\nsmoothing = 1e-3\ndissipation = 20.0\n{more}"
        );
        compliance("contact", name, &keys)
    };
    let mut pushed = 0;
    let depths = [-5e-4, 2e-3, 2e-2];
    let cases = [2.5e-4, 2e-3, 1e-2].into_iter().flat_map(|time_step| depths.map(|depth| (time_step, depth)));
    for (time_step, depth) in cases {
        let pairs = [-3000.0, -30.0, 0.0, 300.0].map(|force| [-3.0, -0.05, 0.0, 1.0].map(|rate| (force, rate)));
        for (force, rate) in pairs.into_iter().flatten() {
            // The wall is at x = 0, and the disc comes from below.
            let problem = disc(&wall("right", "[-1.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", ""), time_step);
            let next = step(&problem, &[depth, 0.0, 0.0, rate, 0.0, 0.0, 0.0], &[force, 0.0, 0.0], &[]);
            let push = force - 2.0 * (next[3] - rate) / time_step;
            let rounding = 1e-9 * (1.0 + force.abs() + rate.abs() / time_step);
            let case = format!("{time_step} s, {depth} m, {force} N, {rate} m/s: {push} N");
            assert!(push >= -rounding, "{case}");
            assert!(next[0] > -1e-3 || push.abs() <= rounding, "{case}: a push from afar");
            pushed += usize::from(push > 1.0);
            // It is the force where the step ends.
            let (end, rate) = (next[0], next[3]);
            if end > 1e-3 && 20.0 * rate > -0.5 {
                assert!((push / (1e4 * end * (1.0 + 20.0 * rate)) - 1.0).abs() < 1e-9, "{case}");
            }
            // Between two walls that overlap the disc, one cannot pull because the other pushes.
            let both = wall("right", "[-1.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", "friction = 0.5\n")
                + &wall("left", "[1.0, 0.0, 0.0]", "[0.001, 0.0, 0.0]", "friction = 0.5\n");
            let next =
                step(&disc(&both, time_step), &[depth, 0.0, 0.0, rate, 0.3, 0.0, 0.0, 0.0], &[force, 0.0, 0.0], &[]);
            let push = force - 2.0 * (next[3] - rate) / time_step;
            if next[0] > 2e-3 {
                assert!(push >= -rounding, "{case}, two walls: {push} N");
            } else if next[0] < -1e-3 {
                assert!(push <= rounding, "{case}, two walls: {push} N");
            }
        }
    }
    assert!(pushed > 30, "{pushed}");
}
