//! Tests of what users of the library see, in one program: it links once, and its tests share the cores to the end.
#![allow(missing_docs, clippy::expect_used, clippy::print_stderr, clippy::print_stdout, clippy::unwrap_used)]

mod aims;
mod architecture;
mod bound;
mod bound_edges;
mod bound_sensitivity;
mod bound_sensors;
mod bounding;
mod bounds_page;
mod brute_force;
mod catalogue;
mod certificates;
mod checks;
#[path = "../common/mod.rs"]
mod common;
mod contacts;
mod controller;
mod derivatives;
mod design;
mod floors;
mod golden;
mod gradients;
mod limits;
mod long_filter;
mod oracles;
mod paper;
mod plans;
mod prices;
mod published;
mod readme;
mod recorded;
mod registries;
mod risk;
mod robot;
mod scene;
mod sensing;
mod sensors;
mod sequence;
mod sequential;
mod simulation;
mod substeps;
mod tasks;
mod tasks_reference;
mod trust;
mod values;
mod varying;
