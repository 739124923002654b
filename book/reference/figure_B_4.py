"""Reference numbers of Figures B.4 and B.6 (time delay, compensated, section B.4).

Made by:  /usr/bin/python3 figure_B_4.py B.4 > figure_B_4.json
          /usr/bin/python3 figure_B_4.py B.6 > figure_B_6.json
`B.3` and `B.5` make those of the figures without compensation, for which the book's own scripts have
left numbers too: they agree to 5e-13 of the largest.
"""

import json
import sys

import numpy as np
from closed_loop import pulse, reference, zero_order_hold
from scipy.linalg import solve_discrete_are

figure = sys.argv[1]
kV, kA, tolerance, volts, delay, height = {
    "B.3": (3.02, 0.642, 0.2, 7.0, 0.04, 2.0),
    "B.5": (0.011, 0.005515, 80.0, 12.0, 0.08, 510.0),
}[{"B.4": "B.3", "B.6": "B.5"}.get(figure, figure)]
dt, samples = 0.001, 10200

A, B = zero_order_hold(np.array([[-kV / kA]]), np.array([[1 / kA]]), dt)
A, B = A[0, 0], B[0, 0]
Q, R = 1 / tolerance**2, 1 / volts**2
S = solve_discrete_are([[A]], [[B]], [[Q]], [[R]])[0, 0]
K = B * S * A / (R + B * S * B)
steps = round(delay / dt)
if figure in ("B.4", "B.6"):
    K *= (A - B * K) ** steps

r = pulse(height, 1, dt, samples)[:, 0]
x, u, queue = 0.0, 0.0, [0.0] * steps
velocity, voltage = [], []
for k in range(samples):
    x = A * x + B * u
    r_next = r[min(k + 1, samples - 1)]
    queue.append(np.clip((r_next - A * r[k]) / B + K * (r[k] - x), -12.0, 12.0))
    u = queue.pop(0)
    velocity.append(x)
    voltage.append(u)

series = {"reference_velocity": r, "velocity": np.array(velocity), "voltage": np.array(voltage)}
source = "independent script: book/reference/figure_B_4.py, SciPy 1.10.1"
rows = sorted(set(range(0, samples, 200)) | set(range(95, 260, 5)) | set(range(5095, 5260, 5)))
print(json.dumps(reference(figure, source, {"K": K}, series, rows), indent=1))
