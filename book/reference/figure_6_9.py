"""Reference numbers of Figure 6.9 (single-jointed arm, section 6.11.4).

Made by:  /usr/bin/python3 figure_6_9.py > figure_6_9.json
"""

import json

import numpy as np
from closed_loop import CIM, motor, reference, sampled_rows, simulate, trapezoid

R, Kt, Kv = motor(CIM, 1)
G = 1 / 2
J = 1 / 3 * 2.2675 * 1.2192**2
A = np.array([[0.0, 1.0], [0.0, -(G**2) * Kt / (Kv * R * J)]])
B = np.array([[0.0], [G * Kt / (R * J)]])
r = trapezoid(0.5, 0.5, 0.005, 1.04)
numbers, states, inputs = simulate(A, B, 0.005, r, [0.01745, 0.08726], 12.0, [0.01745, 0.1745329], 0.01)

series = {
    "reference_angle": r[:, 0],
    "reference_velocity": r[:, 1],
    "angle": states[:, 0],
    "velocity": states[:, 1],
    "voltage": inputs,
}
source = "independent script: book/reference/figure_6_9.py, SciPy 1.10.1"
rows = sampled_rows(len(r), [0, 100, 416, len(r) - 12])
print(json.dumps(reference("6.9", source, numbers, series, rows), indent=1))
