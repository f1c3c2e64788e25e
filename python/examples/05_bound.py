"""Minimum information for a linear plant in steady state and for two masses at a wall.

Its twin in Rust is crates/supple/examples/05_bound.rs; both print the same.
"""

import supple

plant = supple.load("tasks/tanaka_plant.toml")
for cost in (33.0, 40.0, 60.0, 1000.0):
    (bound,) = plant.bound(stationary=True, cost=cost).tasks.values()
    print(
        f"cost {cost:6.1f}: floor {bound.floor_bits_per_step:.4f}, "
        f"Kostina-Hassibi {bound.kostina_hassibi_bits_per_step:.4f}, "
        f"minimum {bound.minimum_bits_per_step:.4f} bits per step, rank {bound.virtual_sensor.rank}"
    )

masses = supple.load("tasks/two_mass.toml")
for k1, k2 in ((500.0, 500.0), (135.912, 171.458)):
    (bound,) = masses.bound(k1=k1, k2=k2).tasks.values()
    print(
        f"k1 = {k1:.0f}, k2 = {k2:.0f}: minimum {bound.minimum_bits_per_step:.4f}, "
        f"controls {bound.control_bits_per_step:.4f}, measurements {bound.measurement_bits_per_step:.4f} "
        f"bits per step, efficiency {100 * bound.efficiency:.1f} %"
    )
