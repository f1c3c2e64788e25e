#[path = "scratchpad.rs"]
#[allow(dead_code)]
mod s;
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::*;
fn main() {
    let task = s::task(false);
    let mut state = TaskState::new(&task);
    for phi in [[300.0, 300.0], [500.0,500.0], [123.0,240.0], [136.0,185.0],[136.0,175.0]] {
        for newton in [true, false] {
            print!("{phi:?} newton {newton}: ");
            for guess in [20.0, 40.0, 57.0, 80.0, 110.0, 150.0] {
                let settings = PlanSettings { newton, max_iterations: 3000, ..Default::default() };
                let mut g = Matrices::vectors(125, 1);
                for t in 0..125 { g.vector_mut(t)[0] = guess; }
                state.evaluate(&task, &phi, &settings, Some(&g)).unwrap();
                print!("{:.4} ({:?} {} reg {} {:.0e}) ", state.cost.nominal, state.plan.status, state.plan.iterations, state.plan.regularised, state.plan.stationarity);
            }
            println!();
        }
    }
}
