"""Promise: the pictures of a diagnosis show what was planted, in units that people use."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.mismatch import locate
from analysis.mismatch.bank.scalars import scalars
from analysis.mismatch.evidence import Curve, Evidence
from analysis.mismatch.files import write_finding
from analysis.mismatch.finding import Change, Finding, Mismatch, Proof, Where
from analysis.mismatch.observe import observe
from analysis.mismatch.pictures import Album, evidence_of
from analysis.mismatch.pictures.album import Counts
from analysis.mismatch.pictures.natural import UNITS, Scale, back
from analysis.mismatch.report import figures
from analysis.mismatch.report.figures import pictures
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.words import STATISTICS
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect, registry
from dsis.measures import MEASURES, measure_exposure
from dsis.recording import read_recording

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 48, 64, 8
BLACK, WHITE = 200.0, 4095.0
SLOPE, INTERCEPT = 0.5, 20.0
LEVELS = {"dark-0": 0.0, "dark-1": 0.0, "low": 150.0, "middle": 600.0, "high": 1500.0}
TIMES = {"dark-0": 0.01, "dark-1": 0.08, "low": 0.02, "middle": 0.02, "high": 0.02}
ROW_SD, GAIN_SD, WAVE = 4.0, 0.02, 3.0  # DN; relative; DN
FX, FY = 10 / COLUMNS, 7 / ROWS
SURE = 5.0  # standard errors
REPEATS = 6  # of simulations for a null
# Row noise is known from `REPEATS` simulations: the error of the model's mean beside its own.
BOTH = sqrt(1 + 1 / REPEATS)


def base_camera(cfa: Cfa) -> Camera:
    noise = BaseNoise(segment=(Segment(slope=SLOPE, intercept=INTERCEPT),))
    return Camera(
        name="planted",
        cfa=cfa,
        black_level=BLACK,
        white_level=WHITE,
        bit_depth=12,
        noise=noise,
    )


def with_effects(camera: Camera, *effects: Effect) -> Camera:
    return camera.model_copy(update={"effect": effects})


@dataclass(frozen=True)
class Planted:
    """Frames made with numpy alone, and what was observed of them."""

    frames: Mapping[str, NDArray[np.uint16]]
    gain: Array
    split: Split
    album: Album
    setting: Setting
    base: State

    @property
    def used(self) -> dict[str, Array]:
        """Return the frames that were searched, DN."""
        return {
            name: self.frames[name][list(numbers)].astype(np.float64)
            for name, numbers in self.split.development.items()
        }

    def evidence(self, *effects: Effect) -> Evidence:
        camera = with_effects(self.base.camera, *effects)
        final = State.of(self.setting, camera, nothing) if effects else self.base
        return evidence_of(self.base, final, self.album, self.split)


def nothing() -> None:
    """Tell nobody."""


def planted(folder: Path, cfa: Cfa) -> Planted:
    rng = np.random.default_rng(7)
    gain = 1 + GAIN_SD * rng.normal(size=(ROWS, COLUMNS))
    y, x = np.mgrid[:ROWS, :COLUMNS]
    frames = {}
    lines = ["[sensor]", 'name = "planted"', f'cfa = "{cfa.value}"', "bit_depth = 12"]
    lines += [f"black_level = {BLACK}", f"white_level = {WHITE}"]
    for name, level in LEVELS.items():
        signal = level * gain
        stack = (
            BLACK
            + signal
            + np.sqrt(SLOPE * level + INTERCEPT) * rng.normal(size=(FRAMES, ROWS, COLUMNS))
        )
        stack += ROW_SD * rng.normal(size=(FRAMES, ROWS, 1))
        phase = rng.uniform(0, 2 * np.pi, (FRAMES, 1, 1))
        stack += WAVE * np.cos(2 * np.pi * (FX * x + FY * y) + phase)
        frames[name] = np.clip(np.rint(stack), 0, WHITE).astype(np.uint16)
        names = [f"{name}-{i}.npy" for i in range(FRAMES)]
        for path, frame in zip(names, frames[name], strict=True):
            np.save(folder / path, frame)
        lines += ["[[exposure]]", f'name = "{name}"', f"frames = {names}".replace("'", '"')]
        lines += [f'kind = "{"flat" if level else "dark"}"', f"exposure_time_s = {TIMES[name]}"]
        lines += [f"light = {level}"] if level else []
    (folder / "recording.toml").write_text("\n".join(lines), encoding="utf-8")
    recording = read_recording(folder)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    album = Album(layout)
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), album, keep=True)
    setting = Setting(layout, seen, split.interpolated, 3, 1, REPEATS, REPEATS, 2, 2, 4)
    base = State.of(setting, base_camera(cfa), nothing)
    return Planted(frames, gain, split, album, setting, base)


@pytest.fixture(scope="module")
def mono(tmp_path_factory: pytest.TempPathFactory) -> Planted:
    return planted(tmp_path_factory.mktemp("mono"), Cfa.MONO)


@pytest.fixture(scope="module")
def bayer(tmp_path_factory: pytest.TempPathFactory) -> Planted:
    return planted(tmp_path_factory.mktemp("bayer"), Cfa("GRBG"))


@pytest.fixture(scope="module")
def found(mono: Planted) -> Evidence:
    """Return the evidence beside a model that has all that was planted but the gains."""
    row = registry()["row_noise"](sigma_dn=ROW_SD)
    wave = registry()["periodic_noise"](amplitude_dn=WAVE, frequency=(FX, FY))
    return mono.evidence(row, wave)


@pytest.fixture(scope="module")
def bare(bayer: Planted) -> Evidence:
    """Return the evidence of a mosaic where nothing was named."""
    return bayer.evidence()


def curve_of(evidence: Evidence, name: str) -> Curve:
    (curve,) = evidence.curves[name]
    return curve


def test_row_noise_stands_above_the_base_model_by_its_variance(found: Evidence) -> None:
    """Closed form: what rows have in common is the variance that was planted, at every signal."""
    curve = curve_of(found, "row_variance")
    assert (curve.unit, curve.against) == ("DN^2", "signal_dn")
    level = np.array(list(LEVELS.values()))
    np.testing.assert_allclose(curve.x, level, atol=0.01 * level.max())
    frames = FRAMES - len(FRAMES // 4 * [1])  # one of four is locked
    dof = (frames - 1) * (ROWS - 1)
    pixel = SLOPE * level + INTERCEPT + WAVE**2 / 2
    error = sqrt(2 / dof) * (ROW_SD**2 + pixel / COLUMNS)
    assert (abs(curve.observed - ROW_SD**2) < SURE * error).all()
    assert (abs(curve.expected_before) < SURE * sqrt(1 / REPEATS) * error).all()
    assert curve.expected_after is not None
    # The recorded rows, seen beside either model, are the same: what is left is chance.
    left = curve.observed - curve.expected_after
    assert (abs(left) < SURE * BOTH * error).all()
    assert curve.z_before is not None
    assert curve.z_after is not None
    assert curve.z_before.min() > 5
    assert abs(curve.z_after).max() < SURE


def test_photon_transfer_shows_the_variance_of_pixels(mono: Planted, found: Evidence) -> None:
    """Oracle: numpy's variance over frames of what is left of rows and columns."""
    curve = curve_of(found, "pixel_variance")
    for value, name in zip(curve.observed, LEVELS, strict=True):
        stack = mono.used[name]
        rest = stack - stack.mean(2, keepdims=True) - stack.mean(1, keepdims=True)
        rest += stack.mean((1, 2), keepdims=True)
        rest -= rest.mean(0)
        dof = (len(stack) - 1) * (ROWS - 1) * (COLUMNS - 1)
        assert value == pytest.approx((rest**2).sum() / dof, rel=1e-6)
    assert curve.unit == "DN^2"


def test_levels_stand_against_light_and_darks_against_time(found: Evidence) -> None:
    flats, darks = curve_of(found, "level"), curve_of(found, "dark_level")
    np.testing.assert_array_equal(flats.x, [150.0, 600.0, 1500.0])
    np.testing.assert_array_equal(darks.x, [0.01, 0.08])
    assert (flats.against, darks.against) == ("light", "exposure_time_s")


def test_gain_map_is_in_percent_of_the_signal(mono: Planted, found: Evidence) -> None:
    """Oracle: the gains that were planted; slope 1 within the map's own noise."""
    kinds = ("gain_map", "gain_alone_map")
    (image,) = next(found.maps[name] for name in kinds if name in found.maps)
    truth = 100 * (mono.gain - mono.gain.mean())
    slope = float((image.recorded * truth).sum() / (truth**2).sum())
    noise = float((image.recorded - truth).std())
    assert slope == pytest.approx(1, abs=SURE * noise / sqrt((truth**2).sum()))
    assert image.unit == "%"
    assert found.shown_in["fixed_pixel_variance"].map.startswith("gain")
    # Neither model has gains: its map holds noise alone.
    assert image.before is not None
    assert image.before.std() < 0.8 * image.recorded.std()


def test_spectrum_shows_the_planted_line(found: Evidence) -> None:
    """Closed form: white noise at 1, a wave of amplitude A at A^2 n m / (4 v) beside it."""
    (one,) = found.spectra["pooled"]
    y, x = np.unravel_index(int(one.power[1:, 1:].argmax()), one.power[1:, 1:].shape)
    assert (y + 1, x + 1) == (round(FY * ROWS), round(FX * COLUMNS))
    assert one.before is not None
    assert one.after is not None
    peak, after = one.power[y + 1, x + 1], one.after[y + 1, x + 1]
    level = np.array(list(LEVELS.values()))
    pixel = SLOPE * level + INTERCEPT + WAVE**2 / 2 + 1 / 12
    # Weighted by 1 / v of all noise, rows included; robust figures serve there: 15 % of tolerance.
    weight = 1 / (pixel + ROW_SD**2)
    power = 1 + WAVE**2 * ROWS * COLUMNS / 4 / pixel
    expected = float((weight * power).sum() / weight.sum())
    assert peak == pytest.approx(expected, rel=0.15)
    assert after == pytest.approx(peak, rel=0.15)
    assert one.before[y + 1, x + 1] < 0.01 * peak
    flat = np.delete(one.power[1:, 1:].ravel(), y * (one.power.shape[1] - 1) + x)
    assert flat.mean() == pytest.approx(1, abs=0.2)


def test_frame_means_are_those_of_the_frames_that_were_looked_at(
    mono: Planted, found: Evidence
) -> None:
    for name in LEVELS:
        (one,) = found.series[name]
        locked = mono.split.locked[name]
        means = mono.frames[name].astype(np.float64).mean((1, 2)) - BLACK
        means[list(locked)] = np.nan
        np.testing.assert_allclose(one.frame_means_dn, means, rtol=1e-6, atol=1e-4)
        assert one.locked == locked
        assert one.sd_before_dn is not None
        assert one.sd_after_dn is not None
        assert one.sd_before_dn < one.sd_after_dn  # row noise moves the mean


def test_codes_are_counted(mono: Planted, found: Evidence) -> None:
    for name, stack in mono.used.items():
        (one,) = found.codes[name]
        counts = np.bincount(stack.astype(np.int64).ravel(), minlength=4096)
        codes = one.lowest + np.arange(one.counts.size)
        np.testing.assert_array_equal(one.counts, counts[codes])
        assert one.before is not None
        # Means of four simulations of as many samples, but for those far from the median.
        assert one.before.sum() == pytest.approx(stack.size, rel=0.01)


def test_threshold_is_that_of_the_search(mono: Planted, found: Evidence) -> None:
    null, own = mono.base.null, mono.base.vector
    at = next(i for i, k in enumerate(own.keys) if k.statistic == "code_spacing" and null.known[i])
    for factor, certain in ((0.99, False), (1.01, True)):
        values = null.mean.copy()
        values[at] += factor * found.threshold_z * null.sd[at]
        _, chances = locate.tested(mono.base.setting.layout, null, replace(own, values=values))
        assert (chances[at] < locate.FAMILY) is np.bool_(certain)
    assert found.tests == null.known.sum() + len(null.contrasts.keys)
    assert found.simulations == REPEATS
    assert found.familywise_level == locate.FAMILY


def test_nothing_named_has_no_after(bare: Evidence) -> None:
    assert all(c.expected_after is None for some in bare.curves.values() for c in some)
    assert all(m.after is None for some in bare.maps.values() for m in some)
    assert all(s.after is None for some in bare.spectra.values() for s in some)
    assert all(s.sd_after_dn is None for some in bare.series.values() for s in some)
    assert all(h.after is None for some in bare.codes.values() for h in some)


def test_channels_of_a_mosaic_are_drawn_apart(bare: Evidence) -> None:
    names = ["R", "Gr", "Gb", "B"]
    assert [c.channel for c in bare.curves["pixel_variance"]] == names
    for image in bare.maps["variance_map"]:
        assert image.recorded.shape == (ROWS // 2, COLUMNS // 2)
        assert image.pitch_px == 2
    lags = bare.curves["line_correlation along rows"][0].x
    np.testing.assert_array_equal(lags % 2, 0)  # next pixel of a colour: two of the mosaic
    assert [s.channel for s in bare.row_spectra["high"]] == names


def test_every_statistic_has_words(mono: Planted, bayer: Planted) -> None:
    names = {key.statistic for one in (mono, bayer) for key in one.base.null.keys}
    assert {*names, *MEASURES} <= STATISTICS.keys()


@pytest.mark.parametrize("which", ["mono", "bayer"])
def test_every_departure_has_its_picture(
    which: str,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    state: Planted = request.getfixturevalue(which)
    evidence: Evidence = request.getfixturevalue({"mono": "found", "bayer": "bare"}[which])
    nan = float("nan")
    proof = Proof(dict(state.split.locked), Change(nan, nan), Change(1, 0), None, None)
    left = state.base.mismatches
    finding = Finding(
        "unexplained", left, (), (), left, (), proof, state.base.camera, evidence=evidence
    )
    assert {"row_variance", "spectral_peak", "fixed_pixel_variance"} <= {m.statistic for m in left}
    for mismatch in left:
        alone = replace(finding, mismatches=(mismatch,), unexplained=())
        assert pictures(alone), mismatch.statistic
    monkeypatch.setattr(figures, "MOST", 6)  # for time; they take turns
    write_finding(finding, tmp_path / "out")
    drawn = {p.stem for p in (tmp_path / "out" / "figures").iterdir()}
    assert {p.name for p in pictures(finding)} == drawn
    assert len(drawn) == 6


def test_any_statistic_can_be_drawn(found: Evidence, bare: Evidence) -> None:
    for evidence in (found, bare):
        for name in {stored.split(" ")[0] for stored in evidence.curves}:
            some = Mismatch(name, 9.0, 0.0, Where(), "It differs.")
            nan = float("nan")
            finding = Finding(
                "unexplained",
                (some,),
                (),
                (),
                (),
                (),
                Proof({}, Change(nan, nan), Change(1, 1), None, None),
                base_camera(Cfa.MONO),
                evidence=evidence,
            )
            assert pictures(finding), name


def test_any_number_of_workers_the_same_evidence(mono: Planted) -> None:
    def arrays(jobs: int) -> list[Array | None]:
        base = replace(mono.base, setting=replace(mono.setting, jobs=jobs))
        seen = evidence_of(base, base, mono.album, mono.split)
        some = [m.before for images in seen.maps.values() for m in images]
        some += [h.before for counted in seen.codes.values() for h in counted]
        return some + [s.before for lines in seen.row_spectra.values() for s in lines]

    for one, two in zip(arrays(1), arrays(3), strict=True):
        np.testing.assert_array_equal(one, two)


VARIANCES = sorted(name for name in UNITS if name.endswith("variance") and name != "pixel_variance")


@pytest.mark.parametrize("name", VARIANCES)
def test_numbers_go_back_to_what_was_measured(name: str) -> None:
    """Oracle: `dsis.measures` gives the same variances in DN^2, before they are transformed."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[-1:1:40j, -1:1:30j]
    fixed = 3 * rng.normal(size=(40, 30)) + 2 * rng.normal(size=(40, 1)) + 2 * (x + y**2)
    fixed += 2 * rng.normal(size=(1, 30))
    noise = 4 * rng.normal(size=(9, 40, 30)) + 3 * rng.normal(size=(9, 40, 1))
    noise += 2 * rng.normal(size=(9, 1, 30)) + rng.normal(size=(9, 1, 1))
    frames = np.rint(500 + fixed + noise).astype(np.uint16)
    channel = measure_exposure(frames, cfa=Cfa.MONO, black_level=100.0).channels["MONO"]
    numbers = {key: value for key, (value, _) in scalars(channel, 9).items()}
    pixel = channel.estimates["pixel_variance"].value
    there: Callable[[float], float] = back(name, Scale(40, 30, 9, pixel, pixel), numbers)
    assert there(numbers[name]) == pytest.approx(channel.estimates[name].value, rel=1e-6)


@given(st.integers(0, 60), st.integers(0, 60), st.lists(st.integers(0, 9), min_size=1))
def test_counts_stay_with_their_codes(lowest: int, other: int, counts: list[int]) -> None:
    kept = Counts(lowest, np.array(counts, float))
    by_code = dict(enumerate(counts, lowest))
    expected = [by_code.get(code, 0) for code in range(other, other + 40)]
    np.testing.assert_array_equal(kept.at(other, 40), expected)
