"""Figure 15.2's reference: the seven phases of the S-curve over 50 m at 7 m/s, 3.5 m/s² after 1 s, each integrated in
closed form from the one before, sampled every 50 ms; the position is the sum of the velocities, as in the book's script.

usage: book/reference/motion_profiles.py   writes figure_15_2.json beside itself
"""

import json
import pathlib

MAX_V, MAX_A, RAMP, DT, GOAL = 7.0, 3.5, 1.0, 0.05, 50.0
J = MAX_A / RAMP
CRUISE = GOAL / MAX_V - MAX_V / MAX_A - RAMP
PHASES = [(RAMP, J), (MAX_V / MAX_A - RAMP, 0.0), (RAMP, -J), (CRUISE, 0.0), (RAMP, -J), (MAX_V / MAX_A - RAMP, 0.0),
          (RAMP, J)]


def sample(t):
    """Velocity and acceleration t seconds after the start."""
    v = a = 0.0
    for duration, jerk in PHASES:
        step = min(t, duration)
        v += a * step + jerk * step * step / 2
        a += jerk * step
        t -= step
        if t <= 0.0:
            return v, a
    return 0.0, 0.0


def main():
    end = sum(duration for duration, _ in PHASES)
    rows = [(0.0, 0.0, 0.0, 0.0)]
    while rows[-1][0] < end:
        t = rows[-1][0] + DT
        v, a = sample(t) if t < end else (0.0, 0.0)
        rows.append((t, rows[-1][1] + v * DT, v, a))
    at = [0, 1, 10, 20, 30, 40, 50, 60, 61, 100, 143, 150, 163, 170, 183, 190, 200, len(rows) - 1]
    series = []
    for k, name in enumerate(["time", "position", "velocity", "acceleration"]):
        column = [row[k] for row in rows]
        series.append({"name": name, "length": len(rows), "rows": at, "values": [column[i] for i in at],
                       "min": min(column), "max": max(column), "mean": sum(column) / len(column)})
    figure = {"figure": "15.2", "source": "the phases in closed form (book/reference/motion_profiles.py); the book's script"
              " has the same parameters", "tolerance": 1e-9, "numbers": [], "series": series}
    path = pathlib.Path(__file__).with_name("figure_15_2.json")
    path.write_text(json.dumps(figure, indent=1) + "\n")


if __name__ == "__main__":
    main()
