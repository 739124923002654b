"""An independent computation of Appendix E's figures, with NumPy and SciPy only.

Nothing of Flyball is in it. `python3 appendix_e.py FOLDER` writes the reference numbers of the figures
of which the book's own scripts left no record (E.22, E.24), or of which they draw something else
than the text says (the columns without "script" of E.11, E.14, E.21 and those "at_rest" of E.23 to
E.25), and of Table E.1. What the scripts recorded stands in the same files, and agrees with this
script, where it computes the same, to 1e-14. Made with Python 3.11, NumPy 1.24.2, SciPy 1.10.1.
"""

import json
import math
import pathlib
import sys

import numpy as np
from closed_loop import CIM, motor, reference, zero_order_hold
from scipy.linalg import solve_discrete_are

TONES = {"F4": 349.23, "A4": 440.0, "C4": 261.63}


def elevator():
    R, Kt, Kv = motor(CIM, 2)
    G, m, r = 42 / 12 * 40 / 14, 6.803886, 0.02762679089
    A = np.array([[0.0, 1.0], [0.0, -(G**2) * Kt / (R * r**2 * m * Kv)]])
    return A, np.array([[0.0], [G * Kt / (R * r * m)]])


def discrete(method, T):
    A, B = elevator()
    I = np.eye(2)
    if method == "zoh":
        return zero_order_hold(A, B, T)
    if method == "forward_euler":
        return I + A * T, B * T
    if method == "backward_euler":
        X = np.linalg.inv(I - A * T)
        return X, X @ B * T
    X = np.linalg.inv(I - A * T / 2)
    return X @ (I + A * T / 2), X @ B * T


class Controller:
    """LQR by Bryson's rule and plant inversion; it remembers its last voltage and reference."""

    def __init__(self, T):
        self.A, self.B = discrete("zoh", T)
        Q, R = np.diag([1 / 0.02**2, 1 / 0.4**2]), np.array([[1 / 12**2]])
        S = solve_discrete_are(self.A, self.B, Q, R)
        self.K = np.linalg.solve(R + self.B.T @ S @ self.B, self.B.T @ S @ self.A)
        self.B_pinv = np.linalg.pinv(self.B)
        self.u, self.r = np.zeros((1, 1)), np.zeros((2, 1))

    def run(self, method, T):
        A, B = discrete(method, T)
        t = np.arange(0, 6.2, T)
        r = np.where((t >= 0.1) & (t < 5.1), 1.524, 0.0)
        x, rows = np.zeros((2, 1)), []
        for k in range(len(r)):
            x = A @ x + B @ self.u
            r_now, r_next = (np.array([[r[i]], [0.0]]) for i in (k, min(k + 1, len(r) - 1)))
            u_ff = self.B_pinv @ (r_next - self.A @ self.r)
            self.r = r_next
            self.u = np.clip(u_ff + self.K @ (r_now - x), -12.0, 12.0)
            rows.append(x[:, 0])
        return np.array(rows)


def velocity_columns():
    """Figures E.21 and E.22: columns of either, by definition and as the script has them."""
    dt, n, stretch = 0.005, 1240, 20
    states = Controller(dt).run("zoh", dt)
    v = states[:, 1]
    start = np.arange(n) // stretch * stretch
    end = start + stretch
    inside = end < n
    fraction = (np.arange(n) - start) / stretch
    line = np.where(inside, v[start] + fraction * (v[np.minimum(end, n - 1)] - v[start]), 0.0)
    # The script's floor(k dt/T) T/dt, whose rounding sometimes begins a stretch one sample late.
    floors = [math.floor(k * dt / 0.1) for k in range(n)]
    script_start = v[[int(floor * 0.1 / dt) for floor in floors]]
    script_end = np.array([v[int((floor + 1) * 0.1 / dt)] if int((floor + 1) * 0.1 / dt) < n else 0.0 for floor in floors])
    last = np.flatnonzero(inside)[-1]
    velocities = {
        "velocity": v,
        "forward_euler": v[start],
        "backward_euler": v[np.minimum(end, n - 1)],
        "bilinear": np.where(inside, line, line[last]),
        "script_forward_euler": np.where(inside, script_end, script_end[last]),
        "script_backward_euler": script_start,
    }
    positions = {
        "position": states[:, 0],
        "forward_euler": np.cumsum(v[start]) * dt,
        "backward_euler": np.cumsum(v[np.minimum(end, n - 1)]) * dt,
        "bilinear": np.cumsum(line) * dt,
        "script_forward_euler": np.cumsum(script_end) * dt,
        "script_backward_euler": np.cumsum(script_start) * dt,
    }
    return velocities, positions


def sampling_columns():
    """Figures E.23 to E.25: {period: columns}."""
    columns, shared = {}, Controller(0.1)
    for T in (0.1, 0.05, 0.01):
        columns[T] = {}
        for method in ("zoh", "forward_euler", "backward_euler", "bilinear"):
            columns[T][method] = shared.run(method, T)[:, 0]
        for method in ("zoh", "forward_euler", "backward_euler", "bilinear"):
            columns[T][method + "_at_rest"] = Controller(0.1).run(method, T)[:, 0]
    return columns


def chord_transform():
    """Figure E.14's columns: the sum at s = σ + 2πjf, and the script's product at s = σ + jf."""
    sigma, f = np.meshgrid(np.linspace(-150, 150, 500), np.linspace(200, 500, 500), indexing="ij")
    s = sigma + 2j * math.pi * f
    total = sum(w / (s**2 + w**2) for w in (2 * math.pi * tone for tone in TONES.values()))
    wrong = np.prod([tone / ((sigma + 1j * f) ** 2 + tone**2) for tone in TONES.values()], axis=0)
    return {"magnitude": np.minimum(abs(total), 30).ravel(), "script_product": np.minimum(abs(wrong), 30).ravel()}


def laplace_table():
    """Table E.1's closed forms."""
    s = 0.5 * np.arange(1, 11)
    F = 2 / (s + 1) ** 3
    G = 2 / ((s + 0.5) ** 2 + 4)
    return {
        "linearity": 3 * F - 2 * G,
        "convolution": F * G,
        "derivative": s * F,
        "second_derivative": s**2 * F,
        "unit_step": 1 / s,
        "ramp": 1 / s**2,
        "exponential_decay": 1 / (s + 2),
    }


def main(folder):
    source = "independent script: book/reference/appendix_e.py, SciPy 1.10.1"

    def write(figure, columns, rows, numbers=None):
        name = figure.replace(" ", "_").replace(".", "_")
        name = name if name.startswith("table") else "figure_" + name
        text = json.dumps(reference(figure, source, numbers or {}, columns, rows), indent=1)
        pathlib.Path(folder, name + ".json").write_text(text + "\n")

    velocities, positions = velocity_columns()
    gains = dict(zip(("K_p", "K_d"), Controller(0.005).K[0]))
    rows = sorted({*range(0, 1240, 31), 19, 20, 21, 39, 40, 41, 199, 200, 219, 220, 1219, 1220, 1239})
    write("E.21", velocities, rows, gains)
    write("E.22", positions, rows)
    gains = dict(zip(("K_p", "K_d"), Controller(0.1).K[0]))
    for (T, columns), figure in zip(sampling_columns().items(), ("E.23", "E.24", "E.25")):
        n = len(columns["zoh"])
        write(figure, columns, sorted({*range(0, n, max(n // 40, 1)), 1, n - 1}), gains)
    write("E.14", chord_transform(), [500 * i + j for i in (0, 100, 250, 399, 499) for j in (0, 103, 250, 400, 499)])
    N = 1000000
    frequency = {"frequency": np.arange(N // 2) / (N * 0.0005), "script_frequency": np.linspace(0, 1000, N // 2)}
    write("E.11", frequency, [0, 1, 130815, 174615, 220000, 499999])
    pairs = laplace_table()
    pairs |= {name + "_closed": values for name, values in pairs.items()}
    write("table E.1", pairs, range(10))


if __name__ == "__main__":
    main(sys.argv[1])
