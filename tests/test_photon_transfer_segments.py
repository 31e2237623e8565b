"""Promise: how many read-out segments there are is decided from the data, and none is invented."""

import numpy as np
import pytest

from analysis.photon_transfer import Line
from analysis.photon_transfer.segments import fit_segments
from planted_camera import points_of


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
