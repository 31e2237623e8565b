"""Promise: a recording that no camera can be fitted to is refused with the reason."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.photon_transfer import fit_camera, summary
from dsis.cfa import Cfa
from dsis.errors import InputError
from planted_camera import ONE, Z_MAX, Recording, camera, misses, record


class TestBroken:
    recording = record(ONE, 1)

    def test_no_flats(self) -> None:
        with pytest.raises(InputError, match="no exposure of kind flat"):
            fit_camera(self.recording.where(lambda e: e.kind == "dark"))

    def test_one_frame_each(self) -> None:
        single = tuple(replace(e, stack=e.stack[:1]) for e in self.recording.exposures)
        with pytest.raises(InputError, match="one frame only"):
            fit_camera(replace(self.recording, exposures=single))

    @pytest.mark.parametrize(
        ("cfa", "rows", "columns", "least"),
        [
            (Cfa.MONO, 1, 1, r"2 or more$"),
            (Cfa.RGGB, 1, 128, r"2 or more of each colour \(RGGB\)$"),
            (Cfa.RGGB, 1, 1, r"2 or more of each colour \(RGGB\)$"),
            (Cfa.RGGB, 3, 3, r"2 or more of each colour \(RGGB\)$"),
        ],
    )
    def test_frames_of_few_pixels(self, cfa: Cfa, rows: int, columns: int, least: str) -> None:
        small = tuple(
            replace(e, stack=np.ascontiguousarray(e.stack[:, :rows, :columns]))
            for e in self.recording.exposures
        )
        sensor = replace(self.recording.sensor, cfa=cfa)
        with pytest.raises(InputError, match=rf"are of \d+ x {rows} pixels, must have {least}"):
            fit_camera(Recording(sensor, small))

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

    def test_why_a_figure_has_no_value(self) -> None:
        """Nothing fixed is planted: in half of all recordings less than nothing is left of it."""
        fits = [fit_camera(record(ONE, seed)) for seed in range(1, 5)]
        for fit in fits:
            (channel,) = fit.channels.values()
            unknown = {q.name for q in channel.figures if q.value is None}
            says = [r for r in fit.remarks if r.startswith("No value (-) of ")]
            assert len(says) == bool(unknown)
            assert all(f"{name} (MONO)" in says[0] for name in unknown)
        assert any("No value (-) of DSNU1288" in r for fit in fits for r in fit.remarks)

    def test_a_pattern_of_darks_that_hides_that_of_flats(self) -> None:
        """It is not too weak to be seen: DSNU1288 is measured, PRNU1288 is lost beside it."""
        offsets = np.random.default_rng(0).normal(
            0, 20.0, self.recording.exposures[1].stack.shape[1:]
        )
        own = tuple(
            replace(e, stack=np.rint(e.stack + offsets).astype(np.uint16))
            if e.name == "dark-01"
            else e
            for e in self.recording.exposures
        )
        fit = fit_camera(replace(self.recording, exposures=own))
        (says,) = [r for r in fit.remarks if r.startswith("No value (-) of ")]
        assert "PRNU1288 (MONO): beside noise, flats have no stronger" in says
        assert "too weak" not in says

    def test_one_dark_and_one_flat_tell_errors_of_their_samples(self) -> None:
        fit = fit_camera(self.recording.where(lambda e: e.name in ("dark-00", "flat-08")))
        errors = {q.name: q.standard_error for q in fit.channels["MONO"].figures}
        assert all(errors[name] is not None for name in ("K", "sigma_y.dark", "sigma_d"))
        assert not any(one is not None and np.isnan(one) for one in errors.values())
        assert "nan" not in summary(fit)

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
