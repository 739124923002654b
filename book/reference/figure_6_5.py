"""Reference numbers of Figure 6.5 (flywheel, section 6.10.3).

Made by:  /usr/bin/python3 figure_6_5.py > figure_6_5.json
"""

import json
import math

import numpy as np
from closed_loop import VEX_775PRO, motor, pulse, reference, sampled_rows, simulate

R, Kt, Kv = motor(VEX_775PRO, 1)
G, J = 12 / 18, 0.00032
A = np.array([[-(G**2) * Kt / (Kv * R * J)]])
B = np.array([[G * Kt / (R * J)]])
r = pulse(9000 * 2 * math.pi / 60, 1, 0.005, 2040)
numbers, states, inputs = simulate(A, B, 0.005, r, [9.42], 12.0, [1.0], 0.01)

series = {"reference_velocity": r[:, 0], "velocity": states[:, 0], "voltage": inputs}
source = "independent script: book/reference/figure_6_5.py, SciPy 1.10.1"
print(json.dumps(reference("6.5", source, numbers, series, sampled_rows(2040, [20, 1020])), indent=1))
