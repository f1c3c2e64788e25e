//! How an actuator's force depends on its control: gain, bias and dynamics, from its class and from itself.
//!
//! All kinds of actuators are `general` ones with certain numbers, and share their defaults.

use supple_text::FileError;

use super::super::xml::Element;
use crate::Law;

/// How many numbers `gainprm` and `biasprm` hold at most.
const MOST: usize = 10;
/// Kinds of actuators that are read.
pub(super) const LAWS: [&str; 4] = ["general", "motor", "position", "velocity"];

/// Words for the filter of a control: whether there is no filter.
const DYNAMICS: [(&str, bool); 7] = [
    ("none", true),
    ("integrator", false),
    ("filter", false),
    ("filterexact", false),
    ("muscle", false),
    ("user", false),
    ("dcmotor", false),
];
/// Words for the gain type: whether the gain is a plain number.
const GAINS: [(&str, bool); 5] =
    [("fixed", true), ("affine", false), ("muscle", false), ("user", false), ("dcmotor", false)];
/// Words for biases: none, affine in length and rate, or other.
const BIASES: [(&str, Bias); 5] = [
    ("none", Bias::None),
    ("affine", Bias::Affine),
    ("muscle", Bias::Other),
    ("user", Bias::Other),
    ("dcmotor", Bias::Other),
];

/// What is added to the product of gain and control.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Bias {
    None,
    Affine,
    Other,
}

/// Gain and bias during reading: those of a class, overridden by an actuator that uses the class.
#[derive(Clone, Copy)]
pub(super) struct Numbers {
    /// The last kind other than `general` that set the numbers.
    kind: &'static str,
    gain: f64,
    bias: [f64; 3],
    /// Whether the gain is a number.
    fixed: bool,
    affine: Bias,
    /// Whether the control acts without delay.
    direct: bool,
}

impl Default for Numbers {
    fn default() -> Self {
        Self { kind: "", gain: 1.0, bias: [0.0; 3], fixed: true, affine: Bias::None, direct: true }
    }
}

impl Numbers {
    /// Applies an element, which belongs to a class or is an actuator.
    ///
    /// # Errors
    /// Where a number or a word is not valid.
    pub(super) fn update(&mut self, at: Element) -> Result<(), FileError> {
        match at.tag() {
            "general" => {
                self.direct = at.choice("dyntype", &DYNAMICS)?.unwrap_or(self.direct);
                self.fixed = at.choice("gaintype", &GAINS)?.unwrap_or(self.fixed);
                self.affine = at.choice("biastype", &BIASES)?.unwrap_or(self.affine);
                let mut gain = [self.gain];
                overlay(at, "gainprm", &mut gain)?;
                [self.gain] = gain;
                overlay(at, "biasprm", &mut self.bias)?;
            }
            "motor" => *self = Self { kind: "motor", ..Self::default() },
            "position" => {
                self.become_kind("position");
                let kp = least_zero(at, "kp")?.unwrap_or(self.gain);
                (self.gain, self.bias[1]) = (kp, -kp);
                match (least_zero(at, "kv")?, least_zero(at, "dampratio")?) {
                    (Some(_), Some(_)) => {
                        return Err(at.error_at("dampratio", "give either `kv` or `dampratio`, not both"));
                    }
                    (Some(kv), None) => self.bias[2] = -kv,
                    (None, Some(ratio)) => self.bias[2] = ratio,
                    (None, None) => {}
                }
                if let Some(time) = least_zero(at, "timeconst")? {
                    self.direct = time == 0.0;
                }
                (self.fixed, self.affine) = (true, Bias::Affine);
            }
            "velocity" => {
                self.become_kind("velocity");
                let kv = least_zero(at, "kv")?.unwrap_or(self.gain);
                (self.gain, self.bias) = (kv, [0.0, 0.0, -kv]);
                (self.fixed, self.affine, self.direct) = (true, Bias::Affine, true);
            }
            // Another kind, which is not modelled; nor are actuators that inherit numbers from it.
            _ => (self.kind, self.fixed) = ("other", false),
        }
        Ok(())
    }

    /// Resets the numbers if the kind changes, as they would mean something else.
    fn become_kind(&mut self, kind: &'static str) {
        if !matches!(self.kind, "" | "other") && self.kind != kind {
            *self = Self::default();
        }
        self.kind = kind;
    }

    /// The law and, where its damping is given by a ratio, without damping and with this ratio; or why it cannot be modelled.
    pub(super) fn law(&self) -> Result<(Law, Option<f64>), &'static str> {
        if !self.direct {
            return Err(
                "its control is filtered: only actuators whose force follows the control at once are supported",
            );
        }
        if !self.fixed {
            return Err("its gain is not a plain number: only `gaintype` \"fixed\" is supported");
        }
        let [offset, slope, rate] = match self.affine {
            Bias::None => [0.0; 3],
            Bias::Affine => self.bias,
            Bias::Other => return Err("its bias is neither `none` nor `affine`"),
        };
        // A positive number of a position servo is a ratio, whichever kind of element gives it.
        let ratio = Some(rate).filter(|rate| *rate > 0.0 && slope == -self.gain && self.gain != 0.0);
        let rate = if ratio.is_some() { 0.0 } else { rate };
        // Avoids negative zero.
        Ok((Law::new(self.gain, offset, 0.0 - slope, 0.0 - rate), ratio))
    }
}

/// Overwrites the first numbers with those of a list.
fn overlay(at: Element, name: &str, into: &mut [f64]) -> Result<(), FileError> {
    let Some(found) = at.list(name)? else { return Ok(()) };
    if found.len() > MOST {
        return Err(at.error_at(name, format!("`{name}` is at most {MOST} numbers, and has {}", found.len())));
    }
    into.iter_mut().zip(found).for_each(|(into, found)| *into = found);
    Ok(())
}

/// A number that is at least 0, where there is one.
fn least_zero(at: Element, name: &str) -> Result<Option<f64>, FileError> {
    match at.number(name)? {
        Some(number) if number < 0.0 => Err(at.error_at(name, format!("`{name}` must be at least 0; found {number}"))),
        number => Ok(number),
    }
}
