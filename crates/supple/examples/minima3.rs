//! x
use std::sync::atomic::AtomicBool;
use supple::design::*;
use supple::*;
fn main() {
    let problem = Problem::load("tasks/two_mass.toml").unwrap();
    let stop = AtomicBool::new(false);
    let control = Control { observer: &NoObserver, stop: &stop };
    for (method, gradient) in [(Method::Sqp, GradientKind::Total), (Method::Barrier, GradientKind::Frozen), (Method::Barrier, GradientKind::Total)] {
        let settings = DesignSettings { starts: 11, method, gradient, ..Default::default() };
        let d = design(&problem, &problem.parameters.initial(), &settings, control).unwrap();
        println!("{:?} {} s {} evals", d.status, d.seconds, d.evaluations);
        for s in &d.starts {
            println!("{:?} -> {:?} DI {:.6} J {:?} {} opt {:.1e} mult {:?} br {} ev {} {:?}", s.from, s.to, s.information, s.costs, s.status, s.optimality, s.multipliers, s.branches, s.evaluations, s.error);
        }
    }
}
