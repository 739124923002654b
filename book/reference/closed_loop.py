"""An independent computation of the book's closed loops, with NumPy and SciPy only.

Nothing of Flyball is in it: scipy.linalg's exponential and Riccati solver, and the loop written
out. `python3 closed_loop.py` repeats Figure 6.3 and compares it with figure_6_3.json, which was made
by the book's own scripts; figure_6_5.py and figure_6_9.py make the numbers of figures for which
there is no such record. Made with Python 3.11, NumPy 1.24.2, SciPy 1.10.1.
"""

import json
import math
import pathlib

import numpy as np
from scipy.linalg import expm, solve_discrete_are

# Datasheets: stall torque (N m), stall current (A), free current (A), free speed (rpm), at 12 V.
CIM = (2.42, 133.0, 2.7, 5310.0)
VEX_775PRO = (0.71, 134.0, 0.7, 18730.0)


def motor(datasheet, count):
    """R, K_t, K_v of `count` motors in one gearbox (12.4 to 12.6)."""
    stall_torque, stall_current, free_current, free_rpm = datasheet
    R = 12.0 / stall_current
    Kv = free_rpm * 2 * math.pi / 60 / (12.0 - free_current * R)
    return R / count, stall_torque / stall_current, Kv


def zero_order_hold(A, B, dt):
    n = A.shape[0]
    M = np.zeros((n + B.shape[1],) * 2)
    M[:n, :n], M[:n, n:] = A, B
    M = expm(M * dt)
    return M[:n, :n], M[:n, n:]


def discretize_noise(A, Q, dt):
    """Van Loan's exponential; ||A|| dt is below 1 in these figures."""
    n = A.shape[0]
    M = expm(np.block([[-A, Q], [np.zeros((n, n)), A.T]]) * dt)
    Q_d = M[n:, n:].T @ M[:n, n:]
    return (Q_d + Q_d.T) / 2


def trapezoid(max_v, time_to_max_v, dt, goal):
    """Rows of (position, velocity) as Snippet 15.1 sums them; for a goal that reaches max_v."""
    a = max_v / time_to_max_v
    brake = goal / max_v
    t, x, rows = 0.0, 0.0, [(0.0, 0.0)]
    while t < brake + time_to_max_v:
        t += dt
        if t < time_to_max_v:
            v = a * t
        elif t < brake:
            v = max_v
        elif t < brake + time_to_max_v:
            v = max_v - a * (t - brake)
        else:
            v = 0.0
        x += v * dt
        rows.append((x, v))
    return np.array(rows)


def pulse(height, states, dt, samples):
    """The first state's reference is `height` for 0.1 s <= t < 5.1 s."""
    r = np.zeros((samples, states))
    t = np.arange(samples) * dt
    r[(t >= 0.1) & (t < 5.1), 0] = height
    return r


def simulate(A_c, B_c, dt, r, Q_tolerance, R_tolerance, state_std, output_std):
    """LQR by Bryson's rule, steady-state Kalman filter, plant inversion, 12 V limit.

    The first state is measured. Answers numbers (by name) and rows of states and input.
    """
    n = A_c.shape[0]
    A, B = zero_order_hold(A_c, B_c, dt)
    C = np.zeros((1, n))
    C[0, 0] = 1.0

    Q = np.diag(1 / np.square(Q_tolerance))
    R = np.array([[1 / R_tolerance**2]])
    S = solve_discrete_are(A, B, Q, R)
    K = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)

    Q_d = discretize_noise(A_c, np.diag(np.square(state_std)), dt)
    R_d = np.array([[output_std**2 / dt]])
    P = solve_discrete_are(A.T, C.T, Q_d, R_d)
    K_e = P @ C.T @ np.linalg.inv(C @ P @ C.T + R_d)

    B_pinv = np.linalg.pinv(B)
    x, x_hat, u = np.zeros((n, 1)), np.zeros((n, 1)), np.zeros((1, 1))
    states, inputs = [], []
    for k in range(len(r)):
        x = A @ x + B @ u
        x_hat = A @ x_hat + B @ u
        x_hat = x_hat + K_e @ (C @ x - C @ x_hat)
        r_now = r[k].reshape(n, 1)
        r_next = r[min(k + 1, len(r) - 1)].reshape(n, 1)
        u = np.clip(B_pinv @ (r_next - A @ r_now) + K @ (r_now - x_hat), -12.0, 12.0)
        states.append(x_hat[:, 0])
        inputs.append(u[0, 0])

    names = ["K"] if n == 1 else ["K_p", "K_d"]
    numbers = dict(zip(names, K[0]))
    for i in range(n):
        suffix = "" if n == 1 else f"_{i + 1}"
        numbers[f"K_e{suffix}"] = K_e[i, 0]
        numbers[f"B_pinv{suffix}"] = B_pinv[0, i]
    return numbers, np.array(states), np.array(inputs)


def reference(figure, source, numbers, series, rows):
    """The JSON that Flyball compares with: `rows` of each series, and extremes and mean of all."""
    return {
        "figure": figure,
        "source": source,
        "tolerance": 1e-9,
        "numbers": [{"name": name, "value": float(value)} for name, value in numbers.items()],
        "series": [
            {
                "name": name,
                "length": len(values),
                "rows": [int(k) for k in rows],
                "values": [float(values[k]) for k in rows],
                "min": float(np.min(values)),
                "max": float(np.max(values)),
                "mean": float(np.mean(values)),
            }
            for name, values in series.items()
        ],
    }


def sampled_rows(samples, events):
    """Every 20th row, the last, and each of the 12 after an event."""
    rows = set(range(0, samples, 20)) | {samples - 1}
    for event in events:
        rows |= set(range(max(event - 2, 0), event + 12))
    return sorted(rows)


def elevator_step():
    """Figure 6.3: numbers, states, inputs."""
    R, Kt, Kv = motor(CIM, 2)
    G, m, r = 42 / 12 * 40 / 14, 6.803886, 0.02762679089
    A_c = np.array([[0.0, 1.0], [0.0, -(G**2) * Kt / (R * r**2 * m * Kv)]])
    B_c = np.array([[0.0], [G * Kt / (R * r * m)]])
    return simulate(A_c, B_c, 0.005, pulse(1.524, 2, 0.005, 2040), [0.02, 0.4], 12.0, [0.05, 1.0], 1e-4)


if __name__ == "__main__":
    record = json.loads(pathlib.Path(__file__).with_name("figure_6_3.json").read_text())
    numbers, states, inputs = elevator_step()
    series = {"position": states[:, 0], "velocity": states[:, 1], "voltage": inputs}
    for entry in record["numbers"]:
        value = numbers[entry["name"]]
        print(entry["name"], "relative difference", abs(value - entry["value"]) / abs(entry["value"]))
    for entry in record["series"]:
        if entry["name"] in series:
            values = series[entry["name"]]
            worst = np.max(np.abs(values[entry["rows"]] - np.array(entry["values"])))
            print(entry["name"], "relative difference", worst / max(abs(entry["min"]), abs(entry["max"])))
