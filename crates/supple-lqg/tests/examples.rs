//! The examples run, and what they print beside one another agrees: they check that themselves.

#[path = "../examples/closed_loop.rs"]
mod closed_loop;
#[path = "../examples/least_information.rs"]
mod least_information;

#[test]
fn the_expected_cost_of_a_closed_loop() -> Result<(), supple_lqg::Error> {
    closed_loop::main()
}

#[test]
fn the_least_information_over_a_horizon() -> Result<(), supple_lqg::Error> {
    least_information::main()
}
