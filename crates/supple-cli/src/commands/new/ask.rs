//! Options of `supple new`; on a terminal, prompts for those that are missing.

use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use supple_robot::{LoadOptions, load};
use supple_text::quoted;

use super::tool::Tool;
use crate::arguments::{ModelKind, NewOptions};
use crate::commands::robot::Planning;
use crate::failure::Failure;
use crate::template::Template;

/// The options, complete.
pub struct Asked {
    pub model: ModelKind,
    pub robot: Option<PathBuf>,
    pub package_roots: Vec<PathBuf>,
    pub template: Option<Template>,
    pub frame: Option<String>,
    pub wall: Option<[f64; 3]>,
    pub at: Option<[f64; 3]>,
    pub set: Vec<String>,
}

const KINDS: [(ModelKind, &str, &str); 4] = [
    (ModelKind::TwoMass, "two_mass", "two masses and a wall"),
    (ModelKind::Linear, "linear", "a linear system in discrete time"),
    (ModelKind::Robot, "robot", "an arm of rigid bodies, with its robot file"),
    // A robot from the user's own file has the same model kind.
    (ModelKind::Robot, "file", "a robot from a URDF, SDF or MJCF file"),
];

impl Asked {
    /// The options as given; prompts for missing ones if standard input and standard error are terminals.
    ///
    /// # Errors
    /// If a wall or place is invalid, or an answer cannot be read.
    pub fn of(options: &NewOptions) -> Result<Self, Failure> {
        let mut asked = Self {
            model: options.model.unwrap_or(ModelKind::TwoMass),
            robot: options.robot.clone(),
            package_roots: options.package_roots.clone(),
            template: options.template,
            frame: options.frame.clone(),
            wall: options
                .wall
                .as_deref()
                .map(|text| normal(text).map_err(|why| wrong("--wall", text, &why)))
                .transpose()?,
            at: options.at.as_deref().map(|text| place(text).map_err(|why| wrong("--at", text, &why))).transpose()?,
            set: options.set.clone(),
        };
        if std::io::stdin().is_terminal() && std::io::stderr().is_terminal() {
            asked.ask(options)?;
        } else if asked.model == ModelKind::Robot {
            asked.template = Some(Template::Press);
        }
        Ok(asked)
    }

    fn ask(&mut self, options: &NewOptions) -> Result<(), Failure> {
        if options.model.is_none() && options.robot.is_none() {
            let choices: Vec<_> = KINDS.iter().map(|(_, name, what)| (*name, *what)).collect();
            let chosen = choose("What is the model?", &choices, 0)?;
            self.model = KINDS[chosen].0;
            if KINDS[chosen].1 == "file" {
                let exists = |text: &str| match Path::new(text).is_file() {
                    true => Ok(PathBuf::from(text)),
                    false => Err("there is no such file".to_owned()),
                };
                self.robot = Some(question("Robot file", "", exists)?);
            }
        }
        if self.robot.is_none() && self.model != ModelKind::Robot || self.template.is_some() {
            return Ok(());
        }
        let choices = Template::ALL.map(|(_, name, what)| (name, what));
        self.template = Some(Template::ALL[choose("What does the robot do?", &choices, 0)?].0);
        if let Some(file) = self.robot.clone() {
            let options = LoadOptions { package_roots: self.package_roots.clone(), ..LoadOptions::default() };
            let robot = load(&file, &options)?;
            let likeliest = Tool::likeliest(&Planning::of(&robot)).frame;
            let known = |text: &str| match robot.frame(text) {
                None if text == likeliest => Ok(text.to_owned()),
                Some(_) => Ok(text.to_owned()),
                None => {
                    let names: Vec<_> = robot.links.iter().map(|link| &link.name).collect();
                    Err(format!("the robot has no such link or frame: it has {}", quoted(&names)))
                }
            };
            let frame = question("Frame that the tool is mounted on", &likeliest, known)?;
            self.frame = Some(frame).filter(|frame| *frame != likeliest);
        }
        let wall = |text: &str| if text == "best" { Ok(None) } else { normal(text).map(Some) };
        self.wall = question("Outward normal of the wall, such as +z or 0,-1,1", "best", wall)?;
        Ok(())
    }
}

fn wrong(option: &str, text: &str, why: &str) -> Failure {
    Failure::usage(format!("{option} {text}: {why}"))
}

/// Parses three finite numbers.
fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|entry| entry.trim().parse().ok()).collect();
    let three: Option<[f64; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
    three.filter(|three| three.iter().all(|entry| entry.is_finite())).ok_or_else(|| "write three numbers, x,y,z".into())
}

/// Parses a direction and normalises it.
fn normal(text: &str) -> Result<[f64; 3], String> {
    let named = ["x", "y", "z"].iter().position(|axis| text.trim().trim_start_matches(['+', '-']) == *axis);
    let vector = match named {
        Some(axis) => {
            let mut vector = [0.0; 3];
            vector[axis] = if text.trim().starts_with('-') { -1.0 } else { 1.0 };
            vector
        }
        None => place(text).map_err(|_| "write +x, -x, +y, -y, +z, -z or three numbers, x,y,z".to_owned())?,
    };
    let length = vector.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    if length < 1e-9 {
        return Err("the normal must not be zero".into());
    }
    Ok(vector.map(|entry| entry / length))
}

/// The index of a choice, given by name or number.
fn choose(what: &str, choices: &[(&str, &str)], default: usize) -> Result<usize, Failure> {
    let mut text = format!("{what}\n");
    for (number, (name, what)) in choices.iter().enumerate() {
        text += &format!("  {} {name:<9} {what}\n", number + 1);
    }
    tell(&text);
    let find = |answer: &str| {
        let by_number = answer.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let by_name = choices.iter().position(|(name, _)| *name == answer);
        by_name.or(by_number.filter(|&number| number < choices.len())).ok_or_else(|| {
            let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
            format!("answer with one of {} or its number", quoted(&names))
        })
    };
    question("Name or number", choices[default].0, find)
}

/// Prompts until the answer is valid. An empty answer selects the default, if there is one.
fn question<T>(what: &str, default: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<T, Failure> {
    let shown = if default.is_empty() { String::new() } else { format!(" [{default}]") };
    loop {
        tell(&format!("{what}{shown}: "));
        let mut line = String::new();
        let count =
            std::io::stdin().lock().read_line(&mut line).map_err(|error| Failure::write("standard input", error))?;
        if count == 0 {
            return Err(Failure::usage("end of input before all prompts were answered; nothing was written".into()));
        }
        let answer = if line.trim().is_empty() { default } else { line.trim() };
        match read(answer) {
            Ok(found) => return Ok(found),
            Err(why) => tell(&format!("  {why}\n")),
        }
    }
}

/// Prints a prompt on standard error; errors are ignored, as the answers may come from a file.
fn tell(text: &str) {
    let mut out = std::io::stderr().lock();
    let _ = out.write_all(text.as_bytes());
    let _ = out.flush();
}
