"""Finds the stiffnesses that minimise the information of two masses pressing on a wall.

Its twin in Rust is crates/supple/examples/01_design.rs; both print the same.
"""

import supple

task = supple.load("tasks/two_mass.toml")
best = task.design()
for name, parameter in task.parameters.items():
    if parameter.role == "design":
        print(f"{name} = {best.parameters[name]:.1f} {parameter.unit}")
for at in (task.evaluate(), best):
    print(f"{at.information.bits:.1f} bits at cost {at.tasks['press'].cost.expected:.1f}")
