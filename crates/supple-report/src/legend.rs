//! Limits the length of legends: further entries are drawn in grey, as one entry.

use serde_json::Value;

/// The most entries of a legend.
pub const MOST_ENTRIES: usize = 8;

/// The entry of what has no entry of its own.
const REST: &str = "others";
const GREY: &str = "@ink/0.3";

/// The name of a trace in the legend; `None` if it has no entry.
fn entry(trace: &Value) -> Option<&str> {
    let shown = trace.get("showlegend").and_then(Value::as_bool) != Some(false);
    let name = trace.get("legendgroup").or_else(|| trace.get("name")).and_then(Value::as_str);
    name.filter(|_| shown)
}

/// The entries of a view, given the traces that it shows, in their order.
fn entries<'a>(traces: &'a [Value], view: &[usize]) -> Vec<&'a str> {
    let mut entries = Vec::new();
    for name in view.iter().filter_map(|&index| entry(traces.get(index)?)) {
        if !entries.contains(&name) {
            entries.push(name);
        }
    }
    entries
}

/// Limits the legend of every view, given by the traces that it shows, to [`MOST_ENTRIES`] entries: all but the
/// first ones become one grey entry, but keep their names in tooltips. Returns the number of grey names.
pub fn group(traces: &mut [Value], views: &[Vec<usize>]) -> usize {
    let mut rest: Vec<String> = Vec::new();
    for view in views {
        let entries = entries(traces, view);
        if entries.len() > MOST_ENTRIES {
            let names = entries[MOST_ENTRIES - 1..].iter().map(|name| (*name).to_owned());
            rest.extend(names.filter(|name| !rest.contains(name)).collect::<Vec<_>>());
        }
    }
    if rest.is_empty() {
        return 0;
    }
    let is_rest = |trace: &Value| {
        let name = trace.get("legendgroup").or_else(|| trace.get("name")).and_then(Value::as_str);
        name.is_some_and(|name| rest.iter().any(|other| other == name))
    };
    let grey: Vec<bool> = traces.iter().map(is_rest).collect();
    for (trace, _) in traces.iter_mut().zip(&grey).filter(|(_, grey)| **grey) {
        fade(trace);
    }
    // One sample in each view.
    for view in views {
        if let Some(&first) = view.iter().find(|&&index| grey.get(index) == Some(&true)) {
            traces[first]["showlegend"] = true.into();
        }
    }
    rest.len()
}

/// One of the others.
fn fade(trace: &mut Value) {
    let skipped = trace.get("hoverinfo").and_then(Value::as_str) == Some("skip");
    if trace.get("text").is_none() && !skipped {
        trace["text"] = trace["name"].clone();
        trace["hoverinfo"] = "x+y+text".into();
    }
    trace["name"] = REST.into();
    trace["legendgroup"] = REST.into();
    trace["showlegend"] = false.into();
    for part in ["line", "marker"] {
        if let Some(part) = trace.get_mut(part) {
            part["color"] = GREY.into();
        }
    }
    if let Some(line) = trace.get_mut("line") {
        line["dash"] = "solid".into();
        line["width"] = 1.0.into();
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn traces(count: usize) -> Vec<Value> {
        (0..count).map(|index| json!({ "name": format!("q{index}"), "line": { "color": "@1", "width": 2 } })).collect()
    }

    #[test]
    fn eight_entries_stay_and_more_are_grouped() {
        let all = |count: usize| -> Vec<Vec<usize>> { vec![(0..count).collect()] };
        let mut eight = traces(8);
        assert_eq!((group(&mut eight, &all(8)), &eight), (0, &traces(8)));
        let mut ten = traces(10);
        assert_eq!(group(&mut ten, &all(10)), 3);
        assert_eq!(entries(&ten, &all(10)[0]), ["q0", "q1", "q2", "q3", "q4", "q5", "q6", "others"]);
        assert_eq!(ten[9]["text"], "q9", "its name is there for those who point at it");
        assert_eq!((&ten[9]["line"]["color"], &ten[6]["line"]["color"]), (&json!(GREY), &json!("@1")));
    }

    #[test]
    fn views_are_counted_one_by_one() {
        let views = |ranges: [std::ops::Range<usize>; 2]| ranges.map(Iterator::collect::<Vec<usize>>).to_vec();
        let mut twelve = traces(12);
        assert_eq!(group(&mut twelve, &views([0..6, 6..12])), 0);
        let overlapping = views([0..6, 2..12]);
        assert_eq!(group(&mut twelve, &overlapping), 3);
        assert_eq!(overlapping.iter().map(|view| entries(&twelve, view).len()).collect::<Vec<_>>(), [6, MOST_ENTRIES]);
    }
}
