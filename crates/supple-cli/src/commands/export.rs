use std::path::PathBuf;

use supple_study::Folder;
use supple_study::controller::{At, ControllerFormat, ExportedController, check_out};

use crate::Outcome;
use crate::arguments::{AtArgument, ControllerFormatArgument, ExportOptions};
use crate::failure::Failure;
use crate::output::{print_text, warn};

/// `supple export DIR --to FORMAT`
pub fn export(options: &ExportOptions) -> Result<Outcome, Failure> {
    let format = match options.to {
        ControllerFormatArgument::C => ControllerFormat::C,
        ControllerFormatArgument::Json => ControllerFormat::Json,
        ControllerFormatArgument::Npz => ControllerFormat::Npz,
    };
    let at = options.at.map(|at| match at {
        AtArgument::Start => At::Start,
        AtArgument::Optimum => At::Optimum,
    });
    if let Some(out) = &options.out {
        check_out(format, out)?;
    }
    let folder = Folder::load(&options.folder)?;
    let exported = ExportedController::of(&folder, None, (options.task.as_deref(), at))?;
    let standard = || PathBuf::from(format!("{}.{}", exported.name(), format.extension()));
    let out = options.out.clone().unwrap_or_else(standard);
    for path in exported.write(format, &out)? {
        print_text(&format!("wrote {}\n", path.display()))?;
    }
    if exported.status.is_converged() {
        return Ok(Outcome::Success);
    }
    let status = exported.status;
    warn(&format!("the plan of task `{}` ended as {status}: its controller may not hold the plan", exported.task));
    Ok(Outcome::Shortfall)
}
