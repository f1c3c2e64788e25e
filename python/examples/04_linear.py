"""A linear problem from arrays: how much a controller must know of a mass that is pushed around, by its sensor's noise.

Its twin in Rust is crates/supple/examples/04_linear.rs; both print the same.
"""

import numpy as np

import supple

STEPS = 100
# A mass of 1 kg at steps of 0.05 s, in a field that pushes it away from 0 more and more.
push = np.linspace(0.0, 2.0, STEPS)
A = np.array([[[1.0, 0.05], [0.05 * f, 1.0]] for f in push])
B = np.array([[0.0], [0.05]])
C = np.array([[1.0, 0.0]])
W = np.diag([0.0, 1e-3])
X0 = np.diag([1e-2, 1e-2])
Q, R = np.diag([1.0, 0.1]), np.array([[0.01]])

for variance in (1e-4, 1e-3, 1e-2):
    V = np.array([[variance]])
    task = supple.linear(A, B, C, W, V, X0, Q, R, QN=10.0 * Q, x0=[1.0, 0.0], N=STEPS, time_step=0.05)
    found = task.evaluate()
    (report,) = found.tasks.values()
    gain = report.trajectory.K[0, 0]
    print(
        f"variance {variance:.4f}: {found.information.bits:.4f} bits, cost {report.cost.expected:.6f}, "
        f"first gains {gain[0]:.4f} {gain[1]:.4f}"
    )
