"""Promise: every shipped spec is right, and the README's keys are those that there are."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dsis.camera import read_camera
from dsis.imagefile import write
from dsis.spec import SHIPPED, Content, Spec, read_spec
from dsis.stimuli import build_stimuli, check_stimuli, estimate
from written_spec import SHORT


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("cameras/*.toml")), ids=lambda p: p.stem)
def test_every_shipped_camera_loads(path: Path) -> None:
    assert read_camera(path).noise.segment


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.toml")), ids=lambda p: p.stem)
def test_every_shipped_spec_loads(path: Path, tmp_path: Path) -> None:
    source = []
    if "stills" in path.read_text(encoding="utf-8"):
        write(tmp_path / "a.png", np.zeros((300, 600, 3), np.float32), "png8")
        source = [tmp_path / "a.png"]
    test = read_spec(path.name, source)
    assert test.spec.conditions.noise == ("awgn", "sd")
    assert test.contents()


def test_the_papers_test_is_the_papers() -> None:
    """Display, distance, scale, end labels and observers as the paper prints them."""
    spec = read_spec("seybold.toml").spec
    assert [c.name for c in spec.content] == ["city", "landscape"]
    assert spec.viewing.diagonal_inch == 23
    assert spec.session.scale == (1, 10)
    assert spec.session.labels == ("very annoying", "imperceptible")
    assert spec.session.observers == 18
    assert (spec.sequence.width, spec.sequence.height) == (1920, 1080)


README = (SHIPPED.parent / "README.md").read_text(encoding="utf-8")


def test_the_readmes_spec_is_complete(tmp_path: Path) -> None:
    (text,) = re.findall(r"```toml\n(schema = \"dsis-test/1\".*?)```", README, re.DOTALL)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    assert read_spec(tmp_path / "mine.toml").contents()[0].name == "city"


def test_the_readme_explains_every_key() -> None:
    table = README[README.index("| section |") : README.index("Every content gets one reference")]
    first = {row.split("|")[1].strip(" `[]") for row in table.splitlines() if "|" in row}
    explained = set(re.findall(r"`(\w+)`", table))
    for key, field in Spec.model_fields.items():
        name = field.alias or key
        kind = {"content": Content}.get(name, field.annotation)
        if hasattr(kind, "model_fields"):
            assert name in first
            assert set(kind.model_fields) <= explained, name
        else:
            assert name in explained


@pytest.mark.parametrize("content", ['files = "still.exr"', 'scene = "landscape"'])
@pytest.mark.parametrize(("width", "height"), [(8, 8), (9, 8)])
def test_the_smallest_sizes_build_with_training(
    spec: Callable[..., Path], tmp_path: Path, content: str, width: int, height: int
) -> None:
    path = spec(
        *SHORT,
        ('files = "still.exr"', content),
        ("width = 64", f"width = {width}"),
        ("height = 48", f"height = {height}"),
        ("training = 0", "training = 2"),
    )
    manifest = build_stimuli(read_spec(path), tmp_path / "out")
    assert {clip.role for clip in manifest.clips} == {"reference", "test", "training"}
    assert check_stimuli(tmp_path / "out") == 8


def test_a_dry_run_times_a_small_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No panorama of full size is painted; disk is counted for the full size."""
    from dsis.scenes import Strip
    from dsis.stimuli import source

    painted: list[int] = []

    def grey(strip: Strip) -> np.ndarray:
        painted.append(strip.rows * strip.columns)
        return np.full((strip.rows, strip.columns, 3), 0.2, np.float32)

    monkeypatch.setattr(source, "panorama", grey)
    found = estimate(read_spec("seybold.toml"), tmp_path / "out", 1)
    assert max(painted) < 4 * 320 * 180 * 4
    # 3 contents: a reference and 4 conditions each; raw and PNG, a byte a sample.
    assert found.clips == 15
    assert found.disk_bytes == 15 * 250 * 1920 * 1080 * 3 * 2
    assert found.memory_bytes > 4 * (1920 + 996) * 1080 * 3 * 4
    assert found.seconds > 0
    assert re.search(r"time .* \(extrapolated from one frame of 320x180 pixels\)", str(found))
