#!/usr/bin/env python3
"""How large a report's page is, how soon it answers, and how smoothly long logs move in headless
Chromium without a graphics processor. Prints each beside what it must reach.

usage: report_page.py COMMAND LOG
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

FRAMES = 120
# Three panels, four curves of 100 000 points: zoomed and moved in every frame.
MOVE = """
const [frames, done] = arguments;
const count = 100000;
const x = Float64Array.from({length: count}, (_, i) => i / 200);
const noise = i => 0.1 * Math.sin(i * i);
const line = (label, style, color, y) => ({label, style, color, x, y});
const panel = (y, lines) => ({y, lines, bands: [], marks: [], spans: [], notes: [], ticks: []});
const live = document.querySelector('main').insertBefore(document.createElement('div'),
                                                         document.querySelector('main').firstChild);
scrollTo(0, 0);
const plot = new flyball.TimePlot({title: 'long', x: 'Time (s)', clock: '', panels: [
  panel('Velocity (m/s)', [line('measured', 'solid', 0, x.map((t, i) => Math.sin(t / 9) + noise(i))),
                           line('simulated', 'dashed', 1, x.map(t => Math.sin(t / 9)))]),
  panel('Residual (m/s)', [line('', 'solid', 2, x.map((t, i) => noise(i)))]),
  panel('Voltage (V)', [line('', 'solid', 3, x.map(t => 12 * Math.sin(t / 20)))])]}, live);
const [first, last] = plot.extent;
let frame = 0;
let begin;
const step = now => {
  begin = begin === undefined ? now : begin;
  if (frame === frames) return done(1000 * frames / (now - begin));
  const middle = first + (last - first) * (0.5 + 0.3 * Math.sin(frame / 9));
  const half = (last - first) * (0.05 + 0.45 * Math.abs(Math.cos(frame / 25)));
  plot.show([middle - half, middle + half]);
  ++frame;
  requestAnimationFrame(step);
};
setTimeout(() => requestAnimationFrame(step), 500);
"""


def browser():
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1100,1000"):
        options.add_argument(argument)
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    driver.set_script_timeout(120)
    driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
    return driver


def cpu(driver):
    """Seconds that the page's thread has computed: what a busy machine adds is not in it."""
    metrics = driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return next(metric["value"] for metric in metrics if metric["name"] == "TaskDuration")


def show(what, value, unit, wanted):
    print(f"{what:44} {value:9.4g} {unit:9} must be {wanted}")


def main(command, log):
    with tempfile.TemporaryDirectory() as folder:
        arguments = [command, "tune", log, "--out", folder + "/report"]
        times = []
        for _ in range(5):
            begin = time.monotonic()
            subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            times.append(time.monotonic() - begin)
        page = pathlib.Path(folder) / "report" / "index.html"
        show("tune with its report, the best of 5", min(times), "s", "at most 1.5")
        show("the page", page.stat().st_size / 1e6, "MB", "at most 1")
        driver = browser()
        ready = []
        for _ in range(5):
            driver.get(page.as_uri())
            time.sleep(0.5)
            ready.append(driver.execute_script(
                "return performance.getEntriesByName('interactive')[0].startTime"))
        show("until it is interactive, the best of 5", min(ready), "ms", "under 300")
        before = cpu(driver)
        frames = driver.execute_async_script(MOVE, FRAMES)
        work = 1000 * (cpu(driver) - before) / FRAMES
        show("100 000 points, zoomed and moved", frames, "frames/s", "at least 30")
        show("  the page's computing in each frame", work, "ms", "under 33")
        driver.quit()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())
