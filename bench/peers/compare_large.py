#!/usr/bin/env python3
"""Large problems of Flyball beside SciPy's on the same matrices, one thread, processor time.

usage: compare_large.py FLYBALL_SIDE [--sizes N,N] [--rounds N] [--part WORD]

FLYBALL_SIDE is the program flyball_side of this folder. The two take turns, problem by problem;
the smallest time of each counts. CAREX 20 is the file of SciPy's own tests, left out where they
are not installed. A SciPy call of more than LIMIT seconds is given up, and the limit shown.
"""
import argparse
import json
import os
import pathlib
import signal
import subprocess
import time

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402  after the number of threads is set
import scipy  # noqa: E402
import scipy.linalg as la  # noqa: E402
import scipy.signal  # noqa: E402

LIMIT = 60.0  # Seconds of processor time.


class TooLong(Exception):
    pass


def too_long(*_):
    raise TooLong


def chain(n):
    """n // 2 lightly damped masses in a row between two walls; an odd state decays by itself."""
    m = n // 2
    K = -2.0 * np.eye(m) + np.eye(m, k=1) + np.eye(m, k=-1)
    A = -np.eye(n)
    A[: 2 * m, : 2 * m] = np.block([[np.zeros((m, m)), np.eye(m)], [K, 0.01 * K]])
    B = np.zeros((n, 1))
    B[m, 0] = 1.0
    B[2 * m:, 0] = 1.0
    return A, B


def problems_of(n):
    random = np.random.default_rng(n)
    G = random.standard_normal((n, n)) / np.sqrt(n)
    eigenvalues = np.linalg.eigvals(G)
    m = n // 2
    B = random.standard_normal((n, m))
    C = random.standard_normal((n, n))
    weights = {"Q": np.eye(n), "R": np.eye(m)}
    unstable = G * 1.05 / np.abs(eigenvalues).max()
    A, b = chain(n)
    sampled = la.expm(0.1 * A)
    stepped = np.linalg.solve(A, (sampled - np.eye(n)) @ b)
    one = {"Q": np.eye(n), "R": np.eye(1)}
    stable = G - (eigenvalues.real.max() + 0.05) * np.eye(n)
    shrinking = G * 0.9 / np.abs(eigenvalues).max()
    return [("random", {"kind": "care", "A": unstable, "B": B} | weights),
            ("random", {"kind": "dare", "A": unstable, "B": B} | weights),
            ("random", {"kind": "lyapunov", "A": stable, "Q": C.T @ C}),
            ("random", {"kind": "discrete-lyapunov", "A": shrinking, "Q": C.T @ C}),
            ("random", {"kind": "logm", "A": la.expm(G)}),
            ("random", {"kind": "place", "A": G, "B": B,
                        "poles": -np.linspace(0.5, 5.0, n)[None, :]}),
            ("chain", {"kind": "care", "A": A, "B": b} | one),
            ("chain", {"kind": "dare", "A": sampled, "B": stepped} | one),
            ("chain", {"kind": "lyapunov", "A": A, "Q": np.eye(n)}),
            ("chain", {"kind": "discrete-lyapunov", "A": sampled, "Q": np.eye(n)}),
            ("chain", {"kind": "logm", "A": sampled})]


def carex_20():
    file = pathlib.Path(la.__file__).parent / "tests/data/carex_20_data.npz"
    if not file.exists():
        return []
    data = np.load(file)
    return [("CAREX 20", {"kind": "care"} | {k: data[k].astype(float) for k in "ABQR"})]


def scipy_time(p):
    work = {
        "dare": lambda: la.solve_discrete_are(p["A"], p["B"], p["Q"], p["R"]),
        "care": lambda: la.solve_continuous_are(p["A"], p["B"], p["Q"], p["R"]),
        "lyapunov": lambda: la.solve_continuous_lyapunov(p["A"], -p["Q"]),
        "discrete-lyapunov": lambda: la.solve_discrete_lyapunov(p["A"], p["Q"], method="bilinear"),
        "logm": lambda: la.logm(p["A"], disp=False),
        "place": lambda: scipy.signal.place_poles(p["A"], p["B"], p["poles"][0]),
    }[p["kind"]]
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    start = time.process_time()
    try:
        work()
    except TooLong:
        return np.inf
    except (np.linalg.LinAlgError, ValueError):
        return np.nan
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return (time.process_time() - start) * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flyball_side")
    parser.add_argument("--sizes", default="200,421")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--part", default="")
    arguments = parser.parse_args()
    signal.signal(signal.SIGPROF, too_long)
    problems = [p for n in arguments.sizes.split(",") for p in problems_of(int(n))] + carex_20()
    print(f"| function | n | Flyball, ms | SciPy {scipy.__version__}, ms | ratio |")
    print("|---|---:|---:|---:|---:|")
    with subprocess.Popen([arguments.flyball_side], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as side:
        for name, p in problems:
            title = f"`{p['kind']}`, {name}"
            if arguments.part not in title:
                continue
            line = json.dumps({k: v.tolist() if isinstance(v, np.ndarray) else v
                               for k, v in p.items()}) + "\n"
            ours = theirs = np.inf
            for _ in range(arguments.rounds):
                side.stdin.write(line)
                side.stdin.flush()
                time_of_ours = float(side.stdout.readline())
                ours = min(ours, time_of_ours / 1e3 if time_of_ours >= 0.0 else np.nan)
                theirs = min(theirs, scipy_time(p))
                if not theirs < 1e4:
                    break
            if np.isinf(theirs):
                peer, ratio = f"over {LIMIT * 1e3:.0f}", f"over {LIMIT * 1e3 / ours:.3g}"
            elif np.isnan(theirs):
                peer, ratio = "fails", ""
            else:
                peer, ratio = f"{theirs:.4g}", f"{theirs / ours:.3g}"
            print(f"| {title} | {len(p['A'])} | {ours:.4g} | {peer} | {ratio} |", flush=True)
        side.stdin.close()


if __name__ == "__main__":
    main()
