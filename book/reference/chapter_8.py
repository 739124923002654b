"""Reference numbers of Figures 8.3, 8.8 and 8.9, of which the book's scripts left none, and of
8.12 and 8.13 with the gain at rest that SciPy has only five digits of.

Made by:  /usr/bin/python3 chapter_8.py 8.9 > figure_8_9.json  (and so on)
drive_loops.py holds the same loop to the scripts' numbers of the figures beside them.
"""

import json
import sys

import numpy as np
from closed_loop import reference, sampled_rows, trapezoid, zero_order_hold
from drive_loops import cross_track, dlqr, exact_dlqr, simulate, unicycle, velocity_model

figure = sys.argv[1]
source = "independent script: book/reference/chapter_8.py, SciPy 1.10.1"
if figure == "8.3":
    dt = 0.005
    A_c, B_c = velocity_model(2)
    A, B = zero_order_hold(A_c, B_c, dt)
    K = dlqr(A_c, B_c, dt, [0.95, 0.95], [12.0, 12.0])
    v = trapezoid(3.5, 1.0, dt, 50.0)[:, 1]
    r = np.column_stack((v, v))
    x, u, states, inputs = np.zeros(2), np.zeros(2), [], []
    for k in range(len(r)):
        x = A @ x + B @ u
        u = np.linalg.solve(B, r[min(k + 1, len(r) - 1)] - A @ r[k]) + K @ (r[k] - x)
        u = np.clip(u, -12.0, 12.0)
        states.append(x)
        inputs.append(u)
    x, u = np.array(states), np.array(inputs)
    series = {
        "reference_left_velocity": r[:, 0], "left_velocity": x[:, 0],
        "reference_right_velocity": r[:, 1], "right_velocity": x[:, 1],
        "left_voltage": u[:, 0], "right_voltage": u[:, 1],
    }
    rows = sampled_rows(len(r), [0, 200, 2858])
    print(json.dumps(reference(figure, source, {"K_11": K[0, 0], "K_12": K[0, 1]}, series, rows), indent=1))
else:
    law = cross_track
    if figure in ("8.12", "8.13"):
        law = lambda drive, x, r: unicycle(drive, x, r, exact_dlqr)
    r, x, u = simulate(law)
    series = {}
    for i, name in enumerate(["x", "y", "heading", "left_velocity", "right_velocity"]):
        series["reference_" + name] = r[:, i]
        series[name] = x[:, i]
    series["left_voltage"], series["right_voltage"] = u.T
    if figure in ("8.8", "8.12"):
        series = {name: series[name] for name in ("reference_x", "x", "reference_y", "y")}
    print(json.dumps(reference(figure, source, {}, series, sampled_rows(len(r), [0])), indent=1))
