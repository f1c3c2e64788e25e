//! Many moves: the newest counts, and memory does not grow with their number. Alone in its process, which is measured.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::path::Path;

use common::{SMALL, Served};
use serde_json::json;

#[test]
fn of_many_moves_the_newest_is_answered_and_memory_stays_bounded() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    let moves = 10_000;
    let resident = || {
        let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        text.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4096
    };
    page.ask("evaluate", 1, json!({}));
    page.next("evaluate");
    let before = resident();
    let low = page.hello["knobs"][0]["bounds"][0].as_f64().unwrap();
    for id in 2..2 + moves {
        let mut values = page.values();
        values[0] = low + 1e-3 * id as f64;
        page.ask("evaluate", id, json!({ "values": values, "want": ["state:0"] }));
    }
    let (mut last, mut answers) = (1, 0);
    while last < 1 + moves {
        let answer = page.next("evaluate");
        let id = answer["id"].as_u64().unwrap();
        assert!(id > last, "an answer to {id} after one to {last}");
        (last, answers) = (id, answers + 1);
        assert!((answer["values"][0].as_f64().unwrap() - low - 1e-3 * id as f64).abs() < 1e-12);
    }
    assert!(answers < moves, "all of {moves} moves were computed");
    let grown = resident().saturating_sub(before);
    assert!(grown < 64 << 20, "{moves} moves took {grown} bytes");
}
