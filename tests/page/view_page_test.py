"""The live view in a browser: headless Chromium, driven by Playwright, watches a simulated run, and a recording.

    view_page_test.py BERTH SOURCE_FOLDER CHROMIUM [--screenshots FOLDER]

With --screenshots, pictures for the documents are taken on the way.
"""

import argparse
import json
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from playwright.sync_api import sync_playwright

ARGUMENTS = argparse.Namespace()
# What a person sees happens within a second or two; a machine that is busy with other tests gets a minute.
PATIENCE_MS = 60_000
SIZE = {"width": 1040, "height": 700}

# Lets a test hold the newest frame still while the server goes on telling the time, as it does when a camera is silent.
FREEZE = """
  const Real = EventSource;
  window.EventSource = class extends Real {
    addEventListener(type, heard) {
      super.addEventListener(type, (event) => {
        if (type !== 'state') return heard(event);
        const state = JSON.parse(event.data);
        if (window.frozen) {
          window.still = window.still || state;
          ['frames', 'finished', 'captured'].forEach((key) => { state[key] = window.still[key]; });
          delete state.samples;
        } else {
          window.still = null;
        }
        heard({data: JSON.stringify(state)});
      });
    }
  };
  const decode = createImageBitmap;
  window.createImageBitmap = (bytes) => (window.frozen ? new Promise(() => {}) : decode(bytes));
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Run:
    """`berth run`, watched at a port; played round until it is stopped."""

    def __init__(self, port, *more):
        command = [ARGUMENTS.berth, "run", "--source", "sim:scenarios/approach.toml", "--max-frames", str(ARGUMENTS.frames)]
        command += ["--backend", "simd", "--fps", "12", "--minutes", "10", "--view", f"127.0.0.1:{port}", *more]
        self.process = subprocess.Popen(command, cwd=ARGUMENTS.source, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                        text=True)
        self.said = self.process.stdout.readline()

    def send(self, which):
        self.process.send_signal(which)

    def stop(self):
        if self.process.poll() is None:
            self.send(signal.SIGCONT)
            self.send(signal.SIGINT)
        self.process.communicate(timeout=60)


class View:
    """`berth view` of a recording, for as long as it is looked at."""

    def __init__(self, recording):
        self.process = subprocess.Popen([ARGUMENTS.berth, "view", recording.name, "--address", "127.0.0.1:0"],
                                        cwd=recording.parent, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=60)


class ViewPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.port = free_port()
        cls.folder = tempfile.TemporaryDirectory()
        token = pathlib.Path(cls.folder.name) / "token"
        token.write_text("0123456789abcdef\n")
        cls.run_of = Run(cls.port, "--view-token", str(token))
        cls.playwright = sync_playwright().start()
        cls.browser = cls.playwright.chromium.launch(
            executable_path=ARGUMENTS.chromium,
            args=["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        cls.context = cls.browser.new_context(viewport=SIZE, color_scheme="light")
        cls.context.set_default_timeout(PATIENCE_MS)
        cls.context.add_init_script(FREEZE)
        cls.page = cls.context.new_page()
        cls.requests, cls.complaints = [], []
        cls.page.on("request", lambda request: cls.requests.append(request.url))
        cls.page.on("console", lambda message: cls.complaints.append(message.text) if message.type == "error" else None)
        cls.page.on("pageerror", lambda error: cls.complaints.append(str(error)))
        cls.page.goto(f"http://127.0.0.1:{cls.port}/")

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.playwright.stop()
        cls.run_of.stop()
        cls.folder.cleanup()

    def until(self, condition, argument=None):
        """Waits for a condition in the page."""
        self.page.wait_for_function(condition, arg=argument, polling=100)

    def until_state(self, state):
        self.until("(state) => document.documentElement.dataset.state === state", state)

    def text(self, name):
        return self.page.locator("#" + name).inner_text()

    def picture(self, name, full=False):
        if ARGUMENTS.screenshots:
            self.page.screenshot(path=str(pathlib.Path(ARGUMENTS.screenshots) / name), full_page=full)

    # The tests run in the order of their names, on one page: a browser takes long to start.

    def test_1_shows_what_there_is_to_see(self):
        self.until_state("live")
        self.until("() => document.getElementById('pose').textContent === 'VALID'")
        self.until("() => document.getElementById('closing').textContent !== '—'")
        self.until("() => document.querySelectorAll('#times tr').length > 3")
        if ARGUMENTS.screenshots:
            self.page.wait_for_timeout(9000)
            self.picture("live-view.png", full=True)
        for name in ["range", "closing", "pose", "age", "video", "scene", "mode", "search", "why", "backend", "health"]:
            self.assertTrue(self.page.locator("#" + name).is_visible(), name)
        self.assertEqual(self.page.locator("#plots canvas").count(), 6)
        self.assertRegex(self.text("range"), r"^[01]\.\d{3,4}$")
        self.assertRegex(self.text("range-sub"), r"^± [\d.]+ mm$")
        self.assertRegex(self.text("backend"), "^simd on ")
        self.assertEqual(self.text("mode"), "docking")
        self.assertRegex(self.text("drops"), r"offered, (none|\d+) dropped")
        self.assertIn("tag36h11 0", self.text("seen"))
        self.assertRegex(self.page.title(), r"^\d\.\d{3} m · Berth$")
        self.assertRegex(self.page.locator("#plots output").first.inner_text(), r"^−?[\d.]+ ± [\d.]+ mm$")
        self.assertTrue(self.page.locator("#alarm").is_hidden())

    def test_2_moves(self):
        self.page.evaluate("""() => {
          const pixels = (canvas) => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height / 2).data.reduce(
            (sum, value) => (sum * 31 + value) % 1000003, 7);
          window.pixelsOf = (selector) => String(pixels(document.querySelector(selector)));
        }""")
        scene_before, range_before = self.page.locator("#scene").screenshot(), self.text("range")
        selectors = ["#video", "#plots .plot:nth-child(3) canvas"]
        before = [self.page.evaluate("(selector) => window.pixelsOf(selector)", selector) for selector in selectors]
        self.until("(old) => document.getElementById('range').textContent !== old", range_before)
        for selector, old in zip(selectors, before):
            self.until("([selector, old]) => window.pixelsOf(selector) !== old", [selector, old])
        for _ in range(50):
            if self.page.locator("#scene").screenshot() != scene_before:
                break
            self.page.wait_for_timeout(100)
        else:
            self.fail("the trajectory does not move")

    def test_3_is_reached_by_keyboard(self):
        self.page.evaluate("() => { document.activeElement.blur(); window.scrollTo(0, 0); }")
        reached = set()
        for _ in range(24):
            self.page.keyboard.press("Tab")
            reached.add(self.page.evaluate(
                "() => { const e = document.activeElement; return e.id || e.dataset.view || e.className || e.tagName; }"))
        self.assertLessEqual({"skip", "object", "theme", "video-on", "overlay-on", "orbit", "top", "side", "camera", "clear",
                              "scene", "span", "token", "end-run"}, reached)
        self.page.locator("#scene").focus()
        for key in ["ArrowLeft", "ArrowUp", "+"]:
            before = self.page.locator("#scene").get_attribute("data-seen")
            self.page.keyboard.press(key)
            self.until("(old) => document.getElementById('scene').dataset.seen !== old", before)
        self.page.locator("[data-view=top]").focus()
        self.page.keyboard.press("Enter")
        self.until("() => document.getElementById('scene').dataset.seen.startsWith('top')")
        self.page.locator("[data-view=orbit]").click()

    def test_4_is_light_or_dark(self):
        ground = "() => getComputedStyle(document.body).backgroundColor"
        light = self.page.evaluate(ground)
        self.page.emulate_media(color_scheme="dark")
        self.until("(light) => getComputedStyle(document.body).backgroundColor !== light", light)
        dark = self.page.evaluate(ground)
        self.assertGreater(sum(map(int, re.findall(r"\d+", light))), 600)
        self.assertLess(sum(map(int, re.findall(r"\d+", dark))), 150)
        self.page.locator("#theme").select_option("light")
        self.assertEqual(self.page.evaluate(ground), light)
        self.page.locator("#theme").select_option("")

    def test_5_fits_a_phone(self):
        self.page.set_viewport_size({"width": 360, "height": 740})
        self.until("() => document.getElementById('video').clientWidth < 360")
        self.assertLessEqual(self.page.evaluate("() => document.documentElement.scrollWidth"), 360)
        for name in ["range", "closing", "pose", "age"]:
            box = self.page.locator("#" + name).bounding_box()
            self.assertGreater(box["height"], 20, name)
            self.assertLess(box["y"] + box["height"], 740, name + " is at a glance")
        self.page.evaluate("() => window.scrollTo(0, 0)")
        self.page.wait_for_timeout(500)
        self.picture("live-view-phone.png")
        self.page.emulate_media(color_scheme="light")
        self.page.set_viewport_size(SIZE)

    def test_6_says_loudly_that_data_are_stale(self):
        self.page.evaluate("() => { window.frozen = true; }")
        self.until_state("stale")
        self.until("() => document.getElementById('range').textContent === '—'")
        self.assertEqual(self.text("pose"), "STALE")
        self.assertEqual(self.text("closing"), "—")
        self.assertIn("NO LIVE DATA", self.text("alarm"))
        self.assertEqual(self.page.locator("#plots output").first.inner_text(), "—")
        self.assertRegex(self.page.title(), "^STALE")
        if ARGUMENTS.screenshots:
            self.page.wait_for_timeout(3000)
        self.picture("live-view-stale.png")
        self.page.evaluate("() => { window.frozen = false; }")
        self.until_state("live")
        self.until("() => document.getElementById('range').textContent !== '—'")
        self.assertIn("data are live again", self.text("log"))

    def test_7_asked_nothing_of_others_and_complained_of_nothing(self):
        own = f"http://127.0.0.1:{self.port}/"
        self.assertEqual([url for url in self.requests if not url.startswith((own, "data:", "blob:"))], [])
        self.assertIn(own + "video.mjpg", self.requests)
        self.assertEqual(self.complaints, [])

    def test_8_comes_back_after_a_restart(self):
        # Held still, the run is silent: the page must not wait for the connection to break.
        self.run_of.send(signal.SIGSTOP)
        self.until_state("lost")
        self.assertEqual(self.text("pose"), "UNKNOWN")
        self.assertEqual(self.text("range"), "—")
        self.run_of.send(signal.SIGCONT)
        self.until_state("live")
        self.page.locator("#token").fill("0123456789abcdef")
        self.page.locator("#end-run").click()
        self.assertIsNone(self.run_of.process.poll(), "one press ended it")
        # A press that comes late is a first one again.
        for _ in range(40):
            self.page.evaluate("() => document.getElementById('end-run').click()")
            try:
                self.run_of.process.communicate(timeout=1.5)
                break
            except subprocess.TimeoutExpired:
                pass
        self.assertIsNotNone(self.run_of.process.poll(), "the run goes on")
        self.until("() => ['ended', 'lost'].includes(document.documentElement.dataset.state)")
        self.assertEqual(self.text("range"), "—")
        type(self).run_of = Run(self.port)
        self.until_state("live")
        self.until("() => document.getElementById('pose').textContent === 'VALID'")
        self.assertIn("another run", self.text("log"))
        self.assertTrue(self.page.locator("#control").is_hidden())
        drawn = self.page.locator("#video").get_attribute("data-count")
        self.until("(old) => Number(document.getElementById('video').dataset.count) > Number(old)", drawn)

    def test_9_reports_a_run(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.html"
            frames = 140 if ARGUMENTS.screenshots else 6
            subprocess.run([ARGUMENTS.berth, "run", "--source", "sim:scenarios/approach.toml", "--max-frames", str(frames),
                            "--backend", "simd", "--report", str(path)], cwd=ARGUMENTS.source, check=True,
                           stdout=subprocess.DEVNULL)
            page = self.context.new_page()
            complaints, requests = [], []
            page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("request", lambda request: requests.append(request.url))
            page.goto(path.as_uri())
            self.assertEqual(page.locator("#frames").inner_text(), str(frames))
            self.assertEqual(page.locator("#plots canvas").count(), 6)
            self.assertGreater(page.locator("#times tr").count(), 2)
            self.assertRegex(page.locator("#objects tr").first.inner_text(), r"tag36h11 0\s+" + str(frames))
            self.assertNotIn("NaN", page.locator("body").inner_text())
            self.assertLessEqual(page.evaluate("() => document.documentElement.scrollWidth"), SIZE["width"])
            before = page.locator("#moment").inner_text()
            page.locator("#time").focus()
            page.keyboard.press("Home")
            page.wait_for_function("(old) => document.getElementById('moment').textContent !== old", arg=before)
            page.keyboard.press("End")
            if ARGUMENTS.screenshots:
                page.screenshot(path=str(pathlib.Path(ARGUMENTS.screenshots) / "report.png"), full_page=True)
            self.assertEqual([url for url in requests if not url.startswith(("file:", "data:", "blob:"))], [])
            self.assertEqual(complaints, [])
            page.close()

    def test_a_looks_through_a_recording(self):
        self.page.goto("about:blank")  # or it would go on drawing
        with tempfile.TemporaryDirectory() as folder:
            frames = 140 if ARGUMENTS.screenshots else 40
            path, cut = pathlib.Path(folder) / "approach.mcap", pathlib.Path(folder) / "cut.mcap"
            subprocess.run([ARGUMENTS.berth, "run", "--source", "sim:scenarios/approach.toml", "--max-frames", str(frames),
                            "--backend", "simd", "--track", "--record", str(path)], cwd=ARGUMENTS.source, check=True,
                           stdout=subprocess.DEVNULL)
            cut.write_bytes(path.read_bytes()[:-1])
            with View(path) as view:
                self.look_through(view, frames)
            with View(cut) as view:
                page = self.context.new_page()
                page.goto(view.url)
                page.wait_for_function("() => document.getElementById('pose').textContent === 'VALID'")
                self.assertIn("it is cut off", page.locator("#alarm").inner_text())
                page.close()

    def look_through(self, view, frames):
        page = self.context.new_page()
        complaints, requests = [], []
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(view.url)

        def at(frame):
            page.wait_for_function("""(text) => document.getElementById('frames').textContent === text &&
                document.getElementById('moment-text').textContent.endsWith('frame ' + text)""", arg=f"{frame} of {frames}")
            return page.locator("#range").inner_text(), page.locator("#age").inner_text()

        at(1)
        page.wait_for_function("() => document.getElementById('moment-note').textContent === ''")
        page.wait_for_function("() => document.querySelectorAll('#times tr').length > 1")
        for name in ["scrub", "range", "closing", "pose", "age", "video", "scene", "mode", "search", "why", "health"]:
            self.assertTrue(page.locator("#" + name).is_visible(), name)
        for name in ["video-on", "span", "clear", "log", "control"]:
            self.assertTrue(page.locator("#" + name).is_hidden(), name)
        self.assertEqual(page.locator("#plots canvas").count(), 6)
        self.assertEqual(page.locator("#mode").inner_text(), "docking")
        self.assertIn("the file is whole", page.locator("#health").inner_text())
        self.assertIn("device", page.locator("#drops").inner_text())
        self.assertTrue(page.locator("#alarm").is_hidden())
        first = at(1)
        # By the keyboard alone.
        for _ in range(12):
            page.keyboard.press("Tab")
            if page.evaluate("() => document.activeElement.id") == "moment":
                break
        else:
            self.fail("the slider is not reached")
        drawn = page.locator("#video").get_attribute("data-count")
        page.keyboard.press("ArrowRight")
        self.assertNotEqual(at(2), first)
        page.wait_for_function("(old) => document.getElementById('video').dataset.count !== old", arg=drawn)
        page.keyboard.press("ArrowLeft")
        self.assertEqual(at(1), first)
        page.keyboard.press("PageUp")
        per_second = page.evaluate("() => document.getElementById('moment').value")
        self.assertGreater(int(per_second), 5)
        at(int(per_second) + 1)
        self.assertRegex(page.locator("#moment").get_attribute("aria-valuetext"), r"^(0\.9\d|1\.00) s, frame ")
        page.keyboard.press("PageDown")
        at(1)
        page.keyboard.press("End")
        self.assertNotEqual(at(frames)[0], first[0])
        page.keyboard.press("Home")
        at(1)
        page.locator("#speed").select_option("5")
        page.locator("#moment").focus()
        page.keyboard.press("Space")
        page.wait_for_function("() => document.getElementById('play').textContent === 'Pause'")
        # It plays to the end and stops there.
        page.wait_for_function("() => document.getElementById('play').textContent === 'Play'")
        end = at(frames)
        page.keyboard.press("Home")
        at(1)
        page.keyboard.press("Space")
        page.keyboard.press("Space")
        self.assertEqual(page.locator("#play").inner_text(), "Play")
        if ARGUMENTS.screenshots:
            page.locator("#moment").fill(str(frames * 2 // 3))
            at(frames * 2 // 3 + 1)
            page.wait_for_timeout(1000)
            page.screenshot(path=str(pathlib.Path(ARGUMENTS.screenshots) / "live-view-recording.png"), full_page=True)
        self.assertRegex(end[1], r"^\d+\.\d\d$")
        self.assertNotIn("NaN", page.locator("body").inner_text())
        self.assertLessEqual(page.evaluate("() => document.documentElement.scrollWidth"), SIZE["width"])
        self.assertEqual([url for url in requests if not url.startswith((view.url, "data:", "blob:"))], [])
        self.assertEqual(complaints, [])
        page.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("berth", type=lambda path: str(pathlib.Path(path).resolve()))
    parser.add_argument("source")
    parser.add_argument("chromium")
    parser.add_argument("--screenshots")
    ARGUMENTS = parser.parse_args()
    if ARGUMENTS.screenshots:
        SIZE = {"width": 1280, "height": 900}
    ARGUMENTS.frames = 140 if ARGUMENTS.screenshots else 12
    unittest.main(argv=["view_page_test"], failfast=True, verbosity=1)
