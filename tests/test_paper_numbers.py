"""Promise: the numbers of the paper's page agree with closed forms and with other computations."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.denoising import bls_gsm, bm3d
from analysis.paper import Setting, claims, denoised, equation5, fig6, table1
from analysis.paper.cells import Cell, white_spectrum
from analysis.paper.jackknife import with_error
from analysis.paper.part import number
from analysis.paper.published import TABLE_1, TABLE_2
from analysis.paper.scene import scene
from dsis.cfa import Cfa
from dsis.covariance import LagCovariance, averaged
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.errors import InputError
from dsis.grid import PixelGrid
from small_paper import Small, write_pictures

# Table 1 on the images that the paper used.

NEAR = 0.002
# The other run's (0,2) of Lu-Tan stands apart from its own (2,0); ours treats rows and columns
# exactly alike. A noise field that all images share explains 0.0008 of it (benchmarks/table1.py).
APART = {("lu_tan", (0, 2)): 0.0045}


@pytest.fixture(scope="module")
def kodak(shared_data):
    files = tuple(sorted((shared_data / "kodak").glob("kodim*.png")))
    assert len(files) == 24
    return table1.measure(Setting(kodak=files, jobs=2))


def test_bilinear_agrees_with_its_closed_form(kodak):
    ours, error = with_error(kodak["bilinear"], LagCovariance.pooled)
    z = [(ours[at] - table1.EXACT[at]) / error[at] for at in table1.ENTRIES]
    assert np.abs(z).max() < 4
    assert max(error[at] for at in table1.ENTRIES) < 0.001


@pytest.mark.parametrize("method", table1.ELSEWHERE)
def test_edge_directed_methods_agree_with_an_independent_computation(method, kodak):
    ours = averaged(kodak[method]).pooled()
    for at, other in zip(table1.ENTRIES, table1.ELSEWHERE[method], strict=True):
        assert ours[at] == pytest.approx(other, abs=APART.get((method, at), NEAR)), at


def test_the_paper_is_met_but_for_the_misprint(kodak):
    """Within 0.0135, what other images, sigma and fields make; the independent run had 0.0130."""
    for method, parts in kodak.items():
        off = averaged(parts).pooled() - TABLE_1[method]
        if method == "dlmmse":
            assert abs(off[1, 0]) > 0.15
            off[1, 0] = 0
        assert np.abs(off).max() < 0.0135


# Equation (5), on City.


def test_equation_5_predicts_camera_noise_on_city():
    """All 225 correlations within 0.005, as the issue asks: some four standard errors."""
    city = scene("city", Setting(jobs=2), 1)
    clean = city.clean(0)
    key = ("bilinear", "all")
    setting = Setting(jobs=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(equation5, "METHODS", ("bilinear",))
        parts = equation5._measured(city, clean, {"all": None}, setting, 8)[key]
    predicted = equation5._predictions(city, clean, "bilinear", None, setting)["exact"]
    ours, error = with_error(parts, LagCovariance.correlations)
    off = np.abs(ours - predicted.correlations())
    assert off.max() < 0.005
    assert np.nanmax(off / np.where(error > 1e-9, error, np.nan)) < 5
    assert averaged(parts).variance == pytest.approx(predicted.variance, rel=0.01)


# Table 2 and the claims.


def test_the_printed_table_alone_decides_what_it_can(monkeypatch):
    """Put the paper's own decibels in the place of ours: its text is judged by its table."""
    scores = {
        (noise, stage, method, name, False): denoised.Score((value,), (value,), (1.0, 1.0))
        for (noise, stage), cells in TABLE_2.items()
        for name, pair in cells.items()
        for method, value in zip(("none", "bilinear"), pair, strict=True)
    }
    monkeypatch.setattr(claims, "measure", lambda *_: scores)
    table = claims.recompute(Small(), Path()).tables[0]
    verdict = {row[0]: row[4] for row in table.rows}
    assert verdict["BM3D improves demosaicked AWGN by only 5.54 dB"] == "does not hold"
    assert verdict["BM3D improves demosaicked SD by only 2.82 dB"] == "does not hold"
    assert verdict["BLS-GSM works better in linear domain"] == "does not hold"  # RGB only
    assert verdict["BM3D works better in display domain"] == "holds"
    assert verdict["BM3D improves both kinds of noise by above 10 dB (RGB)"] == "holds"
    assert [row[1:4] for row in table.rows if "up to 8 dB" in row[0]] == [
        ("8 dB", "8.16 dB", "8.16 dB")
    ]


def test_denoisers_that_know_the_spectrum_win_on_a_flat_chart():
    """Bilinear noise of one variance, no picture: knowing equation (5) must help both denoisers."""
    city = scene("city", Small(), 1)
    noise = 0.02 * Draw(1).normal("chart", PixelGrid(96, 96, city.camera.cfa))
    still = np.full((96, 96, 3), 0.5, np.float32)
    noisy = still + demosaic(noise, city.camera.cfa, "bilinear")
    cell = Cell("awgn", 3, "bilinear", noisy, still)
    spectrum = white_spectrum(city, cell, 0.02)
    for denoiser in (bm3d, bls_gsm):
        plain = np.square(denoiser(noisy, cell.sigma) - still).mean()
        adapted = np.square(denoiser(noisy, spectrum) - still).mean()
        assert adapted < 0.7 * plain


# Fig. 6.


def test_fig_6_reads_the_votes_of_people(tmp_path):
    """Votes that lose 3 grades by demosaicking: the difference is found, and no mark is set."""
    lines = ["observer,stimulus,vote,content,noise,demosaic,level"]
    for person in range(12):
        for noise in ("awgn", "sd"):
            for method, grade in (("none", 8), ("bilinear", 5)):
                vote = grade + (person + (noise == "sd")) % 3 - 1
                name = f"city__{noise}__{method}__0"
                lines.append(f"p{person},{name},{vote},city,{noise},{method},0")
    path = tmp_path / "votes.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="scale"):
        fig6.scores(Setting(votes=path))
    package = {"name": "votes", "scale": [1, 10], "resources": []}
    described = tmp_path / "datapackage.json"
    described.write_text(json.dumps(package), encoding="utf-8")
    part = fig6.recompute(Setting(votes=path), tmp_path)
    rows = {row.what: row for row in part.rows}
    assert rows["city, AWGN: MOS lost by demosaicking"].recomputed == pytest.approx(3.0)
    assert rows["landscape, SD: MOS lost by demosaicking"].recomputed is None
    assert "SIMULATED" not in (tmp_path / "fig6.svg").read_text(encoding="utf-8")


# Small things.


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (0.0, "0"),
        (-1e-9, "0.0000"),
        (-0.00374, "\u22120.0037"),
        (0.5693, "0.5693"),
        (31.514, "31.51"),
        (9000.0, "9000"),
        (float("inf"), "inf"),
    ],
)
def test_numbers_are_set_in_four_digits(value, text):
    assert number(value) == text


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = Draw(1).normal("x", PixelGrid(9, 1, Cfa.MONO))[:, 0].astype(np.float64)
    parts = [LagCovariance(np.full((1, 1, 1, 1), v), 5) for v in values]
    mean, error = with_error(parts, lambda moments: moments.values.ravel())
    assert mean[0] == pytest.approx(values.mean())
    assert error[0] == pytest.approx(values.std(ddof=1) / 3)
    assert np.isnan(with_error(parts[:1], lambda moments: moments.values.ravel())[1][0])


def test_another_seed_is_other_noise(tmp_path):
    files = write_pictures(tmp_path)
    one = table1.measure(Setting(kodak=files), ("bilinear",))["bilinear"][0]
    two = table1.measure(replace(Setting(kodak=files), seed=2), ("bilinear",))["bilinear"][0]
    assert not np.allclose(one.values, two.values, rtol=1e-6)
