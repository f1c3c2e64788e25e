use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Parser;
use supple_study::study::{REPORT, Step, Study, StudyFile};
use supple_study::{About, Folder, Made, RESULT, StudyResult, check_writable};

use crate::Outcome;
use crate::arguments::{Arguments, Common, StudyOptions};
use crate::failure::Failure;
use crate::output::{note, print_text};
use crate::progress::{STOP, Stopping, listen};

/// `supple study FILE`: every step is a run of this program, so that its folder says which command made it.
pub fn study(options: &StudyOptions, common: &Common) -> Result<Outcome, Failure> {
    let out = options.out.clone().unwrap_or_else(|| options.study.file_stem().map(PathBuf::from).unwrap_or_default());
    let file = StudyFile::load(&options.study, &out)?;
    for step in file.steps.iter().chain(&file.figures) {
        check(&file, step)?;
    }
    Folder::check_kind(&out, "study")?;
    check_writable(&out, RESULT)?;
    listen(Stopping::AtPause);
    let clock = Instant::now();
    let mut short = Short::read(&out);
    for (number, step) in file.steps.iter().enumerate() {
        let heading = format!("step {} of {}, {}", number + 1, file.steps.len(), step.name);
        let folder = out.join(&step.name);
        if Folder::is_made(&folder, &step.words) {
            let fell = if short.holds(&step.name) { ", which fell short" } else { "" };
            note(&format!("{heading}: reused from an earlier run{fell}"));
            continue;
        }
        note(&format!("{heading}: supple {}", step.words.join(" ")));
        let fell_short = run(&step.words, common, &step.name)? == Outcome::Shortfall;
        short.set(&step.name, fell_short)?;
        if STOP.load(Ordering::SeqCst) {
            note("stopped; the same command resumes here");
            return Ok(Outcome::Shortfall);
        }
    }
    let fell_short = file.steps.iter().any(|step| short.holds(&step.name));
    let outcome = if fell_short { Outcome::Shortfall } else { Outcome::Success };
    for figure in &file.figures {
        run(&figure.words, common, &figure.name)?;
    }
    save(&file, &out)?;
    let report = out.join(REPORT).display().to_string();
    let words = ["report", &out.display().to_string(), "--out", &report].map(str::to_owned);
    run(&words, common, "report")?;
    let (steps, seconds) = (file.steps.len(), clock.elapsed().as_secs_f64());
    print_text(&format!("{}\n\n{steps} steps in {seconds:.0} s. The report: {report}\n", file.title))?;
    Ok(outcome)
}

/// The steps of a study that fell short, such as by a cost above its bound: kept beside their folders, so that the study's exit
/// code is the same when it only looks at what was made before.
struct Short {
    path: PathBuf,
    names: Vec<String>,
}

impl Short {
    fn read(out: &Path) -> Self {
        let path = out.join("short.txt");
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        Self { path, names: text.lines().map(str::to_owned).collect() }
    }

    fn holds(&self, name: &str) -> bool {
        self.names.iter().any(|known| known == name)
    }

    /// Notes how a step ended, in the file too.
    fn set(&mut self, name: &str, short: bool) -> Result<(), Failure> {
        if self.holds(name) == short {
            return Ok(());
        }
        self.names.retain(|known| known != name);
        if short {
            self.names.push(name.to_owned());
        }
        let written = match self.names.is_empty() {
            true => std::fs::remove_file(&self.path),
            false => std::fs::write(&self.path, self.names.join("\n") + "\n"),
        };
        written.map_err(|error| Failure::write(self.path.display(), error))
    }
}

/// Checks that the words of a step are a command line, before anything is run.
fn check(file: &StudyFile, step: &Step) -> Result<(), Failure> {
    let words = ["supple".to_owned()].into_iter().chain(step.words.iter().cloned());
    match Arguments::try_parse_from(words) {
        Ok(_) => Ok(()),
        Err(error) => {
            // The first line says what is wrong; the rest is about the command line.
            let text = error.to_string();
            let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
            Err(file.error(step, format!("`{}`: {message}", step.name)).into())
        }
    }
}

/// Runs this program with the given words.
fn run(words: &[String], common: &Common, name: &str) -> Result<Outcome, Failure> {
    let program = std::env::current_exe().map_err(|error| Failure::write("this program", error))?;
    let mut command = Command::new(program);
    command.args(words).args(common.instruction_words());
    if let Some(threads) = common.threads() {
        command.env("RAYON_NUM_THREADS", threads.to_string());
    }
    let status = attended(command).map_err(|error| Failure::write(format!("step {name}"), error))?;
    match status.code() {
        Some(0) => Ok(Outcome::Success),
        Some(1) => Ok(Outcome::Shortfall),
        _ if STOP.load(Ordering::SeqCst) => Ok(Outcome::Shortfall),
        _ => Err(Failure::usage(format!("{name} failed: supple {}", words.join(" ")))),
    }
}

/// How often a study looks whether it was told to stop.
const WAKE: Duration = Duration::from_millis(20);

/// Runs a step, and passes on to it that the study was told to stop: it then ends by itself and keeps what it found.
fn attended(mut command: Command) -> std::io::Result<ExitStatus> {
    die_with_parent(&mut command);
    let mut child = command.spawn()?;
    let mut told = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if STOP.load(Ordering::SeqCst) && !std::mem::replace(&mut told, true) {
            terminate(&mut child)?;
        }
        std::thread::sleep(WAKE);
    }
}

/// Where this process is killed, a step does not go on alone.
#[cfg(target_os = "linux")]
fn die_with_parent(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    let ask = || {
        // SAFETY: a call of the kernel with plain numbers, which may be made between fork and exec.
        match unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM) } {
            0 => Ok(()),
            _ => Err(std::io::Error::last_os_error()),
        }
    };
    // SAFETY: `ask` allocates nothing and takes no lock.
    unsafe { command.pre_exec(ask) };
}

#[cfg(not(target_os = "linux"))]
fn die_with_parent(_: &mut Command) {}

#[cfg(unix)]
fn terminate(child: &mut Child) -> std::io::Result<()> {
    // SAFETY: the child has not been waited for, so that the number is its own.
    unsafe { libc::kill(child.id() as libc::pid_t, libc::SIGTERM) };
    Ok(())
}

/// Windows sends Ctrl-C to all programs of a console.
#[cfg(not(unix))]
fn terminate(_: &mut Child) -> std::io::Result<()> {
    Ok(())
}

fn save(file: &StudyFile, out: &Path) -> Result<(), Failure> {
    let outputs = |steps: &[Step]| steps.iter().map(|step| step.output.clone()).collect();
    let study = Study { steps: outputs(&file.steps), figures: outputs(&file.figures) };
    let about = About { title: file.title.clone(), ..About::default() };
    let made = Made::of_sources("study", 0, vec![file.source.clone()], about);
    Ok(Folder::save(out, &made, &StudyResult::Study(Box::new(study)))?)
}
