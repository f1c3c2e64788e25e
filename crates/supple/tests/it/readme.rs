//! What README.md shows is what the code gives.

use crate::common::same_text;
use std::error::Error;

use supple::EvaluateOptions;
use supple::bound::BoundOptions;
use supple::design::{Control, design};

#[allow(dead_code)]
#[path = "../../examples/01_design.rs"]
mod example;
#[allow(dead_code)]
#[path = "../../examples/picture.rs"]
mod picture;

use same_text::{assert_same_text, parts};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

fn read(path: &str) -> Result<String, Box<dyn Error>> {
    std::fs::read_to_string(format!("{ROOT}{path}")).map_err(|error| format!("{path}: {error}").into())
}

/// The blocks of code of one language.
fn blocks<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    let fence = format!("\n```{language}\n");
    text.split(&fence).skip(1).filter_map(|rest| rest.split_once("```").map(|(block, _)| block)).collect()
}

#[test]
fn the_example_is_the_file_and_prints_what_is_shown() -> Result<(), Box<dyn Error>> {
    let readme = read("README.md")?;
    assert_eq!(blocks(&readme, "rust"), [read("crates/supple/examples/01_design.rs")?]);
    let mut printed = Vec::new();
    example::run(&format!("{ROOT}tasks/two_mass.toml"), &mut printed)?;
    assert_same_text(blocks(&readme, "text").last().unwrap_or(&""), &String::from_utf8(printed)?);
    Ok(())
}

#[test]
fn the_picture_is_what_the_example_draws() -> Result<(), Box<dyn Error>> {
    let drawn = picture::draw(&format!("{ROOT}tasks/two_mass.toml"))?;
    assert_same_text(&read("docs/images/two_mass.svg")?, &drawn);
    Ok(())
}

#[test]
fn the_test_command_is_what_ci_runs() -> Result<(), Box<dyn Error>> {
    let (readme, ci) = (read("README.md")?, read(".ci/run")?);
    let commands = blocks(&readme, "sh");
    assert_eq!(commands.len(), 2, "README.md has two commands");
    assert!(ci.contains(commands[1].trim()), ".ci/run does not run `{}`", commands[1].trim());
    Ok(())
}

/// Every number in the sentences of the README is computed here.
#[test]
fn numbers_in_the_text_are_computed() -> Result<(), Box<dyn Error>> {
    let problem = supple_file::load(format!("{ROOT}tasks/two_mass.toml"))?;
    let task = &problem.tasks[0];
    let start = problem.parameters.initial();
    let control = Control::default();
    let found = design(&problem, &start, &problem.design, control)?;
    let best = &found.starts[found.best];
    let before = problem.evaluate(&start, &EvaluateOptions::default())?;
    let bits = |nats: f64| nats / std::f64::consts::LN_2;
    let bound = before.tasks[0].cost.bound.unwrap_or(f64::NAN);
    assert!((best.costs[0] / bound - 1.0).abs() < 1e-6, "the expected cost ends at its bound");
    let limits = &problem.bound(&best.to, &BoundOptions::default())?.tasks[0];
    let reaching: f64 = limits.control_per_step_bits.iter().sum();
    let manifest = read("Cargo.toml")?;
    let rust = manifest.split("rust-version = \"").nth(1).and_then(|rest| rest.split('"').next());
    let project = read("pyproject.toml")?;
    let python = project.split("requires-python = \">=").nth(1).and_then(|rest| rest.split('"').next());
    let computed = [
        format!("{:.1}", before.objective.information_bits),
        format!("{:.1}", task.steps as f64 * task.time_step.resolve::<f64>(&start)),
        format!("{:.1}", bits(best.information)),
        format!("{bound}"),
        format!("{:.1}", bits(best.multipliers[0])),
        format!("{reaching:.1}"),
        format!("{:.1}", limits.minimum_bits),
        rust.unwrap_or_default().to_owned(),
        python.unwrap_or_default().to_owned(),
    ];

    let readme = read("README.md")?;
    let sentences: Vec<&str> = sentences(&readme);
    let numbers: Vec<String> =
        sentences.iter().flat_map(|line| parts(line)).filter(|part| part.parse::<f64>().is_ok()).collect();
    for number in &computed {
        assert!(numbers.contains(number), "README.md does not name {number}");
    }
    // Exit codes.
    let known = |number: &String| computed.contains(number) || ["0", "1", "2"].contains(&number.as_str());
    let unknown: Vec<_> = numbers.iter().filter(|&number| !known(number)).collect();
    assert!(unknown.is_empty(), "README.md names {unknown:?}, which this test does not compute");
    Ok(())
}

/// The text outside of blocks of code and formulas, inline ones and the targets of links included.
fn sentences(text: &str) -> Vec<&str> {
    let outside = |text, fence| str::split(text, fence).step_by(2);
    outside(text, "```")
        .flat_map(|text| outside(text, "$$"))
        .flat_map(|text| outside(text, "$"))
        .flat_map(|text| outside(text, "`"))
        .flat_map(|text| {
            text.split('[').flat_map(|link| link.split_once(')').map_or(vec![link], |(_, rest)| vec![rest]))
        })
        .flat_map(str::lines)
        .collect()
}
