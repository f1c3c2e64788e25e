//! Weights of a cost's entries.

use crate::robot::arm::{arm, cost, stage_cost};

#[test]
fn a_weight_for_each_entry_is_a_cost_of_each_entry() {
    let norms = ["", "\nnorm = { absolute = { smoothing = 0.1 } }"];
    for norm in norms {
        let keys = |keys: &str| format!("{keys}{norm}");
        let together = cost("joint_position", &keys("target = [0.4, 0.2, 0.05]\nweight = [2.0, 0.0, 0.5]"));
        let apart = cost("joint_position", &keys("select = [\"shoulder\"]\ntarget = 0.4\nweight = 2.0"))
            + &cost("joint_position", &keys("select = [\"slide\"]\ntarget = 0.05\nweight = 0.5"));
        let [together, apart] = [together, apart].map(|costs| arm().costing(&costs).problem());
        let (x, u) = ([0.1, -0.5, 0.3, 0.2, 0.1, -0.4], [0.3, 0.1, -0.2]);
        let [found, expected] = [&together, &apart].map(|problem| stage_cost(problem, &x, &u, &[]));
        assert!((found - expected).abs() < 1e-14 * expected, "{found} instead of {expected}");
        assert!(expected > 0.1);
    }
}

#[test]
fn one_target_is_that_of_all_entries() {
    let value = |target: &str| {
        let costs =
            cost("joint_position", &format!("target = {target}\nweight = 1.0")) + &cost("control", "weight = \"a\"");
        let problem = arm().where_(&[("a", 0.2)]).costing(&costs).problem();
        stage_cost(&problem, &[0.1, -0.5, 0.3, 0.0, 0.0, 0.0], &[0.0; 3], &[0.2])
    };
    assert_eq!(value("0.2"), value("[0.2, 0.2, 0.2]"));
    assert_eq!(value("\"a\""), value("0.2"));
}

#[test]
fn weights_that_do_not_fit_are_refused() {
    for (keys, said) in [
        (
            "weight = [1.0, 2.0]",
            "tasks[0].costs[0].weight: must be one number, or 3 of them, one for each entry; found 2",
        ),
        ("weight = [1.0, -2.0, 0.0]", "tasks[0].costs[0].weight: must be at least 0; found -2"),
        ("weight = 1.0\nfinal_weight = [1.0]\nnorm = { absolute = { smoothing = 0.0 } }", "tasks[0].costs[0].norm"),
        (
            "weight = 1.0\nfinal_weight = [\"a / 0\", 1.0, 1.0]",
            "tasks[0].costs[0].final_weight[0]: must be finite; at the initial values of the parameters `a / 0` is inf",
        ),
    ] {
        let task = arm().costing(&cost("joint_position", keys)).where_(&[("a", 1.0)]);
        let error = supple_file::parse(&task.text(), "tests/data/task.toml").err().unwrap().to_string();
        assert!(error.contains(said), "{error}");
    }
}
