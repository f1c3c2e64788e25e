//! Designs from catalogues, as the program tells them.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS, edited};

/// The small task with a CSV catalogue of the first spring and a list for the second.
fn folder(second: &str) -> Folder {
    let text = edited(TWO_MASS, "bounds = [20.0, 120.0]", "bounds = [20.0, 120.0]\ncatalogue = \"springs.csv\"");
    let text = edited(&text, "bounds = [3.0, 50.0]", &format!("bounds = [3.0, 50.0]\ncatalogue = {second}"));
    let folder = Folder::with_task(text);
    std::fs::write(folder.path("springs.csv"), "name,value,price\nS25,25,2\nS50,50,3\nS100,100,5.5\n").unwrap();
    folder
}

/// The page names the chosen entries; JSON and page say the same; evaluating what was chosen gives the same numbers.
#[test]
fn chosen_entries_are_shown() {
    let folder = folder("[{ value = 5.0, price = 1 }, { value = 20.0, price = 1.5 }]");
    let json = folder.run(&["design", "task.toml", "--starts", "1", "--json"]).json(0);
    let catalogue = &json["catalogue"];
    assert_eq!((&catalogue["method"], &catalogue["combinations"]), (&"all_combinations".into(), &6.into()));
    assert_eq!((&catalogue["designed"], &catalogue["complete"]), (&6.into(), &true.into()));
    let chosen = catalogue["chosen"].as_array().unwrap();
    let values: Vec<f64> = chosen.iter().map(|entry| entry["value"].as_f64().unwrap()).collect();
    assert!([25.0, 50.0, 100.0].contains(&values[0]) && [5.0, 20.0].contains(&values[1]), "{values:?}");
    let paid: f64 = chosen.iter().map(|entry| entry["price"].as_f64().unwrap()).sum();
    assert_eq!(catalogue["price"].as_f64(), Some(paid));
    let bits = json["optimum"]["objective"]["information_bits"].as_f64().unwrap();
    let free = catalogue["continuous"]["information_bits"].as_f64().unwrap();
    assert!((catalogue["gap_bits"].as_f64().unwrap() - (bits - free)).abs() < 1e-6 * bits);

    let page = folder.run(&["design", "task.toml", "--starts", "1"]);
    let (code, page) = page.quiet();
    assert_eq!(code, Some(0));
    let row = page.lines().find(|line| line.starts_with(" k1") && line.contains(" S")).unwrap();
    assert!(row.contains(&values[0].to_string()) && row.contains(chosen[0]["name"].as_str().unwrap()), "{row}");
    assert!(page.contains("Chosen from all 6 combinations of entries; "), "{page}");
    assert!(page.contains("Optimum among the catalogue entries"), "{page}");

    // Cut short, the program says so, and its exit code too.
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    std::fs::write(folder.path("task.toml"), format!("{text}\n[design]\nmax_combinations = 2\n")).unwrap();
    let cut = folder.run(&["design", "task.toml", "--starts", "1"]);
    assert_eq!(cut.code, Some(1));
    assert!(cut.stdout.contains("The best of 2 of 6 combinations; better ones may remain"), "{}", cut.stdout);
}

/// A design that needs not pay what entries cost is no measure of those that do.
#[test]
fn what_is_not_paid_is_not_compared() {
    let folder = folder("[{ value = 5.0, price = 1 }, { value = 20.0, price = 1.5 }]");
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    std::fs::write(folder.path("task.toml"), format!("{text}\n[design]\nbudget = 20.0\n")).unwrap();
    let run = folder.run(&["design", "task.toml", "--starts", "1"]);
    let (_, page) = run.quiet();
    assert!(page.contains("Without catalogues, and without paying for their entries, "), "{page}");
    assert!(folder.run(&["design", "task.toml", "--starts", "1", "--json"]).json(0)["catalogue"]["gap_bits"].is_null());
}

/// Where no combination within the cost limit, the page and the exit code say so.
#[test]
fn no_combination_will_do() {
    let folder = folder("[49.5, 50.0]");
    std::fs::write(folder.path("springs.csv"), "value\n20\n20.1\n").unwrap();
    let run = folder.run(&["design", "task.toml", "--starts", "1"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(1));
    assert!(
        page.contains(
            "Chosen from all 4 combinations of entries; none is within all cost limits; this is the closest."
        ),
        "{page}"
    );
    assert!(
        page.contains("No design from the catalogues within all cost limits was found. The closest exceeds"),
        "{page}"
    );
}

/// What is wrong in a CSV file is told with its line.
#[test]
fn errors_name_the_line_of_the_file() {
    let folder = folder("[5.0]");
    std::fs::write(folder.path("springs.csv"), "name,value,price\nS25,25,2\nS500,500,3\n").unwrap();
    let run = folder.run(&["design", "task.toml"]);
    assert!(run.error().contains("springs.csv:3:1: must be within the bounds [20, 120]; found 500"), "{}", run.stderr);
}
