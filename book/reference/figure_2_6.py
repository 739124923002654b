"""Reference numbers of Figure 2.6 (PI controller on a flywheel, section 2.3).

Made by:  /usr/bin/python3 figure_2_6.py > figure_2_6.json
`python3 figure_2_6.py 2.7` makes those of Figure 2.7 (K_i = 0.2), for which the book's own script has
left numbers too: the two agree to 3e-16.
"""

import json
import math
import sys

import numpy as np
from closed_loop import VEX_775PRO, motor, pulse, reference, sampled_rows, zero_order_hold
from scipy.linalg import solve_discrete_are

figure, K_i = ("2.7", 0.2) if sys.argv[1:] == ["2.7"] else ("2.6", 0.01)
dt, samples = 0.005, 2040
R, Kt, Kv = motor(VEX_775PRO, 1)
G, J = 12 / 18, 0.00032
A, B = zero_order_hold(np.array([[-(G**2) * Kt / (Kv * R * J)]]), np.array([[G * Kt / (R * J)]]), dt)
r = pulse(9000 * 2 * math.pi / 60, 1, dt, samples)[:, 0]
R_weight = 1 / 12.0**2
S = solve_discrete_are(A, B, np.array([[1 / 200.0**2]]), np.array([[R_weight]]))
K_p = ((B.T @ S @ A) / (R_weight + B.T @ S @ B))[0, 0]

x, u, integral = 0.0, 0.0, 0.0
velocity, voltage = [], []
for k in range(samples):
    x = A[0, 0] * x + B[0, 0] * u
    error = r[k] - x
    integral = np.clip(integral + error * dt, -12 / K_i, 12 / K_i)
    u = np.clip(K_p * error + K_i * integral, -12.0, 12.0)
    velocity.append(x)
    voltage.append(u)

series = {"reference_velocity": r, "velocity": np.array(velocity), "voltage": np.array(voltage)}
source = "independent script: book/reference/figure_2_6.py, SciPy 1.10.1"
rows = sampled_rows(samples, [20, 1020])
print(json.dumps(reference(figure, source, {"K_p": K_p, "K_i": K_i}, series, rows), indent=1))
