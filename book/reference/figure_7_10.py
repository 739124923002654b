"""Reference numbers of Figures 7.10, C.2 and C.3 (second-order CIM motor).

Made by:  /usr/bin/python3 figure_7_10.py 7.10 > figure_7_10.json
          /usr/bin/python3 figure_7_10.py C.2 > figure_C_2.json
          /usr/bin/python3 figure_7_10.py C.3 > figure_C_3.json
`C.1` makes those of Figure C.1, for which the book's own script has left numbers too: the two agree
to 3e-16.
"""

import json
import sys

import numpy as np
from closed_loop import reference, zero_order_hold
from scipy.linalg import solve_discrete_are

figure = sys.argv[1]
J, b, K_t, K_e, R_motor, L = 7.75e-5, 8.91e-5, 0.0184, 0.0211, 0.0916, 5.9e-5
A_c = np.array([[-b / J, K_t / J], [-K_e / L, -R_motor / L]])
B_c = np.array([[0.0], [1 / L]])
C = np.array([[1.0, 0.0]])
r = np.array([[2000 * 0.1047], [0.0]])

dt = 0.001 if figure == "7.10" else 0.0001
A, B = zero_order_hold(A_c, B_c, dt)
Q = np.diag([1 / 20**2, 0.0 if figure == "7.10" else 1 / 40**2])
R = np.array([[1 / 12.0**2]])
S = solve_discrete_are(A, B, Q, R)
K = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)

ahead = r - A @ r
inversion = np.linalg.pinv(B) @ ahead
weighted = np.linalg.solve(B.T @ Q @ B + R, B.T @ Q @ ahead)
only_q = np.linalg.solve(B.T @ Q @ B, B.T @ Q @ ahead)
# Theorem C.2.1, and r projected on what N_x can reach.
N = np.linalg.pinv(np.block([[A - np.eye(2), B], [C, np.zeros((1, 1))]])) @ np.array([[0], [0], [1.0]])
steady = N[2:] @ np.linalg.pinv(N[:2]) @ r

feedforwards = {
    "7.10": {"no_feedforward": np.zeros((1, 1)), "plant_inversion": inversion},
    "C.1": {"plant_inversion": inversion, "qr_weighted": weighted},
    "C.2": {"no_feedforward": np.zeros((1, 1)), "steady_state": steady, "qr_weighted": weighted},
    "C.3": {"qr_weighted": weighted, "q_weighted": only_q},
}[figure]

samples = round(0.025 / dt)
series = {"reference_velocity": np.full(samples, r[0, 0]), "reference_current": np.zeros(samples)}
numbers = {"K_1": K[0, 0], "K_2": K[0, 1]}
for name, u_ff in feedforwards.items():
    x = np.zeros((2, 1))
    states, inputs = [], []
    for _ in range(samples):
        u = np.clip(K @ (r - x) + u_ff, -12.0, 12.0)
        x = A @ x + B @ u
        states.append(x[:, 0])
        inputs.append(u[0, 0])
    series[f"velocity_{name}"] = np.array(states)[:, 0]
    series[f"current_{name}"] = np.array(states)[:, 1]
    series[f"voltage_{name}"] = np.array(inputs)
    if name != "no_feedforward":
        numbers[f"u_ff_{name}"] = u_ff[0, 0]

source = "independent script: book/reference/figure_7_10.py, SciPy 1.10.1"
rows = range(0, samples, max(1, samples // 50))
print(json.dumps(reference(figure, source, numbers, series, rows), indent=1))
