//! Robot files: URDF, SDF or MJCF text in, [`Robot`] out; every error names file, line, element and what is valid.

mod assemble;
mod degrees;
mod joint_kind;
mod meshes;
mod mimic;
mod mjcf;
pub(crate) mod moments;
mod names;
mod options;
mod parts;
mod physics;
mod scan;
mod sdf;
mod solids;
mod urdf;
mod values;
mod warnings;
mod words;
mod xml;

use std::path::Path;

use supple_text::FileError;

pub use self::options::LoadOptions;
use crate::Robot;

/// Reads a robot from a file; its root element determines the format: `robot` is URDF, `sdf` SDF, `mujoco` MJCF.
///
/// # Errors
/// Where the file cannot be read, or anything in it is wrong or cannot be modelled.
///
/// ```
/// use supple_robot::LoadOptions;
///
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/iiwa14_door.urdf");
/// let robot = supple_robot::load(file, &LoadOptions::default())?;
/// assert!(robot.link("iiwa_link_7").is_some());
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn load(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Robot, FileError> {
    let path = path.as_ref();
    parse(&options.files.read(path)?, &path.display().to_string(), options)
}

/// Reads a robot from text; errors call the file `name`, and meshes are looked up in its folder.
///
/// # Errors
/// Where anything in it is wrong or cannot be modelled.
///
/// Example: the [front page](crate).
pub fn parse(text: &str, name: &str, options: &LoadOptions) -> Result<Robot, FileError> {
    let (text, said) = xml::cleaned(text);
    let mut robot = of_text(&text, name, options)?;
    robot.warnings.splice(0..0, said.iter().cloned());
    robot.every_warning.splice(0..0, said);
    Ok(robot)
}

fn of_text(text: &str, name: &str, options: &LoadOptions) -> Result<Robot, FileError> {
    let document = xml::Document::parse(text, name)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let root = document.root();
    match root.tag() {
        "robot" => urdf::read(&document, options, folder),
        "sdf" => sdf::read(&document, options, folder),
        "mujoco" => {
            let sources = mjcf::Sources::read(&document, Path::new(name), options)?;
            let mut document = document;
            sources.put_into(&mut document)?;
            let robot = mjcf::read(&document, options, folder)?;
            Ok(Robot { included: sources.paths(), ..robot })
        }
        _ => Err(root.error("a robot file begins with `robot` (URDF), `sdf` (SDF) or `mujoco` (MJCF)")),
    }
}
