//! Studies take tasks whose kinds are of this crate.

use std::error::Error;
use std::path::Path;

use outsider::kinds;
use supple_study::pareto::ParetoOptions;
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, StudyResult, Watch};

const REACH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tasks/reach.toml");

#[test]
fn a_front_is_found_stored_and_read() -> Result<(), Box<dyn Error>> {
    let task = LoadedTask::load_with(Path::new(REACH), kinds())?;
    let folder = tempfile::tempdir()?;
    let watch = Watch::default();
    let work = Work::Pareto(ParetoOptions { points: 2, starts: 1, seed: 0 });
    let result = work.run(&task, Some(folder.path()), watch)?;
    assert!(matches!(&result, StudyResult::Pareto(front) if front.points.len() == 2));
    let made = Made::of(&task, work);
    Folder::conclude(folder.path(), &made, &result)?;
    let read = Folder::load(folder.path())?;
    assert_eq!(read.made, made);
    let again = LoadedTask::restore_with(&read.made.sources, kinds())?;
    assert_eq!(again.problem.tasks.len(), task.problem.tasks.len());
    // Without them the same text is refused, by name.
    let Err(refused) = LoadedTask::restore(&read.made.sources) else { return Err("it is read".into()) };
    assert!(refused.to_string().contains("must be one of"), "{refused}");
    Ok(())
}
