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
from dsis.spec import SHIPPED, Content, Spec, read_spec
from dsis.stimuli import build_stimuli, check_stimuli, estimate

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


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_a_seed_option_out_of_range_is_refused(spec: Callable[..., Path], seed: int) -> None:
    with pytest.raises(InputError, match=f"--seed: is {seed}, must be from 0 to {2**63 - 1}"):
        read_spec(spec(), seed=seed)


def picture(path: Path, rows: int = 60, columns: int = 70) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    forms = {".png": "png8", ".tif": "tiff16", ".exr": "exr"}
    write(path, np.full((rows, columns, 3), 0.2, np.float32), forms[path.suffix])
    return path


SHORT = [("seconds = 0.2", "seconds = 0.04"), ("_s = 0.2", "_s = 0.04")]  # one frame
STILLS = ('name = "still"\nfiles = "still.exr"', 'stills = "photos"')


@pytest.mark.parametrize(
    "names", [["IMG 1.png", "IMG-1.tif"], ["s.png", "s.tif", "s.exr"]], ids=["sign", "extension"]
)
def test_stills_with_one_name_are_refused(
    spec: Callable[..., Path], tmp_path: Path, names: list[str]
) -> None:
    for name in names:
        picture(tmp_path / "photos" / name)
    with pytest.raises(InputError, match="two contents have the name") as raised:
        read_spec(spec(STILLS))
    shown = sorted(str(tmp_path / "photos" / name) for name in names)
    assert sum(path in str(raised.value) for path in shown) == 2
    assert ("and 1 more" in str(raised.value)) == (len(names) == 3)


def test_stills_of_many_folders_with_one_name_are_refused(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    sources = [picture(tmp_path / f"day{i}" / "a.png") for i in range(10)]
    picture(tmp_path / "photos" / "b.png")
    with pytest.raises(InputError, match=r"'a': .*day0.a\.png and .*day1.a\.png and 8 more"):
        read_spec(spec(STILLS), sources)


def test_one_still_found_twice_is_refused(spec: Callable[..., Path], tmp_path: Path) -> None:
    picture(tmp_path / "photos" / "b.png")
    path = spec((STILLS[0], 'stills = ["photos", "photos/*.png"]'))
    with pytest.raises(InputError, match=r"b\.png is found twice"):
        read_spec(path)


def test_one_file_is_a_still_and_many_are_a_sequence(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    assert read_spec(spec()).footage["still"].still
    for i in range(5):
        picture(tmp_path / f"take{i}.exr")
    taken = read_spec(spec(("still.exr", "take*.exr"))).footage["still"]
    assert not taken.still
    assert [path.name for path in taken] == [f"take{i}.exr" for i in range(5)]


def test_a_sequences_frames_have_one_size_and_are_images(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    path = spec()
    for i in range(7):
        picture(tmp_path / "take" / f"{i}.exr")
    path = spec(("still.exr", "take"))
    for rows, columns in ((50, 70), (90, 90)):
        picture(tmp_path / "take" / "2.exr", rows, columns)
        with pytest.raises(InputError, match=rf"2\.exr is {columns}x{rows} .*0\.exr is 70x60"):
            read_spec(path)
    (tmp_path / "take" / "2.exr").write_text("no image", encoding="utf-8")
    with pytest.raises(InputError, match=r"2\.exr: is no readable image") as raised:
        read_spec(path)
    assert len(raised.value.faults) == 1
    picture(tmp_path / "take" / "2.exr")
    (tmp_path / "take" / "6.exr").write_text("no image, and not needed", encoding="utf-8")
    assert read_spec(path)


def test_folders_may_have_brackets_hidden_files_and_folders(
    spec: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "take[1]"
    for name in ("a.png", "._a.png", "b.png"):
        picture(folder / name)
    (folder / "dir.png").mkdir()
    for pattern in (folder, folder / "*.png", folder / "[ab].png"):
        assert set(read_spec(spec(STILLS), [pattern]).footage) == {"a", "b"}
    monkeypatch.chdir(folder)
    assert set(read_spec(spec(STILLS), ["*.png"]).footage) == {"a", "b"}
    inside = spec(("player", "png8"), *SHORT)
    build_stimuli(read_spec(inside), folder / "out")
    assert check_stimuli(folder / "out") == 5


@pytest.fixture
def solved(spec: Callable[..., Path], tmp_path: Path) -> Path:
    """Build one frame with matched white noise; return its manifest."""
    path = spec(*SHORT)
    build_stimuli(read_spec(path), tmp_path / "out")
    return tmp_path / "out" / "manifest.json"


def test_solved_white_noise_is_not_kept_for_other_footage_or_seeds(solved: Path) -> None:
    assert read_spec(solved).sigma["still", 0] > 0
    assert read_spec(solved, seed=2).sigma == {}
    assert read_spec(solved, [solved.parents[1] / "still.exr"]).sigma == {}


@pytest.mark.parametrize("wrong", ["-1", "Infinity", "NaN", "true", '"1"', "1e300"])
def test_a_manifests_sigma_is_checked(solved: Path, wrong: str) -> None:
    text = solved.read_text(encoding="utf-8")
    sigma = repr(read_spec(solved).sigma["still", 0])
    solved.write_text(text.replace(f'"0": {sigma}', f'"0": {wrong}'), encoding="utf-8")
    with pytest.raises(InputError, match=r"awgn_sigma\.still\.0: is .*, must be"):
        read_spec(solved)


def test_a_given_sigma_doubles_with_every_stop(spec: Callable[..., Path], tmp_path: Path) -> None:
    """Of three levels, sigma from the frames: 5 standard errors, where clipping takes no part."""
    path = spec(*SHORT, ('match = "psnr"', "sigma = 1.5"), ("levels = [0]", "levels = [0, 1, 3]"))
    manifest = build_stimuli(read_spec(path), tmp_path / "out")
    for level in (0, 1, 3):
        clip = manifest.clip(f"still__awgn__none__{level}")
        assert clip.awgn_sigma == 1.5 * 2**level
        measured = 255 / 10 ** (clip.quality.psnr_float_db[0] / 20)
        assert abs(measured / clip.awgn_sigma - 1) < 5 / np.sqrt(2 * 64 * 48 * 3)


@pytest.mark.parametrize("rule", ["psnr", "visibility"])
def test_strong_under_exposure_is_matched(
    spec: Callable[..., Path], tmp_path: Path, rule: str
) -> None:
    """Sigma is solved to 0.001 of a code; PSNR changes by 8.7 dB per relative change at most."""
    path = spec(*SHORT, ("levels = [0]", "levels = [9, 16]"), ('"psnr"', f'"{rule}"'))
    manifest = build_stimuli(read_spec(path), tmp_path / "out")
    for level in (9, 16):
        white, camera = (manifest.clip(f"still__{n}__none__{level}") for n in ("awgn", "sd"))
        if rule == "psnr":
            assert abs(white.quality.psnr_db[0] - camera.quality.psnr_db[0]) < 0.005
        else:
            assert white.quality.visible_noise == pytest.approx(
                camera.quality.visible_noise, rel=1e-3
            )


AFAR = "diagonal_inch = 23\ndistance_heights = 300\npeak_cd_m2 = 100"


@pytest.mark.parametrize("rule", ["psnr", "visibility"])
def test_a_level_that_white_noise_cannot_reach_is_refused(
    spec: Callable[..., Path], tmp_path: Path, rule: str
) -> None:
    """A nearly noiseless camera 16 stops under shows black for white; noise shows half of it.

    From afar an eye sees the half as grey: less of a difference than black is.
    """
    text = (SHIPPED / "cameras" / "single_gain.toml").read_text(encoding="utf-8")
    text = text.replace("slope = 0.4", "slope = 1e-9").replace("intercept = 6.0", "intercept = 0")
    (tmp_path / "dark.toml").write_text(text, encoding="utf-8")
    path = spec(
        *SHORT,
        ("levels = [0]", "levels = [16]"),
        ("cameras/dual_gain_cinema.toml", "dark.toml"),
        ('"psnr"', f'"{rule}"'),
        ("[camera]", f"[viewing]\n{AFAR}\n[camera]"),
    )
    write(tmp_path / "still.exr", np.full((60, 70, 3), 0.9, np.float32), "exr")
    with pytest.raises(InputError, match=r"conditions\.levels.*awgn\.match") as raised:
        build_stimuli(read_spec(path), tmp_path / "out")
    message = str(raised.value)
    assert "at level 16 sd of content 'still' has" in message
    assert ("dB" if rule == "psnr" else "visible noise energy") in message


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
    paint = source.panorama

    def spy(strip: Strip) -> np.ndarray:
        painted.append(strip.rows * strip.columns)
        return paint(strip)

    monkeypatch.setattr(source, "panorama", spy)
    found = estimate(read_spec("seybold.toml"), tmp_path / "out", 1)
    assert max(painted) < 4 * 320 * 180 * 4
    # 3 contents: a reference and 4 conditions each; raw and PNG, a byte a sample.
    assert found.clips == 15
    assert found.disk_bytes == 15 * 250 * 1920 * 1080 * 3 * 2
    assert found.memory_bytes > 4 * (1920 + 996) * 1080 * 3 * 4
    assert found.seconds > 0
    assert re.search(r"time .* \(extrapolated from one frame of 320x180 pixels\)", str(found))
