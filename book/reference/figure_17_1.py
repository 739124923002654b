#!/usr/bin/env python3
"""Figures 17.1 to 17.3: the optimum of section 17.1.1 from its structure, u = 1, 0, -1, 1 with one value
between at each switch; /usr/bin/python3 book/reference/figure_17_1.py writes the three files.

The switches are those for which the adjoint, by p⁺ = p + v dt and v⁺ = v + u dt,
    λ_p,k-1 = λ_p,k - 2 (r - p_k),  λ_v,k-1 = λ_v,k + dt λ_p,k,
has the sign of -u and vanishes where u is between its bounds; the script checks it with exact fractions.
"""

import json
import pathlib
from fractions import Fraction as F

N, dt, r = 700, F(1, 200), F(2)
between = F(44, 49)
u = [F(1)] * 200 + [F(0)] * 210 + [-between] + [F(-1)] * 244 + [between] + [F(1)] * 44
p, v = [F(0)], [F(0)]
for k in range(N):
    p.append(p[k] + v[k] * dt)
    v.append(v[k] + u[k] * dt)
assert (p[N], v[N]) == (r, F(0)) and max(v) == 1 and min(v) >= -1

# λ from two unknowns at the end, fixed by λ_v = 0 at the two values between (the speed limit is left at k = 410).
def adjoint(a, b):
    lp, lv = [None] * N, [None] * N
    lp[N - 1], lv[N - 1] = a, b
    for k in range(N - 1, 0, -1):
        lp[k - 1] = lp[k] - 2 * (r - p[k])
        lv[k - 1] = lv[k] + dt * lp[k]
    return lv


zero, by_a, by_b = adjoint(F(0), F(0)), adjoint(F(1), F(0)), adjoint(F(0), F(1))
rows = [(by_a[k] - zero[k], by_b[k] - zero[k], -zero[k]) for k in (410, 655)]
det = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]
a = (rows[0][2] * rows[1][1] - rows[0][1] * rows[1][2]) / det
b = (rows[0][0] * rows[1][2] - rows[0][2] * rows[1][0]) / det
lv = adjoint(a, b)
assert all(lv[k] > 0 for k in range(411, 655)) and all(lv[k] < 0 for k in range(656, N))

cost = sum((r - x) ** 2 for x in p)
for name, figure, values in (("position", "17.1", p), ("velocity", "17.2", v), ("acceleration", "17.3", u)):
    at = [0, 1, 100, 199, 200, 300, 409, 410, 411, 500, 600, 654, 655, 656, len(values) - 1]
    numbers = [float(x) for x in values]
    document = {
        "figure": figure,
        "source": "the optimum from its structure, in exact fractions (book/reference/figure_17_1.py)",
        "tolerance": 1e-9,
        "numbers": [{"name": "cost", "value": float(cost)}],
        "series": [{"name": name, "length": len(numbers), "rows": at, "values": [numbers[k] for k in at],
                    "min": min(numbers), "max": max(numbers), "mean": float(sum(values) / len(values))}],
    }
    path = pathlib.Path(__file__).parent / f"figure_{figure.replace('.', '_')}.json"
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
