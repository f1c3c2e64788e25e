//! "Design from here", as a page sees it.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{SMALL, Served};
use serde_json::json;

#[test]
fn a_search_is_told_live_can_be_stopped_and_ends_at_a_design() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    page.ask("design", 1, json!({ "count": 1 }));
    let first = page.next("design");
    assert_eq!(first["visited"]["design"].as_array().unwrap().len(), page.values().len());
    let end = loop {
        let message = page.next("design");
        if message["ended"].is_object() {
            break message;
        }
    };
    assert_eq!(end["ended"]["status"], "converged");
    page.ask("evaluate", 2, json!({ "values": end["design"] }));
    let numbers = &page.next("evaluate")["designs"][0]["numbers"];
    let found = end["ended"]["to_bits"].as_f64().unwrap();
    assert!((numbers["measured"].as_f64().unwrap() - found).abs() < 1e-6 * found && numbers["feasible"] == true);
    // A search for 500 starts takes long; it ends soon after it is told to.
    page.ask("design", 3, json!({ "count": 500 }));
    page.next("design");
    page.ask("stop", 4, json!({ "what": "design" }));
    let end = loop {
        let message = page.next("design");
        if message["id"] == 3 && message["visited"].is_null() {
            break message;
        }
    };
    assert!(end["stopped"] == true || end["error"].is_string(), "{end}");
}

/// The first design of this task takes long to plan: nothing is heard of the search until then, but it can be stopped.
#[test]
fn a_search_stops_within_moments_even_while_it_plans() {
    let served = Served::of(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/iiwa_door.toml")));
    let mut page = served.page();
    page.ask("design", 1, json!({ "count": 1 }));
    std::thread::sleep(Duration::from_millis(200));
    let began = Instant::now();
    page.ask("stop", 2, json!({ "what": "design" }));
    let end = loop {
        let message = page.next("design");
        if message["visited"].is_null() {
            break message;
        }
    };
    assert!(began.elapsed().as_secs_f64() < 5.0, "{:?}", began.elapsed());
    assert!(end["stopped"] == true || end["error"].as_str().is_some_and(|why| why.starts_with("stopped")), "{end}");
}
