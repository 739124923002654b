#!/usr/bin/env python3
"""What a browser makes of a report: headless Chromium, without a network.

usage: report_page_test.py COMMAND EXAMPLES
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

command, examples = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
SHIFT = Keys.SHIFT


def browser():
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                     "--force-device-scale-factor=1", "--window-size=1100,1000"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    driver.set_script_timeout(60)
    driver.execute_cdp_cmd("Network.enable", {})
    driver.execute_cdp_cmd("Network.emulateNetworkConditions",
                           {"offline": True, "latency": 0, "downloadThroughput": 0,
                            "uploadThroughput": 0})
    return driver


def tune(folder, **environment):
    subprocess.run([command, "tune", examples / "logs" / "elevator.json", "--out", folder],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                   env={**os.environ, **environment}, timeout=300)
    return (pathlib.Path(folder) / "index.html").as_uri()


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.url = tune(cls.folder.name + "/report")
        cls.driver = browser()

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        cls.folder.cleanup()

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def emulate(self, width=1100, height=1000, mobile=False, scheme="light", media="", motion=""):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": height, "deviceScaleFactor": 1,
                                     "mobile": mobile})
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                    {"media": media, "features": [
                                        {"name": "prefers-color-scheme", "value": scheme},
                                        {"name": "prefers-reduced-motion", "value": motion}]})

    def open(self, url=None, plots=True, **emulation):
        """The page with all of its plots, also those that are not in view."""
        self.emulate(**emulation)
        self.driver.get(url or self.url)
        if plots:
            self.js("flyball.open_all()")
            self.frames()

    def frames(self):
        """Waits until what was asked for is drawn, also what waits for the plots to rest."""
        self.driver.execute_async_script(
            "const done = arguments[0];"
            "requestAnimationFrame(() => setTimeout(() => requestAnimationFrame(() =>"
            " requestAnimationFrame(done)), 250));")

    def find(self, selector):
        element = self.driver.find_element("css selector", selector)
        self.js("arguments[0].scrollIntoView({block: 'center'})", element)
        return element

    def ranges(self):
        """What each figure's panels show of x, by the figure's name."""
        return self.js("""
            return Object.fromEntries([...document.querySelectorAll('figure.plot')].map(figure =>
                [figure.dataset.name, figure.plot.panels.map(panel =>
                    panel.graph ? panel.graph.xAxisRange() : panel.view.x)]));""")

    def drag(self, element, start, by, key=None):
        actions = ActionChains(self.driver)
        if key:
            actions.key_down(key)
        actions.move_to_element_with_offset(element, *start).click_and_hold()
        for _ in range(4):
            actions.move_by_offset(by[0] // 4, by[1] // 4)
        actions.release()
        if key:
            actions.key_up(key)
        actions.perform()
        self.frames()

    def assert_no_complaint(self):
        self.assertEqual(self.driver.get_log("browser"), [])

    def test_loads_offline_alone_and_without_a_complaint(self):
        self.driver.get("about:blank")
        self.driver.get_log("performance")
        self.open()
        asked = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                asked.append(message["params"]["request"]["url"])
        self.assertEqual([url for url in asked if not url.startswith("data:")], [self.url])
        figures = self.js("return document.querySelectorAll('figure.plot').length")
        self.assertGreaterEqual(figures, 10)
        self.assertEqual(self.js("return flyball.all.length"), figures)
        self.assertEqual(self.js("return document.querySelectorAll('.plot.on > .live').length"), figures)
        self.assert_no_complaint()

    def test_a_zoom_on_one_plot_zooms_its_neighbours(self):
        self.open()
        before = self.ranges()
        for name, shown in before.items():
            for panel in shown:
                self.assertEqual(panel, shown[0], f"the panels of {name} share their axis")
        panel = self.find("[data-name=closed_loop] .panel")
        self.drag(panel, (-150, 0), (200, 0))
        zoomed = self.ranges()
        low, high = zoomed["closed_loop"][0]
        full = before["closed_loop"][0]
        self.assertAlmostEqual((high - low) / (full[1] - full[0]), 200 / self.js(
            "return document.querySelector('[data-name=closed_loop]').plot.panels[0].graph.getArea().w"),
            places=2)
        for name in ("closed_loop", "estimate"):
            for shown in zoomed[name]:
                self.assertEqual(shown, [low, high], name)
        for name, shown in zoomed.items():
            if name not in ("closed_loop", "estimate"):
                self.assertEqual(shown, before[name], name)
        # Moved, not zoomed: to the right what was before it.
        self.drag(panel, (0, 0), (80, 0), SHIFT)
        moved = self.ranges()["estimate"][0]
        self.assertLess(moved[0], low)
        self.assertAlmostEqual(moved[1] - moved[0], high - low, places=9)
        ActionChains(self.driver).double_click(panel).perform()
        self.frames()
        self.assertEqual(self.ranges(), before)
        # With keys, and back by the button.
        live = self.find("[data-name=estimate] .live")
        live.send_keys("+")
        self.frames()
        self.assertNotEqual(self.ranges()["closed_loop"], before["closed_loop"])
        self.find("[data-name=closed_loop] .bar button").click()
        self.frames()
        self.assertEqual(self.ranges(), before)
        self.assert_no_complaint()

    def test_the_cursor_reads_all_plots_of_its_clock(self):
        self.open()
        panel = self.find("[data-name=closed_loop] .panel")
        ActionChains(self.driver).move_to_element_with_offset(panel, 40, 0).perform()
        self.frames()
        time, values = self.js("""
            const plot = document.querySelector('[data-name=closed_loop]').plot;
            return [plot.clock.cursor, plot.panels.flatMap(panel => panel.panel.lines.map(line => {
                let best = 0;
                line.x.forEach((x, i) => {
                  if (Math.abs(x - plot.clock.cursor) < Math.abs(line.x[best] - plot.clock.cursor)) best = i;
                });
                return line.y[best];
            }))];""")
        outputs = [output.text.replace("−", "-") for output in self.driver.find_elements(
            "css selector", "[data-name=closed_loop] output")]
        self.assertIn(f"{time:.3g}"[:4], outputs[0])
        shown = [float(text) for text in outputs[1:] if text]
        self.assertEqual(len(shown), len(values))
        for wanted, got in zip(values, shown):
            self.assertAlmostEqual(wanted, got, delta=1e-3 * max(1e-9, abs(wanted)))
        self.assertTrue(self.driver.find_element("css selector", "[data-name=estimate] output").text)
        # A pole's place, of the one that is next to the cursor.
        canvas = self.find("[data-name=poles] canvas")
        x, y, pole = self.js("""
            const panel = document.querySelector('[data-name=poles]').plot.panels[0];
            const line = panel.panel.lines.find(line => line.style === 'crosses');
            return [panel.px(line.x[0]), panel.py(line.y[0]), [line.x[0], line.y[0]]];""")
        size = canvas.size
        ActionChains(self.driver).move_to_element_with_offset(
            canvas, round(x - size["width"] / 2) + 2, round(y - size["height"] / 2) + 2).perform()
        self.frames()
        near = self.js("""const near = document.querySelector('[data-name=poles]').plot.panels[0].near;
                          return near && [near.x, near.y];""")
        self.assertEqual(near, pole)

    def moment(self):
        """Where the drawing is, and where the plots of its clock are."""
        return self.js("""
            const drawing = document.querySelector('figure.animation').plot;
            const plot = document.querySelector('[data-name=closed_loop]').plot;
            const {hair, graph} = plot.panels[0];
            return {now: drawing.now, playing: drawing.playing, cursor: plot.clock.cursor,
                    hair: hair.hidden ? null : graph.toDataXCoord(parseFloat(hair.style.left)),
                    first: drawing.time[0], last: drawing.time[drawing.time.length - 1],
                    look: drawing.canvas.toDataURL()};""")

    def test_a_drawing_opens_when_it_comes_into_view(self):
        self.open(plots=False)
        self.js("document.querySelector('figure.animation').parentElement.scrollIntoView()")
        self.frames()
        self.assertEqual(self.find("figure.animation.on .live").get_attribute("aria-label"), "Motion of the elevator")

    def test_the_drawing_moves_with_the_plots(self):
        self.open()
        live = self.find("figure.animation .live")
        self.assertEqual(self.js("return document.querySelectorAll('figure.animation').length"), 1)
        self.assertEqual(live.get_attribute("aria-label"), "Motion of the elevator")
        slider = live.find_element("css selector", "input[type=range]")
        self.assertEqual(slider.accessible_name, "Time")
        begin = self.moment()
        self.assertFalse(begin["playing"], "nothing moves before it is asked to")
        # The cursor of a plot is the drawing's moment, and stays it when it has left the plot.
        panel = self.find("[data-name=closed_loop] .panel")
        ActionChains(self.driver).move_to_element_with_offset(panel, -60, 0).perform()
        self.frames()
        pointed = self.moment()
        self.assertAlmostEqual(pointed["now"], pointed["cursor"], places=12)
        self.assertGreater(pointed["now"], begin["first"])
        self.assertNotEqual(pointed["look"], begin["look"])
        # By keys, and then all plots show that moment.
        slider = self.find("figure.animation input[type=range]")
        slider.send_keys(Keys.HOME)
        self.frames()
        self.assertAlmostEqual(self.moment()["hair"], begin["first"], places=2)
        self.assertTrue(slider.get_attribute("aria-valuetext").startswith("0 s, position 0 m"),
                        slider.get_attribute("aria-valuetext"))
        slider.send_keys(Keys.END)
        self.frames()
        ended = self.moment()
        self.assertAlmostEqual(ended["now"], ended["last"], places=9)
        self.assertAlmostEqual(ended["hair"], ended["last"], places=2)
        told = self.driver.find_element("css selector", "figure.animation output").text
        position = self.js("""const line = document.querySelector('[data-name=closed_loop]').plot.panels[0]
                                  .panel.lines[0]; return line.y[line.y.length - 1];""")
        self.assertAlmostEqual(float(told.split("position ")[1].split(" ")[0].replace("−", "-")), position,
                               delta=1e-3 * abs(position))
        # Played from the start, by the button's key; a pointer over the plots does not disturb it.
        button = self.driver.find_element("css selector", "figure.animation button")
        self.assertEqual(button.text, "Play")
        button.send_keys(Keys.SPACE)
        self.frames()
        played = self.moment()
        self.assertEqual(button.text, "Pause")
        self.assertLess(played["now"], ended["last"])
        self.assertGreater(played["now"], begin["first"])
        self.frames()
        later = self.moment()
        self.assertGreater(later["now"], played["now"])
        self.assertAlmostEqual(later["hair"], later["now"], delta=0.25)
        button.send_keys(Keys.SPACE)
        self.frames()
        stopped = self.moment()
        self.frames()
        self.assertEqual(self.moment()["now"], stopped["now"])
        self.assertEqual(button.text, "Play")
        # A zoomed clock plays what it shows.
        self.js("document.querySelector('[data-name=closed_loop]').plot.show([0.5, 0.6])")
        self.frames()
        self.js("document.querySelector('figure.animation').plot.press()")
        WebDriverWait(self.driver, 20).until(lambda _: not self.moment()["playing"])
        self.assertAlmostEqual(self.moment()["now"], 0.6, places=9)
        self.assert_no_complaint()

    def test_reduced_motion_moves_by_presses_alone(self):
        self.open(motion="reduce")
        button = self.find("figure.animation button")
        self.assertEqual(button.text, "Next moment")
        begin = self.moment()
        button.click()
        self.frames()
        after = self.moment()
        self.assertAlmostEqual(after["now"] - begin["now"], (begin["last"] - begin["first"]) / 20, places=9)
        self.frames()
        self.assertEqual(self.moment()["now"], after["now"])
        self.emulate(motion="no-preference")  # while the page is open
        self.frames()
        self.assertEqual(button.text, "Play")

    def test_a_curve_can_be_hidden_and_shown(self):
        self.open()
        name = self.find("[data-name=closed_loop] .legend button")
        visible = ("return document.querySelector('[data-name=closed_loop]')"
                   ".plot.panels[0].graph.visibility()[0]")
        self.assertTrue(self.js(visible))
        name.click()
        self.assertFalse(self.js(visible))
        self.assertEqual(name.get_attribute("aria-pressed"), "false")
        name.click()
        self.assertTrue(self.js(visible))

    def test_a_plane_is_zoomed_with_equal_axes(self):
        self.open()
        canvas = self.find("[data-name=poles] canvas")
        unit = """const {view, area} = document.querySelector('[data-name=poles]').plot.panels[0];
                  return [(view.x[1] - view.x[0]) / area.w, (view.y[1] - view.y[0]) / area.h];"""
        before = self.js(unit)
        self.assertAlmostEqual(*before, places=12)
        self.drag(canvas, (-100, -80), (160, 120))
        after = self.js(unit)
        self.assertAlmostEqual(*after, places=12)
        self.assertLess(after[0], 0.6 * before[0])
        ActionChains(self.driver).double_click(canvas).perform()
        self.frames()
        self.assertEqual(self.js(unit), before)

    def test_phones_scroll_down_alone(self):
        for width in (390, 320):
            self.open(width=width, height=800, mobile=True)
            self.assertEqual(self.js("return innerWidth"), width)
            self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), width)
            wide = self.js("""return [...document.querySelectorAll('table')].filter(table =>
                table.getBoundingClientRect().right > innerWidth && !table.closest('.scroll')).length""")
            self.assertEqual(wide, 0, "a table that does not scroll inside itself")
        self.assert_no_complaint()

    def test_fingers_zoom_and_the_page_still_scrolls(self):
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled",
                                    {"enabled": True, "maxTouchPoints": 2})
        try:
            self.open(width=390, height=800, mobile=True)
            panel = self.find("[data-name=closed_loop] .panel")
            self.assertEqual(self.js("return getComputedStyle(arguments[0].querySelector('canvas')).touchAction",
                                     panel), "pan-y")
            before = self.ranges()["estimate"][0]
            x, y = self.js("const b = arguments[0].getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]",
                           panel)

            def touch(kind, *places):
                self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {
                    "type": kind, "touchPoints": [{"x": place, "y": y, "id": i}
                                                  for i, place in enumerate(places)]})

            touch("touchStart", x - 20, x + 20)
            for spread in (30, 45, 60, 80):
                touch("touchMove", x - spread, x + spread)
            touch("touchEnd")
            self.frames()
            after = self.ranges()["estimate"][0]
            self.assertAlmostEqual((after[1] - after[0]) / (before[1] - before[0]), 20 / 80, places=1)
        finally:
            self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})

    def test_plots_follow_the_colour_scheme(self):
        look = """return [getComputedStyle(document.body).backgroundColor,
                          document.querySelector('[data-name=closed_loop]').plot.panels[0].graph.getColors()[0]]"""
        self.open(scheme="light")
        light = self.js(look)
        self.emulate(scheme="dark")  # while the page is open
        self.frames()
        dark = self.js(look)
        self.assertEqual(light[0], "rgb(255, 255, 255)")
        self.assertNotEqual(light, dark)
        self.assertNotEqual(light[1], dark[1])

    def test_print_and_no_scripts_have_the_still_pictures(self):
        shown = """const seen = element => element && getComputedStyle(element).display !== 'none';
                   return [...document.querySelectorAll('figure.plot')].map(figure =>
                       [seen(figure.querySelector('.still')), !!seen(figure.querySelector('.live'))]);"""
        drawing = "return getComputedStyle(document.querySelector('figure.animation')).display"
        self.open()
        self.assertEqual({tuple(pair) for pair in self.js(shown)}, {(False, True)})
        self.assertEqual(self.js(drawing), "block")
        self.emulate(media="print", scheme="dark")
        self.assertEqual({tuple(pair) for pair in self.js(shown)}, {(True, False)})
        self.assertEqual(self.js(drawing), "none")
        self.assertEqual(self.js("return getComputedStyle(document.body).backgroundColor"),
                         "rgb(255, 255, 255)")
        self.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
        try:
            self.open(plots=False)
            self.assertEqual({tuple(pair) for pair in self.js(shown)}, {(True, False)})
            self.assertEqual(self.js(drawing), "none")
        finally:
            self.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})

    def test_code_is_copied(self):
        self.driver.execute_cdp_cmd("Browser.grantPermissions",
                                    {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]})
        self.open()
        self.find("#constants summary").click()
        button = self.find("#constants .copy")
        button.click()
        WebDriverWait(self.driver, 10).until(lambda _: button.text == "Copied")
        code = self.js("return document.querySelector('#constants pre').textContent")
        self.assertGreater(len(code), 100)
        copied = self.driver.execute_async_script(
            "navigator.clipboard.readText().then(arguments[0], problem => arguments[0](String(problem)))")
        self.assertEqual(copied, code)

    def test_long_series_keep_their_extremes_and_few_rows(self):
        self.open()
        rows, spike, gap, everything = self.js("""
            const count = 100000;
            const x = Float64Array.from({length: count}, (_, i) => i / 200);
            const y = x.map(t => Math.sin(t));
            y[43210] = 7;
            y[60000] = NaN;
            const live = document.querySelector('main').appendChild(document.createElement('div'));
            const panel = {y: 'y', lines: [{label: 'a', style: 'solid', color: 0, x, y}], bands: [],
                           marks: [], spans: [], notes: [], ticks: []};
            const plot = new flyball.TimePlot({title: 't', x: 'Time (s)', clock: '', panels: [panel]}, live);
            const rows = plot.panels[0].rows(plot.extent);
            plot.show([200, 230]);
            return [rows.length, rows.some(row => row[1] === 7), rows.some(row => row[1] !== row[1]),
                    plot.panels[0].rows([100, 100.5]).filter(row => row[0] >= 100 && row[0] <= 100.5).length];""")
        self.assertLess(rows, 5000)
        self.assertTrue(spike)
        self.assertTrue(gap)
        self.assertEqual(everything, 101, "a window of few rows has every one of them")
        self.frames()
        self.assert_no_complaint()

    def test_without_fonts_the_page_is_whole_and_says_what_lacks(self):
        with tempfile.TemporaryDirectory() as folder:
            none = pathlib.Path(folder) / "fonts.conf"
            none.write_text('<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd"><fontconfig></fontconfig>')
            url = tune(folder + "/report", FONTCONFIG_FILE=str(none))
            self.open(url)
            self.assertIn("could not be drawn as PNG",
                          self.driver.find_element("css selector", "header p.caution").text)
            self.assertEqual(self.js("return document.querySelectorAll('figure.plot.on').length"),
                             self.js("return document.querySelectorAll('.still svg').length"))
            self.assertEqual(list((pathlib.Path(folder) / "report" / "pictures").glob("*.png")), [])
            self.assert_no_complaint()

    def test_without_gnuplot_the_plots_are_there_and_the_page_says_so(self):
        with tempfile.TemporaryDirectory() as folder:
            url = tune(folder + "/report", PATH=folder)
            self.open(url)
            self.assertIn("still pictures could not be drawn",
                          self.driver.find_element("css selector", "header p.caution").text)
            self.assertEqual(self.js("return document.querySelectorAll('figure.plot.on').length"),
                             self.js("return document.querySelectorAll('figure.plot').length"))
            self.assertEqual(self.js("return document.querySelectorAll('.still svg').length"), 0)
            self.emulate(media="print")
            self.assertEqual(self.js("return getComputedStyle(document.querySelector('.live')).display"), "block")
            self.assert_no_complaint()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
