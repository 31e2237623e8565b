"""Promise: the four conditions are the paper's, on disk as the manifest says, bit for bit again."""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from dsis.camera import Camera
from dsis.cfa import mosaic, pattern
from dsis.cli import main
from dsis.color import Color, DisplayTransform
from dsis.errors import DamagedError, InputError
from dsis.imagefile import read, write
from dsis.manifest import read_manifest
from dsis.spec import SHIPPED, read_spec
from dsis.stimuli import build_stimuli, check_stimuli
from dsis.stimuli.conditions import Rendering

ROWS, COLUMNS, FRAMES = 48, 64, 6
SPEC = """\
schema = "dsis-test/1"
seed = 3
formats = {formats}
[sequence]
width = {columns}
height = {rows}
fps = 25
seconds = {seconds}
[[content]]
name = "ramp"
files = "ramp.exr"
pan_px_per_frame = 0.5
[camera]
model = "cameras/{camera}.toml"
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
{awgn}
[conditions]
noise = ["awgn", "sd"]
demosaic = ["none", "bilinear", "lu_tan"]
levels = {levels}
[session]
reference_s = 0.2
test_s = 0.2
training = 0
"""


def scene(rows: int, columns: int) -> np.ndarray:
    """Return smooth linear light from black to a little over diffuse white, coloured."""
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float32)
    light = 0.5 + 0.5 * np.sin(x / 9) * np.cos(y / 7)
    return np.stack([light, 0.8 * light**2, 0.3 + 0.5 * light], axis=2).astype(np.float32)


def write_spec(folder: Path, **changes: object) -> Path:
    values = {
        "formats": '["player"]',
        "rows": ROWS,
        "columns": COLUMNS,
        "seconds": FRAMES / 25,
        "camera": "dual_gain_cinema",
        "awgn": 'match = "psnr"',
        "levels": "[0]",
    } | changes
    size = int(values["rows"]), int(values["columns"])
    write(folder / "ramp.exr", scene(size[0] + 8, size[1] + 40), "exr")
    path = folder / "spec.toml"
    path.write_text(SPEC.format(**values), encoding="utf-8")
    return path


def frames_of(folder: Path, stimulus: str) -> np.ndarray:
    data = np.fromfile(folder / "player" / f"{stimulus}.rgb", np.uint8)
    return data.reshape(FRAMES, ROWS, COLUMNS, 3)


def every_byte(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stimuli")
    build_stimuli(read_spec(write_spec(folder, levels="[0, 2]")), folder / "out", jobs=2)
    return folder / "out"


def test_every_condition_is_there(built: Path) -> None:
    manifest = read_manifest(built)
    names = {clip.stimulus for clip in manifest.clips}
    conditions = {
        f"ramp__{noise}__{dem}__{level}"
        for noise in ("awgn", "sd")
        for dem in ("none", "bilinear", "lu_tan")
        for level in (0, 2)
    }
    assert names == {"ramp__reference"} | conditions
    assert check_stimuli(built) == 13 * FRAMES


def test_any_number_of_jobs_gives_the_same_bytes(built: Path, tmp_path: Path) -> None:
    spec = built.parent / "spec.toml"
    build_stimuli(read_spec(spec), tmp_path / "one", jobs=1)
    assert every_byte(tmp_path / "one") == every_byte(built)


def test_a_manifest_builds_the_same_clips_again(built: Path, tmp_path: Path) -> None:
    build_stimuli(read_spec(built / "manifest.json"), tmp_path / "again", jobs=2)
    assert every_byte(tmp_path / "again") == every_byte(built)


def test_another_seed_gives_other_noise_on_the_same_reference(built: Path, tmp_path: Path) -> None:
    build_stimuli(read_spec(built.parent / "spec.toml", seed=4), tmp_path / "other", jobs=2)
    name = "ramp__reference"
    np.testing.assert_array_equal(frames_of(tmp_path / "other", name), frames_of(built, name))
    name = "ramp__sd__none__0"
    assert (frames_of(tmp_path / "other", name) != frames_of(built, name)).any()


def test_logged_psnr_is_that_of_the_files(built: Path) -> None:
    manifest = read_manifest(built)
    reference = frames_of(built, "ramp__reference").astype(np.float64)
    for clip in manifest.clips:
        if clip.role == "test":
            error = frames_of(built, clip.stimulus) - reference
            psnr = 10 * np.log10(255**2 / (error**2).mean(axis=(1, 2, 3)))
            np.testing.assert_allclose(clip.quality.psnr_db, psnr, rtol=1e-9)


def test_white_noise_is_matched_to_the_camera_noise(built: Path) -> None:
    """Short clips are matched on all frames: to the tolerance of sigma, 0.001 of a code."""
    manifest = read_manifest(built)
    for level in (0, 2):
        awgn, sd = (
            float(
                np.mean(
                    [p or 0 for p in manifest.clip(f"ramp__{n}__none__{level}").quality.psnr_db]
                )
            )
            for n in ("awgn", "sd")
        )
        assert abs(awgn - sd) < 0.005
    weak, strong = (manifest.clip(f"ramp__sd__none__{level}").quality for level in (0, 2))
    assert np.mean(strong.psnr_db) < np.mean(weak.psnr_db) - 3


@pytest.mark.parametrize("awgn", ["sigma = 4.28", 'match = "visibility"'])
def test_white_noise_level_given_or_matched_by_visibility(awgn: str, tmp_path: Path) -> None:
    manifest = build_stimuli(read_spec(write_spec(tmp_path, awgn=awgn)), tmp_path / "out")
    white, camera = (manifest.clip(f"ramp__{n}__none__0") for n in ("awgn", "sd"))
    if "sigma" in awgn:
        assert white.awgn_sigma == 4.28
        assert white.quality.psnr_float_db[0] == pytest.approx(
            20 * np.log10(255 / 4.28), abs=5 * 4.343 * np.sqrt(2 / (ROWS * COLUMNS * 3))
        )
    else:
        # The energy is measured on three of the six frames that were matched.
        assert white.quality.visible_noise == pytest.approx(camera.quality.visible_noise, rel=0.1)


class Identity(DisplayTransform):
    """Shows scene light as it is."""

    def display_from_scene(self, rgb: np.ndarray) -> np.ndarray:
        return rgb


def rendering(camera: str, transform: type[DisplayTransform], seed: int = 1) -> Rendering:
    from dsis.camera import read_camera

    model: Camera = read_camera(SHIPPED / "cameras" / f"{camera}.toml")
    return Rendering(model, transform(Color()), seed, exposure_time_s=0.02)


@pytest.mark.parametrize("camera", ["dual_gain_cinema", "single_gain"])
@pytest.mark.parametrize("method", ["bilinear", "dlmmse", "lu_tan"])
def test_pairs_differ_by_demosaicking_alone(camera: str, method: str) -> None:
    """All three methods keep measured samples: sampled again, `dem` must be `rgb` sampled."""
    make = rendering(camera, Identity)
    clean = make.camera.clean_raw(scene(ROWS, COLUMNS))
    raw = make.noisy_raw(clean, "city", 1, 4)
    balanced = make.camera.scene_light(raw)
    full = make.display_demosaicked(raw, method)
    np.testing.assert_allclose(
        mosaic(full, make.camera.cfa), mosaic(balanced, make.camera.cfa), rtol=1e-6, atol=1e-7
    )
    codes = make.noisy_display(np.clip(scene(ROWS, COLUMNS), 0, 1), 4.0, "city", 1, 4)
    again = mosaic(make.mosaicked_display(codes, method), make.camera.cfa)
    np.testing.assert_allclose(again, mosaic(codes, make.camera.cfa), rtol=1e-6)


def test_a_display_frame_is_made_alike_in_all_its_rows() -> None:
    """Frames go through the transform in runs of rows: here three, the last one short."""
    make = rendering("dual_gain_cinema", DisplayTransform)
    raw = make.camera.clean_raw(scene(250, 160))
    at_once = make.transform.display_from_scene(make.camera.scene_light(raw))
    np.testing.assert_allclose(make.display(raw), at_once, rtol=1e-5, atol=1e-6)


def test_the_mosaic_of_sd_dem_is_the_raw_of_sd_rgb_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit: what enters the demosaicker, less the white-balance gains."""
    from dsis.stimuli import conditions

    make = rendering("dual_gain_cinema", Identity)
    gain = np.array(make.camera.white_balance, np.float32)
    entered = []

    def spy(sampled: np.ndarray, cfa: object, method: str, **_: object) -> np.ndarray:
        entered.append((sampled, cfa, method))
        return np.repeat(sampled[:, :, np.newaxis], 3, axis=2)

    monkeypatch.setattr(conditions, "demosaic", spy)
    raw = make.noisy_raw(make.camera.clean_raw(scene(ROWS, COLUMNS)), "city", 0, 0)
    make.display_demosaicked(raw, "bilinear")
    colours = pattern(make.camera.cfa)
    for row in (0, 1):
        for column in (0, 1):
            c = colours[row, column]
            expected = raw[row::2, column::2, c] * gain[c]
            np.testing.assert_array_equal(entered[0][0][row::2, column::2], expected)


# Share of a raw variance that bilinear interpolation keeps, by site (red, green, green, blue) and
# channel: 1 where measured, 1/2 from two neighbours, 1/4 from four.
KEPT = {
    "sd_rgb": np.array([[1, 1, 1]]),
    "sd_dem": np.array(
        [[1, 1 / 4, 1 / 4], [1 / 2, 1, 1 / 2], [1 / 2, 1, 1 / 2], [1 / 4, 1 / 4, 1]]
    ),
}


def predicted_moments(
    make: Rendering, clean: np.ndarray, variance: np.ndarray, case: str
) -> np.ndarray:
    """Return the display variance of a flat chart (3,), by quadrature over the raw noise.

    The three channels of a site are independent and Gaussian: Gauss and Hermite's rule with 21^3
    points, averaged over the kinds of site.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    weights = weights / weights.sum()
    z = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(1, -1, 3)
    w = np.einsum("i,j,k->ijk", weights, weights, weights).ravel()
    first, second = np.zeros(3), np.zeros(3)
    for kept in KEPT[case]:
        raw = clean + z * np.sqrt(variance * kept)
        display = make.display(raw.astype(np.float32))[0].astype(np.float64)
        first += w @ display / len(KEPT[case])
        second += w @ display**2 / len(KEPT[case])
    return second - first**2


@pytest.mark.parametrize("light", [0.02, 0.18, 0.5])
@pytest.mark.parametrize("level", [0, 2])
@pytest.mark.parametrize("case", ["sd_rgb", "sd_dem"])
def test_display_variance_of_a_flat_chart(light: float, level: int, case: str) -> None:
    """Display variance = that of the colour transform under raw noise m x + t + 1/12 (rounding).

    Tolerance: z = 5 of the sampling error; bilinear's correlated noise counts as an eighth as
    many samples (the sum of its squared correlations is below 8).
    """
    make = rendering("dual_gain_cinema", DisplayTransform)
    camera, side = make.camera, 400
    clean = camera.clean_raw(np.full((side, side, 3), light, np.float32))
    stops = np.float32(2.0**level)
    variance = (camera.segments.variance_dn2(clean[0, 0] / stops) + 1 / 12) * stops**2
    predicted = predicted_moments(make, clean[0, 0].astype(np.float64), variance, case)
    raw = make.noisy_raw(clean, "chart", level, 0)
    display = make.display(raw) if case == "sd_rgb" else make.display_demosaicked(raw, "bilinear")
    samples = (display[2:-2, 2:-2].astype(np.float64) - display.mean(axis=(0, 1))) ** 2
    loss = 8 if case == "sd_dem" else 1
    error = samples.std(axis=(0, 1)) * np.sqrt(loss) / side
    z = (samples.mean(axis=(0, 1)) - predicted) / error
    assert np.abs(z).max() < 5, f"{samples.mean(axis=(0, 1))}, predicted {predicted}"


def test_formats_hold_the_same_frames(tmp_path: Path) -> None:
    formats = ["player", "png8", "tiff16", "dpx16", "exr"]
    spec = write_spec(tmp_path, formats=json.dumps(formats))
    manifest = build_stimuli(read_spec(spec), tmp_path / "out", jobs=2)
    assert check_stimuli(tmp_path / "out", jobs=2) == len(manifest.clips) * FRAMES * len(formats)
    name = "ramp__sd__bilinear__0"
    player = frames_of(tmp_path / "out", name)[3] / 255
    # Half a code of 8 bits, of 16 bits, and half floats' 11 bits below 1.
    for form, extension, error in (
        ("png8", "png", 1e-6),
        ("tiff16", "tif", 0.51 / 255),
        ("dpx16", "dpx", 0.51 / 255),
        ("exr", "exr", 0.51 / 255 + 2**-12),
    ):
        image = read(tmp_path / "out" / form / name / f"00003.{extension}")
        assert np.abs(np.clip(image, 0, 1) - player).max() <= error, form


def test_a_numbered_sequence_is_read_in_natural_order(tmp_path: Path) -> None:
    spec = write_spec(tmp_path)
    for frame in range(12):
        light = np.full((ROWS, COLUMNS, 3), 0.02 * (frame + 1), np.float32)
        write(tmp_path / f"take{frame}.exr", light, "exr")
    text = spec.read_text(encoding="utf-8").replace('"ramp.exr"', '"take*.exr"')
    spec.write_text(text.replace("pan_px_per_frame = 0.5\n", ""), encoding="utf-8")
    build_stimuli(read_spec(spec), tmp_path / "out")
    levels = frames_of(tmp_path / "out", "ramp__reference").mean(axis=(1, 2, 3))
    assert (np.diff(levels) > 0).all()


def test_stills_are_contents_of_their_own_with_a_remark(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write(tmp_path / f"{name}.png", np.clip(scene(300, 520), 0, 1), "png8")
    text = (SHIPPED / "stills.toml").read_text(encoding="utf-8")
    text = text.replace("seconds = 0.4", "seconds = 0.04").replace("_s = 0.4", "_s = 0.04")
    (tmp_path / "s.toml").write_text(text.replace("training = 4", "training = 0"), encoding="utf-8")
    manifest = build_stimuli(read_spec(tmp_path / "s.toml", [tmp_path]), tmp_path / "out")
    assert {clip.content for clip in manifest.clips} == {"one", "two"}
    assert len(manifest.remarks) == 2
    assert "not noise-free, display-referred" in manifest.remarks[0]
    # Un-tone-mapped comes back: but for the optics, the reference is the still.
    data = np.fromfile(tmp_path / "out" / "player" / "one__reference.rgb", np.uint8)
    still = read(tmp_path / "one.png")[15:285, 20:500]
    assert np.abs(data.reshape(270, 480, 3) / 255 - still).mean() < 0.01


def test_a_camera_with_effects_says_what_they_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Row noise of 120 DN on about 50 must lower PSNR and be seen; AWGN knows no camera."""
    spec = write_spec(tmp_path, camera="striped", awgn="sigma = 4")
    shipped = (SHIPPED / "cameras" / "dual_gain_cinema.toml").read_text(encoding="utf-8")
    camera = tmp_path / "cameras" / "striped.toml"
    camera.parent.mkdir()
    camera.write_text(
        shipped + '[[effect]]\nkind = "row_noise"\nsigma_dn = 120\n', encoding="utf-8"
    )
    assert main(["stimuli", str(spec), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    manifest = read_manifest(tmp_path / "out")
    for name in ("ramp__sd__none__0", "ramp__sd__bilinear__0"):
        quality = manifest.clip(name).quality
        with_effects = [quality.psnr_db[frame] for frame in quality.visible_frames]
        assert np.mean(with_effects) < np.mean(quality.base_psnr_db) - 0.3
        assert quality.visible_noise > 1.2 * quality.base_visible_noise
        assert f"effects on {name}: PSNR" in said
    assert manifest.clip("ramp__awgn__none__0").quality.base_psnr_db == ()
    # The base model alone is the same test without the effect, bit for bit.
    camera.write_text(shipped, encoding="utf-8")
    plain = build_stimuli(read_spec(spec), tmp_path / "plain")
    before = plain.clip("ramp__sd__none__0").quality
    after = manifest.clip("ramp__sd__none__0").quality
    assert [before.psnr_db[frame] for frame in before.visible_frames] == list(after.base_psnr_db)
    assert before.visible_noise == pytest.approx(after.base_visible_noise, rel=1e-12)


@pytest.mark.parametrize("damage", ["flip", "missing", "short", "long"])
def test_check_finds_what_is_wrong(built: Path, tmp_path: Path, damage: str) -> None:
    shutil.copytree(built, tmp_path / "copy")
    clip = tmp_path / "copy" / "player" / "ramp__sd__none__0.rgb"
    data = bytearray(clip.read_bytes())
    if damage == "flip":
        data[2 * ROWS * COLUMNS * 3 + 5] ^= 1
    elif damage == "short":
        del data[-1:]
    elif damage == "long":
        data += bytes(ROWS * COLUMNS * 3)
    clip.write_bytes(data)
    if damage == "missing":
        clip.unlink()
    with pytest.raises(DamagedError) as raised:
        check_stimuli(tmp_path / "copy")
    expected = {"flip": "frame 2 is not", "missing": "cannot be read", "short": "frame 5 is not"}
    assert expected.get(damage, "7 frames, must be 6") in str(raised.value)
    assert "ramp__sd__none__0" in str(raised.value)
    assert main(["stimuli", "--check", str(tmp_path / "copy")]) == 1


def test_foreign_folders_and_recorded_votes_are_not_replaced(built: Path, tmp_path: Path) -> None:
    test = read_spec(built.parent / "spec.toml")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("keep me", encoding="utf-8")
    with pytest.raises(InputError, match=r"not empty and holds no manifest\.json"):
        build_stimuli(test, tmp_path / "mine")
    shutil.copytree(built, tmp_path / "voted")
    (tmp_path / "voted" / "session").mkdir()
    with pytest.raises(InputError, match="recorded votes \\(session\\), which would be lost"):
        build_stimuli(test, tmp_path / "voted")
    assert (tmp_path / "mine" / "thesis.txt").exists()


def killed_at_work(spec: Path, out: Path) -> set[int]:
    """Build in a process of its own, kill it soon and return the frames that it had finished."""
    command = [sys.executable, "-m", "dsis", "stimuli", str(spec), "--out", str(out), "--jobs", "2"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    journal = out.with_name(out.name + ".partial") / "journal.jsonl"

    def finished() -> list[bytes]:
        try:
            data = journal.read_bytes()
        except FileNotFoundError:
            data = b""  # not begun, or ended: a finished build takes its journal away
        return [line for line in data.splitlines(keepends=True) if b'"frame"' in line]

    deadline = time.monotonic() + 120
    while len(finished()) <= 8 and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)  # at once, whatever else the machine does before the kill
    process.send_signal(signal.SIGKILL)
    assert process.wait() in (0, -signal.SIGKILL)
    return {json.loads(line)["frame"] for line in finished() if line.endswith(b"\n")}


def test_killed_half_way_it_goes_on_and_ends_bit_identical(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows, columns = 160, 240
    out, partial = tmp_path / "out", tmp_path / "out.partial"
    # On a busy machine a build may end before its progress is seen: then a longer one is killed.
    for frames in (24, 48, 80):
        shutil.rmtree(out, ignore_errors=True)
        shutil.rmtree(partial, ignore_errors=True)
        spec = write_spec(tmp_path, rows=rows, columns=columns, seconds=frames / 25)
        kept = killed_at_work(spec, out)
        if 0 < len(kept) < frames:
            break
    else:
        pytest.fail("all builds ended before they could be killed")
    assert not out.exists()
    # A frame that was damaged on disk is made again; a torn last line is forgotten.
    spoilt = min(kept)
    with (partial / "player" / "ramp__sd__none__0.rgb").open("r+b") as file:
        file.seek(spoilt * rows * columns * 3)
        file.write(b"spoilt")
    with (partial / "journal.jsonl").open("ab") as file:
        file.write(b'{"content": "ramp", "fra')
    undisturbed = tmp_path / "undisturbed"
    build_stimuli(read_spec(spec), undisturbed, jobs=2)

    from dsis.stimuli.build import Builder

    made: list[int] = []
    write_one = Builder._write

    def spy(self: Builder, frame: int) -> dict:
        made.append(frame)
        return write_one(self, frame)

    monkeypatch.setattr(Builder, "_write", spy)
    build_stimuli(read_spec(spec), out, jobs=2)
    assert sorted(made) == sorted(set(range(frames)) - kept | {spoilt})
    assert every_byte(out) == every_byte(undisturbed)
    assert not partial.exists()


def test_unfinished_work_of_another_spec_is_not_mixed_in(tmp_path: Path) -> None:
    spec = write_spec(tmp_path)
    partial = tmp_path / "out.partial"
    partial.mkdir()
    (partial / "journal.jsonl").write_text('{"build": "of another spec"}\n', encoding="utf-8")
    with pytest.raises(InputError, match="unfinished work of another spec"):
        build_stimuli(read_spec(spec), tmp_path / "out")
    assert (partial / "journal.jsonl").exists()


def test_dry_run_says_disk_memory_and_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = write_spec(tmp_path)
    assert main(["stimuli", str(spec), "--out", str(tmp_path / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "7 clips, 42 frames" in said
    assert f"{7 * FRAMES * ROWS * COLUMNS * 3 / 1000:.3g} kB" in said
    assert "memory" in said
    assert "time" in said
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "out.partial").exists()
