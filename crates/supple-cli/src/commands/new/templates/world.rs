//! What the tool meets: walls and doors.

use std::fmt::Write;

use supple_robot::vector::{add, scale};

use super::{Draft, Template, list, said};
use crate::commands::new::rules::{door_width, four_digits, plain, round};

impl Draft<'_> {
    /// The direction that the mount yields in for an insert: along x of the mount.
    pub(super) fn side(&self) -> [f64; 3] {
        self.start.along[0]
    }

    pub(super) fn world(&self, text: &mut String) {
        let Self { start, rules, template, .. } = self;
        let (smoothing, apart) = (rules.smoothing, rules.clearance);
        let contact = |text: &mut String, normal: [f64; 3], point: [f64; 3], friction: f64| {
            let _ = write!(
                text,
                "\n[[model.compliance]]\nkind = \"contact\"\nname = \"wall\"\nframe = {:?}\n",
                self.mount_name()
            );
            said(text, &format!("normal = {}", list(&normal)), "outward");
            said(text, &format!("point = {}", list(&point)), "m");
            said(
                text,
                &format!("stiffness = {:?}", rules.wall_stiffness()),
                &format!("N/m: {:?} N go {smoothing:?} m deep", rules.force),
            );
            said(text, "dissipation = 1.0", "s/m");
            said(text, &format!("smoothing = {smoothing:?}"), "m: the clearance at which force begins");
            if friction > 0.0 {
                let _ = writeln!(text, "friction = {friction:?}");
                said(text, &format!("slip = {:?}", four_digits(0.25 * rules.travel / rules.time)), "m/s");
            }
        };
        match template {
            Template::Press => contact(text, start.normal, self.before(apart), 0.0),
            Template::Hold => contact(text, start.normal, start.position, 0.0),
            Template::Wipe => contact(text, start.normal, self.before(apart), 0.2),
            Template::Insert => {
                let side = self.side();
                let point = add(start.position, scale(apart, side));
                contact(text, scale(-1.0, side), point, 0.2);
            }
            Template::Reach => {}
            Template::Handle => self.door(text),
        }
    }

    /// A point of the wall at a distance from the tool.
    pub(super) fn before(&self, distance: f64) -> [f64; 3] {
        add(self.start.position, scale(-distance, self.start.normal))
    }

    /// Width of the door, m.
    fn width(&self) -> f64 {
        door_width(self.limb)
    }

    /// How far it opens, rad.
    pub fn opening(&self) -> f64 {
        four_digits(self.rules.travel / self.width())
    }

    /// Tolerance of that angle at the end, rad.
    pub fn opening_tolerance(&self) -> f64 {
        four_digits(0.1 * self.opening())
    }

    /// Standard deviation of the direction from the handle to the hinge, rad: the hinge is off sideways by twice as much as
    /// a wall.
    pub(super) fn direction_sd(&self) -> f64 {
        2.0 * self.rules.wall_sd / self.width()
    }

    /// The handle in the door's frame, whose axes are x, z and -y of the mount: shifted by the tool's sag.
    fn sagged(&self, width: f64) -> String {
        let [x, y, z] = self.loads();
        let entry = |at: f64, load: f64| match load {
            0.0 => format!("{:?}", plain(at)),
            _ if at == 0.0 => format!("\"{load:?} / k\""),
            _ => format!("\"{:?} + {load:?} / k\"", plain(at)),
        };
        format!("[{}, {}, {}]", entry(-width, x), entry(0.0, z), entry(0.0, -y))
    }

    fn door(&self, text: &mut String) {
        let Self { limb, start, rules, .. } = self;
        // The hinge is to the side of the handle, against y of the mount: pulling turns it by a positive angle.
        let (width, [x, y]) = (self.width(), start.along);
        let z = scale(-1.0, y);
        let columns = [x, [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]], z];
        let pitch = (-columns[0][2]).atan2(columns[1][2].hypot(columns[2][2]));
        let rpy = [columns[1][2].atan2(columns[2][2]), pitch, columns[0][1].atan2(columns[0][0])];
        let (hinge, door, mass) = (self.hinge_name(), self.door_name(), round(0.1 * limb.mass));
        let _ = write!(
            text,
            "\n# A door. The tool hooks its handle, so the robot knows where the handle is, but not in which direction from there the\n\
             # hinge is, and so not along which arc the handle moves. That direction, the x axis, is the angle of a joint at the\n\
             # handle with so much damping that it hardly turns.\n\
             [[model.insert]]\nname = {hinge:?}\nframe = {:?}\nposition = {}\nrpy = {}\naxes = [\"rz\"]\n",
            limb.planning.robot.links[0].name,
            list(&start.position),
            list(&rpy),
        );
        let creep = four_digits(rules.force * width * rules.time / (0.02 * self.direction_sd()));
        said(text, &format!("damping = {creep:?}"), "N m s/rad");
        let _ = write!(
            text,
            "\n[[model.insert]]\nname = {door:?}\nframe = {hinge:?}\nposition = {}\naxes = [\"rz\"]\n",
            list(&[width, 0.0, 0.0]),
        );
        said(text, &format!("mass = {mass:?}"), "kg");
        said(text, &format!("center = {}", list(&[-0.5 * width, 0.0, 0.0])), "m");
        let moment = mass * width * width / 12.0;
        said(text, &format!("inertia = {}", list(&[moment * 0.1, moment, moment])), "kg m^2");
        let closer = four_digits(rules.force * width / self.opening());
        said(text, &format!("stiffness = {closer:?}"), &format!("N m/rad: {:?} N hold the door open", rules.force));
        said(text, &format!("damping = {:?}", four_digits(0.05 * rules.force * width)), "N m s/rad");
        // If stiffer and less damped, it would oscillate within a time step, and an initial uncertainty of half a millimetre
        // would cause forces of a hundred newtons.
        let k = four_digits(2.0 * rules.stiffness);
        let d = four_digits(2.0 * (k * rules.mass).sqrt());
        let handle = limb.free_name("handle");
        let _ = write!(
            text,
            "\n# The position of the tool, sagging in its mount, at the start: the hook then carries no load.\n\
             [model.frames.{handle}]\non = {door:?}\nposition = {}\n\n# The tool hooks the handle: it may turn there.\n\
             [[model.compliance]]\nkind = \"bushing\"\nname = \"hook\"\nframe_a = {handle:?}\nframe_c = {:?}\n",
            self.sagged(width),
            self.mount_name(),
        );
        said(text, &format!("stiffness = [{k:?}, {k:?}, {k:?}]"), "N/m");
        said(text, &format!("damping = [{d:?}, {d:?}, {d:?}]"), "N s/m");
        let _ = writeln!(text, "torsional_stiffness = [0.0, 0.0, 0.0]\ntorsional_damping = [0.0, 0.0, 0.0]");
    }
}
