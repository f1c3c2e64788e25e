//! What quantities may refer to by name.

use supple_text::{nearest_few, quoted};

use crate::channels::{Channel, Channels, Drive};
use crate::document::Unfit;
use crate::physics::{DependentJoint, FileSensor, Model, frame_signals};

/// What quantities may refer to: the names and sizes of the model.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct Vocabulary {
    /// Names and units of states and controls.
    pub channels: Channels,
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the joints, whose states are `q.NAME` and `v.NAME`.
    pub joints: Vec<String>,
    /// The joints that do not move on their own.
    pub dependent: Vec<DependentJoint>,
    /// Names of the frames, whose signals come first.
    pub frames: Vec<String>,
    /// Names of the model's signals.
    pub signals: Vec<String>,
    /// Names of the elements of compliance, whose signals are `NAME.FORCE`.
    pub couplings: Vec<String>,
    /// Elastic joints, each with the element of compliance whose `q.NAME` and `v.NAME` are the states of its motor.
    pub motors: Vec<(String, String)>,
    /// The drives, in the order of the controls; empty if they have no joints.
    pub drives: Vec<Drive>,
    /// Sensors of the robot's file.
    pub file_sensors: Vec<FileSensor>,
}

/// Up to so many signals, the error for an unknown one lists all; otherwise so many of the nearest.
const FEW_SIGNALS: usize = 20;
const NEAREST_SIGNALS: usize = 6;

/// Prefix of compliance signals that are deflections rather than forces.
pub const DEFLECTION: &str = "deflection";

impl Vocabulary {
    /// The names and sizes of a model.
    pub fn of<M: Model>(model: &M) -> Self {
        Self {
            channels: model.channels(),
            states: model.state_names(),
            joints: model.joint_names(),
            dependent: model.dependent_joints(),
            frames: model.frame_names(),
            signals: model.signals(),
            couplings: model.coupling_names(),
            motors: model.motors(),
            drives: model.drives(),
            file_sensors: model.file_sensors(),
        }
    }

    /// How many controls there are.
    #[must_use]
    pub fn controls(&self) -> usize {
        self.channels.controls.len()
    }

    /// The place of a state.
    pub fn state(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        self.states.iter().position(|state| state == name).ok_or_else(|| {
            let what = format!("the model has no state `{name}`");
            self.if_dependent(key, name).unwrap_or_else(|| Unfit::unknown(key, &what, name, &self.states))
        })
    }

    /// The channel of a state; without a unit where the model gives none.
    #[must_use]
    pub fn state_channel(&self, place: usize) -> Channel {
        let named = || Channel::new(self.states.get(place).map_or("", String::as_str), "");
        self.channels.states.get(place).cloned().unwrap_or_else(named)
    }

    /// The name of a signal.
    pub fn signal_name(&self, place: usize) -> &str {
        self.signals.get(place).map_or("", String::as_str)
    }

    /// The error if the name of a joint, or of one of its states, belongs to one that does not move on its own.
    fn if_dependent(&self, key: &'static str, name: &str) -> Option<Unfit> {
        let (message, help) = DependentJoint::message(name, &self.dependent)?;
        Some(Unfit { help: Some(help), ..Unfit::new(key, message) })
    }

    /// The joints with these names, or all where none are given; at least one.
    pub fn selected_joints(&self, select: Option<Vec<String>>) -> Result<Vec<String>, Unfit> {
        if self.joints.is_empty() {
            return Err(Unfit::new("kind", "the model has no joints"));
        }
        let select = select.unwrap_or_else(|| self.joints.clone());
        if select.is_empty() {
            return Err(Unfit::new("select", "name at least one joint"));
        }
        match select.iter().find(|name| !self.joints.contains(name)) {
            None => Ok(select),
            Some(name) => Err(self.if_dependent("select", name).unwrap_or_else(|| {
                Unfit::unknown("select", &format!("the robot has no moving joint `{name}`"), name, &self.joints)
            })),
        }
    }

    /// The element of compliance that makes a joint elastic.
    #[must_use]
    pub fn motor_of(&self, joint: &str) -> Option<&str> {
        self.motors.iter().find(|(own, _)| own == joint).map(|(_, element)| element.as_str())
    }

    /// The place of a frame's first signal; those of [`FRAME_SIGNALS`](crate::FRAME_SIGNALS) follow.
    pub fn frame(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        let place = self.frames.iter().position(|frame| frame == name);
        let unknown = || {
            let what = format!("the model has no link or frame `{name}`");
            Unfit::unknown(key, &what, name, &self.frames)
        };
        place.map(frame_signals).ok_or_else(unknown)
    }

    /// The name of the frame that a signal belongs to.
    pub fn frame_of(&self, signal: usize) -> &str {
        self.frames.get(signal / frame_signals(1)).map_or("", String::as_str)
    }

    /// Indices of signals by their full names.
    pub fn signals_of(&self, names: &[String]) -> Result<Vec<usize>, Unfit> {
        let find = |name: &String| {
            // Signals of the robot as a whole come last.
            let place = self.signals.iter().rposition(|other| other == name);
            place.ok_or_else(|| self.unknown_signal(name))
        };
        names.iter().map(find).collect()
    }

    /// The error for a signal that there is not. A robot has hundreds: it then lists the nearest ones, and how the
    /// others begin.
    fn unknown_signal(&self, name: &str) -> Unfit {
        let what = format!("the model has no signal `{name}`");
        if self.signals.len() <= FEW_SIGNALS {
            return Unfit::unknown("select", &what, name, &self.signals);
        }
        // `gripper.` of `gripper.force_x`; signals without an owner are listed themselves.
        let mut beginnings: Vec<&str> = Vec::new();
        for signal in &self.signals {
            let beginning = signal.rfind('.').map_or(signal.as_str(), |dot| &signal[..=dot]);
            if !beginnings.contains(&beginning) {
                beginnings.push(beginning);
            }
        }
        let near = quoted(&nearest_few(name, &self.signals, NEAREST_SIGNALS));
        let count = self.signals.len();
        let message = format!(
            "{what}; the nearest of its {count} signals are {near}; the others begin with {}",
            quoted(&beginnings)
        );
        Unfit::new("select", message)
    }

    /// The places of the drives with these names, or of all where none are given, and of their signals that begin with
    /// `prefix`; at least one.
    pub(super) fn selected_drives(
        &self,
        select: Option<Vec<String>>,
        prefix: &str,
    ) -> Result<(Vec<usize>, Vec<usize>), Unfit> {
        if self.drives.is_empty() {
            return Err(Unfit::new("kind", "the model has no drives of joints"));
        }
        let names: Vec<&str> = self.drives.iter().map(|drive| drive.channel.name.as_str()).collect();
        let find = |name: &String| {
            let place = names.iter().position(|other| other == name);
            place.ok_or_else(|| Unfit::unknown("select", &format!("the robot has no drive `{name}`"), name, &names))
        };
        let drives: Vec<usize> = match select {
            None => (0..names.len()).collect(),
            Some(select) if select.is_empty() => return Err(Unfit::new("select", "name at least one drive")),
            Some(select) => select.iter().map(find).collect::<Result<_, _>>()?,
        };
        let signals: Vec<String> = drives.iter().map(|&drive| format!("{prefix}{}", names[drive])).collect();
        let signals = self.signals_of(&signals)?;
        Ok((drives, signals))
    }

    /// Whether any of the drives at these places acts at the end of a step.
    pub(super) fn any_acts_at_end(&self, drives: &[usize]) -> bool {
        drives.iter().any(|&drive| self.drives[drive].acts_at_end)
    }

    /// The places and names of an element's signals: of its deflections, or all others.
    fn of_coupling(&self, coupling: &str, deflections: bool) -> Result<Vec<(usize, &str)>, Unfit> {
        if !self.couplings.iter().any(|other| other == coupling) {
            let what = format!("the model has no compliance `{coupling}`");
            return Err(Unfit::unknown("coupling", &what, coupling, &self.couplings));
        }
        let own = |(place, signal): (usize, &'_ String)| {
            let name = signal.strip_prefix(coupling)?.strip_prefix('.')?.len();
            Some((place, name))
        };
        let all = self.signals.iter().enumerate().skip(frame_signals(self.frames.len()));
        let named = all.filter_map(own).map(|(place, name)| {
            let signal = self.signal_name(place);
            (place, &signal[signal.len() - name..])
        });
        Ok(named.filter(|(_, name)| name.starts_with(DEFLECTION) == deflections).collect())
    }

    /// Indices of an element's forces or deflections by name; all if no names are given, except the depth of a
    /// contact, which is not a force.
    pub fn coupling(
        &self,
        coupling: &str,
        select: Option<Vec<String>>,
        deflections: bool,
    ) -> Result<Vec<usize>, Unfit> {
        let own = self.of_coupling(coupling, deflections)?;
        let Some(select) = select else {
            return Ok(own.iter().filter(|(_, name)| *name != "penetration").map(|&(place, _)| place).collect());
        };
        if select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        let names: Vec<&str> = own.iter().map(|&(_, name)| name).collect();
        let find = |name: &String| {
            let place = own.iter().find(|(_, other)| other == name).map(|&(place, _)| place);
            place.ok_or_else(|| Unfit::unknown("select", &format!("`{coupling}` has no `{name}`"), name, &names))
        };
        select.iter().map(find).collect()
    }

    /// The place of a contact's signal, by the contact's name where the model has named ones.
    pub fn contact_signal(&self, contact: Option<&str>, signal: &'static str) -> Result<usize, Unfit> {
        let ending = |other: &'_ String| {
            let name = other.strip_suffix(signal)?.strip_suffix('.')?;
            Some(name.to_owned())
        };
        let named: Vec<String> = self.signals.iter().filter_map(ending).collect();
        match contact {
            Some(name) => {
                let whole = format!("{name}.{signal}");
                self.signals.iter().position(|other| *other == whole).ok_or_else(|| {
                    Unfit::unknown("contact", &format!("the model has no contact `{name}`"), name, &named)
                })
            }
            None => self.signals.iter().position(|other| other == signal).ok_or_else(|| {
                if named.is_empty() {
                    return Unfit::new("kind", format!("the model has no contact: it has no signal `{signal}`"));
                }
                let message = format!("is missing: the model has {}", supple_text::quoted(&named));
                Unfit { help: Some("name the contact".into()), ..Unfit::new("contact", message) }
            }),
        }
    }

    /// The channel of a contact's signal, named after the contact if it has a name.
    #[must_use]
    pub fn contact_channel(&self, signal: usize, what: &str, unit: &str) -> Channel {
        match self.signal_name(signal).rsplit_once('.') {
            Some((contact, _)) => Channel::new(format!("{what} of {contact}"), unit),
            None => Channel::new(what, unit),
        }
    }

    /// The channel of an element's force or deflection, `NAME.SIGNAL`.
    #[must_use]
    pub fn coupling_channel(&self, place: usize) -> Channel {
        let name = self.signal_name(place);
        let (element, signal) = name.rsplit_once('.').unwrap_or(("", name));
        // The effort on a prismatic joint is a force.
        if signal == "torque" && self.torque_unit(element) == "N" {
            return Channel::new(format!("{element}.force"), "N");
        }
        let unit = match signal {
            "contact_force" | "force_x" | "force_y" | "force_z" => "N",
            "torque_x" | "torque_y" | "torque_z" => "N m",
            "penetration" | "deflection_x" | "deflection_y" | "deflection_z" => "m",
            "deflection_roll" | "deflection_pitch" | "deflection_yaw" => "rad",
            "torque" => self.torque_unit(element),
            _ => self.deflection_unit(element),
        };
        Channel::new(name, unit)
    }

    /// The unit of the position that an element acts on; empty if unknown.
    fn deflection_unit(&self, element: &str) -> &str {
        // Springs of inserted joints are named as their joints.
        let joint = self.motors.iter().find(|(_, own)| own == element).map_or(element, |(joint, _)| joint);
        let state = self.states.iter().position(|state| *state == format!("q.{joint}"));
        state.and_then(|place| self.channels.states.get(place)).map_or("", |channel| channel.unit.as_str())
    }

    /// The unit of the effort of an element that acts on a joint.
    #[must_use]
    pub fn torque_unit(&self, element: &str) -> &'static str {
        match self.deflection_unit(element) {
            "rad" => "N m",
            "m" => "N",
            _ => "",
        }
    }
}
