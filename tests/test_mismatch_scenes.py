"""Scenes in `dsis mismatch`: measured by local signal, on recordings that numpy alone makes."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, shift

from analysis.mismatch import Finding, find_mismatch
from analysis.mismatch.finding import Mismatch
from analysis.mismatch.observe import observe
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.recording import read_recording

Array = NDArray[np.float64]
Light = Callable[[np.random.Generator, str, Array, int], Array]
Noise = Callable[[np.random.Generator, str, Array], Array]
ROWS, COLUMNS, FRAMES = 64, 96, 8
BLACK, WHITE, SLOPE, READ = 64.0, 4095, 0.5, 3.0
LEVELS = {"dark-0": 0.0, "dark-1": 0.0, "flat-0": 60.0, "flat-1": 300.0, "flat-2": 900.0,
          "flat-3": 2000.0}  # fmt: skip
SCENES = {"street": 800.0, "room": 250.0}
SURE = 5.0
LOCKED = 7  # a frame that is locked
RIVALS = frozenset(
    {"row_noise", "line_flicker", "flicker", "image_lag", "rts", "crosstalk", "spatial_filtering"}
)


def picture(rng: np.random.Generator, mean_dn: float) -> Array:
    """Return clouds with hard edges, and a black shadow."""
    clouds = gaussian_filter(rng.normal(size=(ROWS, COLUMNS)), 4)
    image = np.exp(0.8 * clouds / clouds.std())
    image[10:30, 20:60] *= 1.8
    image[40:60, 50:80] *= 0.3
    image[34:50, 4:34] = 0.0
    return np.asarray(np.minimum(mean_dn * image / image.mean(), 3000.0))


def white(rng: np.random.Generator, _name: str, light: Array) -> Array:
    return np.sqrt(SLOPE * light + READ**2) * rng.normal(size=light.shape)


def steady(_rng: np.random.Generator, _name: str, light: Array, _frame: int) -> Array:
    return light


def recorded(
    folder: Path, seed: int, *, light: Light = steady, noise: Noise = white, cfa: str = "MONO"
) -> Path:
    """Write a recording; `light` and `noise` make what is special about it."""
    rng = np.random.default_rng(seed)
    lines = ["[sensor]", 'name = "numpy"', f'cfa = "{cfa}"', "bit_depth = 12"]
    lines += [f"black_level = {BLACK}", f"white_level = {WHITE}"]
    for name, level in {**LEVELS, **SCENES}.items():
        kind = "scene" if name in SCENES else "flat" if level else "dark"
        clean = picture(rng, level) if kind == "scene" else np.full((ROWS, COLUMNS), level)
        names = [f"{name}-{i}.npy" for i in range(FRAMES)]
        for i, path in enumerate(names):
            now = light(rng, name, clean, i)
            codes = np.rint(BLACK + now + noise(rng, name, now))
            np.save(folder / path, np.clip(codes, 0, WHITE).astype(np.uint16))
        lines += ["[[exposure]]", f'name = "{name}"', f'kind = "{kind}"']
        lines += [f"exposure_time_s = {0.5 if name == 'dark-1' else 0.01}", f"frames = {names}"]
        lines += [f"light = {level}"] if kind == "flat" else []
    (folder / "recording.toml").write_text("\n".join(lines), encoding="utf-8")
    return folder


def found(
    folder: Path,
    cfa: str = "MONO",
    *,
    vocabulary: frozenset[str] | None = None,
    segments: tuple[Segment, ...] = (Segment(slope=SLOPE, intercept=READ**2),),
) -> Finding:
    camera = Camera(
        name="numpy", cfa=Cfa(cfa), black_level=BLACK, white_level=WHITE, bit_depth=12,
        noise=BaseNoise(segment=segments),
    )  # fmt: skip
    return find_mismatch(camera, read_recording(folder), seed=2, vocabulary=vocabulary)


def of(finding: Finding, statistic: str) -> Mismatch:
    (one,) = [m for m in finding.mismatches if m.statistic == statistic]
    return one


@pytest.mark.parametrize(("seed", "cfa"), [(1, "MONO"), (2, "MONO"), (3, "RGGB")])
def test_scenes_of_the_camera_are_a_match(seed: int, cfa: str, tmp_path: Path) -> None:
    finding = found(recorded(tmp_path, seed, cfa=cfa), cfa)
    assert finding.verdict == "match"
    assert not any("scene" in remark.lower() for remark in finding.remarks)
    # Every scene was tested, in bins of signal.
    curves = finding.evidence.curves["pixel_variance"]
    assert all(curve.x.size > len(LEVELS) for curve in curves)


@pytest.mark.parametrize("switch", [350.0, 850.0])
def test_where_between_two_flats_a_segment_begins_is_not_asked_of_a_scene(
    switch: float, tmp_path: Path
) -> None:
    """The camera model says 500 DN, flats of 300 and 900 DN cannot say better."""
    upper = {"slope": 3 * SLOPE, "intercept": 400.0}

    def two(rng: np.random.Generator, name: str, light: Array) -> Array:
        above = np.sqrt(upper["slope"] * light + upper["intercept"]) * rng.normal(size=light.shape)
        return np.where(light < switch, white(rng, name, light), above)

    lower = Segment(slope=SLOPE, intercept=READ**2, upper_dn=500.0)
    finding = found(recorded(tmp_path, 8, noise=two), segments=(lower, Segment(**upper)))
    assert finding.verdict == "match"
    # Darker and brighter ranges of the scenes are judged.
    (curve,) = finding.evidence.curves["pixel_variance"]
    assert curve.x.size > len(LEVELS)


@pytest.mark.long
def test_row_noise_is_located_in_scenes_too(tmp_path: Path) -> None:
    def rows(rng: np.random.Generator, name: str, light: Array) -> Array:
        return white(rng, name, light) + 4.0 * rng.normal(size=(ROWS, 1))

    finding = found(recorded(tmp_path, 4, noise=rows), vocabulary=RIVALS)
    assert [one.effect for one in finding.omitted_physics] == ["row_noise"]
    where = of(finding, "row_variance").where
    assert set(SCENES) <= set(where.exposures)
    assert where.kind is None  # darks, flats and scenes
    assert not finding.unexplained
    # In DN^2 the curve of all exposures is one line: what was planted.
    (curve,) = finding.evidence.curves["row_variance"]
    assert curve.unit == "DN^2"
    assert curve.observed[-len(SCENES) :] == pytest.approx(16.0, rel=SURE * (2 / 5 / 63) ** 0.5)


@pytest.mark.long
def test_lag_shows_in_scenes(tmp_path: Path) -> None:
    last: dict[str, Array] = {}

    def lagging(rng: np.random.Generator, name: str, light: Array) -> Array:
        charge = np.sqrt(SLOPE * light) * rng.normal(size=light.shape)
        before = last.get(name, np.zeros(light.shape))
        last[name] = charge
        return 0.9 * charge + 0.1 * before + READ * rng.normal(size=light.shape)

    finding = found(recorded(tmp_path, 5, noise=lagging), vocabulary=RIVALS)
    assert [one.effect for one in finding.omitted_physics] == ["image_lag"]
    assert set(SCENES) <= set(of(finding, "frame_correlation").where.exposures)
    assert not finding.unexplained


def test_moments_are_those_of_the_local_noise(tmp_path: Path) -> None:
    """Closed form of Poisson charge at 8 DN an electron: moments 8^2 S and 8^3 S + 3 v^2."""
    gain, truths = 8.0, {}

    def poisson(rng: np.random.Generator, name: str, light: Array) -> Array:
        truths[name] = light
        return gain * rng.poisson(light / gain) - light + 4 * READ * rng.normal(size=light.shape)

    recording = read_recording(recorded(tmp_path, 11, noise=poisson))
    source = Source(recording)
    layout = layout_of(recording, Split.of(recording).development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    for name in SCENES:
        light = truths[name]
        variance = gain * light + 16 * READ**2
        own = seen.scalars[name, "MONO"]
        for statistic, moment, power in (
            ("skewness", gain**2 * light, 1.5),
            ("kurtosis", gain**3 * light, 2.0),
        ):
            expected = float(moment.mean() / (variance**power).mean())
            value, error = own[statistic]
            # Skewed noise scatters more than the white noise that errors are of.
            assert abs(value - expected) < SURE * 1.5 * error
            assert statistic == "kurtosis" or expected > 2 * error


@pytest.mark.long
def test_what_only_scenes_show_stays_unexplained(tmp_path: Path) -> None:
    def noisier(rng: np.random.Generator, name: str, light: Array) -> Array:
        return white(rng, name, light) * (1.2 if name == "street" else 1.0)

    finding = found(recorded(tmp_path, 6, noise=noisier))
    assert finding.verdict == "unexplained"
    where = of(finding, "pixel_variance").where
    assert (where.exposures, where.kind) == (("street",), "scene")
    assert where.signal_dn is not None
    low, high = where.signal_dn
    assert low < 300
    assert high > 1500


def test_noise_of_bright_places_is_located_by_signal(tmp_path: Path) -> None:
    def bright(rng: np.random.Generator, name: str, light: Array) -> Array:
        own = white(rng, name, light)
        return np.where((light > 1000) & (name == "street"), 1.25 * own, own)

    finding = found(recorded(tmp_path, 7, noise=bright), vocabulary=frozenset())
    where = of(finding, "pixel_variance").where
    assert (where.exposures, where.kind) == (("street",), "scene")
    assert where.signal_dn is not None
    assert where.signal_dn[0] > 500  # the bin that holds 1000


@pytest.mark.parametrize("frames", ["all", "a locked one"])
def test_a_scene_that_shifts_is_left_out(frames: str, tmp_path: Path) -> None:
    def pan(_rng: np.random.Generator, name: str, light: Array, frame: int) -> Array:
        path = 0.2 * frame if frames == "all" else 1.5 * (frame == LOCKED)
        return shift(light, (0, path), order=1, mode="nearest") if name == "street" else light

    finding = found(recorded(tmp_path, 8, light=pan))
    assert finding.verdict == "match"
    (remark,) = [r for r in finding.remarks if "scene" in r.lower()]
    assert "street" in remark
    assert "room" not in remark
    assert "street" not in finding.proof.heldout_frames
    assert "room" in finding.proof.heldout_frames


@pytest.mark.long
def test_lamps_that_flicker_in_a_scene_are_no_noise_of_its_pixels(tmp_path: Path) -> None:
    def lamps(rng: np.random.Generator, name: str, light: Array, _frame: int) -> Array:
        return light * (1 + 0.03 * rng.normal()) if name in SCENES else light

    finding = found(recorded(tmp_path, 9, light=lamps))
    assert {m.statistic for m in finding.mismatches} == {"frame_variance"}
    assert set(of(finding, "frame_variance").where.exposures) <= set(SCENES)
    assert not finding.omitted_physics


def test_the_picture_is_the_scene_without_its_noise(tmp_path: Path) -> None:
    truths = {}

    def kept(_rng: np.random.Generator, name: str, light: Array, _frame: int) -> Array:
        truths[name] = light
        return light

    recording = read_recording(recorded(tmp_path, 10, light=kept))
    source = Source(recording)
    layout = layout_of(recording, Split.of(recording).development, source.frames)
    assert set(layout.scenes) == set(SCENES)
    for name, scene in layout.scenes.items():
        error = scene.signal_dn - truths[name]
        noise = np.sqrt((SLOPE * truths[name] + READ**2) / 6)  # 6 of 8 frames are not locked
        assert float((error / noise).std()) < 1.0
        shadow = error[38:46, 8:30] / noise[38:46, 8:30]  # away from its edges
        assert float(shadow.std()) < 0.6  # a mean of 25 pixels: 0.2, less what looks like detail
        (local,) = scene.channels.values()
        for one in local.bins.values():
            inside = (local.labels >= one.ranges.start) & (local.labels < one.ranges.stop)
            assert scene.signal_dn[inside].min() >= np.float32(one.low_dn)
            assert scene.signal_dn[inside].max() <= np.float32(one.high_dn)
