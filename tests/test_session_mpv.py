"""Promise: through mpv every frame is exact, and its counters agree with a film of the screen."""

import mmap
import os
import shutil
import struct
import subprocess
import threading
import time
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from dsis.errors import DamagedError, InputError
from dsis.manifest import Clip, ClipFiles, Manifest, write_manifest
from dsis.session.clips import checked_clip
from dsis.session.mpv import MpvPlayer, find_mpv
from dsis.session.steps import steps
from dsis.spec import Sequence, Session

BITS = 12  # of the number that every frame carries
SQUARE = 8  # pixels a side
SAMPLE_S = 0.003


# ---- clips whose frames say which they are


def numbered(number, size, rng):
    """Return a noisy frame that begins with `number` in binary squares, and its complement."""
    frame = rng.integers(0, 256, (size.height, size.width, 3), np.uint8)
    for bit in range(BITS):
        for row, value in enumerate((number >> bit & 1, 1 - (number >> bit & 1))):
            box = np.s_[row * SQUARE : (row + 1) * SQUARE, bit * SQUARE : (bit + 1) * SQUARE]
            frame[box] = 255 * value
    return frame


def write_numbered_test(folder, size, first=(1000, 2000), **session):
    """Write a reference and a test clip; frame k of them is number `first` + k."""
    rng = np.random.default_rng(1)
    noise = [numbered(0, size, rng) for _ in range(8)]
    clips = []
    for name, offset in zip(("city__reference", "city__one"), first, strict=True):
        with (folder / f"{name}.rgb").open("wb") as file:
            for k in range(size.frames):
                frame = noise[k % 8].copy()
                code = numbered(
                    offset + k,
                    Sequence(width=BITS * SQUARE, height=2 * SQUARE, fps=1.0, seconds=1.0),
                    rng,
                )
                frame[: 2 * SQUARE, : BITS * SQUARE] = code
                file.write(frame.tobytes())
        role = "reference" if name.endswith("reference") else "test"
        reference = None if role == "reference" else "city__reference"
        files = {"player": ClipFiles(path=f"{name}.rgb")}
        clips.append(
            Clip(stimulus=name, content="city", role=role, reference=reference, files=files)
        )
    times = dict.fromkeys(("reference_s", "test_s"), size.seconds)
    manifest = Manifest(
        schema="dsis-manifest/1",
        sequence=size,
        session=Session(
            **{**times, "variant": "I", "training": 0, "dummies": 0, "grey_s": 0.4, **session}
        ),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


# ---- a virtual screen, filmed


@contextmanager
def virtual_screen(folder, width, height):
    """Start Xvfb; yield (its name, its memory as (row, column, 3) codes)."""
    reader, writer = os.pipe()
    command = ["Xvfb", "-displayfd", str(writer), "-screen", "0", f"{width}x{height}x24"]
    server = subprocess.Popen(
        [*command, "-fbdir", str(folder), "-nolisten", "tcp"],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    try:
        with os.fdopen(reader) as numbers:
            name = f":{numbers.readline().strip()}"
        with (folder / "Xvfb_screen0").open("rb") as file:
            memory = mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ)
        head = struct.unpack(">25I", memory[:100])  # of an X window dump
        offset, line = head[0] + 12 * head[19], head[12]
        raw = np.frombuffer(memory, np.uint8, count=line * height, offset=offset)
        yield name, raw.reshape(height, line // 4, 4)[:, :width, 2::-1]
    finally:
        server.terminate()
        server.wait(10)


class Film:
    """Watches the numbers that appear on the screen at `left`, `top`."""

    def __init__(self, screen, left=0, top=0):
        self._screen, self._left, self._top = screen, left, top
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self.numbers, self.exact = [], {}

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *exception):
        self._stop.set()
        self._thread.join()

    def _number(self):
        middle = SQUARE // 2
        columns = self._left + middle + SQUARE * np.arange(BITS)
        rows = [self._top + middle, self._top + middle + SQUARE]
        high, low = self._screen[rows][:, columns, 0].astype(int)
        if not np.array_equal(high + low, np.full(BITS, 255)) or not np.isin(high, (0, 255)).all():
            return None
        return int(sum(1 << bit for bit in np.flatnonzero(high)))

    def _watch(self):
        while not self._stop.is_set():
            number = self._number()
            if number is not None and self.numbers[-1:] != [number]:
                self.numbers.append(number)
            time.sleep(SAMPLE_S)

    def of(self, first, frames):
        """Return the frames of one clip that were seen, in order."""
        return [n - first for n in self.numbers if first <= n < first + frames]


needs_mpv = pytest.mark.skipif(
    shutil.which("mpv") is None or shutil.which("Xvfb") is None, reason="needs mpv and Xvfb"
)


@needs_mpv
def test_mpv_shows_every_frame_exactly_and_its_counters_agree_with_the_film(tmp_path, monkeypatch):
    size = Sequence(width=320, height=180, fps=25.0, seconds=1.0)
    manifest = write_numbered_test(tmp_path, size, test_s=0.8)
    pair = {
        show: checked_clip(manifest, tmp_path, manifest.clip(name))
        for show, name in (("reference", "city__reference"), ("test", "city__one"))
    }
    player = MpvPlayer(size, output="x11", full_screen=False)
    with virtual_screen(tmp_path, size.width, size.height) as (name, screen):
        monkeypatch.setenv("DISPLAY", name)
        try:
            with Film(screen) as film:
                began = time.monotonic()
                reference, test = player.show(steps(manifest.session), pair)
                took_s = time.monotonic() - began
            time.sleep(0.2)  # mpv says that it shows something just before it is there
            grey = screen.copy()
            exact = [_still(player, pair["test"], k, screen) for k in (0, 7, 19)]
        finally:
            player.close()
    assert (reference.show, test.show) == ("reference", "test")
    seen = film.of(1000, 25), film.of(2000, 25)
    assert seen == (list(range(25)), list(range(20)))
    assert (reference.dropped, test.dropped) == (0, 0)
    for log, frames in ((reference, 25), (test, 20)):
        assert log.counters["frames"] == frames
        assert log.counters["estimated-frame-number"] == frames - 1
        # from the first frame to the last, and a frame for the messages about either
        assert abs(log.counters["wall_s"] - (frames - 1) / 25) <= 2 / 25
    assert took_s >= 1.0 + 0.8 + 2 * 0.4
    assert np.unique(grey).tolist() == [126]
    assert exact == [True] * 3


def _still(player, clip, number, screen):
    """Show one frame alone and compare the screen with it."""
    path = clip.path.with_name("still.rgb")
    path.write_bytes(clip.frame(number))
    player._load(player._started(), path, None)
    time.sleep(0.3)
    expected = np.frombuffer(clip.frame(number), np.uint8).reshape(screen.shape)
    return np.array_equal(screen, expected)


@needs_mpv
def test_clips_larger_than_the_monitor_are_refused(tmp_path, monkeypatch):
    size = Sequence(width=320, height=180, fps=25.0, seconds=0.2)
    manifest = write_numbered_test(tmp_path, size)
    clip = checked_clip(manifest, tmp_path, manifest.clip("city__one"))
    player = MpvPlayer(size, output="x11")
    with virtual_screen(tmp_path, 160, 120) as (name, _):
        monkeypatch.setenv("DISPLAY", name)
        try:
            with pytest.raises(DamagedError, match="the clips have 320 x 180"):
                player.show(steps(manifest.session), {"reference": clip, "test": clip})
        finally:
            player.close()


@needs_mpv
def test_an_mpv_that_is_gone_is_said_and_started_again(tmp_path, monkeypatch):
    size = Sequence(width=320, height=180, fps=25.0, seconds=0.2)
    manifest = write_numbered_test(tmp_path, size, grey_s=0.1)
    clip = checked_clip(manifest, tmp_path, manifest.clip("city__one"))
    pair = {"reference": clip, "test": clip}
    player = MpvPlayer(size, output="x11", full_screen=False)
    with virtual_screen(tmp_path, 320, 180) as (name, _):
        monkeypatch.setenv("DISPLAY", name)
        try:
            player._started()
            killer = threading.Timer(0.15, player._process.kill)
            killer.start()
            with pytest.raises(DamagedError, match="mpv has ended"):
                player.show(steps(manifest.session), pair)
            killer.join()
            with suppress(ProcessLookupError):
                player._process.wait(10)
            assert [log.dropped for log in player.show(steps(manifest.session), pair)] == [0, 0]
        finally:
            player.close()


def test_a_missing_or_old_mpv_is_reported(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"mpv: is not found: install mpv 0\.35 or newer"):
        find_mpv()
    old = tmp_path / "mpv"
    old.write_text("#!/bin/sh\necho mpv 0.32.0 Copyright\n", encoding="utf-8")
    old.chmod(0o755)
    with pytest.raises(InputError, match=r"must be version 0\.35 or newer"):
        find_mpv()
