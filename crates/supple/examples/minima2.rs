#[path = "scratchpad.rs"]
#[allow(dead_code)]
mod s;
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::*;
fn main() {
    let task = s::task(false);
    let mut state = TaskState::new(&task);
    let settings = PlanSettings { newton: std::env::args().nth(1).is_none(), max_iterations: 3000, ..Default::default() };
    let constant = |v: f64| { let mut g = Matrices::vectors(125, 1); for t in 0..125 { g.vector_mut(t)[0] = v; } g };
    // continuation along k2 at k1=136
    for k1 in [134.0, 136.0, 138.0] {
    for start in [120.0, 150.0, 175.0, 200.0, 240.0, 300.0,400.0] {
        for guess in [57.0, 150.0] {
        print!("k1 {k1} start {start} guess {guess}: ");
        state.evaluate(&task, &[k1, start], &settings, Some(&constant(guess))).unwrap();
        print!("({start} {:.3} {:.3})", state.cost.nominal, state.cost.expected());
        let steps: Vec<f64> = if start < 185.0 { (0..=((185.0-start)/5.0) as usize).map(|i| start + 5.0*i as f64).collect() } else { (0..=((start-185.0)/5.0) as usize).map(|i| start - 5.0*i as f64).collect() };
        for k2 in steps {
            let c = state.plan.trajectory.controls.clone();
            state.evaluate(&task, &[k1, k2], &settings, Some(&c)).unwrap();
        }
        println!(" -> 185: {:.4} J {:.4} DI {:.3} {:?}", state.cost.nominal, state.cost.expected(), state.information.total, state.plan.status);
    }}}
    // map of the best over guesses
    for k1 in [110.0, 120.0,125.0,130.0, 136.0] { for k2 in [100.0,125.0, 150.0, 185.0, 240.0, 300.0, 400.0, 500.0, 600.0] {
        let mut best = (f64::MAX, 0.0, 0.0, 0.0);
        for guess in [30.0, 57.0, 80.0, 110.0, 150.0, 200.0, 300.0, 400.0] {
            state.evaluate(&task, &[k1, k2], &settings, Some(&constant(guess))).unwrap();
            if state.plan.status == supple::plan::PlanStatus::Converged && state.cost.expected() < best.0 { best = (state.cost.expected(), guess, state.information.total, state.cost.nominal); }
        }
        print!("({k1},{k2}): {:.2} nom {:.2} g{} DI {:.1} | ", best.0, best.3, best.1, best.2);
    } println!(); }
}
