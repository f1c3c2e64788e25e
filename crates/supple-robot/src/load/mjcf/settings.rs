//! The `compiler` and `option` sections: conventions for the rest of the file, and gravity.

use supple_text::FileError;

use super::super::warnings::Warnings;
use super::super::words::shown;
use super::super::xml::Element;
use super::known::require_attributes;

/// Switches of `flag` that change the dynamics if disabled.
const FLAGS: [&str; 7] = ["constraint", "equality", "frictionloss", "limit", "spring", "damper", "actuation"];
/// Words for a flag that is true or false.
const TRUTH: [(&str, bool); 2] = [("true", true), ("false", false)];

/// Whether bodies get their inertia from their geoms.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum FromGeoms {
    Never,
    Always,
    /// Where there is no `inertial`.
    WhereMissing,
}

/// A rotation of a sequence of Euler angles.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// Its axis: x, y or z.
    pub(super) axis: usize,
    /// Whether the axis turns with the frame.
    pub(super) moving: bool,
}

/// The `compiler` settings, which apply to the whole file. If a setting is given several times, the last one applies.
pub(super) struct Settings {
    /// Radians per unit of angle in the file.
    pub(super) angle: f64,
    /// What `euler` means.
    pub(super) euler: [Turn; 3],
    /// Whether a `range` alone limits a joint.
    pub(super) autolimits: bool,
    pub(super) from_geoms: FromGeoms,
    /// Groups of the geoms that give inertia: the first and the last one.
    pub(super) groups: [f64; 2],
    /// Whether physically impossible moments of inertia are replaced by their mean.
    pub(super) balance: bool,
    /// Least mass of a body, kg.
    pub(super) least_mass: f64,
    /// Least principal moment of inertia of a body, kg m^2.
    pub(super) least_moment: f64,
    /// Mass of all bodies together, to which masses and moments are scaled, kg.
    pub(super) total_mass: Option<f64>,
    /// Folder of meshes, as the file gives it.
    pub(super) mesh_folder: String,
    /// Whether folders are stripped from file names.
    pub(super) strip_folders: bool,
}

impl Settings {
    /// The settings of a file.
    ///
    /// # Errors
    /// If a setting is invalid or unknown: it may change units, or request something unsupported.
    pub(super) fn read(root: Element) -> Result<Self, FileError> {
        let mut settings = Self {
            angle: std::f64::consts::PI / 180.0,
            euler: [0, 1, 2].map(|axis| Turn { axis, moving: true }),
            autolimits: true,
            from_geoms: FromGeoms::WhereMissing,
            groups: [0.0, 5.0],
            balance: false,
            least_mass: 0.0,
            least_moment: 0.0,
            total_mass: None,
            mesh_folder: String::new(),
            strip_folders: false,
        };
        let mut asset_folder = String::new();
        for at in root.all("compiler") {
            require_attributes(at, "compiler")?;
            settings.update(at)?;
            if let Some(folder) = at.attribute("assetdir") {
                folder.clone_into(&mut asset_folder);
            }
        }
        if settings.mesh_folder.is_empty() {
            settings.mesh_folder = asset_folder;
        }
        Ok(settings)
    }

    /// One `compiler` element.
    fn update(&mut self, at: Element) -> Result<(), FileError> {
        if at.choice("coordinate", &[("local", false), ("global", true)])? == Some(true) {
            let message = "global coordinates are not supported, nor are they by MuJoCo since version 2.3.4";
            return Err(at.error_at("coordinate", message));
        }
        if let Some(mass) = at.number("settotalmass")? {
            self.total_mass = Some(mass).filter(|&mass| mass > 0.0);
        }
        let degree = std::f64::consts::PI / 180.0;
        set(&mut self.angle, at.choice("angle", &[("radian", 1.0), ("degree", degree)])?);
        set(&mut self.autolimits, at.choice("autolimits", &TRUTH)?);
        set(&mut self.balance, at.choice("balanceinertia", &TRUTH)?);
        set(&mut self.strip_folders, at.choice("strippath", &TRUTH)?);
        let words = [("false", FromGeoms::Never), ("true", FromGeoms::Always), ("auto", FromGeoms::WhereMissing)];
        set(&mut self.from_geoms, at.choice("inertiafromgeom", &words)?);
        set(&mut self.groups, at.numbers("inertiagrouprange")?);
        for (name, into) in [("boundmass", &mut self.least_mass), ("boundinertia", &mut self.least_moment)] {
            let Some(least) = at.number(name)? else { continue };
            if least < 0.0 {
                return Err(at.error_at(name, format!("`{name}` must be at least 0; found {least}")));
            }
            *into = least;
        }
        if let Some(folder) = at.attribute("meshdir") {
            folder.clone_into(&mut self.mesh_folder);
        }
        if let Some(sequence) = at.attribute("eulerseq") {
            self.euler = turns(sequence).ok_or_else(|| {
                let found = shown(sequence);
                at.error_at("eulerseq", format!("`eulerseq` must be three letters of `xyzXYZ`; found {found}"))
            })?;
        }
        Ok(())
    }
}

/// Overwrites a value if another is given.
fn set<T>(value: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *value = given;
    }
}

/// The rotations that a sequence of letters stands for.
fn turns(sequence: &str) -> Option<[Turn; 3]> {
    let turn = |letter: char| {
        let axis = "xyz".find(letter.to_ascii_lowercase())?;
        Some(Turn { axis, moving: letter.is_ascii_lowercase() })
    };
    sequence.chars().map(turn).collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// Gravity of the `option` sections, m/s^2.
///
/// # Errors
/// Where it is not three numbers.
pub(super) fn gravity(root: Element, warnings: &mut Warnings) -> Result<[f64; 3], FileError> {
    let mut gravity = [0.0, 0.0, -9.81];
    let mut enabled = true;
    for at in root.all("option") {
        set(&mut gravity, at.numbers("gravity")?);
        for name in ["density", "viscosity"] {
            if at.number(name)?.is_some_and(|value| value != 0.0) {
                let what = || format!("`{name}` of `option` is left out: no medium slows the robot down");
                warnings.leave_out_force(name, at, what);
            }
        }
        for flag in at.all("flag") {
            let words = [("enable", true), ("disable", false)];
            set(&mut enabled, flag.choice("gravity", &words)?);
            for name in FLAGS {
                if flag.choice(name, &words)? == Some(false) {
                    let what = || format!("`{name}` of `flag` is left out: what it disables acts nonetheless");
                    warnings.leave_out_force(name, flag, what);
                }
            }
        }
    }
    Ok(if enabled { gravity } else { [0.0; 3] })
}
