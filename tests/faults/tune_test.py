#!/usr/bin/env python3
"""Allocations of a whole `flyball tune` fail, each in a run of its own.

usage: tune_test.py FLYBALL PRELOADED LOG [--faults N] [--seed N] [--jobs N]

Beside the log stands an earlier report and a file of the user's. After a run with a fault the
report is whole, the earlier or the new one, and nothing but it and the user's file is there; the
status is 2 and "not enough memory" is said, or 0 with a new report where the memory was not needed.
"""

import argparse
import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# What a person wrote into the folder, and what differs between runs that are alike.
NOTE = "note.txt"


def files(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


class Runner:
    def __init__(self, options, folder):
        self.options = options
        self.folder = folder
        self.earlier = folder / "earlier"
        self.run(self.earlier, ["--max-voltage", "6V"], check=True)
        (self.earlier / NOTE).write_text("mine")
        again = folder / "again"
        shutil.copytree(self.earlier, again)
        self.allocations = 0
        count = folder / "count"
        self.run(again, [], check=True, FLYBALL_COUNT_ALLOCATIONS=str(count))
        self.allocations = int(count.read_text())
        self.old = files(self.earlier)
        self.new = files(again)

    def run(self, out, more, check=False, **fault):
        environment = os.environ | {"LD_PRELOAD": self.options.preloaded} | fault
        return subprocess.run(
            [self.options.flyball, "tune", self.options.log, "--out", str(out), *more],
            env=environment, cwd=self.folder, capture_output=True, text=True,
            errors="replace", timeout=600, check=check)

    def fault(self, k, stays_short):
        """What is wrong after the k-th allocation failed."""
        with tempfile.TemporaryDirectory(dir=self.folder) as place:
            report = Path(place) / "report"
            shutil.copytree(self.earlier, report)
            short = {"FLYBALL_MEMORY_STAYS_SHORT": "1"} if stays_short else {}
            try:
                done = self.run(report, [], FLYBALL_FAIL_ALLOCATION=str(k), **short)
            except subprocess.TimeoutExpired:
                return "never ended"
            now = files(report)
            beside = sorted(set(os.listdir(place)) - {"report"})
        wrong = []
        if done.returncode not in (0, 2):
            wrong.append(f"status {done.returncode}")
        if done.returncode == 2 and "not enough memory" not in done.stderr:
            wrong.append("memory is not named")
        if now.get(NOTE) != self.old[NOTE]:
            wrong.append("the user's file is gone")
        # A picture that could not be drawn is left out, and that is said.
        drawn = "could not be drawn" not in done.stderr
        same_names = set(now) == set(self.new)
        # index.html names the command; the fields of a whole report are the same.
        if now != self.old and (not same_names if drawn else not set(now) <= set(self.new)):
            wrong.append("the report is not whole: " + ", ".join(sorted(set(now) ^ set(self.new))))
        elif now != self.old and drawn and any(
                now[name] != self.new[name] for name in self.new if name not in self.varying):
            wrong.append("the report's files differ: " + ", ".join(
                name for name in self.new if now[name] != self.new[name]))
        if done.returncode == 0 and now == self.old:
            wrong.append("success, and no new report")
        if beside:
            wrong.append("left behind: " + ", ".join(beside))
        return "; ".join(wrong) + (": " + done.stderr.strip()[-400:] if wrong else "")

    @property
    def varying(self):
        return (".flyball-report", "index.html")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("flyball")
    parser.add_argument("preloaded")
    parser.add_argument("log")
    parser.add_argument("--faults", type=int, default=int(os.environ.get("FLYBALL_TUNE_FAULTS", 150)))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="flyball-tune-faults-") as folder:
        runner = Runner(options, Path(folder))
        chance = random.Random(options.seed)
        faults = [(chance.randint(1, runner.allocations), chance.random() < 0.25)
                  for _ in range(options.faults)]
        with ThreadPoolExecutor(options.jobs) as pool:
            found = list(pool.map(lambda fault: runner.fault(*fault), faults))
    wrong = [(fault, what) for fault, what in zip(faults, found) if what]
    for (k, stays_short), what in wrong:
        print(f"allocation {k}{' and all after it' if stays_short else ''}: {what}")
    print(f"{len(faults)} of {runner.allocations} allocations failed, {len(wrong)} badly")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
