"""Promise: a wrong spec gets one message with all its faults, and status 2."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from dsis.cli import main
from dsis.errors import InputError
from dsis.spec import SHIPPED, read_spec

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
    "a number of 5000 digits": ([("seed = 1", "seed = " + "1" * 5000)], "is not TOML"),
    "5000 brackets": ([("seed = 1", "seed = " + "[" * 5000 + "]" * 5000)], "is not TOML"),
    "files is a number": ([('"still.exr"', "5")], "files: is 5, must be a file, folder or glob"),
    "no files": ([('"still.exr"', "[]")], "content[0].files: has 0 items, must have at least 1"),
    "nameless file": ([('"still.exr"', '""')], "content[0].files: is '', must be a file"),
    "one nameless file": ([('"still.exr"', '["still.exr", ""]')], "files: is ['still.exr', '']"),
    "endless file": ([('"still.exr"', f'"{"a" * 300}"')], "no image file found there"),
    "no such user": ([('"still.exr"', '"~no-one/a.png"')], "is '~no-one/a.png': no image file"),
    "NUL in a file's name": ([('"still.exr"', '"a\\u0000"')], "no image file found there"),
    "endless camera": ([("cameras/dual_gain_cinema.toml", "c" * 300)], "no such file"),
    "endless name": ([('name = "still"', f'name = "{"n" * 65}"')], "of 65 characters, must have"),
    "frame rate": ([("fps = 25", "fps = 1e10")], "sequence.fps: is 10000000000.0, must be less"),
    "endless number": ([("fps = 25", "fps = " + "1" * 400)], "fps: is 1111"),
    "endless clip": ([("seconds = 0.2", "seconds = 1e308")], "frames, must be at most 1000000"),
    "too wide": ([("width = 64", "width = 40000")], "width: is 40000, must be less than or equal"),
    "endless pan": (
        [('files = "still.exr"', 'scene = "city"\npan_px_per_frame = -1e300')],
        "content[0].pan_px_per_frame: is -1e+300, must be greater than or equal to -1000",
    ),
    "endless strip": (
        [('files = "still.exr"', 'scene = "city"\npan_px_per_frame = 1e3'), ("= 0.2", "= 300")],
        "content[0].pan_px_per_frame: needs a scene of 1.44e+09 pixels",
    ),
    "seed beyond 63 bits": ([("seed = 1", f"seed = {2**63}")], f"seed: is {2**63}, must be less"),
    "seed true": ([("seed = 1", "seed = true")], "seed: is true, must be a valid integer"),
    "title is a date": ([('"a test"', "2020-01-01")], "title: is the date or time 2020-01-01"),
    "format twice": ([('["player"]', '["player", "player"]')], "formats: named twice: player"),
    "endless sigma": ([('match = "psnr"', "sigma = 1e300")], "awgn.sigma: is 1e+300, must be less"),
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


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_a_seed_option_out_of_range_is_refused(spec: Callable[..., Path], seed: int) -> None:
    with pytest.raises(InputError, match=f"--seed: is {seed}, must be from 0 to {2**63 - 1}"):
        read_spec(spec(), seed=seed)
