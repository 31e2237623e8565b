"""Rendered panoramas are kept: found again, never mixed up, never trusted when damaged."""

import ast
import json
import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dsis.scenes import Strip, cache, cache_folder, renderer
from dsis.scenes.cache import is_kept, kept, kept_or_rendered

Light = NDArray[np.float32]
STRIP = Strip("city", 7, 32, 40)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DSIS_CACHE", str(tmp_path))
    return cache_folder()


class Renderer:
    """Renders numbers that depend on the place alone, and counts."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self, strip: Strip = STRIP) -> Light:
        def rendered() -> Light:
            self.times += 1
            row, column = np.indices((strip.rows, strip.columns), np.float32)
            return np.stack([row, column, row + column + strip.seed], axis=2)

        return kept_or_rendered(strip, rendered)


def only(folder: Path, ending: str) -> Path:
    (path,) = folder.glob(f"*.{ending}")
    return path


def test_it_is_rendered_once_and_cannot_be_changed(folder: Path) -> None:
    ask = Renderer()
    first, again = ask(), ask()
    assert ask.times == 1
    assert first.tobytes() == again.tobytes()
    assert not first.flags.writeable
    assert not again.flags.writeable
    assert np.load(only(folder, "npy")).tobytes() == first.tobytes()
    record = json.loads(only(folder, "json").read_text(encoding="utf-8"))
    assert record["primaries"] == "Rec.709, D65"
    assert {key: record[key] for key in ("scene", "seed", "rows", "columns")} == {
        "scene": "city",
        "seed": 7,
        "rows": 32,
        "columns": 40,
    }


def test_a_wider_one_serves_a_narrower_request_and_not_the_reverse() -> None:
    ask = Renderer()
    wide = ask(Strip("city", 7, 32, 60))
    assert is_kept(STRIP)
    assert not is_kept(Strip("city", 7, 32, 61))
    narrow = ask(STRIP)
    assert ask.times == 1
    assert narrow.tobytes() == wide[:, :40].tobytes()
    ask(Strip("city", 7, 32, 61))
    assert ask.times == 2


@pytest.mark.parametrize(
    "other",
    [
        Strip("landscape", 7, 32, 40),
        Strip("city", 71, 32, 40),
        Strip("city", 7, 33, 40),
        Strip("city", 7, 32, 40, samples=8),
        Strip("city", 7, 32, 40, ambient=8),
    ],
)
def test_another_request_is_another_panorama(other: Strip) -> None:
    ask = Renderer()
    ask(STRIP)
    assert kept(other) is None
    ask(other)
    assert ask.times == 2


def test_other_code_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    ask = Renderer()
    ask(STRIP)
    monkeypatch.setattr(cache, "code_version", lambda _scene: "0123456789abcdef")
    ask(STRIP)
    assert ask.times == 2


def test_what_other_code_made_of_the_scene_is_removed_and_said(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ask = Renderer()
    others = [Strip("city", 7, 32, 60), Strip("city", 8, 33, 40, samples=2)]
    for strip in (*others, Strip("landscape", 7, 32, 40)):
        ask(strip)
    (folder / "city-7.exr").write_bytes(b"somebody's own")
    before = {path.name for path in folder.iterdir()}
    assert "another version" not in caplog.text
    monkeypatch.setattr(cache, "code_version", lambda _scene: "0123456789abcdef")
    ask(STRIP)
    left = {path.name for path in folder.iterdir()}
    gone = {name.rsplit("-", 1)[0] for name in before - left}
    assert gone == {"city-7-32x60-s4a4", "city-8-33x40-s2a4"}
    assert {"city-7.exr"} < left
    assert is_kept(STRIP)
    assert f"{folder}: removed 2 of city that another version of dsis rendered, 0 MB" in caplog.text
    assert len(caplog.records) == 1


def test_what_other_code_is_rendering_is_left_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ask, new = Renderer(), "0123456789abcdef"
    ask(STRIP)
    held = {path.name for path in folder.iterdir()}
    with cache._held(STRIP):
        monkeypatch.setattr(cache, "code_version", lambda _scene: new)
        ask(STRIP)
    assert held < {path.name for path in folder.iterdir()}
    assert caplog.text == ""


def test_the_code_version_follows_what_renders(tmp_path: Path) -> None:
    """Every source that a scene's renderer may use counts; the keeping of panoramas does not."""
    package = tmp_path / "dsis" / "scenes"
    inside = ("renderer.py", "cache.py", "sky.py", "city/trees.py", "landscape/lake.py")
    outside = [f"../{name}" for name in renderer.OUTSIDE]
    for name in (*inside, *outside):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text("1", encoding="utf-8")

    def version(scene: str) -> str:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(renderer, "__file__", str(package / "renderer.py"))
            return renderer.code_version.__wrapped__(scene)

    before = version("city")
    for name, changes in {
        "renderer.py": False,
        "cache.py": False,
        "landscape/lake.py": False,
        "sky.py": True,
        "city/trees.py": True,
        **dict.fromkeys(outside, True),
    }.items():
        (package / name).write_text("2", encoding="utf-8")
        after = version("city")
        assert (after != before) == changes, name
        before = after


def test_nothing_else_of_dsis_renders() -> None:
    """What renderers import from outside their package is in the code version too.

    But for errors, and for the workers, who decide no byte.
    """
    known = {"errors", "workers", *(name.removesuffix(".py") for name in renderer.OUTSIDE)}
    folder = Path(renderer.__file__).parent
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            ours = [name for name in names if name.startswith("dsis.")]
            used = {name.split(".")[1] for name in ours} - {"scenes"}
            assert used <= known, path.name


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), ending=st.booleans())
def test_a_flipped_bit_is_noticed_wherever_it_is(
    folder: Path, place: float, bit: int, ending: bool
) -> None:
    ask = Renderer()
    sound = ask().tobytes()
    path = only(folder, "npy" if ending else "json")
    damaged = bytearray(path.read_bytes())
    at = int(place * len(damaged))
    damaged[at] ^= 1 << bit
    path.write_bytes(damaged)
    assert ask().tobytes() == sound  # the record's words beside its digest decide nothing
    assert ask().tobytes() == sound


@pytest.mark.parametrize("ending", ["npy", "json"])
@pytest.mark.parametrize("left", [0, 20, None])
def test_what_is_cut_short_or_gone_is_rendered_again_and_said(
    folder: Path, ending: str, left: int | None, caplog: pytest.LogCaptureFixture
) -> None:
    ask = Renderer()
    sound = ask().tobytes()
    path = only(folder, ending)
    whole = path.read_bytes()
    path.unlink()
    if left is not None:
        path.write_bytes(whole[:left])
    with caplog.at_level(logging.WARNING):
        assert ask().tobytes() == sound
    assert ask.times == 2
    said = f"{only(folder, 'npy')} is damaged and is rendered again"
    assert (said in caplog.text) == ((ending, left) != ("json", None))  # without a record: nothing
    ask()
    assert ask.times == 2
    assert path.read_bytes() == whole


def test_a_damaged_one_is_forgotten_by_narrower_requests_too(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    ask = Renderer()
    ask(Strip("city", 7, 32, 60))
    only(folder, "npy").write_bytes(b"damaged")
    ask(STRIP)
    assert caplog.text.count("is damaged") == 1
    ask(STRIP)
    assert ask.times == 2
    assert caplog.text.count("is damaged") == 1


def test_files_get_their_names_when_they_are_whole(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kill in the middle of writing leaves nothing under a name that is looked for."""
    write = Path.write_bytes
    seen: list[str] = []

    def watched(path: Path, held: bytes) -> int:
        seen.extend(other.name for other in (path, *folder.iterdir()) if other.suffix != ".lock")
        return write(path, held)

    monkeypatch.setattr(Path, "write_bytes", watched)
    Renderer()()
    record, panorama = only(folder, "json").name, only(folder, "npy").name
    unfinished = {f".{panorama}.unfinished", f".{record}.unfinished"}
    assert set(seen) == {*unfinished, panorama}  # the record last


def test_a_full_disk_costs_the_cache_and_not_the_panorama(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(path: Path, held: bytes) -> int:
        path.touch()
        raise OSError(28, "No space left on device", str(path), len(held))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        ask = Renderer()
        assert ask().shape == (32, 40, 3)
    assert ask.times == 1
    assert "panoramas are not kept there (No space left on device)" in caplog.text
    assert [path for path in folder.iterdir() if path.suffix != ".lock"] == []


def test_a_place_that_is_no_folder_costs_the_cache_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("DSIS_CACHE", str(tmp_path / "file"))
    ask = Renderer()
    assert ask().shape == (32, 40, 3)
    assert "panoramas are not kept there" in caplog.text


PROCESS = """
import sys, time
import numpy as np
from dsis.scenes import Strip
from dsis.scenes.cache import kept_or_rendered

def render():
    print("rendered", flush=True)
    time.sleep(0.5)
    return np.ones((32, 40, 3), np.float32)

print(kept_or_rendered(Strip("city", 7, 32, 40), render).sum(), flush=True)
"""


def test_of_several_processes_one_renders_and_the_others_wait() -> None:
    running = [
        subprocess.Popen([sys.executable, "-c", PROCESS], stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    said = [process.communicate(timeout=60)[0].split() for process in running]
    assert sorted(map(len, said)) == [1, 1, 2]
    assert {words[-1] for words in said} == {"3840.0"}


def test_the_folder_is_the_platforms(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("DSIS_CACHE")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder() == tmp_path / "xdg" / "dsis" / "scenes"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == tmp_path / ".cache" / "dsis" / "scenes"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == tmp_path / ".cache" / "dsis" / "scenes"
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cache_folder() == tmp_path / "Library" / "Caches" / "dsis" / "scenes"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_folder() == tmp_path / "local" / "dsis" / "scenes"
