use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::*;
use supple::gradient::*;

pub fn task(small: bool) -> Task {
    let name = if small { "tasks/two_mass_small.toml" } else { "tasks/two_mass.toml" };
    Problem::load(name).unwrap_or_else(|e| panic!("{e}")).tasks.remove(0)
}

fn main() {
    let text = std::fs::read_to_string("crates/supple/tests/golden/two_mass.json").unwrap();
    let golden: serde_json::Value = serde_json::from_str(&text).unwrap();
    let settings = PlanSettings::default();
    for (name, small) in [("two_mass_small", true), ("two_mass", false)] {
        let task = task(small);
        let mut state = TaskState::new(&task);
        for point in golden[name].as_array().unwrap() {
            let f = |k: &str| point[k].as_f64().unwrap();
            let list = |v: &serde_json::Value| v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
            let phi = list(&point["phi"]);
            let controls = list(&point["controls"]);
            let mut guess = Matrices::vectors(125, 1);
            for t in 0..125 { guess.vector_mut(t)[0] = controls[t]; }
            state.evaluate(&task, &phi, &settings, Some(&guess)).unwrap();
            println!("{phi:?} {:?} it {} stat {:.1e} rel {:.1e}", state.plan.status, state.plan.iterations, state.plan.stationarity, state.plan.relative_stationarity);
            let rel = |a: f64, b: f64| (a - b).abs() / b.abs();
            println!("  nominal {:.1e} belief {:.1e} process {:.1e} initial {:.1e} exp {:.1e} di {:.1e} paper {:.1e}",
                rel(state.cost.nominal, f("nominal_cost")), rel(state.cost.belief, f("belief_cost")), rel(state.cost.process, f("process_cost")),
                rel(state.cost.initial, f("initial_cost")), rel(state.cost.expected(), f("expected_cost")), rel(state.information.total, f("directed_information_nat")),
                rel(supple::information::paper_form(&state.belief).unwrap(), f("directed_information_paper_form_nat")));
            let mut frozen = FrozenGradient::default();
            state.frozen_gradient(&task, &phi, &mut frozen);
            println!("  frozen {:?} {:?}", frozen, point["frozen_gradient"]);
            let mut g = vec![];
            state.nominal_gradient(&task, &phi, &mut g);
            println!("  nominal {:?} {}", g, point["total_gradient"]["nominal_cost"]);
            for (n, fun) in [("directed_information", Functional::INFORMATION), ("belief_cost", Functional::BELIEF), ("process_cost", Functional::PROCESS), ("initial_cost", Functional::INITIAL)] {
                state.total_gradient(&task, &phi, fun, &mut g).unwrap();
                let gold = list(&point["total_gradient"][n]);
                println!("  {n} {:?} {:?} rel {:.1e} {:.1e}", g, gold, rel(g[0], gold[0]), rel(g[1], gold[1]));
            }
            state.evaluate(&task, &phi, &settings, None).unwrap();
            println!("  cold: nominal {} (golden {}) {:?} it {} stat {:.1e} reg {}", state.cost.nominal, f("nominal_cost"), state.plan.status, state.plan.iterations, state.plan.stationarity, state.plan.regularised);
            let t0 = std::time::Instant::now();
            for _ in 0..100 { state.evaluate(&task, &phi, &settings, None).unwrap(); }
            println!("  {:?} per cold evaluate", t0.elapsed()/100);
        }
    }
}
