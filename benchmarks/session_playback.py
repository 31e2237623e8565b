"""Whether every frame of a 3 s clip of 1280x720 at 25 frames a second is shown, and exactly.

Three ways, each through `dsis session` or its player, on noise:

- the page in headless Chromium: the page's own log;
- the page in Chromium on a virtual screen (Xvfb), which is filmed: every frame carries its number,
  and what stands on the screen is compared with the clip;
- mpv on a virtual screen: counters, wall clock and film.

Needs Chromium, Playwright, Xvfb and mpv; what is missing is said.
"""

import argparse
import importlib.util
import os
import shutil
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from dsis.session.clips import checked_clip
from dsis.session.mpv import MpvPlayer
from dsis.session.steps import steps
from dsis.session.store import read_store
from dsis.spec import Sequence

TESTS = Path(__file__).resolve().parents[1] / "tests"
SCREEN = (1440, 1000)  # room for what a browser draws around a page
FIRST = {"reference": 1000, "test": 2000}


def load(name):
    spec = importlib.util.spec_from_file_location(name, TESTS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Compared:
    """Compares the whole picture on the screen with the clip, where the film has just seen it."""

    def __init__(self, folder, size, screen, left, top):
        shape = (size.frames, size.height, size.width, 3)
        self._clips = {
            FIRST[show]: np.memmap(folder / f"{name}.rgb", np.uint8, "r", shape=shape)
            for show, name in (("reference", "city__reference"), ("test", "city__one"))
        }
        self._box = np.s_[top : top + size.height, left : left + size.width]
        self._screen, self.equal, self.unequal = screen, 0, 0

    def look(self, number):
        """Compare the screen with the frame of that number."""
        for first, clip in self._clips.items():
            if first <= number < first + len(clip):
                shot = self._screen[self._box].copy()
                error = int(np.abs(shot.astype(np.int16) - clip[number - first]).max())
                self.equal, self.unequal = self.equal + (error == 0), self.unequal + (error != 0)


def watch(film, compared, stop):
    """Compare a tenth of the pictures: each costs some milliseconds of the two cores."""
    looked = 0
    while not stop.is_set():
        if len(film.numbers) >= looked + 10:
            looked = len(film.numbers)
            compared.look(film.numbers[-1])
        time.sleep(0.002)


def through_the_page(helpers, browser, folder, size, screen=None):
    """Hold a session of one presentation; return (logs, film or None, comparison or None)."""
    with ExitStack() as stack:
        address, _, _ = stack.enter_context(helpers.served(folder, "anna"))
        context = browser.new_context(no_viewport=screen is not None)
        page = context.new_page()
        if screen is None:
            page.set_viewport_size({"width": 1280, "height": 720})
        page.goto(address)
        helpers.begin(page)
        film = compared = None
        if screen is not None:
            page.wait_for_selector("#stage:not([hidden])")
            time.sleep(0.5)  # full screen takes its time
            corner = page.evaluate(
                "() => { const b = document.getElementById('screen').getBoundingClientRect();"
                " return [b.x + window.screenX + (outerWidth - innerWidth) / 2,"
                " b.y + window.screenY + outerHeight - innerHeight]; }"
            )
            left, top = map(int, corner)
            test = load("test_session_mpv")
            film = stack.enter_context(test.Film(screen, left, top))
            compared = Compared(folder, size, screen, left, top)
            stop = threading.Event()
            watching = threading.Thread(target=watch, args=(film, compared, stop), daemon=True)
            watching.start()
            stack.callback(watching.join)
            stack.callback(stop.set)
        page.wait_for_selector("#vote:not([hidden])", timeout=120_000)
        page.keyboard.press("5")
        page.keyboard.press("Enter")
        page.wait_for_selector("#done:not([hidden])")
        context.close()
    with read_store(folder) as store:
        return store.events("voted")[0]["clips"], store.events("started")[0], film, compared


def report_page(what, logs, started, film, compared, size):
    for log in logs:
        painted = [k for k, _ in log["frames"]]
        line = f"{what}, {log['show']}: {len(painted)} of {size.frames} frames painted, "
        line += f"longest interval {log['longest_interval_ms']:.1f} ms"
        if film is not None:
            seen = film.of(FIRST[log["show"]], size.frames)
            line += f"; film: {len(set(seen))} distinct, in order: {seen == sorted(seen)}"
        print(line)
    print(f"{what}: display {started['display']['refresh_hz']:.2f} Hz")
    if compared is not None:
        print(f"{what}: {compared.equal} pictures compared equal, {compared.unequal} not")


def through_mpv(folder, size, manifest):
    test = load("test_session_mpv")
    pair = {
        show: checked_clip(manifest, folder, manifest.clip(name))
        for show, name in (("reference", "city__reference"), ("test", "city__one"))
    }
    player = MpvPlayer(size, output="x11", full_screen=False)
    with test.virtual_screen(folder, size.width, size.height) as (name, screen):
        os.environ["DISPLAY"] = name
        try:
            with test.Film(screen) as film:
                compared, stop = Compared(folder, size, screen, 0, 0), threading.Event()
                watching = threading.Thread(target=watch, args=(film, compared, stop))
                watching.start()
                logs = player.show(steps(manifest.session), pair)
                stop.set()
                watching.join()
        finally:
            player.close()
    for log in logs:
        seen = film.of(FIRST[log.show], size.frames)
        print(
            f"mpv, {log.show}: {log.dropped} dropped by its counters, wall clock "
            f"{log.counters['wall_s']:.3f} s for {(size.frames - 1) / size.fps:.3f} s; film: "
            f"{len(set(seen))} of {size.frames} distinct, in order: {seen == sorted(seen)}"
        )
    print(f"mpv: {compared.equal} pictures compared equal, {compared.unequal} not")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    options = parser.parse_args()
    size = Sequence(width=1280, height=720, fps=25.0, seconds=options.seconds)
    test = load("test_session_mpv")
    with tempfile.TemporaryDirectory() as name:
        for way in ("headless", "filmed", "mpv"):
            folder = Path(name) / way
            folder.mkdir()
            manifest = test.write_numbered_test(folder, size, grey_s=1.0, vote_s=0.1)
            if way == "mpv":
                if shutil.which("mpv") and shutil.which("Xvfb"):
                    through_mpv(folder, size, manifest)
                else:
                    print("mpv: needs mpv and Xvfb")
                continue
            with ExitStack() as stack:
                play_one(stack, way, folder, size)
            shutil.rmtree(folder)


def play_one(stack, way, folder, size):
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  the other way needs none

    helpers = load("test_session_browser")
    screen, flags = None, [*helpers.FLAGS]
    environment = dict(os.environ)
    if way == "filmed":
        test = load("test_session_mpv")
        environment["DISPLAY"], screen = stack.enter_context(test.virtual_screen(folder, *SCREEN))
        flags += ["--kiosk", f"--window-size={SCREEN[0]},{SCREEN[1]}", "--window-position=0,0"]
    playwright = stack.enter_context(sync_playwright())
    browser = playwright.chromium.launch(
        executable_path=helpers.CHROMIUM, headless=screen is None, args=flags, env=environment
    )
    stack.callback(browser.close)
    found = through_the_page(helpers, browser, folder, size, screen)
    report_page(f"page, {way}", *found, size)


if __name__ == "__main__":
    main()
