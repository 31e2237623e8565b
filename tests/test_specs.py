"""Promise: every shipped spec is right, and a wrong one gets one message with all its faults."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dsis.camera import read_camera
from dsis.cli import main
from dsis.errors import InputError
from dsis.imagefile import write
from dsis.spec import SHIPPED, read_spec

GOOD = """\
schema = "dsis-test/1"
title = "a test"
seed = 1
formats = ["player"]

[sequence]
width = 64
height = 48
fps = 25
seconds = 0.2

[[content]]
name = "still"
files = "still.exr"

[camera]
model = "cameras/dual_gain_cinema.toml"

[optics]
f_number = 5.6
wavelength_nm = 550
pitch_um = 8.25
low_pass_spot_separation_px = 0.75
fill_factor = 1.0

[color]
display = "Rec.1886 Rec.709 - Display"
view = "ACES 1.0 - SDR Video"
scene_space = "Linear ARRI Wide Gamut 3"

[awgn]
match = "psnr"

[conditions]
noise = ["awgn", "sd"]
demosaic = ["none", "bilinear"]
levels = [0]

[session]
reference_s = 0.2
test_s = 0.2
training = 0
"""


@pytest.fixture
def spec(tmp_path: Path) -> Callable[..., Path]:
    """Write GOOD with some replacements beside a still of 70 x 60 pixels."""
    write(tmp_path / "still.exr", np.full((60, 70, 3), 0.2, np.float32), "exr")

    def with_changes(*changes: tuple[str, str]) -> Path:
        text = GOOD
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        path = tmp_path / "spec.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return with_changes


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


FAULTS = {
    "unknown key": ([("fps = 25", "fps = 25\nframerate = 25")], "sequence.framerate: unknown key"),
    "a near miss": ([("width = 64", "widht = 64")], "did you mean width?"),
    "missing key": ([("height = 48\n", "")], "sequence.height: is missing"),
    "missing file": ([('"still.exr"', '"no.exr"')], "content[0].files: is 'no.exr': no image file"),
    "missing camera": ([("dual_gain_cinema", "nothing")], "camera.model: is 'cameras/noth"),
    "negative sigma": ([('match = "psnr"', "sigma = -2")], "awgn.sigma: is -2, must be greater"),
    "two noise rules": ([('match = "psnr"', 'match = "psnr"\nsigma = 2')], "awgn: needs exactly"),
    "unknown demosaicker": (
        [('"bilinear"', '"malvar"')],
        "conditions.demosaic: unknown demosaicker 'malvar', must be of: none, bilinear, dlmmse",
    ),
    "unknown noise": ([('"sd"', '"poisson"')], 'conditions.noise[1]: is "poisson", must be'),
    "wrong type": ([("width = 64", 'width = "64"')], 'sequence.width: is "64", must be'),
    "float for a whole number": ([("seed = 1", "seed = 1.5")], "seed: is 1.5, must be"),
    "missing section": ([("[optics]", "[optick]")], "optics: is missing"),
    "unknown section": ([("[optics]", "[optick]")], "optick: unknown key"),
    "still too small": ([("width = 64", "width = 80")], "still.exr is 70x60 pixels, must be 80x48"),
    "pan too far": (
        [('"still.exr"', '"still.exr"\npan_px_per_frame = 3')],
        "still.exr is 70x60 pixels, must be 76x48 or more",
    ),
    "clip shorter than shown": ([("test_s = 0.2", "test_s = 4")], "session.test_s: is 4 s, must"),
    "unknown scene": ([('files = "still.exr"', 'scene = "desert"')], "scene: is 'desert'"),
    "two sources": (
        [('"still.exr"', '"still.exr"\nscene = "city"')],
        "content[0]: needs exactly one of: scene, files, stills (has scene and files)",
    ),
    "no name": ([('name = "still"\n', "")], "content[0]: name is missing"),
    "a name that is no file name": ([('name = "still"', 'name = "a/b"')], "name: is 'a/b'"),
    "level twice": ([("levels = [0]", "levels = [0, 0]")], "conditions.levels: named twice: 0"),
    "nothing to build": ([("levels = [0]", "levels = []")], "conditions.levels: has 0 items"),
    "unknown view": ([("ACES 1.0 - SDR Video", "ACES 9")], 'color.view: is "ACES 9"'),
    "unknown schema": ([("dsis-test/1", "dsis-test/9")], 'schema: is "dsis-test/9", must be'),
    "zero frames a second": ([("fps = 25", "fps = 0")], "sequence.fps: is 0, must be greater"),
    "not a number": ([("fps = 25", "fps = nan")], "sequence.fps"),
    "scale upside down": ([("training = 0", "training = 0\nscale = [5, 1]")], "session.scale"),
    "not TOML": ([("seed = 1", "seed = = 1")], "is not TOML"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_wrong_spec_gets_a_message_and_status_2(
    name: str, spec: Callable[..., Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    changes, expected = FAULTS[name]
    path = spec(*changes)
    assert main(["stimuli", str(path), "--out", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert expected in message
    assert "Traceback" not in message
    assert not list(tmp_path.glob("out*"))


def test_all_faults_come_in_one_message(spec: Callable[..., Path]) -> None:
    picked = ["unknown key", "missing file", "negative sigma", "unknown demosaicker",
              "wrong type", "missing section", "clip shorter than shown"]  # fmt: skip
    path = spec(*(change for name in picked for change in FAULTS[name][0]))
    with pytest.raises(InputError) as raised:
        read_spec(path)
    message = str(raised.value)
    for name in picked:
        if name != "clip shorter than shown":  # the sequence it is measured by is wrong itself
            assert FAULTS[name][1] in message, name
    assert all(line.startswith(str(path)) for line in message.splitlines())


def test_a_fault_in_the_camera_names_the_cameras_file(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    text = (SHIPPED / "cameras" / "single_gain.toml").read_text(encoding="utf-8")
    text = text.replace("slope = 0.4", "slope = -0.4").replace('cfa = "RGGB"', 'cfa = "RGB"')
    text += '\n[[effect]]\nkind = "row_nose"\nsigma_dn = 1\n'
    (tmp_path / "my.toml").write_text(text, encoding="utf-8")
    path = spec(("cameras/dual_gain_cinema.toml", "my.toml"), ("seed = 1", "seed = -1"))
    with pytest.raises(InputError) as raised:
        read_spec(path)
    message = str(raised.value)
    assert "my.toml: noise.segment[0].slope: is -0.4, must be" in message
    assert 'my.toml: cfa: is "RGB", must be' in message
    assert "my.toml: effect[0].kind: is 'row_nose' (did you mean row_noise?)" in message
    assert "spec.toml: seed: is -1, must be" in message


@pytest.mark.parametrize(
    "arguments", [["stimuli", "absent.toml"], ["stimuli"], ["stimuli", "--check", "absent"]]
)
def test_what_is_absent_gets_a_message(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert re.match(r"dsis: .*(absent|SPEC)", capsys.readouterr().err)
