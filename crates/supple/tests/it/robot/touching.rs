//! What contacts report of themselves, against what sensors and costs see of them.

use supple::{ContactState, Problem};

use crate::robot::arm::{Description, arm, compliance, cost, observe, sensor, stage_cost};
use crate::robot::assert_close;

/// A disc of 0.1 m that slides along x and y and turns about z, between a wall at y = 0.2 and a rough one at x = 2; a spring
/// acts beside its joint.
fn disc(more_costs: &str) -> Problem {
    let wall = |name: &str, normal: &str, point: &str, more: &str| {
        let keys =
            format!("frame = \"disc\"\nnormal = {normal}\npoint = {point}\nradius = 0.1\nstiffness = 1000.0\n{more}");
        compliance("contact", name, &keys)
    };
    let sensors =
        ["floor", "side"].map(|name| sensor("coupling_force", &format!("coupling = \"{name}\"\nvariance = 1.0")));
    Description {
        model: "file = \"disc.urdf\"\n".into(),
        sensors: sensors.concat(),
        start: String::new(),
        costs: cost("penetration", "contact = \"side\"\nweight = 1.0") + more_costs,
        time_step: "1.0".into(),
        ..arm()
    }
    .with(&wall("floor", "[0.0, 2.0, 0.0]", "[5.0, 0.2, -3.0]", "smoothing = 0.001\n"))
    .with(&compliance("spring", "soft", "joint = \"x\"\nstiffness = 3.0"))
    .with(&wall("side", "[-1.0, 0.0, 0.0]", "[2.0, 0.0, 0.0]", "smoothing = 0.002\nfriction = 0.5\n"))
    .problem()
}

/// Springs are no contacts, and states come in the order of the names.
#[test]
fn contact_states_are_what_sensors_and_costs_see() {
    let problem = disc("");
    let system = &problem.tasks[0].system;
    let names: Vec<String> = system.contacts().into_iter().map(|contact| contact.name).collect();
    assert_eq!(names, ["floor", "side"]);
    for (x, y, place) in [(1.895, 0.295, 0.0), (1.91, 0.4, 0.0), (0.3, 0.5, 0.003)] {
        let state = [x, y, 0.4, 0.1, -0.2, 2.0, 0.0, place];
        let [floor, side] = system.contact_states(&state, &[])[..] else { panic!("two contacts") };
        let seen = |state: &ContactState| [&[state.force][..], &state.total_force].concat();
        assert_close("forces", &[seen(&floor), seen(&side)].concat(), &observe(&problem, &state, &[]), 1e-12);
        assert_close(
            "depth squared",
            &[side.clearance.powi(2)],
            &[stage_cost(&problem, &state, &[0.0; 3], &[])],
            1e-12,
        );
        assert_close("clearance of the floor", &[floor.clearance], &[y - 0.3], 1e-9);
        assert_eq!([floor.stiffness, floor.smoothing], [1000.0, 0.001]);
        assert_eq!([side.stiffness, side.smoothing], [1000.0, 0.002]);
        assert_eq!((floor.touches(), floor.is_apart()), (y < 0.3, y > 0.301));
    }
}

/// Costs are counted as in the file; forces along any axis need the contact.
#[test]
fn costs_want_forces_of_the_contacts_that_they_name() {
    let more = cost("contact_force", "contact = \"side\"\ntarget = 4.0\nsmoothing = 0.1\nweight = 1.0")
        + &cost("coupling_force", "coupling = \"floor\"\nselect = [\"contact_force\"]\nweight = 1.0")
        + &cost(
            "coupling_force",
            "coupling = \"floor\"\nselect = [\"force_x\", \"contact_force\"]\ntarget = [1.0, 2.0]\nweight = 1.0",
        );
    let problem = disc(&more);
    let wanted = problem.tasks[0].system.wanted_forces(&[]);
    let wanted: Vec<_> = wanted.iter().map(|force| (force.cost, force.kind, force.contact, force.target)).collect();
    assert_eq!(wanted, [(1, "contact_force", 1, 4.0), (3, "coupling_force", 0, 1.0), (3, "coupling_force", 0, 2.0)]);
}
