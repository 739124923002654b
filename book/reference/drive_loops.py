"""An independent computation of the drive figures of chapter 8, with NumPy and SciPy only.

Nothing of Flyball is in it: the quintic path and its times written out, SciPy's exponential and
Riccati solver, Dormand and Prince's fifth-order step, the loop by hand. `python3 drive_loops.py`
compares Figures 8.5, 8.7, 8.11 and 8.13 with what the book's own scripts gave, where that record
is (book_reference.json, given as the first argument), and answers the largest difference relative
to each series' size. The figures without a record, 8.3, 8.8 and 8.9, come from here:
chapter_8.py. Made with Python 3.11, NumPy 1.24.2, SciPy 1.10.1.

The observer has no noise to filter and the model is exact, so its estimate is the state.
"""

import json
import math
import sys

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from closed_loop import CIM, motor, zero_order_hold

MASS, RADIUS, HALF_TRACK, INERTIA, GEARING = 52.0, 0.08255 / 2, 0.59055 / 2, 6.0, 60.0 / 11.0


def velocity_model(motors):
    """A and B of Theorem 8.7.1."""
    R, Kt, Kv = motor(CIM, motors)
    C1 = -(GEARING**2) * Kt / (Kv * R * RADIUS**2)
    C2 = GEARING * Kt / (R * RADIUS)
    p = 1 / MASS + HALF_TRACK**2 / INERTIA
    q = 1 / MASS - HALF_TRACK**2 / INERTIA
    return np.array([[p * C1, q * C1], [q * C1, p * C1]]), np.array([[p * C2, q * C2], [q * C2, p * C2]])


def dlqr(A_c, B_c, dt, Q_tolerance, R_tolerance):
    A, B = zero_order_hold(A_c, B_c, dt)
    Q = np.diag([1 / q**2 for q in Q_tolerance])
    R = np.diag([1 / r**2 for r in R_tolerance])
    P = solve_discrete_are(A, B, Q, R)
    return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)


def exact_dlqr(A_c, B_c, dt, Q_tolerance, R_tolerance, digits=60):
    """The same with 60 digits, by doubling: near rest the cross-track error is hardly controllable,
    and SciPy has five digits of its gain."""
    from decimal import Decimal, getcontext

    getcontext().prec = digits
    number = np.vectorize(Decimal, otypes=[object])

    def inverse(M):
        n = len(M)
        W = np.hstack((M.copy(), number(np.eye(n))))
        for i in range(n):
            pivot = i + max(range(n - i), key=lambda k: abs(W[i + k, i]))
            W[[i, pivot]] = W[[pivot, i]]
            W[i] = W[i] / W[i, i]
            for k in range(n):
                if k != i:
                    W[k] = W[k] - W[k, i] * W[i]
        return W[:, n:]

    n = len(A_c)
    # The exponential's series of the exact A and B.
    M = number(np.zeros((n + B_c.shape[1],) * 2))
    M[:n, :n], M[:n, n:] = number(A_c), number(B_c)
    M = M * Decimal(dt)
    term = power = number(np.eye(len(M)))
    for k in range(1, 60):
        term = term.dot(M) / Decimal(k)
        power = power + term
    A, B = power[:n, :n], power[:n, n:]
    R = number(np.diag([1 / r**2 for r in R_tolerance]))
    H = number(np.diag([1 / q**2 for q in Q_tolerance]))
    G, V, I = B.dot(inverse(R)).dot(B.T), A, number(np.eye(n))
    for _ in range(60):
        W = inverse(I + G.dot(H))
        G, H, V = G + V.dot(W).dot(G).dot(V.T), H + V.T.dot(H).dot(W).dot(V), V.dot(W).dot(V)
    return (inverse(R + B.T.dot(H).dot(B)).dot(B.T).dot(H).dot(A)).astype(float)


def trajectory(period=0.02):
    """Rows of x, y, heading, left and right velocity: WPILib's path and times of the figures."""
    start, end = np.array([1.330117, 13.0]), np.array([10.17, 18.0])
    pull = 1.2 * np.linalg.norm(end - start)
    # Quintic Hermite with zero second derivatives and tangents along x.
    tangent = np.array([pull, 0.0])
    rise = end - start
    c = [start, tangent, np.zeros(2), 10 * rise - 6 * tangent - 4 * tangent,
         -15 * rise + 8 * tangent + 7 * tangent, 6 * rise - 3 * tangent - 3 * tangent]

    def point(t):
        d = sum(k * c[k] * t ** (k - 1) for k in range(1, 6))
        dd = sum(k * (k - 1) * c[k] * t ** (k - 2) for k in range(2, 6))
        p = sum(c[k] * t**k for k in range(6))
        return (*p, math.atan2(d[1], d[0]), (d[0] * dd[1] - dd[0] * d[1]) / math.hypot(*d) ** 3)

    def twist(a, b):
        turn = math.remainder(b[2] - a[2], 2 * math.pi)
        dx, dy = b[0] - a[0], b[1] - a[1]
        x = math.cos(a[2]) * dx + math.sin(a[2]) * dy
        y = -math.sin(a[2]) * dx + math.cos(a[2]) * dy
        half = turn / 2
        cot = half / math.tan(half) if abs(turn) > 1e-9 else 1 - turn**2 / 12
        return cot * x + half * y, cot * y - half * x, turn

    points = [point(0.0)]
    stack = [(0.0, 1.0)]
    while stack:
        a, b = stack.pop()
        dx, dy, turn = twist(point(a), point(b))
        if abs(dy) > 0.00127 or abs(dx) > 0.127 or abs(turn) > 0.0872:
            middle = (a + b) / 2
            stack += [(middle, b), (a, middle)]
        else:
            points.append(point(b))
    length = np.concatenate(([0.0], np.cumsum([math.hypot(q[0] - p[0], q[1] - p[1]) for p, q in zip(points, points[1:])])))
    v = np.minimum(3.5, np.sqrt(2 * 3.5 * np.minimum(length, length[-1] - length)))
    t = np.concatenate(([0.0], np.cumsum(2 * np.diff(length) / (v[1:] + v[:-1]))))
    rows = []
    for time in np.arange(0, t[-1], period):
        i = min(np.searchsorted(t, time, side="right"), len(t) - 1)
        a, b = points[i - 1], points[i]
        dt, span = time - t[i - 1], t[i] - t[i - 1]
        acceleration = (v[i] - v[i - 1]) / span
        f = (v[i - 1] * dt + acceleration * dt**2 / 2) / (length[i] - length[i - 1])
        # Position and heading in proportion: WPILib's interpolation of the transform, not of a twist.
        speed = v[i - 1] + acceleration * dt
        bend = a[3] + f * (b[3] - a[3])
        rows.append((a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]),
                     a[2] + f * math.remainder(b[2] - a[2], 2 * math.pi),
                     speed * (1 - bend * HALF_TRACK), speed * (1 + bend * HALF_TRACK)))
    return np.array(rows)


def dormand_prince(f, x, h):
    """One step of the fifth-order formula."""
    a = [[], [1 / 5], [3 / 40, 9 / 40], [44 / 45, -56 / 15, 32 / 9],
         [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
         [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656]]
    b = [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]
    k = []
    for row in a:
        k.append(f(x + h * sum((c * s for c, s in zip(row, k)), np.zeros_like(x))))
    return x + h * sum(c * s for c, s in zip(b, k))


class Drive:
    def __init__(self, motors=3, dt=0.02):
        self.dt = dt
        self.A_v, self.B_v = velocity_model(motors)
        self.B = np.vstack((np.zeros((3, 2)), self.B_v))

    def f(self, x, u):
        v = (x[3] + x[4]) / 2
        return np.concatenate(([v * math.cos(x[2]), v * math.sin(x[2]), (x[4] - x[3]) / (2 * HALF_TRACK)],
                               self.A_v @ x[3:] + self.B_v @ u))

    def jacobian(self, heading, v):
        s, c = math.sin(heading), math.cos(heading)
        A = np.zeros((5, 5))
        A[0, 2:] = -v * s, c / 2, c / 2
        A[1, 2:] = v * c, s / 2, s / 2
        A[2, 3:] = -1 / (2 * HALF_TRACK), 1 / (2 * HALF_TRACK)
        A[3:, 3:] = self.A_v
        return A


def simulate(law, first_order=False):
    """Rows of state and input. @param law  (drive, x, r) -> the feedback's voltages."""
    drive = Drive()
    r = trajectory()
    x = np.array([r[0, 0] + 0.5, r[0, 1] + 0.5, math.pi / 2, 0.0, 0.0])
    u = np.zeros(2)
    states, inputs = [], []
    for k in range(len(r)):
        if k > 0:
            if first_order:
                A, B = zero_order_hold(drive.jacobian(x[2], (x[3] + x[4]) / 2), drive.B, drive.dt)
                x = A @ x + B @ u
            else:
                for _ in range(4):
                    x = dormand_prince(lambda at: drive.f(at, u), x, drive.dt / 4)
        ahead = r[min(k + 1, len(r) - 1)]
        feedforward = np.linalg.pinv(drive.B) @ ((ahead - r[k]) / drive.dt - drive.f(r[k], np.zeros(2)))
        u = law(drive, x, r[k]) + feedforward
        u = u / max(1.0, np.abs(u).max() / 12.0)
        states.append(x)
        inputs.append(u)
    return r, np.array(states), np.array(inputs)


TOLERANCES = [0.05, 0.125, 10.0, 0.95, 0.95]


def global_frame(drive, x, r):
    """8.4 to 8.7: the regulator of the model linearised where the robot is."""
    v = (x[3] + x[4]) / 2
    K = dlqr(drive.jacobian(x[2], v if abs(v) >= 1e-9 else 1e-9), drive.B, drive.dt, TOLERANCES, [12, 12])
    return K @ (r - x)


def cross_track(drive, x, r):
    """8.8 and 8.9, Theorem 8.7.4."""
    v = (x[3] + x[4]) / 2
    slow = abs(v) < 1e-6
    design = exact_dlqr if slow else dlqr
    K = design(drive.jacobian(0.0, v if abs(v) >= 1e-9 else 1e-9), drive.B, drive.dt, TOLERANCES, [12, 12])
    s, c = math.sin(x[2]), math.cos(x[2])
    e = r - x
    e[:2] = c * e[0] + s * e[1], -s * e[0] + c * e[1]
    return K @ e


def wheels(v, omega):
    return np.array([v - omega * HALF_TRACK, v + omega * HALF_TRACK])


def robot_error(x, r):
    s, c = math.sin(x[2]), math.cos(x[2])
    return np.array([c * (r[0] - x[0]) + s * (r[1] - x[1]), -s * (r[0] - x[0]) + c * (r[1] - x[1]), r[2] - x[2]])


def velocity_feedback(drive, x, wanted):
    return dlqr(drive.A_v, drive.B_v, drive.dt, [0.95, 0.95], [12, 12]) @ (wanted - x[3:])


def ramsete(sinc, b=2.0, zeta=0.7):
    """8.10 and 8.11, Theorem 8.8.2."""

    def law(drive, x, r):
        v_d, omega_d = (r[3] + r[4]) / 2, (r[4] - r[3]) / (2 * HALF_TRACK)
        e = robot_error(x, r)
        k = 2 * zeta * math.sqrt(omega_d**2 + b * v_d**2)
        v = v_d * math.cos(e[2]) + k * e[0]
        omega = omega_d + k * e[2] + b * v_d * sinc(e[2]) * e[1]
        return velocity_feedback(drive, x, wheels(v, omega))

    return law


def unicycle(drive, x, r, slow_design=dlqr):
    """8.12 and 8.13, Theorem 8.9.1."""
    v_d, omega_d = (r[3] + r[4]) / 2, (r[4] - r[3]) / (2 * HALF_TRACK)
    A = np.zeros((3, 3))
    A[1, 2] = v_d if abs(v_d) >= 1e-9 else 1e-9
    B = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    design = slow_design if abs(v_d) < 1e-6 else dlqr
    K = design(A, B, drive.dt, [0.0625, 0.125, 2.5], [0.95, 0.95])
    v, omega = np.array([v_d, omega_d]) + K @ robot_error(x, r)
    return velocity_feedback(drive, x, wheels(v, omega))


def sinc_of_text(e):
    return np.sinc(e / math.pi)


if __name__ == "__main__":
    record = json.load(open(sys.argv[1]))["figures"]
    cases = [
        ("8.5", "simulations", simulate(global_frame, first_order=True)),
        ("8.7", "simulations", simulate(global_frame)),
        ("8.11", "simulations", simulate(ramsete(np.sinc))),
        ("8.11", "simulations_true_sinc", simulate(ramsete(sinc_of_text))),
        ("8.13", "simulations", simulate(unicycle)),
    ]
    for figure, key, (r, states, inputs) in cases:
        points = record[figure]["expected"][key][0]["checkpoints"]
        worst = {}
        for name, ours in (("r", r), ("x", states), ("u", inputs)):
            theirs = np.array(points[name])
            worst[name] = float((np.abs(ours[points["k"]] - theirs) / np.abs(theirs).max(axis=0)).max())
        print(figure, key, worst)
