//! The exported C, compiled by the machine's compiler and run on measurements of the nonlinear plant.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use supple_study::LoadedTask;
use supple_study::controller::{ControllerFormat, ExportedController};

use super::{edited, evaluated, exported, repository, shipped};

/// Reads measurements, prints controls; then what is returned past the end, the state's size, and nanoseconds per step.
const HARNESS: &str = r#"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "out.h"

int main(void)
{
    static double y[STEPS][P + 1];
    double u[M], sum = 0.0, seconds;
    NAME_controller controller;
    int t, i, repeats = 0;
    clock_t begin;
    for (t = 0; t < STEPS; t++)
        for (i = 0; i < P; i++)
            if (scanf("%lf", &y[t][i]) != 1) return 2;
    NAME_init(&controller);
    for (t = 0; t < STEPS; t++) {
        if (NAME_step(&controller, y[t], u) != UPPER_OK) return 3;
        for (i = 0; i < M; i++) printf("%.17g\n", u[i]);
    }
    for (i = 0; i < M; i++) u[i] = -1.0;
    if (NAME_step(&controller, y[0], u) != UPPER_OVER || u[0] != -1.0) return 4;
    begin = clock();
    do {
        NAME_init(&controller);
        for (t = 0; t < STEPS; t++) {
            if (NAME_step(&controller, y[t], u) != UPPER_OK) return 5;
            sum += u[0];
        }
        repeats++;
        seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    } while (seconds < 0.2);
    printf("%lu\n%.17g\n", (unsigned long)sizeof controller, 1e9 * seconds / repeats / STEPS);
    return sum == sum ? 0 : 6;
}
"#;

/// The machine's C compiler: that of `CC`, or `cc`; none where there is none.
fn compiler() -> Option<String> {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let found = Command::new(&compiler).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("SKIPPED: there is no C compiler `{compiler}`: the exported C was not compiled");
    }
    found.then_some(compiler)
}

/// Compiles a source beside `out.c` without a warning, and runs it with `input`; its standard output.
fn run(compiler: &str, folder: &Path, main: &str, input: &str) -> String {
    std::fs::write(folder.join("main.c"), main).unwrap();
    let flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", "main.c", "out.c", "-lm", "-o", "main"];
    let compiled = Command::new(compiler).args(flags).current_dir(folder).output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let mut program = Command::new(folder.join("main"));
    let mut program = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    program.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = program.wait_with_output().unwrap();
    assert!(output.status.success(), "{:?}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// Compares the C of a controller with the library on measurements; how often a control was at a bound.
fn compare(exported: &ExportedController, measured: &[Vec<f64>]) -> usize {
    let Some(compiler) = compiler() else { return usize::MAX };
    let folder = tempfile::tempdir().unwrap();
    exported.write(ControllerFormat::C, &folder.path().join("out.c")).unwrap();
    let (controller, name) = (&exported.controller, exported.name());
    let (m, p) = (controller.dimensions.controls, controller.dimensions.measurements);
    let main = HARNESS.replace("NAME", &name).replace("UPPER", &name.to_ascii_uppercase());
    let main = main.replace("STEPS", &controller.steps().to_string());
    let main = main.replace("[M]", &format!("[{m}]")).replace("< M;", &format!("< {m};"));
    let main = main.replace("P + 1", &format!("{p} + 1")).replace("< P;", &format!("< {p};"));
    let input: String = measured.iter().flatten().map(|y| format!("{y:?}\n")).collect();
    let said = run(&compiler, folder.path(), &main, &input);
    let numbers: Vec<f64> = said.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(numbers.len(), controller.steps() * m + 2);

    let (mut run, mut worst, mut clipped) = (controller.start(), 0.0_f64, 0);
    for (t, y) in measured[..controller.steps()].iter().enumerate() {
        assert!(controller.step(&mut run, y).unwrap());
        for (a, (u, c)) in run.controls.iter().zip(&numbers[t * m..]).enumerate() {
            let difference = (u - c).abs() / (1.0 + u.abs());
            // Rounding of hundreds of steps.
            assert!(difference <= 1e-11, "step {t}, control {a}: {c} in C, {u} in the library");
            worst = worst.max(difference);
            let at = |bounds: &[f64]| bounds[a] == *u;
            clipped +=
                usize::from(controller.bounds.as_ref().is_some_and(|bounds| at(bounds.lower()) || at(bounds.upper())));
        }
    }
    let header = std::fs::read_to_string(folder.path().join("out.h")).unwrap();
    let size = numbers[numbers.len() - 2];
    assert!(header.contains(&format!("State: {size} bytes")), "{size}: {header:.900}");
    let tables = header.lines().find(|line| line.contains("Tables:")).unwrap();
    let work = header.lines().find(|line| line.contains("Work:")).unwrap();
    println!(
        "task `{}`: {:.0} ns per step; {};{}; largest difference {worst:.1e}; {clipped} controls at bounds",
        exported.task.name,
        numbers[numbers.len() - 1],
        tables.trim_start_matches(" * "),
        work.trim_start_matches(" *"),
    );
    clipped
}

/// Compares the first task of a file.
fn compare_task(task: &LoadedTask, name: Option<&str>) -> usize {
    let folder = evaluated(task, 3);
    let (exported, measured) = exported(&folder, name);
    compare(&exported, &measured)
}

#[test]
fn c_is_the_library_for_two_masses() {
    compare_task(&shipped("two_mass.toml"), None);
}

#[test]
fn c_is_the_library_for_a_door() {
    compare_task(&shipped("iiwa_door.toml"), Some("close"));
}

#[test]
fn c_is_the_library_in_contact() {
    compare_task(&shipped("soft_gripper.toml"), None);
}

#[test]
fn c_is_the_library_for_a_linear_system() {
    compare_task(&shipped("tanaka_plant.toml"), None);
}

/// Torques that the plan holds at their limits, and more of them where the plant is noisy.
#[test]
fn c_clips_as_the_library() {
    let limited = "\nsteps = 500\nenforce_effort_limits = true\n";
    let clipped = compare_task(&edited("iiwa_door.toml", "\nsteps = 500\n", limited), Some("open"));
    assert!(clipped > 0, "a control is at a bound");
}

/// Names that are no identifiers of C, that would end a comment, or that are alike; and numbers of all sizes.
#[test]
fn any_name_compiles() {
    let name = r#"name = "2 pick */ place ??/\\ Tür /*""#;
    compare_task(&edited("tanaka_plant.toml", "name = \"regulate\"", name), None);
}

/// The example of the documentation compiles and runs.
#[test]
fn the_example_of_the_documentation_runs() {
    let Some(compiler) = compiler() else { return };
    let page = std::fs::read_to_string(repository("docs/controller.md")).unwrap();
    let example = page.split("```c\n").nth(1).unwrap().split("```").next().unwrap();
    assert!(example.lines().count() <= 20, "{example}");
    let folder = tempfile::tempdir().unwrap();
    let (exported, _) = exported(&evaluated(&shipped("two_mass.toml"), 0), None);
    exported.write(ControllerFormat::C, &folder.path().join("press.c")).unwrap();
    std::fs::rename(folder.path().join("press.c"), folder.path().join("out.c")).unwrap();
    let rest = "\nvoid read_sensors(double *y) { y[0] = y[1] = 0.0; }\n\
                void drive(const double *u) { printf(\"%.17g\\n\", u[0]); }\n";
    let said = run(&compiler, folder.path(), &format!("#include <stdio.h>\n{example}{rest}"), "");
    let mut run = exported.controller.start();
    for line in said.lines() {
        assert!(exported.controller.step(&mut run, &[0.0, 0.0]).unwrap());
        let (c, u) = (line.parse::<f64>().unwrap(), run.controls[0]);
        assert!((c - u).abs() <= 1e-12 * (1.0 + u.abs()));
    }
    assert_eq!(said.lines().count(), exported.controller.steps());
}
