//! An optimiser of this crate finds the optimum that those of the library find.

use std::error::Error;

use outsider::PatternSearch;
use supple::design::{Aim, Control, DesignSettings, Searcher};

#[test]
fn an_optimiser_from_outside_finds_the_optimum() -> Result<(), Box<dyn Error>> {
    let problem = supple_file::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml"))?;
    let settings = DesignSettings { starts: 1, rounds: 1, ..Default::default() };
    let control = Control::default();
    let searcher = Searcher::new(&problem, &settings, Aim::default(), control);
    let phi = problem.parameters.initial();
    let own = searcher.with_optimiser(&PatternSearch).search(&phi)?;
    let known = searcher.search(&phi)?;
    let [own, known] = [&own, &known].map(|found| &found.starts[found.best]);
    let error = (own.information / known.information - 1.0).abs();
    assert!(error < 1e-6, "{} nats instead of {}", own.information, known.information);
    assert!((own.to[0] - known.to[0]).abs() < 1e-3, "{:?} is not {:?}", own.to, known.to);
    Ok(())
}
