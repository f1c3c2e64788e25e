//! Rules of thumb for the numbers of a task. docs/choosing.md explains them.

use std::f64::consts::PI;

use supple_robot::vector::dot;
use supple_text::{digits, nearest, quoted, short, significant};

use super::limb::Limb;
use super::place::{LOADED, Start};
use crate::failure::Failure;
use crate::template::Template;

/// Greatest force that a task presses with, N.
const FORCE: f64 = 10.0;
/// Share of the force that the drives can sustain.
const SHARE: f64 = 0.25;
/// Maximum mass of a tool, kg; maximum sag of the softest mount under its weight, m; and minimum natural frequency of
/// the tool on that mount, Hz.
const HEAVIEST: f64 = 5.0;
const SAG: f64 = 0.02;
const SLOWEST: f64 = 1.0;
/// Ratio of the stiffness of the stiff mount to that of the softest.
const SOFTER: f64 = 40.0;
/// Maxima of the wall's position uncertainty, of a joint sensor's noise at the tool, and of the characteristic
/// deflection, m; an arm with a reach of one metre has these values.
const WALL: f64 = 0.005;
const TIP: f64 = 0.002;
const DEFLECTION: f64 = 0.02;
/// Minimum and maximum number of steps, and maximum time step in between, s: longer steps are too coarse for drives
/// of 10 Hz and for mounts.
const STEPS: [usize; 2] = [200, 2000];
const STEP: f64 = 5e-3;
/// Stiffness of the mount of a freely moving tool, relative to that of a pressing tool.
const FREE: f64 = 0.2;
/// Share of the task's time within which joints accelerate to their characteristic speed.
const SPEEDING_UP: f64 = 0.2;

/// How many times the force that the drives sustain may be asked for, and the longest time of a task, s.
const MOST_FORCE: f64 = 10.0;
const LONGEST: f64 = 1000.0;
/// What lengths are at most.
const REACH: &str = "m, the reach of the limb";

/// The numbers of a task, in SI units.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Force that the tool presses with, N.
    pub force: f64,
    /// How far it moves along a wall, into a hole or through the air, m.
    pub travel: f64,
    /// How far it is from the wall at first, m.
    pub clearance: f64,
    /// How long it takes, s.
    pub time: f64,
    /// Mass of the tool beyond the mount, kg.
    pub mass: f64,
    /// Stiffness of the stiff mount, N/m.
    pub stiffness: f64,
    /// Deflection of the mount that matters, m.
    pub deflection: f64,
    /// Deviation from the target position that matters, m.
    pub tolerance: f64,
    /// Standard deviation of the wall's position, m.
    pub wall_sd: f64,
    /// Length over which the contact sets in, m.
    pub smoothing: f64,
    /// Standard deviation of the precise force sensor, N.
    pub force_sd: f64,
    /// Standard deviation of a joint's sensor, seen at the tool, m.
    pub tip_sd: f64,
    /// Natural frequency of position-controlled joints, Hz.
    pub bandwidth: f64,
    /// Speed over which joints wander in a second, rad/s or m/s.
    pub disturbance: f64,
    /// Where the cost limit lies between the costs with the precise and the coarsest sensor: 0 to 1.
    pub margin: f64,
}

impl Rules {
    /// Rules for a limb in a posture; `longer` scales the contact's smoothing length.
    ///
    /// # Errors
    /// If `set` contains an unknown number or an invalid value.
    pub fn of(limb: &Limb, start: &Start, template: Template, set: &[String], longer: f64) -> Result<Self, Failure> {
        let most = round(FORCE.min(SHARE * start.sustained).min(FORCE * limb.reach / 0.5));
        let mut rules = Self {
            force: if template == Template::Insert { round(0.2 * most) } else { most },
            travel: round(0.1 * limb.reach),
            clearance: 0.0,
            time: 1.0,
            mass: round(0.02 * limb.mass).min(HEAVIEST),
            stiffness: 0.0,
            deflection: round(0.02 * limb.reach).min(DEFLECTION),
            tolerance: 0.0,
            wall_sd: round(0.005 * limb.reach).min(WALL),
            smoothing: 0.0,
            force_sd: 0.0,
            tip_sd: round(0.001 * limb.reach).min(TIP),
            bandwidth: 10.0,
            disturbance: if template == Template::Hold { 0.1 } else { 0.02 },
            margin: 0.25,
        };
        let given = set.iter().map(|setting| rules.set(setting)).collect::<Result<Vec<_>, _>>()?;
        if rules.force <= 0.0 && template != Template::Reach && !given.contains(&"force") {
            return Err(no_force(limb, start));
        }
        if given.contains(&"travel") {
            rules.check_travel(limb, template)?;
        }
        rules.check_sizes(&given, limb, start)?;
        // In order: later rules use earlier numbers.
        let unless_given = |name: &str, number: &mut f64, rule: f64| {
            if !given.contains(&name) {
                *number = rule;
            }
        };
        // The weight of the tool on the springs whose stiffness is designed.
        let axes = [start.along[0], start.along[1], start.normal];
        let yielding = axes.iter().zip(template.yields()).filter(|(_, yields)| *yields);
        let weight = rules.mass * yielding.map(|(axis, _)| dot(*axis, limb.gravity).powi(2)).sum::<f64>().sqrt();
        let least = (weight / SAG).max(rules.mass * (2.0 * PI * SLOWEST).powi(2));
        // On a stiff mount, a freely moving tool would oscillate too fast for the time step.
        let share = if template == Template::Reach { FREE } else { 1.0 };
        let stiffness = round(share * 1e3 * rules.force / limb.reach);
        let stiffness = if stiffness < SOFTER * least { round_up(SOFTER * least) } else { stiffness };
        unless_given("stiffness", &mut rules.stiffness, stiffness);
        unless_given("force_sd", &mut rules.force_sd, four_digits(0.05 * rules.force));
        unless_given("tolerance", &mut rules.tolerance, round(0.05 * rules.travel));
        unless_given("smoothing", &mut rules.smoothing, four_digits(longer * 3.5 * rules.wall_sd));
        Ok(rules)
    }

    /// Whether given numbers are of a size that the limb can have to do with.
    fn check_sizes(&self, given: &[&str], limb: &Limb, start: &Start) -> Result<(), Failure> {
        let strongest = if start.sustained > 0.0 { MOST_FORCE * start.sustained } else { f64::INFINITY };
        let sizes = [
            ("force", self.force, strongest, "N, ten times what the drives sustain"),
            ("time", self.time, LONGEST, "s"),
            ("clearance", self.clearance, limb.reach, REACH),
            ("deflection", self.deflection, limb.reach, REACH),
            ("tolerance", self.tolerance, limb.reach, REACH),
            ("wall_sd", self.wall_sd, limb.reach, REACH),
            ("smoothing", self.smoothing, limb.reach, REACH),
            ("tip_sd", self.tip_sd, limb.reach, REACH),
        ];
        match sizes.into_iter().find(|(name, value, most, _)| given.contains(name) && value > most) {
            None => Ok(()),
            Some((name, value, most, unit)) => Err(Failure::usage(format!(
                "--set {name}: must be at most {} {unit}; found {}",
                short(most, 3),
                digits(value)
            ))),
        }
    }

    /// Whether the tool can move so far: along a line from end to end of its reach, or with a door by half a turn.
    fn check_travel(&self, limb: &Limb, template: Template) -> Result<(), Failure> {
        let found = digits(self.travel);
        if template == Template::Handle {
            let width = door_width(limb);
            let (most, opening) = (significant(PI * width, 3), short(self.travel / width, 3));
            if self.travel > most.max(PI * width) {
                return Err(Failure::usage(format!(
                    "--set travel: the handle moves along an arc around the hinge, {} m away, by at most {} m, half a turn; \
                     found {found}, which opens the door by {opening} rad",
                    digits(width),
                    digits(most)
                )));
            }
        } else if limb.is_bounded() && self.travel > 2.0 * limb.span {
            let most = short(2.0 * limb.span, 3);
            return Err(Failure::usage(format!(
                "--set travel: the tool at `{}` can move by {most} m at most, from end to end; found {found}",
                limb.frame()
            )));
        }
        Ok(())
    }

    fn set(&mut self, setting: &str) -> Result<&'static str, Failure> {
        let wrong = |what: String| Failure::usage(format!("--set {setting}: {what}"));
        let mut numbers = [
            ("force", &mut self.force),
            ("travel", &mut self.travel),
            ("clearance", &mut self.clearance),
            ("time", &mut self.time),
            ("mass", &mut self.mass),
            ("stiffness", &mut self.stiffness),
            ("deflection", &mut self.deflection),
            ("tolerance", &mut self.tolerance),
            ("wall_sd", &mut self.wall_sd),
            ("smoothing", &mut self.smoothing),
            ("force_sd", &mut self.force_sd),
            ("tip_sd", &mut self.tip_sd),
            ("bandwidth", &mut self.bandwidth),
            ("disturbance", &mut self.disturbance),
            ("margin", &mut self.margin),
        ];
        let Some((name, value)) = setting.split_once('=') else { return Err(wrong("write NAME=VALUE".into())) };
        let names = numbers.each_ref().map(|(name, _)| *name);
        let Some((name, number)) = numbers.iter_mut().find(|(known, _)| *known == name.trim()) else {
            let hint = nearest(name.trim(), &names).map_or_else(String::new, |hint| format!(" ({hint})"));
            return Err(wrong(format!("templates have the numbers {}{hint}", quoted(&names))));
        };
        let value: f64 = value.trim().parse().map_err(|_| wrong("the value is not a number".into()))?;
        let found = digits(value);
        match *name {
            "margin" if !(value > 0.0 && value < 1.0) => {
                return Err(wrong(format!("must be above 0 and below 1; found {found}")));
            }
            "clearance" if value == 0.0 => {}
            _ if !(value.is_finite() && value > 0.0) => return Err(wrong(format!("must be above 0; found {found}"))),
            _ => {}
        }
        **number = value;
        Ok(name)
    }

    /// How many steps it takes.
    pub fn steps(&self) -> usize {
        let [least, most] = STEPS;
        // But for rounding.
        ((self.time / STEP - 1e-6).ceil() as usize).clamp(least, most)
    }

    /// Time step, s.
    pub fn time_step(&self) -> f64 {
        four_digits(self.time / self.steps() as f64)
    }

    /// The softest mount, N/m: the force deflects it by 40 times the deflection of the stiff one.
    pub fn soft(&self) -> f64 {
        four_digits(self.stiffness / SOFTER)
    }

    /// Damping of the stiff mount, N s/m: half of critical.
    pub fn damping(&self) -> f64 {
        four_digits((self.stiffness * self.mass).sqrt())
    }

    /// Stiffness of the wall, N/m: under the force, the penetration equals the smoothing length.
    pub fn wall_stiffness(&self) -> f64 {
        four_digits(self.force / self.smoothing)
    }

    /// Standard deviation of a joint's sensor, rad, or m where all slide; of a slide it is [`Rules::tip_sd`].
    pub fn joint_sd(&self, limb: &Limb) -> f64 {
        round(self.tip_sd / limb.lever())
    }

    /// The weight of a term: 1 where it is off by `tolerance` all the time.
    pub fn weight(&self, tolerance: f64) -> f64 {
        four_digits(1.0 / (self.steps() as f64 * tolerance * tolerance))
    }

    /// The weight of a final term: 1 where it is off by `tolerance` at the end.
    pub fn final_weight(&self, tolerance: f64) -> f64 {
        four_digits(1.0 / (tolerance * tolerance))
    }

    /// Characteristic speed of sliding joints, m/s, or of turning joints, rad/s: ten times the mean speed of the travel,
    /// and at most half of the lowest speed limit of these joints.
    pub fn joint_speed(&self, limb: &Limb, slides: bool) -> f64 {
        let lever = if slides { 1.0 } else { limb.lever() };
        round(10.0 * self.travel / (self.time * lever)).min(four_digits(0.5 * limb.slowest(slides)))
    }

    /// Characteristic acceleration of these joints, m/s^2 or rad/s^2: reaches their speed in a fifth of the time. Without
    /// this term, commands would cost nothing and might demand more than real drives can follow.
    pub fn joint_acceleration(&self, limb: &Limb, slides: bool) -> f64 {
        four_digits(self.joint_speed(limb, slides) / (SPEEDING_UP * self.time))
    }

    /// Speed over which Coulomb friction builds up, rad/s, or m/s if all joints slide: half of the characteristic speed,
    /// so that the linearisation captures friction in motion instead of a brake at rest.
    pub fn friction_smoothing(&self, limb: &Limb) -> f64 {
        four_digits(0.5 * self.joint_speed(limb, limb.slides()))
    }

    /// Tolerated deviation of a position command from the one that holds the start, rad, or m if all joints slide: three
    /// times the travel.
    pub fn command(&self, limb: &Limb) -> f64 {
        four_digits(3.0 * round(self.travel / limb.lever()))
    }

    /// Tolerated torque beyond that which supports the robot, N m, or N if all joints slide: that of the contact force, or
    /// of friction and damping at the characteristic speed, if greater.
    pub fn load(&self, limb: &Limb) -> f64 {
        let slides = limb.slides();
        let speed = self.joint_speed(limb, slides);
        let resistance = limb.of_kind(slides).map(|joint| joint.friction + joint.damping * speed).fold(0.0, f64::max);
        round(resistance.max(self.force * limb.lever()))
    }
}

/// Width of the door of `handle`, m.
pub fn door_width(limb: &Limb) -> f64 {
    round(0.3 * limb.reach)
}

/// Rounds to the nearest of 1, 2 or 5 times a power of ten.
pub fn round(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return value;
    }
    let decade = 10.0_f64.powf(value.log10().floor());
    let near = |a: &f64, b: &f64| (a / (value / decade)).ln().abs().total_cmp(&(b / (value / decade)).ln().abs());
    let first = [1.0, 2.0, 5.0, 10.0].into_iter().min_by(near).unwrap_or(1.0);
    four_digits(first * decade)
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = 10.0_f64.powf(value.log10().floor());
    let above = |first: &f64| first * decade >= value * (1.0 - 1e-9);
    four_digits([1.0, 2.0, 5.0].into_iter().find(above).unwrap_or(10.0) * decade)
}

/// A number with four digits.
pub fn four_digits(value: f64) -> f64 {
    significant(value, 4)
}

/// A number with six digits, without a sign where it is 0.
pub fn plain(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { significant(value, 6) }
}

/// The error that the drives have no force left at a start, and which joints need their effort already.
fn no_force(limb: &Limb, start: &Start) -> Failure {
    let loads = start.held.iter().zip(limb.efforts()).zip(limb.joints());
    let said = loads.filter(|((held, effort), _)| held.abs() >= LOADED * effort).map(|((held, effort), joint)| {
        format!("holding joint `{joint}` takes {} of the {} of its drive", short(held.abs(), 3), short(effort, 3))
    });
    let said: Vec<String> = said.collect();
    let why = if said.is_empty() { String::new() } else { format!(": {}", said.join(", ")) };
    Failure::usage(format!(
        "in no posture found can the drives press on a wall{why}, which includes springs of the robot file; give the force as \
         `--set force=..`, choose another --frame or --at, or take the effort of joints without drives out of the file"
    ))
}
