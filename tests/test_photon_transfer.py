"""Promise: `fit_camera` recovers the camera that a recording was made with, or says why it cannot.

The recordings are made in memory by `Camera.expose`; reading files is another promise.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from analysis.photon_transfer import Fit, Line, fit_camera, fit_values, summary, write_fit
from analysis.photon_transfer.lines import Points
from analysis.photon_transfer.recorded import channel_names
from analysis.photon_transfer.rounding import rounded_moments, unrounded
from analysis.photon_transfer.segments import fit_segments
from analysis.photon_transfer.statistics import expose_statistics
from dsis.camera import BaseNoise, Camera, Segment, read_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import registry
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.simulate import read_maps

Z_MAX = 5.0
LEVELS_DN = (0.0, 0.0, 60.0, 200.0, 500.0, 1100.0, 1800.0, 3000.0, 6000.0, 12000.0)


@dataclass(frozen=True)
class Sensor:
    name: str
    cfa: Cfa
    black_level: float
    white_level: float
    bit_depth: int


@dataclass(frozen=True)
class Exposure:
    name: str
    kind: str
    exposure_time_s: float
    light: float | None
    stack: np.ndarray

    @property
    def frames(self) -> np.ndarray:
        return self.stack


@dataclass(frozen=True)
class Recording:
    sensor: Sensor
    exposures: tuple[Exposure, ...]

    def frames(self, exposure: Exposure) -> Iterator[np.ndarray]:
        return iter(exposure.stack)

    def where(self, keep: object) -> "Recording":
        return replace(self, exposures=tuple(e for e in self.exposures if keep(e)))  # type: ignore[operator]


def camera(
    *segments: tuple[float | None, float, float], cfa: Cfa = Cfa.MONO, **more: object
) -> Camera:
    values = {"black_level": 256.0, "white_level": 16383.0, "bit_depth": 14} | more
    pieces = tuple(Segment(upper_dn=u, slope=m, intercept=t) for u, m, t in segments)
    return Camera(name="planted", cfa=cfa, noise=BaseNoise(segment=pieces), **values)  # type: ignore[arg-type]


def record(
    made: Camera,
    seed: int,
    *,
    levels: tuple[float, ...] = LEVELS_DN,
    frames: int = 4,
    size: tuple[int, int] = (48, 64),
    gains: tuple[tuple[float, float], tuple[float, float]] = ((0.6, 1.0), (1.0, 0.7)),
    time_per_dn: float = 1e-5,
    dark_dn_per_s: float = 0.0,
    sensor_seed: int = 99,
) -> Recording:
    """Return a recording of uniform flats; level 0 is a dark. Colours differ by `gains`."""
    grid = PixelGrid(*size, made.cfa)
    shares = np.ones(size, np.float32)
    if made.cfa is not Cfa.MONO:
        shares = np.tile(np.array(gains, np.float32), (size[0] // 2, size[1] // 2))
    exposures = []
    for number, level in enumerate(levels):
        seconds = 0.01 * (number + 1) if level == 0 else level * time_per_dn
        clean = (shares * np.float32(level) + np.float32(dark_dn_per_s * seconds)).astype(
            np.float32
        )
        draw = Draw(seed, (f"{number}",))
        codes = [
            made.expose(clean, draw, Draw(sensor_seed), t, grid, exposure_time_s=seconds)
            for t in range(frames)
        ]
        stack = (np.stack(codes) + made.black_level).astype(np.uint16)
        kind = "flat" if level else "dark"
        exposures.append(Exposure(f"{kind}-{number:02}", kind, seconds, level or None, stack))
    sensor = Sensor("planted", made.cfa, 240.0, made.white_level, made.bit_depth)
    return Recording(sensor, tuple(exposures))


ONE = camera((None, 1.7, 30.0))
TWO = camera((800.0, 1.7, 30.0), (None, 1.7, 700.0))  # a step of 16 errors at 1100 DN


def test_statistics_are_those_of_numpy() -> None:
    """Oracle: the definitions, written with numpy on the whole stack."""
    recording = record(camera((None, 1.7, 30.0), cfa=Cfa.GBRG), 3, levels=(0.0, 700.0), frames=5)
    exposure = recording.exposures[1]
    names = channel_names(Cfa.GBRG)
    assert names == (("Gb", "B"), ("R", "Gr"))
    for found in expose_statistics(recording, exposure):
        i, j = next((i, j) for i in (0, 1) for j in (0, 1) if names[i][j] == found.channel)
        plane = exposure.stack[:, i::2, j::2].astype(np.float64)
        n = plane[0].size
        z = plane - plane.mean(0) - (plane.mean((1, 2)) - plane.mean())[:, None, None]
        assert found.level_dn == pytest.approx(plane.mean(), rel=1e-12)
        assert found.variance_dn2 == pytest.approx((z**2).sum() / (4 * (n - 1)), rel=1e-9)
        d = np.stack([plane[1] - plane[0], plane[3] - plane[2]])
        assert found.pair_variance_dn2 == pytest.approx((d**2).mean() / 2, rel=1e-9)
        assert found.removed_dn2 == pytest.approx((d.mean((1, 2)) ** 2).mean() / 2, rel=1e-9)
        fixed = plane.mean(0).var(ddof=1) - found.variance_dn2 / 5
        assert found.fixed_dn2 == pytest.approx(fixed, abs=1e-9)


def test_two_frames_give_equation_1_with_the_change_removed() -> None:
    exposure = record(ONE, 4, levels=(0.0, 900.0), frames=2).exposures[1]
    shifted = exposure.stack.copy()
    shifted[1] += 40  # the light changed between the frames
    recording = Recording(Sensor("s", Cfa.MONO, 0, 65535, 16), (replace(exposure, stack=shifted),))
    (found,) = expose_statistics(recording, recording.exposures[0])
    (plain,) = expose_statistics(recording, exposure)
    n = found.pixels
    assert found.variance_dn2 == pytest.approx(plain.variance_dn2, rel=1e-9)
    assert found.pair_variance_dn2 - found.removed_dn2 == pytest.approx(
        found.variance_dn2 * (n - 1) / n, rel=1e-9
    )
    error = np.sqrt(2 * plain.variance_dn2 / n)  # of the difference of two frame means
    assert abs(np.sqrt(2 * found.removed_dn2) - 40.0) < Z_MAX * error


@pytest.mark.parametrize("effect", [None, "row_noise", "column_noise"])
def test_error_of_the_variance_is_right(effect: str | None) -> None:
    """Oracle: the scatter of 150 repetitions; its own relative error is 1 / sqrt(300) = 6 %."""
    extra = () if effect is None else (registry()[effect].model_validate({"sigma_dn": 6.0}),)
    made = ONE.model_copy(update={"effect": extra})
    found = []
    for seed in range(150):
        recording = record(made, seed, levels=(400.0,), size=(32, 32))
        found.append(expose_statistics(recording, recording.exposures[0])[0])
    scatter = np.std([s.variance_dn2 for s in found], ddof=1)
    stated = np.sqrt(np.mean([s.variance_se_dn2**2 for s in found]))
    assert abs(stated / scatter - 1) < 4 / np.sqrt(300)


@given(mean=st.floats(-3, 3), sd=st.floats(0.3, 1.2))
@settings(max_examples=60, deadline=None)
def test_rounding_is_undone(mean: float, sd: float) -> None:
    """Oracle: sums over the probabilities of the codes."""
    codes = np.arange(-20, 21)
    share = np.diff(stats.norm.cdf(np.append(codes, 21) - 0.5, mean, sd))
    level = float((share * codes).sum())
    variance = float((share * codes**2).sum() - level**2)
    assert rounded_moments(mean, sd) == pytest.approx((level, variance), abs=1e-6)
    found = unrounded(level, 0.001, variance, 0.001)
    if found.recovered:
        assert found.level_dn == pytest.approx(mean, abs=1e-4)
        assert found.variance_dn2 == pytest.approx(sd**2, abs=1e-4)


def patterned(made: Camera) -> Camera:
    """Return the camera with a fixed pattern of pixels, columns and gains."""
    effects = (("dsnu", "sigma_dn", 5.0), ("prnu", "sigma_percent", 1.0),
               ("column_fpn", "sigma_dn", 3.0))  # fmt: skip
    links = tuple(registry()[kind].model_validate({key: value}) for kind, key, value in effects)
    return made.model_copy(update={"effect": links})


def misses(fit: Fit, made: Camera) -> dict[str, float]:
    """Return how far each parameter is off, in its own standard errors; nan where not found."""
    found = {"black": (fit.black_dn - made.black_level) / (fit.black_se_dn or np.nan)}
    for k, (line, true) in enumerate(zip(fit.segments.lines, made.noise.segment, strict=True)):
        found[f"slope {k}"] = (line.slope_dn - true.slope) / line.slope_se_dn
        found[f"intercept {k}"] = (line.intercept_dn2 - true.intercept) / line.intercept_se_dn2
    fitted = {effect.kind: effect for effect in fit.effects}
    for true_effect in made.effect:
        kind, found_effect = true_effect.kind, fitted.get(true_effect.kind)
        if found_effect is None:
            found[kind] = np.nan
            continue
        true_value = getattr(true_effect, found_effect.parameter)
        found[kind] = (found_effect.value - true_value) / found_effect.standard_error
    return found


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("made", [ONE, TWO], ids=["one segment", "two segments"])
def test_intervals_cover_the_planted_camera(made: Camera, cfa: Cfa) -> None:
    """Reduced: 40 runs; `benchmarks/photon_transfer.py` does 500. z is 4.1 binomial errors."""
    runs, planted = 40, made.model_copy(update={"cfa": cfa})
    inside: dict[str, int] = {}
    right = 0
    for seed in range(runs):
        fit = fit_camera(record(planted, seed, size=(32, 48)))
        if len(fit.segments.lines) != len(planted.noise.segment):
            continue
        right += 1
        for name, z in misses(fit, planted).items():
            inside[name] = inside.get(name, 0) + (abs(z) < 1.96)
        for switch in fit.segments.switches:
            inside["switch"] = inside.get("switch", 0) + (switch.low_dn < 800 <= switch.high_dn)
    assert right >= 0.95 * runs
    for name, count in inside.items():
        assert stats.binom.cdf(count, right, 0.95) > 2e-5, f"{name}: {count} of {right}"


def points_of(variance: np.ndarray, x: np.ndarray, relative: float) -> Points:
    size = x.size
    return Points.of(
        x_dn=x,
        variance_dn2=variance,
        relative_se=np.full(size, relative),
        x_se_dn=np.full(size, 0.01),
        channel=np.full(size, "MONO"),
        black_share=np.full(size, -1.0),
    )


class TestNumberOfSegments:
    x = np.array([0.0, 50, 150, 400, 800, 1500, 3000, 6000, 12000, 20000])
    line = 2.18 * x + 23.0

    def count(self, expected: np.ndarray, relative: float, runs: int) -> list[int]:
        rng = np.random.default_rng(1)
        shape = relative**-2
        return [
            len(
                fit_segments(
                    points_of(
                        expected * rng.gamma(shape, 1 / shape, self.x.size), self.x, relative
                    ),
                    None,
                ).lines
            )
            for _ in range(runs)
        ]

    @pytest.mark.parametrize("relative", [0.05, 0.005])
    def test_none_is_invented(self, relative: float) -> None:
        assert sum(k > 1 for k in self.count(self.line, relative, 200)) <= 4

    @pytest.mark.parametrize("at", [2, 4, 6])
    @pytest.mark.parametrize("relative", [0.03, 0.003])
    def test_a_step_of_ten_errors_at_three_levels_is_found(self, at: int, relative: float) -> None:
        step = 10 * relative * np.median(self.line[at : at + 3])
        found = self.count(self.line + step * (self.x >= self.x[at]), relative, 60)
        assert np.mean([k == 2 for k in found]) >= 0.93  # 95 % less one binomial error of 60

    @pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
    def test_a_smooth_bend_is_no_switch(self, share: float) -> None:
        found = self.count(self.line * (1 - share * self.x / self.x.max()), 0.01, 40)
        assert sum(k > 1 for k in found) <= 4

    def test_three_segments(self) -> None:
        x = np.linspace(0, 9000, 30)
        expected = np.select([x < 2000, x < 5000], [x + 20, x + 300], x + 900)
        shape = 0.005**-2
        drawn = expected * np.random.default_rng(0).gamma(shape, 1 / shape, x.size)
        fit = fit_segments(points_of(drawn, x, 0.005), None)
        assert len(fit.lines) == 3
        for switch, true in zip(fit.switches, (2000, 5000), strict=True):
            assert switch.low_dn < true <= switch.high_dn

    def test_the_user_may_fix_it(self) -> None:
        for number in (1, 2, 3):
            fit = fit_segments(points_of(self.line, self.x, 0.01), number)
            assert len(fit.lines) == number
            assert fit.forced
        with pytest.raises(ValueError, match="distinct levels"):
            fit_segments(points_of(self.line, self.x, 0.01), 6)

    def test_a_line_is_scipys(self) -> None:
        """Oracle: scipy's curve_fit with the true errors."""
        from scipy.optimize import curve_fit

        error = 0.01 * self.line
        drawn = self.line + error * np.random.default_rng(2).normal(size=self.x.size)
        value, covariance = curve_fit(
            lambda x, m, t: m * x + t, self.x, drawn, sigma=error, absolute_sigma=True
        )
        (line,) = fit_segments(points_of(drawn, self.x, 0.01), 1).lines
        assert isinstance(line, Line)
        # The weights are the fit's own variance: a percent of an error of a percent.
        assert abs(line.slope_dn - value[0]) < 0.1 * line.slope_se_dn
        assert line.slope_se_dn == pytest.approx(np.sqrt(covariance[0, 0]), rel=0.03)
        assert line.intercept_se_dn2 == pytest.approx(np.sqrt(covariance[1, 1]), rel=0.03)


def test_dark_current_and_black_level_at_zero_time() -> None:
    recording = record(ONE, 8, levels=(0.0,) * 5 + (500.0, 2000.0, 6000.0), dark_dn_per_s=300.0)
    fit = fit_camera(recording)
    dark = fit.channels["MONO"].dark
    assert dark is not None
    assert dark.current_dn_per_s is not None
    assert dark.current_se_dn_per_s is not None
    assert abs(dark.current_dn_per_s - 300.0) < Z_MAX * dark.current_se_dn_per_s
    assert abs(fit.black_dn - 256.0) < Z_MAX * (fit.black_se_dn or 0)
    for name, z in misses(fit, ONE).items():
        assert abs(z) < Z_MAX, name


def test_noise_of_a_third_of_a_code() -> None:
    made = camera((None, 0.02, 0.1), black_level=64.3, white_level=4095.0, bit_depth=12)
    levels = (0.0, 0.0, 5.2, 20.1, 80.7, 300.0, 900.0, 2500.0)
    fit = fit_camera(record(made, 5, levels=levels, frames=8, size=(96, 96)))
    for name, z in misses(fit, made).items():
        assert abs(z) < Z_MAX, name
    assert any("rounding" in remark for remark in fit.remarks)


def test_charge_that_fills_below_the_white_level_is_seen() -> None:
    recording = record(ONE, 6, levels=(*LEVELS_DN, 13000.0, 14000.0, 15000.0))
    full = []
    for exposure in recording.exposures:
        stack = np.minimum(exposure.stack, np.uint16(256 + 9000))
        full.append(replace(exposure, stack=stack))
    fit = fit_camera(replace(recording, exposures=tuple(full)))
    assert fit.saturation_dn == pytest.approx(9000.0, abs=1.0)
    assert fit.full_well_reached
    assert fit.camera.saturation_dn == fit.saturation_dn
    assert abs(misses(fit, ONE)["slope 0"]) < Z_MAX


def test_a_variance_that_is_not_straight_is_said_and_its_errors_widened() -> None:
    recording = record(ONE, 7, size=(96, 96))
    shaken = []
    for number, exposure in enumerate(recording.exposures):
        mean = exposure.stack.mean(0)
        wide = mean + (exposure.stack - mean) * (1 + 0.1 * (-1) ** number)
        shaken.append(replace(exposure, stack=np.rint(wide).astype(np.uint16)))
    fit = fit_camera(replace(recording, exposures=tuple(shaken)))
    plain = fit_camera(recording)
    assert fit.segments.scatter > 0.05
    assert any("not on straight lines" in remark for remark in fit.remarks)
    assert fit.segments.lines[0].slope_se_dn > 3 * plain.segments.lines[0].slope_se_dn
    assert plain.segments.scatter == 0


def test_channels_that_differ_are_said() -> None:
    alike = fit_camera(record(camera((None, 1.7, 30.0), cfa=Cfa.RGGB), 1))
    assert alike.homogeneity_p > 1e-3
    made = record(camera((None, 1.7, 30.0), cfa=Cfa.RGGB), 1)
    other = record(camera((None, 2.1, 30.0), cfa=Cfa.RGGB), 2)
    mixed = []
    for a, b in zip(made.exposures, other.exposures, strict=True):
        stack = a.stack.copy()
        stack[:, 1::2, 1::2] = b.stack[:, 1::2, 1::2]
        mixed.append(replace(a, stack=stack))
    fit = fit_camera(replace(made, exposures=tuple(mixed)))
    assert fit.homogeneity_p < 1e-3
    assert any("channels' lines differ" in remark for remark in fit.remarks)
    blue = fit.channels["B"].lines[0]
    assert blue is not None
    assert abs(blue.slope_dn - 2.1) < Z_MAX * blue.slope_se_dn


class TestBroken:
    recording = record(ONE, 1)

    def test_no_flats(self) -> None:
        with pytest.raises(InputError, match="no exposure of kind flat"):
            fit_camera(self.recording.where(lambda e: e.kind == "dark"))

    def test_one_frame_each(self) -> None:
        single = tuple(replace(e, stack=e.stack[:1]) for e in self.recording.exposures)
        with pytest.raises(InputError, match="one frame only"):
            fit_camera(replace(self.recording, exposures=single))

    def test_some_with_one_frame(self) -> None:
        exposures = list(self.recording.exposures)
        exposures[5] = replace(exposures[5], stack=exposures[5].stack[:1])
        fit = fit_camera(replace(self.recording, exposures=tuple(exposures)))
        assert any("one frame only" in r and exposures[5].name in r for r in fit.remarks)

    def test_identical_frames(self) -> None:
        same = tuple(
            replace(e, stack=np.repeat(e.stack[:1], 4, 0)) for e in self.recording.exposures
        )
        with pytest.raises(InputError, match="equal the frame before"):
            fit_camera(replace(self.recording, exposures=same))

    def test_one_repeated_frame(self) -> None:
        exposures = list(self.recording.exposures)
        stack = exposures[6].stack.copy()
        stack[2] = stack[1]
        exposures[6] = replace(exposures[6], stack=stack)
        fit = fit_camera(replace(self.recording, exposures=tuple(exposures)))
        assert any("equal the frame before" in r and exposures[6].name in r for r in fit.remarks)

    def test_frames_in_turn(self) -> None:
        exposures = list(self.recording.exposures)
        exposures[5] = replace(exposures[5], stack=exposures[5].stack[[0, 1, 0, 1]])
        fit = fit_camera(replace(self.recording, exposures=tuple(exposures)))
        name = exposures[5].name
        assert any("occurs elsewhere" in r and name in r for r in fit.remarks)
        assert any("byte-identical" in r and name in r for r in fit.remarks)
        assert abs(misses(fit, ONE)["slope 0"]) < Z_MAX

    def test_a_frame_of_another_flat(self) -> None:
        exposures = list(self.recording.exposures)
        stack = exposures[6].stack.copy()
        stack[3] = exposures[5].stack[1]
        exposures[6] = replace(exposures[6], stack=stack)
        fit = fit_camera(replace(self.recording, exposures=tuple(exposures)))
        for exposure in exposures[5:7]:
            assert any("occurs elsewhere" in r and exposure.name in r for r in fit.remarks)
        assert abs(misses(fit, ONE)["slope 0"]) < Z_MAX

    def test_codes_in_steps(self) -> None:
        """Oracle: the same recording with codes one apart; all variances 4^2 times as large."""
        large = tuple(replace(e, stack=e.stack * np.uint16(4)) for e in self.recording.exposures)
        sensor = replace(self.recording.sensor, white_level=16383.0 * 4, bit_depth=16)
        fit = fit_camera(Recording(sensor, large))
        plain = fit_camera(self.recording)
        line, before = fit.segments.lines[0], plain.segments.lines[0]
        assert line.slope_dn == pytest.approx(4 * before.slope_dn, rel=1e-6)
        assert line.intercept_dn2 == pytest.approx(16 * before.intercept_dn2, rel=1e-6)
        assert any("steps of 4 DN" in remark for remark in fit.remarks)
        assert fit.camera.effect[-1].kind == "quantisation"

    def test_saturated_only(self) -> None:
        full = tuple(
            e if e.kind == "dark" else replace(e, stack=np.full_like(e.stack, 16383))
            for e in self.recording.exposures
        )
        with pytest.raises(InputError, match="at the white level"):
            fit_camera(replace(self.recording, exposures=full))

    def test_black_clipped_at_zero(self) -> None:
        low = tuple(
            replace(e, stack=np.maximum(e.stack.astype(int) - 256, 0).astype(np.uint16))
            for e in self.recording.exposures
        )
        fit = fit_camera(replace(self.recording, exposures=low))
        assert fit.black_se_dn is None
        assert any("at code 0" in r for r in fit.remarks)
        assert any("nominal" in r for r in fit.remarks)
        # Nominal 240 DN, yet the darks' mean is near 0.
        assert any("the nominal black level 240 DN is wrong" in r for r in fit.remarks)

    def test_no_darks(self) -> None:
        fit = fit_camera(self.recording.where(lambda e: e.kind == "flat"))
        assert fit.black_dn == 240.0
        assert fit.black_se_dn is None
        assert any("nominal" in remark for remark in fit.remarks)
        assert all(not channel.figures for channel in fit.channels.values())

    def test_one_level(self) -> None:
        fit = fit_camera(self.recording.where(lambda e: e.kind == "dark" or e.light == 6000.0))
        assert abs(misses(fit, ONE)["slope 0"]) < Z_MAX
        with pytest.raises(InputError, match="1 distinct levels"):
            fit_camera(self.recording.where(lambda e: e.light == 6000.0))

    def test_too_many_segments(self) -> None:
        with pytest.raises(InputError, match="--segments 7"):
            fit_camera(self.recording, 7)

    def test_a_slope_below_zero_is_no_camera(self) -> None:
        dull = camera((None, 0.0, 400.0))
        fits = [fit_camera(record(dull, seed)) for seed in range(8)]
        falling = [fit for fit in fits if fit.segments.lines[0].slope_dn < 0]
        assert falling
        with pytest.raises(InputError, match="must not be negative"):
            _ = falling[0].camera


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    fit = fit_camera(record(TWO, 2), threads=2)
    assert fit_values(fit) == fit_values(fit_camera(record(TWO, 2), threads=1))
    files = write_fit(fit, tmp_path / "camera.toml", "made for a test")
    assert {file.name for file in files} == {
        "camera.toml",
        "camera-fit.json",
        "camera-ptc.svg",
        "camera-ptc.png",
        "camera-distribution.png",
        "maps.npz",
    }
    assert {file.name for file in tmp_path.iterdir()} == {file.name for file in files}
    made = read_camera(tmp_path / "camera.toml")
    assert made == fit.camera
    assert made.noise.segment[0].upper_dn == fit.segments.switches[0].middle_dn
    text = (tmp_path / "camera.toml").read_text()
    assert "# made for a test" in text
    assert f"{fit.segments.switches[0].low_dn:.6g}" in text
    before = [file.read_bytes() for file in files]
    write_fit(fit, tmp_path / "camera.toml", "made for a test")
    assert before == [file.read_bytes() for file in files]
    assert "| gain |" in summary(fit)


def test_the_written_camera_makes_the_same_recording_again(tmp_path: Path) -> None:
    """Fit, simulate, fit: the second fit agrees with the first."""
    first = fit_camera(record(TWO, 3, size=(96, 96)))
    write_fit(first, tmp_path / "camera.toml")
    second = fit_camera(record(read_camera(tmp_path / "camera.toml"), 4, size=(96, 96)))
    for a, b in zip(first.segments.lines, second.segments.lines, strict=True):
        error = np.hypot(a.slope_se_dn, b.slope_se_dn)
        assert abs(a.slope_dn - b.slope_dn) < Z_MAX * error


def test_an_effect_can_be_appended_to_the_file(tmp_path: Path) -> None:
    """As the description of camera.toml shows it."""
    write_fit(fit_camera(record(ONE, 2)), tmp_path / "camera.toml")
    with (tmp_path / "camera.toml").open("a") as file:
        file.write('\n[[effect]]\nkind = "row_noise"\nsigma_dn = 3.2\n')
    text = (tmp_path / "camera.toml").read_text()
    assert "white_balance" not in text
    assert "camera_from_scene" not in text
    assert read_camera(tmp_path / "camera.toml").effect[-1].kind == "row_noise"


def test_a_converter_that_clips_first_gives_a_lower_limit() -> None:
    fit = fit_camera(record(ONE, 6, levels=(*LEVELS_DN, 15900.0, 18000.0)))
    assert not fit.full_well_reached
    assert fit.saturation_dn is None
    assert fit.full_well_dn == 16383.0 - fit.black_dn
    (well,) = (q for q in fit.quantities if q.name == "full_well")
    assert "converter clips first" in well.means
    assert any("converter clips" in remark for remark in fit.remarks)
    (figure,) = (q for q in fit.channels["MONO"].figures if q.name == "mu_e.sat")
    assert "lower limit" in figure.means


def test_progress_counts_exposures() -> None:
    calls: list[tuple[int, int, str]] = []
    recording = record(ONE, 1)
    fit_camera(recording, threads=2, progress=lambda *call: calls.append(call))
    assert [done for done, _, _ in calls] == list(range(1, len(LEVELS_DN) + 1))
    assert {total for _, total, _ in calls} == {len(LEVELS_DN)}
    assert {name for _, _, name in calls} == {e.name for e in recording.exposures}


def test_maps_and_effects_are_those_of_the_sensor(tmp_path: Path) -> None:
    """Oracle: the fields that the sensor was made with, and the stated noise of the maps."""
    effects = (
        registry()["dsnu"].model_validate({"sigma_dn": 6.0}),
        registry()["prnu"].model_validate({"sigma_percent": 2.0}),
    )
    made = ONE.model_copy(update={"effect": effects})
    levels = (0.0, 0.0, 500.0, 1100.0, 3000.0, 6000.0)
    fit = fit_camera(record(made, 3, frames=8, levels=levels))
    write_fit(fit, tmp_path / "camera.toml")
    maps, grid = read_maps(tmp_path / "camera.toml"), PixelGrid(48, 64, Cfa.MONO)
    offsets, gains = Draw(99).normal("dsnu", grid), Draw(99).normal("prnu", grid)
    error = maps.dsnu_dn - 6 * (offsets - offsets.mean())
    # An sd of n pixels is known to 1 / sqrt(2 n) of itself.
    bound = Z_MAX / np.sqrt(2 * error.size)
    assert abs(error.std() / maps.dsnu_noise_dn - 1) < bound
    error = maps.prnu_gain - (1 + 0.02 * gains) / (1 + 0.02 * gains.mean())
    assert abs(error.std() / maps.prnu_noise - 1) < bound
    found = {effect.kind: effect for effect in fit.effects}
    assert set(found) == {"dsnu", "prnu"}
    for kind, sigma in (("dsnu", 6.0), ("prnu", 2.0)):
        assert abs(found[kind].value - sigma) < Z_MAX * found[kind].standard_error
    other = tmp_path / "other.toml"
    with pytest.raises(InputError, match=r"patterns of camera\.toml, must be those of other\.toml"):
        read_maps(other)
    write_fit(replace(fit, maps=None), tmp_path / "camera.toml")
    assert not (tmp_path / "maps.npz").exists()


@pytest.mark.parametrize("kind", ["row", "column"])
def test_noise_of_lines_is_said(kind: str) -> None:
    effect = registry()[f"{kind}_noise"].model_validate({"sigma_dn": 6.0})
    made = ONE.model_copy(update={"effect": (effect,)})
    fit = fit_camera(record(made, 1))
    (remark,) = (r for r in fit.remarks if "noise of" in r and "is in the intercept" in r)
    assert f"{kind} noise of" in remark
    # 48 rows or 64 columns, 3 degrees of freedom each: known to 1 / sqrt(2 * 3 * 47).
    value = float(remark.split("noise of ")[1].split(" DN")[0])
    assert abs(value / 6 - 1) < Z_MAX / np.sqrt(2 * 3 * 47)
