//! One small task for every kind of compliance, sensor and cost of a robot, with parameters in every number.

use crate::robot::arm::{Description, arm, compliance, cost, sensor, servo};

/// A place for a coupling with the tool, where the tool is at the start.
const ANCHOR: &str = "[model.frames.anchor]\non = \"base\"\nposition = [0.43, 0.03, 0.76]\nrpy = [0.1, 0.45, 0.05]\n";

const WALL: &str = "normal = [-1.0, 0.2, 0.3]\nsmoothing = 0.01\nstiffness = 300.0\npoint = [0.43, 0.03, 0.75]\n";

fn spring() -> Description {
    let keys = "joint = \"slide\"\nstiffness = \"k\"\nrest = \"rest\"\ndamping = \"d\"";
    arm().with(&compliance("spring", "return", keys)).where_(&[("k", 60.0), ("rest", 0.04), ("d", 1.5)])
}

fn elastic_joint() -> Description {
    let keys = "joint = \"shoulder\"\nstiffness = \"k\"\ndamping = \"d\"\nmotor_inertia = \"i\"\nmotor_damping = \"b\"";
    let parameters = [("k", 30.0), ("d", 0.5), ("i", 0.05), ("b", 0.2)];
    let start = "\"q.flexible\" = 0.35\n\"v.flexible\" = -0.2\n";
    let mut description = arm().with(&compliance("elastic_joint", "flexible", keys)).where_(&parameters);
    description.start += start;
    description
}

fn bushing() -> Description {
    let frame = "[model.frames.anchor]\non = \"base\"\nposition = [\"px\", \"py\", \"pz\"]\n\
                 rpy = [\"roll\", \"pitch\", \"yaw\"]\n";
    let place = [("px", 0.43), ("py", 0.03), ("pz", 0.76), ("roll", 0.1), ("pitch", 0.45), ("yaw", 0.05)];
    let keys = "frame_a = \"anchor\"\nframe_c = \"tool\"\nstiffness = [\"k1\", \"k2\", \"k3\"]\n\
                damping = [\"d1\", \"d2\", \"d3\"]\ntorsional_stiffness = [\"t1\", \"t2\", \"t3\"]\n\
                torsional_damping = [\"b1\", \"b2\", \"b3\"]";
    let linear = [("k1", 80.0), ("k2", 150.0), ("k3", 40.0), ("d1", 2.0), ("d2", 1.0), ("d3", 3.0)];
    let torsional = [("t1", 3.0), ("t2", 2.0), ("t3", 4.0), ("b1", 0.1), ("b2", 0.2), ("b3", 0.05)];
    arm().with(frame).with(&compliance("bushing", "gripper", keys)).where_(&place).where_(&linear).where_(&torsional)
}

fn contact() -> Description {
    let keys = "frame = \"tool\"\nnormal = [-1.0, 0.2, 0.3]\npoint = [\"px\", \"py\", \"pz\"]\nradius = \"r\"\n\
                stiffness = \"k\"\ndissipation = \"d\"\nsmoothing = \"s\"\nfriction = \"mu\"\nslip = \"slip\"";
    let wall = [("px", 0.43), ("py", 0.03), ("pz", 0.75), ("r", 0.01)];
    let numbers = [("k", 300.0), ("d", 0.5), ("s", 0.01), ("mu", 0.4), ("slip", 0.05)];
    let mut description = arm().with(&compliance("contact", "wall", keys)).where_(&wall).where_(&numbers);
    description.start += "\"c.wall\" = 0.002\n";
    description
}

/// At least one of every kind of compliance.
pub fn of_compliance() -> Vec<Description> {
    vec![spring(), elastic_joint(), bushing(), contact()]
}

/// The arm with one element of each kind, without parameters.
fn equipped() -> Description {
    let bushing = "frame_a = \"anchor\"\nframe_c = \"tool\"\nstiffness = [80.0, 150.0, 40.0]\n\
                   damping = [2.0, 1.0, 3.0]\ntorsional_stiffness = [3.0, 2.0, 4.0]\n\
                   torsional_damping = [0.1, 0.2, 0.05]";
    let elastic = "joint = \"shoulder\"\nstiffness = 30.0\ndamping = 0.5\nmotor_inertia = 0.05";
    let contact = format!("frame = \"tool\"\n{WALL}friction = 0.3\nslip = 0.05\ndissipation = 0.4\nradius = 0.01");
    let spring = "joint = \"slide\"\nstiffness = 20.0\nrest = 0.05";
    arm()
        .with(ANCHOR)
        .with(&compliance("bushing", "gripper", bushing))
        .with(&compliance("elastic_joint", "flexible", elastic))
        .with(&compliance("contact", "wall", &contact))
        .with(&compliance("spring", "return", spring))
}

/// At least one of every kind of sensor.
pub fn of_sensors() -> Vec<Description> {
    let joints = sensor("joint_position", "select = [\"elbow\", \"slide\"]\nvariance = [\"v\", 2e-3]")
        + &sensor("joint_position", "select = [\"shoulder\"]\nside = \"motor\"\nvariance = \"v\"")
        + &sensor("joint_velocity", "select = [\"slide\", \"shoulder\"]\nvariance = \"w\"")
        + &sensor("joint_velocity", "select = [\"shoulder\"]\nside = \"motor\"\nvariance = 1e-2")
        + &sensor("joint_torque", "select = [\"shoulder\"]\nvariance = \"t\"");
    let frames = sensor("frame_point", "frame = \"fore\"\nvariance = \"v\"")
        + &sensor(
            "frame_pose",
            "frame = \"tool\"\nreference = [0.1, 0.5, 0.0]\nvariance = [1e-3, \"v\", 1e-3, 2e-3, 2e-3, \"w\"]",
        );
    let turns = sensor("frame_turn", "frame = \"tool\"\nreference = [0.1, 0.5, 0.0]\nvariance = [1e-3, \"v\", \"w\"]");
    let file = sensor("file", "select = [\"angle\", \"place\", \"turn\"]\nvariance = \"v\"");
    let forces = sensor("coupling_force", "coupling = \"gripper\"\nvariance = \"f\"")
        + &sensor("coupling_force", "coupling = \"wall\"\nvariance = 0.5")
        + &sensor("coupling_force", "coupling = \"gripper\"\nselect = [\"force_z\", \"torque_x\"]\nvariance = 0.2")
        + &sensor("coupling_force", "coupling = \"return\"\nvariance = 0.1")
        + &sensor("coupling_force", "coupling = \"flexible\"\nvariance = 0.1");
    let touch = sensor("contact_force", "contact = \"wall\"\nsmoothing = \"g\"\nvariance = \"v\"")
        + &sensor("clearance", "contact = \"wall\"\nvariance = \"v\"")
        + &sensor("penetration", "contact = \"wall\"\nvariance = \"w\"")
        + &sensor("frame_pose", "frame = \"tool\"\nlever = \"l\"\nvariance = 1e-3");
    let whole = sensor("center_of_mass", "axes = [\"z\", \"x\"]\nvariance = \"v\"")
        + &sensor("frame_velocity", "frame = \"tool\"\nvariance = \"w\"")
        + &sensor("state", "select = [\"q.elbow\", \"c.wall\"]\nvariance = [\"v\", 2e-3]")
        + &sensor("signal", "select = [\"gripper.force_x\", \"tool.xy\"]\nvariance = \"w\"");
    let deflections = sensor("coupling_deflection", "coupling = \"gripper\"\nvariance = \"v\"")
        + &sensor("coupling_deflection", "coupling = \"return\"\nvariance = \"w\"")
        + &sensor("coupling_deflection", "coupling = \"flexible\"\nselect = [\"deflection\"]\nvariance = 1e-3");
    let last_step = sensor("joint_acceleration", "select = [\"slide\", \"shoulder\"]\nvariance = [\"v\", 2.0]")
        + &sensor("joint_acceleration", "select = [\"slide\"]\nvariance = 0.5")
        + &sensor("joint_position", "select = [\"elbow\"]\nvariance = \"w\"")
        + &sensor("drive_effort", "variance = \"w\"")
        + &sensor("power", "variance = \"v\"")
        + &sensor("control", "variance = \"w\"")
        + &sensor("state_and_control", "variance = \"v\"");
    vec![
        equipped().sensing(&last_step).where_(&[("v", 1e-2), ("w", 4e-3)]),
        equipped().sensing(&touch).where_(&[("v", 1e-3), ("w", 4e-3), ("g", 0.5), ("l", 0.4)]),
        equipped().sensing(&whole).where_(&[("v", 1e-3), ("w", 4e-3)]),
        equipped().sensing(&deflections).where_(&[("v", 1e-3), ("w", 4e-3)]),
        equipped().sensing(&joints).where_(&[("v", 1e-3), ("w", 4e-3), ("t", 0.05)]),
        equipped().sensing(&frames).where_(&[("v", 1e-3), ("w", 4e-3)]),
        equipped().sensing(&turns).where_(&[("v", 1e-3), ("w", 4e-3)]),
        Description { time_step: "0.002".into(), ..servo().sensing(&file) }.where_(&[("v", 1e-3)]),
        equipped().sensing(&forces).where_(&[("f", 0.3)]),
    ]
}

/// The numbers of links, joints, drives and the task itself.
pub fn of_numbers() -> Vec<Description> {
    let links = "gravity = [\"gx\", \"gy\", \"gz\"]\n[model.links.fore]\nmass = \"mass\"\ninertia_scale = \"scale\"\n\
                 center = [\"cx\", \"cy\", \"cz\"]\n[model.links.tip]\nmass = 0.5\n";
    let weight = [("gx", 0.3), ("gy", -0.2), ("gz", -9.81)];
    let inertia = [("mass", 0.9), ("scale", 1.2), ("cx", 0.11), ("cy", -0.01), ("cz", 0.02)];
    let joints = "friction_smoothing = \"smoothing\"\n[model.joints.elbow]\ndamping = \"damping\"\n\
                  friction = \"friction\"\narmature = \"armature\"\nstiffness = \"stiffness\"\nrest = \"rest\"\n\
                  offset = [\"ox\", \"oy\", \"oz\"]\nlength_scale = \"length\"\n\
                  [model.drives.elbow]\ngear = \"gear\"\nrotor_inertia = \"rotor\"\n";
    let passive = [("damping", 0.2), ("friction", 0.3), ("armature", 0.02), ("stiffness", 4.0), ("rest", -0.2)];
    let place = [("ox", 0.01), ("oy", -0.02), ("oz", 0.03), ("length", 1.1)];
    let drive = [("gear", 3.0), ("rotor", 0.001), ("smoothing", 0.2)];
    let servos =
        "[model.drives.servo]\nkp = \"kp\"\nkv = \"kv\"\ngear = \"gear\"\n[model.drives.speed]\nkv = \"speed\"\n";
    let poses = sensor("frame_pose", "frame = \"tool\"\nvariance = 1e-3");
    let mount = "[[model.insert]]\nname = \"mount\"\nframe = \"tool\"\naxes = [\"x\", \"ry\"]\nmass = \"mass\"\n\
                 center = [\"cx\", 0.0, 0.02]\ninertia = [1e-3, 2e-3, 1e-3]\nstiffness = [\"k\", 3.0]\n\
                 damping = [2.0, \"d\"]\n";
    let mounted = [("mass", 0.4), ("cx", 0.01), ("k", 60.0), ("d", 0.2)];
    let mut task =
        arm().where_(&[("dt", 0.02), ("q", 0.3), ("u", 0.5), ("x0", 1e-3), ("w", 1e-4), ("y", 2e-3), ("d", 1e4)]);
    task = task.where_(&[("light", 0.05), ("dark", 0.2)]);
    task.time_step = "\"dt\"\nbound = \"d\"\ninitial_control = [\"u\", 0.0, 0.2]".into();
    task.start = task.start.replace("= 0.3\n", "= \"q\"\n");
    task.noise = "initial = { \"*\" = \"x0\" }\nprocess = { \"v.*\" = \"w\" }\nmeasurement = [1e-3, \"y\", 1e-3]\n\
                  [[tasks.noise.varying]]\nmeasurement = [\"q.elbow\"]\nstate = \"q.slide\"\ncenter = \"light\"\n\
                  coefficient = \"dark\"\n"
        .into();
    vec![
        arm().with(links).sensing(&poses).where_(&weight).where_(&inertia),
        arm().with(joints).sensing(&poses).where_(&passive).where_(&place).where_(&drive),
        Description { time_step: "0.002".into(), ..servo().with(servos) }.where_(&[
            ("kp", 30.0),
            ("kv", 1.5),
            ("gear", 1.2),
            ("speed", 5.0),
        ]),
        arm().with(mount).sensing(&poses).costing(&cost("control", "weight = 0.01")).where_(&mounted),
        task,
    ]
}

/// Several sub-steps, with both integrators, dry friction and costs of the next state.
pub fn of_substeps() -> Vec<Description> {
    let accelerations = cost("joint_acceleration", "select = [\"elbow\"]\ntarget = 0.5\nweight = 0.002");
    let [one, other] = [contact().explicit(), of_numbers().remove(1)]
        .map(|task| Description { costs: task.costs.clone() + &accelerations, ..task });
    let last_step = sensor("joint_acceleration", "variance = 2.0") + &sensor("power", "variance = 0.1");
    let recalling = spring().sensing(&last_step);
    [spring(), elastic_joint(), contact(), of_numbers().remove(2), of_numbers().remove(4), one, other, recalling]
        .map(|mut description| {
            description.model.insert_str(0, "substeps = 3\n");
            description
        })
        .into()
}

/// At least one of every kind of cost.
pub fn of_costs() -> Vec<Description> {
    // What depends on the control has no final weight.
    let each = "weight = \"a\"\nnorm = { absolute = { smoothing = \"s\" } }";
    let all = format!("{each}\nfinal_weight = \"b\"");
    let list = [
        cost("joint_position", &format!("select = [\"elbow\"]\ntarget = [\"t\"]\n{all}")),
        cost("joint_velocity", &format!("target = [0.1, \"t\", 0.0]\n{all}")),
        cost("state", &format!("select = [\"q.flexible\", \"c.wall\"]\ntarget = [\"t\", 0.0]\n{all}")),
        cost("frame_point", &format!("frame = \"tool\"\naxes = [\"x\", \"z\"]\ntarget = [\"t\", 0.8]\n{all}")),
        cost(
            "frame_pose",
            &format!("frame = \"tool\"\nposition = [0.4, \"t\", 0.8]\nrpy = [0.0, 0.5, 0.1]\nlever = \"l\"\n{all}"),
        ),
        cost(
            "frame_pose",
            &format!("frame = \"tool\"\nreference = [0.0, 0.5, 0.1]\ntarget = [0.4, \"t\", 0.8, 0.0, 0.1, 0.0]\n{all}"),
        ),
        cost(
            "coupling_force",
            &format!("coupling = \"gripper\"\nselect = [\"force_x\", \"torque_y\"]\ntarget = [\"t\", 0.0]\n{all}"),
        ),
        cost("contact_force", &format!("contact = \"wall\"\ntarget = \"t\"\nsmoothing = \"g\"\n{all}")),
        cost("penetration", &format!("contact = \"wall\"\ntarget = \"t\"\n{all}")),
        cost(
            "frame_turn",
            &format!("frame = \"tool\"\nreference = [0.0, 0.5, 0.1]\ntarget = [0.0, \"t\", 0.1]\n{all}"),
        ),
        cost("frame_velocity", &format!("frame = \"tool\"\nselect = [\"vx\", \"wy\"]\ntarget = [\"t\", 0.0]\n{all}")),
        cost(
            "joint_velocity",
            "target = [0.1, \"t\", 0.0]\nweight = [\"a\", 0.0, 0.3]\nfinal_weight = [0.2, \"b\", 0.0]\n\
             norm = { absolute = { smoothing = \"s\" } }",
        ),
        cost("clearance", &format!("contact = \"wall\"\ntarget = \"t\"\n{all}")),
        cost("center_of_mass", &format!("axes = [\"x\", \"z\"]\ntarget = [\"t\", 0.5]\n{all}")),
        cost(
            "coupling_deflection",
            &format!("coupling = \"gripper\"\ntarget = [0.0, 0.0, 0.0, 0.0, \"t\", 0.0]\n{all}"),
        ),
        cost("joint_torque", &format!("target = \"t\"\n{all}")),
        cost("signal", &format!("select = [\"gripper.force_x\"]\ntarget = \"t\"\n{all}")),
        cost("control", &format!("target = [\"t\", 0.0, 0.1]\n{each}")),
        cost("drive_effort", &format!("target = [\"t\", 0.0, 0.1]\n{each}")),
        cost("power", &format!("target = [\"t\", 0.0, 0.0]\n{each}")),
        cost("joint_acceleration", &format!("select = [\"elbow\"]\ntarget = \"t\"\n{each}")),
        cost("state_and_control", &format!("target = [\"t\"{}]\n{each}", ", 0.0".repeat(11))),
    ];
    let control = cost("control", "weight = 0.01") + &cost("joint_velocity", "weight = 0.02");
    let mut list: Vec<Description> = list
        .into_iter()
        .map(|cost| {
            let mut description = equipped().costing(&(cost.clone() + &control));
            let values = [("a", 0.7), ("b", 1.2), ("s", 0.3), ("t", 0.2), ("l", 0.4), ("g", 0.5)];
            let used = values.iter().filter(|(name, _)| cost.contains(&format!("\"{name}\"")));
            description.parameters = used.copied().collect();
            description
        })
        .collect();
    let file = cost("file", &format!("select = [\"angle\", \"place\"]\ntarget = [\"t\", 0.3, 0.0, 0.5]\n{all}"));
    let values = [("a", 0.7), ("b", 1.2), ("s", 0.3), ("t", 0.2)];
    list.push(Description { time_step: "0.002".into(), ..servo().costing(&(file + &control)) }.where_(&values));
    list.push(quadratic());
    list
}

fn quadratic() -> Description {
    let matrix = |order: usize, diagonal: &str| {
        let entry = |i, j| {
            if i == j {
                diagonal
            } else if i + j == 1 {
                "\"c\""
            } else {
                "0.0"
            }
        };
        let row = |i| format!("[{}]", (0..order).map(|j| entry(i, j)).collect::<Vec<_>>().join(", "));
        format!("[{}]", (0..order).map(row).collect::<Vec<_>>().join(", "))
    };
    let keys = format!("Q = {}\nR = {}\nfinal = {}", matrix(6, "\"q\""), matrix(3, "\"r\""), matrix(6, "2.0"));
    arm().costing(&cost("quadratic", &keys)).where_(&[("q", 1.5), ("r", 0.2), ("c", 0.05)])
}

/// All of them.
pub fn all() -> Vec<Description> {
    [of_compliance(), of_sensors(), of_numbers(), of_substeps(), of_costs()].concat()
}
