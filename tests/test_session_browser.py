"""Promise: in a real browser each frame is the stimulus, drops are noticed, no vote is lost."""

import hashlib
import io
import shutil
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

from dsis.manifest import Clip, ClipFiles, Manifest, write_manifest
from dsis.session import serve
from dsis.session.personal import read_records
from dsis.session.setup import Setup
from dsis.session.store import read_store
from dsis.spec import Sequence, Session

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = ["--no-sandbox", "--force-color-profile=srgb"]
WIDTH, HEIGHT = 96, 64
CLIP_SHOWN = "#stage:not([hidden]) #label:empty"
CONSENT = "I take part of my own free will.\n\nI may stop at any time."


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with sync_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield found
        found.close()


def frames_of(stimulus, count):
    """Every code in every channel, at random: no two frames are alike."""
    seed = int.from_bytes(hashlib.sha256(stimulus.encode()).digest()[:8], "little")
    size = (count, HEIGHT, WIDTH, 3)
    return np.random.default_rng(seed).integers(0, 256, size, np.uint8)


def write_test(folder, *, contents=("city", "land"), training=1, fps=10.0, frames=2, **session):
    """Two frames of 100 ms, unless said: a loaded machine drops none of them."""
    folder.mkdir()
    clips = []
    for content in contents:
        names = ["reference", "one", "two"] + ["training"] * (training and content == contents[0])
        for name in names:
            stimulus = f"{content}__{name}"
            data = frames_of(stimulus, frames)
            data.tofile(folder / f"{stimulus}.rgb")
            sha256 = hashlib.sha256(data.tobytes()).hexdigest()
            role = name if name in ("reference", "training") else "test"
            reference = None if role == "reference" else f"{content}__reference"
            files = {"player": ClipFiles(path=f"{stimulus}.rgb", sha256=sha256)}
            clips.append(
                Clip(
                    stimulus=stimulus, content=content, role=role, reference=reference, files=files
                )
            )
    seconds = frames / fps
    times = {"reference_s": seconds, "test_s": seconds, "grey_s": 0.15, "vote_s": 0.05}
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=Sequence(width=WIDTH, height=HEIGHT, fps=fps, seconds=seconds),
        session=Session(**{**times, "variant": "I", "training": training, "dummies": 1, **session}),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


@contextmanager
def served(folder, observer, **options):
    """Hold a session in a thread; yield (address, what was said, the thread)."""
    said = []
    options = {"open_browser": False, "say": said.append, **options}
    thread = threading.Thread(target=serve, args=(folder, observer), kwargs=options, daemon=True)
    thread.start()
    while not any("http" in line for line in said):
        assert thread.is_alive(), said
        time.sleep(0.01)
    address = next(line for line in said if "http" in line).split()[1]
    yield address, said, thread
    thread.join(timeout=10)
    assert not thread.is_alive()


@contextmanager
def page_of(browser, address, width=1280, height=720):
    page = browser.new_page(viewport={"width": width, "height": height})
    faults = []
    page.on("pageerror", lambda error: faults.append(error))  # noqa: PLW0108  it takes no builtin
    page.goto(address)
    yield page
    page.close()
    assert faults == []


def fill_observer(page):
    page.wait_for_selector("#observer:not([hidden])")
    form = "#observer-form"
    for name, value in {
        "age": "25-34",
        "expertise": "naive",
        "acuity_chart": "Landolt",
        "corrected": "true",
        "colour_test": "Ishihara",
        "colour_vision": "normal",
    }.items():
        page.select_option(f"{form} [name={name}]", value)
    for name, value in {"acuity": "0.63", "colour_plates": "14", "colour_read": "14"}.items():
        page.fill(f"{form} [name={name}]", value)
    page.press(f"{form} [name=note]", "Enter")


def fill_display(page):
    page.wait_for_selector("#display:not([hidden])")
    form = "#display-form"
    page.select_option(f"{form} [name=steps_seen]", "true")
    page.select_option(f"{form} [name=pixels_even]", "true")
    for name, value in {
        "model": "virtual",
        "diagonal_inch": "23",
        "peak_cd_m2": "100",
        "distance_heights": "3",
    }.items():
        page.fill(f"{form} [name={name}]", value)
    page.press(f"{form} [name=note]", "Enter")


def begin(page):
    fill_observer(page)
    fill_display(page)
    page.wait_for_selector("#start:not([hidden])")
    page.keyboard.press("Enter")


def next_screen(page):
    """Wait for the ballot, a pause or the end, and return which it is."""
    page.wait_for_selector(":is(#vote, #pause, #done, #problem):not([hidden])")
    shown = [n for n in ("vote", "pause", "done", "problem") if page.is_visible(f"#{n}")]
    assert shown != ["problem"], page.inner_text("#what")
    return shown[0]


def vote_by_keys(page, grade):
    """Choose wrongly, correct it, confirm."""
    page.keyboard.press("3")
    page.keyboard.press("Backspace")
    assert page.is_disabled("#confirm")
    page.keyboard.press("Enter")  # nothing is chosen: nothing happens
    assert page.is_visible("#vote")
    page.keyboard.press("7")
    page.keyboard.press(str(grade % 10))
    page.keyboard.press("Enter")


def vote_by_mouse(page, grade):
    assert page.is_disabled("#confirm")
    page.click(f"#grades label:has(input[value='{grade}'])")
    page.click("#confirm")


def test_two_observers_by_keyboard_and_by_mouse(browser, tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, contents=("city",))
    for observer, vote in (("anna", vote_by_keys), ("bert", vote_by_mouse)):
        given = []
        setup = Setup(consent=CONSENT, lab="TUM")
        with (
            served(folder, observer, setup=setup) as (address, _, _thread),
            page_of(browser, address) as page,
        ):
            fill_observer(page)
            page.wait_for_selector("#consent:not([hidden])")
            assert page.inner_text("#consent-text").split("\n\n") == CONSENT.split("\n\n")
            page.keyboard.press("Enter")
            fill_display(page)
            page.wait_for_selector("#start:not([hidden])")
            page.keyboard.press("Enter")
            for _ in range(10):
                page.keyboard.press("9")  # while a clip is shown: not a vote
                screen = next_screen(page)
                if screen == "done":
                    break
                if screen == "pause":
                    page.keyboard.press("Enter")
                    page.wait_for_selector("#stage:not([hidden])")
                    continue
                grade = (5 + 3 * len(given)) % 10 + 1
                vote(page, grade)
                given.append(grade)
                page.wait_for_selector("#vote", state="hidden")
            assert "all your votes are stored" in page.inner_text("#done")
        with read_store(folder) as store:
            store.check()
            votes = [row.vote for row in store.rows(observer)]
            assert [v.vote for v in votes] == given
            assert len(votes) == 4  # one training, one dummy, two tests
            assert all(v.valid and v.dropped_frames == 0 and v.reaction_ms > 0 for v in votes)
            assert store.events("display")[-1]["measured"]["device_pixel_ratio"] == 1
    assert set(read_records(folder)) == {"anna", "bert"}


def pixels(png):
    """Return a PNG as (row, column, 3) codes."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def test_what_stands_on_the_screen_is_the_stimulus_pixel_for_pixel(browser, tmp_path):
    folder = tmp_path / "stimuli"
    frames = 3
    write_test(folder, contents=("city",), training=0, dummies=0, fps=2.0, frames=frames)
    known = {
        frame.tobytes(): (name, i)
        for name in ("city__reference", "city__one", "city__two")
        for i, frame in enumerate(frames_of(name, frames))
    }
    seen, greys = set(), 0
    with (
        served(folder, "anna") as (address, _, _thread),
        page_of(browser, address, 401, 301) as page,
    ):
        begin(page)
        page.wait_for_selector("#stage:not([hidden])")
        box = page.locator("#screen").bounding_box()
        assert (box["width"], box["height"]) == (WIDTH, HEIGHT)
        x, y = int(box["x"]), int(box["y"])
        for _ in range(2):
            while page.is_visible("#stage"):
                shot = pixels(page.screenshot())[y : y + HEIGHT, x : x + WIDTH]
                frame = known.get(shot.tobytes())
                if frame is not None:
                    seen.add(frame)
                elif page.is_visible("#stage") and np.median(shot) == 126:  # a word on the grey
                    greys += 1
                    assert np.isin(shot, np.arange(127)).all()
                else:
                    assert not page.is_visible("#stage"), "a picture that is in no clip"
            assert next_screen(page) == "vote"
            page.keyboard.press("5")
            page.keyboard.press("Enter")
            page.wait_for_selector("#vote", state="hidden")
        page.wait_for_selector("#done:not([hidden])")
    assert greys > 0
    assert len(seen) == 3 * frames


def _same(row, other):
    return row.presentation.stimulus == other.presentation.stimulus


def test_a_stall_is_logged_as_dropped_frames_and_the_showing_repeated(browser, tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, contents=("city",), training=0, dummies=0, fps=25.0, frames=20)
    # Planned inside the page: how late this process notices a clip must not move the stall.
    stall = f"""() => {{
        const stall = () => {{ const t = performance.now(); while (performance.now() - t < 130); }};
        const look = () => document.querySelector("{CLIP_SHOWN}")
            ? setTimeout(stall, 200) : requestAnimationFrame(look);
        look();
    }}"""
    with served(folder, "anna") as (address, said, _thread), page_of(browser, address) as page:
        page.evaluate(stall)
        begin(page)
        while next_screen(page) == "vote":  # a loaded machine may drop frames of its own
            page.keyboard.press("8")
            page.keyboard.press("Enter")
            page.wait_for_selector("#vote", state="hidden")
        page.wait_for_selector("#done:not([hidden])")
    with read_store(folder) as store:
        rows = store.rows("anna")
        stalled = store.events("voted")[0]["clips"][0]
    assert not rows[0].vote.valid
    assert all(row.vote.valid == (row.vote.dropped_frames == 0) for row in rows)
    # 130 ms at 25 frames a second: at least two frames (of 40 ms) had no chance
    assert rows[0].vote.dropped_frames >= 2
    assert stalled["longest_interval_ms"] >= 110
    assert any("frames dropped; it is repeated at the end" in line for line in said)
    again = [row.presentation.attempt for row in rows if _same(row, rows[0])]
    assert again[:2] == [1, 2]


def test_a_reload_in_mid_trial_or_a_second_window_loses_nothing(browser, tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, contents=("city",), training=0, dummies=0, fps=10.0, frames=4)
    with served(folder, "anna") as (address, _, _thread), page_of(browser, address) as page:
        begin(page)
        assert next_screen(page) == "vote"
        with page_of(browser, address) as second:
            second.wait_for_selector("#problem:not([hidden])", timeout=10_000)
            assert "open in another window" in second.inner_text("#what")
        page.keyboard.press("4")
        page.keyboard.press("Enter")
        page.wait_for_selector(CLIP_SHOWN, state="attached")
        page.reload()  # while a clip is shown
        page.wait_for_selector("#start:not([hidden])")
        assert page.is_visible("#again")
        page.keyboard.press("Enter")
        assert next_screen(page) == "vote"
        page.reload()  # with an unconfirmed vote
        page.wait_for_selector("#start:not([hidden])")
        page.keyboard.press("Enter")
        assert next_screen(page) == "vote"
        page.keyboard.press("6")
        page.keyboard.press("Enter")
        page.wait_for_selector("#done:not([hidden])")
    with read_store(folder) as store:
        store.check()
        assert [row.vote.vote for row in store.rows("anna")] == [4, 6]
        assert len(store.events("interrupted")) == 2


def luminance(css):
    """Return the relative luminance of a CSS colour (WCAG 2)."""
    codes = [float(c) / 255 for c in css[css.index("(") + 1 : -1].split(",")[:3]]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in codes]
    return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def test_every_screen_is_grey_legible_and_labelled(browser, tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, contents=("city",), training=0, dummies=0, frames=1)
    with served(folder, "anna") as (address, _, _thread), page_of(browser, address) as page:
        for screen, fill in {
            "observer": fill_observer,
            "display": fill_display,
            "start": lambda page: page.keyboard.press("Enter"),
            "vote": next_screen,  # leave the ballot as it is
        }.items():
            page.wait_for_selector(f"#{screen}:not([hidden])")
            colours = page.evaluate(
                "[...document.querySelectorAll('main:not([hidden]) *, body')].map(e =>"
                " [getComputedStyle(e).color, getComputedStyle(e).backgroundColor])"
            )
            for text, back in colours:
                ground = "rgb(126, 126, 126)" if back.startswith("rgba(0, 0, 0, 0") else back
                assert ground in ("rgb(126, 126, 126)", "rgb(0, 0, 0)"), ground
                high, low = sorted([luminance(text), luminance(ground)], reverse=True)
                assert (high + 0.05) / (low + 0.05) >= 4.5  # WCAG 2, AA
            unlabelled = page.evaluate(
                "[...document.querySelectorAll('main:not([hidden]) :is(input, select)')]"
                ".filter(e => !e.labels.length && !e.ariaLabel).length"
            )
            assert unlabelled == 0
            fill(page)
        for _ in range(2):
            next_screen(page)
            page.keyboard.press("1")
            page.keyboard.press("Enter")
            page.wait_for_selector("#vote", state="hidden")
        page.wait_for_selector("#done:not([hidden])")


def test_the_five_grade_scale_shows_its_words(browser, tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, contents=("city",), training=0, dummies=0, frames=1, scale=(1, 5))
    with served(folder, "anna") as (address, _, _thread), page_of(browser, address) as page:
        begin(page)
        for _ in range(2):
            next_screen(page)
            assert page.locator("#grades input").count() == 5
            assert "slightly annoying" in page.inner_text("#grades")
            assert page.get_by_label("4, perceptible, but not annoying").count() == 1
            page.keyboard.press("6")  # not on the scale
            assert page.is_disabled("#confirm")
            page.keyboard.press("4")
            page.keyboard.press("Enter")
            page.wait_for_selector("#vote", state="hidden")
        page.wait_for_selector("#done:not([hidden])")
