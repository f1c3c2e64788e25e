//! Rules of thumb for the numbers of a task. docs/choosing.md explains them.

use supple_text::{nearest, quoted};

use super::limb::Limb;
use super::place::Start;
use crate::failure::Failure;
use crate::template::Template;

/// Greatest force that a task presses with, N.
const FORCE: f64 = 10.0;
/// Share of the force that the drives can sustain.
const SHARE: f64 = 0.25;
/// Steps of a task.
pub const STEPS: usize = 100;

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
    /// Deviation from the target position that matters, m.
    pub tolerance: f64,
    /// Standard deviation of the wall's position, m.
    pub wall_sd: f64,
    /// Standard deviation of the precise force sensor, N.
    pub force_sd: f64,
    /// Standard deviation of a joint's sensor, seen at the tool, m.
    pub tip_sd: f64,
    /// Speed over which joints wander in a second, rad/s or m/s.
    pub disturbance: f64,
    /// The limit of the cost, as a multiple of that of the stiff design.
    pub margin: f64,
}

impl Rules {
    /// Those of a limb in a posture.
    ///
    /// # Errors
    /// Where `set` names what is no number of a task, or a value that cannot be.
    pub fn of(limb: &Limb, start: &Start, template: Template, set: &[String]) -> Result<Self, Failure> {
        let force = round(FORCE.min(SHARE * start.sustained).min(FORCE * limb.reach / 0.5));
        let travel = round(0.1 * limb.reach);
        let clearance = round(0.01 * limb.reach);
        let mut rules = Self {
            force,
            travel,
            clearance,
            time: match template {
                Template::Press | Template::Insert => 0.5,
                _ => 1.0,
            },
            mass: round(0.02 * limb.mass),
            stiffness: round(1e3 * force),
            tolerance: round(0.05 * travel),
            wall_sd: round(0.2 * clearance),
            force_sd: 0.02 * force,
            tip_sd: round(0.02 * clearance),
            disturbance: if template == Template::Hold { 0.1 } else { 0.02 },
            margin: 1.2,
        };
        let given = set.iter().map(|setting| rules.set(setting)).collect::<Result<Vec<_>, _>>()?;
        if !given.contains(&"stiffness") {
            rules.stiffness = round(1e3 * rules.force);
        }
        if !given.contains(&"force_sd") {
            rules.force_sd = digits(0.02 * rules.force);
        }
        if !given.contains(&"tolerance") {
            rules.tolerance = round(0.05 * rules.travel);
        }
        Ok(rules)
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
            ("tolerance", &mut self.tolerance),
            ("wall_sd", &mut self.wall_sd),
            ("force_sd", &mut self.force_sd),
            ("tip_sd", &mut self.tip_sd),
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
        let least = if *name == "margin" { 1.0 } else { 0.0 };
        if !(value.is_finite() && value > least) {
            return Err(wrong(format!("must be above {least}; found {}", supple_text::digits(value))));
        }
        **number = value;
        Ok(name)
    }

    /// Time step, s.
    pub fn time_step(&self) -> f64 {
        digits(self.time / STEPS as f64)
    }

    /// The softest mount, N/m: the force deflects it by 40 times the deflection of the stiff one.
    pub fn soft(&self) -> f64 {
        digits(self.stiffness / 40.0)
    }

    /// Damping of the stiff mount, N s/m: half of critical.
    pub fn damping(&self) -> f64 {
        round((self.stiffness * self.mass).sqrt())
    }

    /// Stiffness of the wall, N/m: the force goes as deep as the contact sets in.
    pub fn wall_stiffness(&self) -> f64 {
        digits(self.force / self.smoothing())
    }

    /// Clearance at which the contact sets in, m: 2.5 deviations of the wall's position, within which filters see it.
    pub fn smoothing(&self) -> f64 {
        digits(2.5 * self.wall_sd)
    }

    /// Standard deviation of a joint's sensor, rad, or m where all slide; of a slide it is [`Rules::tip_sd`].
    pub fn joint_sd(&self, limb: &Limb) -> f64 {
        round(self.tip_sd / limb.lever())
    }

    /// The weight of a term: 1 where it is off by `tolerance` all the time.
    pub fn weight(&self, tolerance: f64) -> f64 {
        digits(1.0 / (STEPS as f64 * tolerance * tolerance))
    }

    /// Speed of joints that matters, rad/s, or m/s where all slide: that of the travel within the time.
    pub fn joint_speed(&self, limb: &Limb) -> f64 {
        round(self.travel / (self.time * limb.lever()))
    }

    /// Load that controls are measured by, N m, or N where all joints slide: half of what holds the robot up, or presses.
    pub fn load(&self, limb: &Limb, start: &Start) -> f64 {
        let held = start.held.iter().fold(0.0, |most: f64, held| most.max(held.abs()));
        round(0.5 * held.max(self.force * limb.lever()))
    }
}

/// The number 1, 2 or 5 times a power of ten next to a number.
pub fn round(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return value;
    }
    let decade = 10.0_f64.powf(value.log10().floor());
    let near = |a: &f64, b: &f64| (a / (value / decade)).ln().abs().total_cmp(&(b / (value / decade)).ln().abs());
    let first = [1.0, 2.0, 5.0, 10.0].into_iter().min_by(near).unwrap_or(1.0);
    digits(first * decade)
}

/// A number with four digits.
pub fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
