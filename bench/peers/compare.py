#!/usr/bin/env python3
"""Whole functions of Flyball beside SciPy's and Octave's on the same random problems, one thread.

usage: compare.py FLYBALL_SIDE [--seed N]

FLYBALL_SIDE is the program flyball_side of this folder. The three run one after the other, three
times over, and the smallest time of each problem counts. Octave (with its control package) is left
out where it is not installed.
"""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402  after the number of threads is set
import scipy  # noqa: E402
import scipy.linalg as la  # noqa: E402

SIZES = (2, 5, 10, 20, 50, 100)
KINDS = ("dare", "care", "lyapunov", "discrete-lyapunov", "expm")
PER_SIZE = 4


def problem(random, kind, n):
    A = random.standard_normal((n, n))
    if kind == "expm":
        return {"kind": kind, "A": A / np.abs(A).sum(axis=0).max() * 5.0}
    if kind == "lyapunov":
        A -= (np.linalg.eigvals(A).real.max() + 0.5) * np.eye(n)
    else:
        A *= (1.05 if kind in ("dare", "care") else 0.9) / np.abs(np.linalg.eigvals(A)).max()
    m = max(1, n // 2)
    C = random.standard_normal((n, n))
    result = {"kind": kind, "A": A, "Q": C.T @ C}
    if kind in ("dare", "care"):
        result |= {"B": random.standard_normal((n, m)), "R": np.eye(m)}
    return result


def scipy_time(p):
    work = {
        "dare": lambda: la.solve_discrete_are(p["A"], p["B"], p["Q"], p["R"]),
        "care": lambda: la.solve_continuous_are(p["A"], p["B"], p["Q"], p["R"]),
        "lyapunov": lambda: la.solve_continuous_lyapunov(p["A"], -p["Q"]),
        "discrete-lyapunov": lambda: la.solve_discrete_lyapunov(p["A"], p["Q"]),
        "expm": lambda: la.expm(p["A"]),
    }[p["kind"]]
    if p["kind"] == "discrete-lyapunov" and len(p["A"]) > 50:
        work = lambda: la.solve_discrete_lyapunov(p["A"], p["Q"], method="bilinear")  # noqa: E731
    best = float("inf")
    deadline = time.perf_counter() + 0.06
    calls = 0
    while calls < 5 or time.perf_counter() < deadline:
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
        calls += 1
    return best * 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flyball_side")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    here = pathlib.Path(__file__).parent
    octave = shutil.which("octave-cli") or shutil.which("octave")
    random = np.random.default_rng(arguments.seed)
    problems = [problem(random, kind, n) for kind in KINDS for n in SIZES for _ in range(PER_SIZE)]
    lines = "".join(json.dumps({k: v.tolist() if isinstance(v, np.ndarray) else v
                                for k, v in p.items()}) + "\n" for p in problems)
    times = {"Flyball": [], f"SciPy {scipy.__version__}": []}
    if octave:
        version = subprocess.run([octave, "--eval", "printf(version())"], capture_output=True,
                                 text=True, check=True).stdout
        times[f"Octave {version}"] = []
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "problems.jsonl"
        file.write_text(lines)
        for _ in range(3):
            for name, runs in times.items():
                if name == "Flyball":
                    answer = subprocess.run([arguments.flyball_side], input=lines,
                                            capture_output=True, text=True, check=True).stdout
                elif name.startswith("SciPy"):
                    runs.append([scipy_time(p) for p in problems])
                    continue
                else:
                    answer = subprocess.run([octave, str(here / "octave_side.m"), str(file)],
                                            capture_output=True, text=True, check=True).stdout
                runs.append([float(t) for t in answer.split()])
    best = {name: np.min(np.array(runs), axis=0) for name, runs in times.items()}
    peers = [name for name in best if name != "Flyball"]
    print(f"| function | n | Flyball, µs | {' | '.join(f'{p}, µs | ratio' for p in peers)} |")
    print("|---|---:|---:|" + "---:|---:|" * len(peers))
    for i, kind in enumerate(KINDS):
        for j, n in enumerate(SIZES):
            part = slice((i * len(SIZES) + j) * PER_SIZE, (i * len(SIZES) + j + 1) * PER_SIZE)
            ours = best["Flyball"][part]
            cells = "".join(f" {best[p][part].mean():.4g} | {best[p][part].sum() / ours.sum():.3g} |"
                            for p in peers)
            print(f"| {kind} | {n} | {ours.mean():.4g} |{cells}")


if __name__ == "__main__":
    main()
