#!/usr/bin/env python3
"""Frequency responses and simulations of Flyball beside NumPy's and SciPy's, one thread.

usage: compare.py FREQUENCY_RESPONSE_SIDE [--seed N]

FREQUENCY_RESPONSE_SIDE is the program of this folder. 10^5 points of a 20-state 2x2 system: beside
NumPy's solve of all points at once in blocks of a thousand, which is the fastest that it has.
10^6 steps of a 3-state system: beside scipy.signal.dlsim and lsim.
"""
import argparse
import json
import os
import subprocess
import time

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402  after the number of threads is set
import scipy  # noqa: E402
import scipy.signal as signal  # noqa: E402


def numpy_response(A, B, C, D, w):
    values = np.empty((len(w), C.shape[0], B.shape[1]), complex)
    eye = np.eye(len(A))
    for k in range(0, len(w), 1000):
        part = w[k : k + 1000, None, None]
        values[k : k + 1000] = C @ np.linalg.solve(1j * part * eye - A, B.astype(complex)[None]) + D
    return values


def milliseconds(work, times):
    best = float("inf")
    for _ in range(times):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return 1e3 * best, result


def main():
    arguments = argparse.ArgumentParser(usage=__doc__)
    arguments.add_argument("side")
    arguments.add_argument("--seed", type=int, default=1)
    arguments = arguments.parse_args()
    random = np.random.default_rng(arguments.seed)
    A = random.standard_normal((20, 20))
    A -= (np.linalg.eigvals(A).real.max() + 0.1) * np.eye(20)
    B, C, D = random.standard_normal((20, 2)), random.standard_normal((2, 20)), random.standard_normal((2, 2))
    w = np.logspace(-2, 2, 100_000)
    Ad = np.array([[0.9, 0.1, 0.0], [-0.1, 0.9, 0.05], [0.0, 0.0, 0.8]])
    Bd, Cd, Dd = np.array([[0.0], [0.0], [1.0]]), np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 1))
    u = random.standard_normal(1_000_000)
    problem = {name: value.tolist() for name, value in dict(A=A, B=B, C=C, D=D, w=w, Ad=Ad, Bd=Bd, Cd=Cd, Dd=Dd, u=u).items()}
    side = json.loads(subprocess.run([arguments.side], input=json.dumps(problem), capture_output=True, text=True, check=True).stdout)
    response, values = milliseconds(lambda: numpy_response(A, B, C, D, w), 2)
    dlsim, result = milliseconds(lambda: signal.dlsim((Ad, Bd, Cd, Dd, 0.01), u), 1)
    t = np.arange(len(u)) * 0.01
    lsim, _ = milliseconds(lambda: signal.lsim((np.diag([-1.0, -2.0, -3.0]), np.ones((3, 1)), Cd, Dd), u, t), 1)
    mine = np.array(side["real"]) + 1j * np.array(side["imag"])
    theirs = values[::997].transpose(0, 2, 1).reshape(-1)
    print(f"NumPy {np.__version__}, SciPy {scipy.__version__}")
    print("| task | Flyball, ms | peer | peer, ms | ratio | difference |")
    print("|---|---:|---|---:|---:|---:|")
    difference = np.abs(mine - theirs).max() / np.abs(theirs).max()
    print(f"| response | {side['response_ms']:.1f} | numpy.linalg.solve | {response:.0f} | {response / side['response_ms']:.0f} | {difference:.1e} |")
    difference = abs(side["y_end"] - result[1][-1, 0]) / abs(result[1]).max()
    print(f"| simulation | {side['simulation_ms']:.1f} | scipy.signal.dlsim | {dlsim:.0f} | {dlsim / side['simulation_ms']:.0f} | {difference:.1e} |")
    print(f"| simulation | {side['simulation_ms']:.1f} | scipy.signal.lsim | {lsim:.0f} | {lsim / side['simulation_ms']:.0f} | |")


if __name__ == "__main__":
    main()
