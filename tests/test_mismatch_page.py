"""Promise: the page of `dsis mismatch` hides nothing, and shows each mismatch in a picture."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import matplotlib.figure
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.bank.key import Key
from analysis.mismatch.evidence import Curve, Evidence, Histogram, Map, Series, Shown
from analysis.mismatch.files import FILES, write_finding
from analysis.mismatch.finding import Finding, FittedParameter, Gain, Where
from analysis.mismatch.model import processes
from analysis.mismatch.report import render
from analysis.mismatch.report.figures import MOST, curves, pictures, series
from analysis.mismatch.report.figures.spectra import folded
from analysis.mismatch.report.numbers import measured
from analysis.mismatch.report.sentences import credited, numbers_in_short, parameters
from analysis.mismatch.says import sentence
from analysis.mismatch.words import effect_says, effect_words
from dsis.effects import registry
from folder_bytes import every_byte
from mismatch_findings import FOUND, LINE, NAMED, NAN, NOTHING, ROWS, evidence


class Page(HTMLParser):
    """The sources a page asks for, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.asked: list[str] = []
        self.tags: set[str] = set()
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.asked += [str(value) for name, value in attrs if name in ("src", "href", "srcset")]

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


def test_it_names_all_files_beside_it() -> None:
    text = Page(render(FOUND, [], "")).text
    beside = text[text.index("Files beside this page") :]
    for name in FILES - {"report.html"}:
        assert name in beside, name


def test_processes_draw_the_same_bytes(tmp_path: Path) -> None:
    finding = replace(FOUND, evidence=evidence())
    write_finding(finding, tmp_path / "one")
    with processes(2):
        write_finding(finding, tmp_path / "other")
    assert every_byte(tmp_path / "one") == every_byte(tmp_path / "other")


@pytest.mark.parametrize("finding", [replace(FOUND, evidence=evidence()), FOUND, NOTHING])
def test_page_needs_no_network_and_hides_nothing(finding: Finding, tmp_path: Path) -> None:
    write_finding(finding, tmp_path / "out", "Recording a < b\nCopyright of somebody")
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert all(asked.startswith("data:image/svg+xml;base64,") for asked in page.asked)
    assert not page.tags & {"script", "link", "iframe", "object"}
    assert "@import" not in text
    assert "url(" not in text
    assert "Recording a < b" in page.text
    assert "no ground truth" in page.text
    for mismatch in (*finding.mismatches, *finding.unexplained):
        assert mismatch.says in page.text
    for other in (*NAMED.alternatives, *finding.undecided) if finding.omitted_physics else ():
        assert other.why_not in page.text
        assert other.would_settle in page.text
    for remark in finding.remarks:
        assert remark in page.text
    drawn = len(pictures(finding))
    assert len(page.asked) == drawn + bool(finding.omitted_physics)
    files = sorted(p.suffix for p in (tmp_path / "out" / "figures").iterdir())
    assert files.count(".png") == files.count(".svg") == len(page.asked)


def test_terms_that_are_no_part_of_an_effect_are_not_printed() -> None:
    known = {
        "offset_dn": FittedParameter(0.0, 0.0),
        "gain_percent": FittedParameter(0.614, 0.022),
        "lag_pixels": FittedParameter(7.0, 0.0),
        "length_rows": FittedParameter(2.33, 0.2),
    }
    said = parameters(replace(NAMED, parameters=known, choices={"edge": "top"}))
    assert said.startswith("edge top; gain 0.614")
    assert "offset" not in said
    assert "lag 7 pixels; length 2.33 ± 0.20 rows" in said
    none_found = {"gain_percent": FittedParameter(0.0, 0.02)}
    assert "gain" in parameters(replace(NAMED, parameters=none_found))


def test_every_kind_of_evidence_has_its_picture() -> None:
    shown = {
        "row_variance": "row_variance",
        "spectral_peak": "spectrum-pooled",
        "row_spectrum_peak": "row-spectrum-flat-1",
        "frame_variance": "frame-means",
        "code_imbalance": "codes-flat-1",
        "fixed_pixel_variance": "gain_map-pixels",
    }
    some = tuple(replace(LINE, statistic=name, z=9.0 - i) for i, name in enumerate(shown))
    found = pictures(replace(FOUND, mismatches=some, unexplained=(), evidence=evidence()))
    assert [picture.name for picture in found] == list(shown.values())


def test_a_fixed_pattern_is_shown_where_it_departs_most() -> None:
    """Rows and columns as line means, a surface smoothed, pixels with their distribution."""
    image = np.random.default_rng(2).normal(size=(24, 32))
    some = (Map("MONO", "DN", image, image),)
    names = {
        "fixed_row_variance": ("time_map", "", "time_map-rows"),
        "parity": ("gain_map", "columns", "gain_map-columns-parity"),
        "half_seam": ("offset_map", "rows", "offset_map-rows-halves"),
        "fixed_smooth_variance": ("gain_alone_map", "", "gain_alone_map-smooth-MONO"),
        "fixed_spectral_peak": ("gain_alone_map", "", "gain_alone_map-spectrum"),
        "outlying_pixels": ("time_map", "", "time_map-pixels-MONO"),
    }
    seen = Evidence(
        maps={name: some for name, _, _ in names.values()},
        shown_in={
            statistic: Shown(name, axis)  # type: ignore[arg-type] # one of three words
            for statistic, (name, axis, _) in names.items()
        },
    )
    for statistic, (_, _, drawn) in names.items():
        one = replace(LINE, statistic=statistic, where=Where(channel="MONO"))
        found = pictures(replace(FOUND, mismatches=(one,), unexplained=(), evidence=seen))
        assert [picture.name for picture in found] == [drawn]
        found[0].draw(matplotlib.figure.Figure())


@pytest.mark.parametrize(
    ("z", "first"), [(20.0, "gain_map-smooth"), (4.0, "fixed_smooth_variance")]
)
def test_what_departs_most_comes_first(z: float, first: str) -> None:
    levels = np.array([0.0, 100.0, 300.0])
    curve = Curve("MONO", "signal_dn", levels, levels / 30, 0 * levels, None, 0 * levels + 1)
    seen = Evidence(
        curves={"fixed_smooth_variance": (curve,)},
        maps={"gain_map": (Map("MONO", "%", np.ones((24, 32))),) * 2},
        shown_in={"fixed_smooth_variance": Shown("gain_map", z=z)},
    )
    one = replace(LINE, statistic="fixed_smooth_variance")
    found = pictures(replace(FOUND, mismatches=(one,), unexplained=(), evidence=seen))
    assert found[0].name == first
    assert len(found) == 2


def test_curves_within_chance_stand_aside_for_a_better_picture() -> None:
    """A sum over exposures may be certain where no single exposure is."""
    zero, levels = np.zeros(3), np.array([0.0, 100.0, 300.0])
    low, high = (
        Curve("MONO", "signal_dn", levels, zero + z, zero, None, zero + 1) for z in (2.0, 9.0)
    )
    (row,) = evidence().row_spectra["flat-1"]
    seen = Evidence(
        curves={"frame_variance": (low,), "row_spectrum_peak": (low,), "row_variance": (high,)},
        row_spectra={"pooled": (row,)},
    )
    for statistic, drawn in {
        "frame_variance": "frame_variance",
        "row_spectrum_peak": "row-spectrum-pooled",
        "row_variance": "row_variance",
    }.items():
        one = replace(LINE, statistic=statistic)
        found = pictures(replace(FOUND, mismatches=(one,), unexplained=(), evidence=seen))
        assert [picture.name for picture in found] == [drawn]


def test_codes_are_shown_where_they_differ_most() -> None:
    counts = 100 + np.arange(40.0)
    odd = counts + 50 * (-1.0) ** np.arange(40)
    seen = Evidence(
        codes={
            "flat-1": (Histogram("MONO", 90, counts, counts),),
            "flat-2": (Histogram("MONO", 90, odd, counts),),
        }
    )
    one = replace(LINE, statistic="code_imbalance")
    (found,) = pictures(replace(FOUND, mismatches=(one,), unexplained=(), evidence=seen))
    assert found.name == "codes-flat-2"


@pytest.mark.parametrize(
    ("gain", "said"),
    [
        (Gain(3.0, (1.0, 5.0)), ""),
        (Gain(3.0, (-1.0, 5.0)), "Weakly proven: row noise."),
        (Gain(3.0, (NAN, NAN)), "3, not proven"),
        (Gain(NAN, (-float("inf"), float("inf"))), "\u2013, not proven"),
    ],
)
def test_a_gain_that_is_not_proven_is_called_so(gain: Gain, said: str, tmp_path: Path) -> None:
    named = replace(NAMED, heldout_gain=gain)
    finding = replace(FOUND, omitted_physics=(named,), undecided=())
    write_finding(finding, tmp_path / "out")
    text = Page((tmp_path / "out" / "report.html").read_text(encoding="utf-8")).text
    assert ("not proven" in text) is not np.isfinite(gain.ci95[0])
    assert ("Not proven" in text) is not np.isfinite(gain.ci95[0])
    assert ("Weakly proven" in text) is (gain.ci95[0] == -1)
    assert said in text


def test_a_parameter_may_be_several_numbers(tmp_path: Path) -> None:
    frequency = FittedParameter((0.13, -0.21), 0.0002)
    named = replace(NAMED, parameters={"frequency": frequency})
    finding = replace(FOUND, omitted_physics=(named,))
    assert json.loads(json.dumps(finding.values()))["omitted_physics"][0]["parameters"] == {
        "frequency": {"value": [0.13, -0.21], "standard_error": 0.0002}
    }
    write_finding(finding, tmp_path / "out")
    text = Page((tmp_path / "out" / "report.html").read_text(encoding="utf-8")).text
    assert "(0.13000 ± 0.00020, \u22120.21000 ± 0.00020) cycles/pixel" in text


def test_frames_that_were_not_looked_at_are_left_out() -> None:
    means = np.array([1.0, 2.0, NAN, 3.0])
    figure = matplotlib.figure.Figure()
    series.draw(figure, {"flat-1": [Series("MONO", means, locked=(2,))]})
    (axes,) = figure.axes
    np.testing.assert_array_equal(axes.lines[0].get_xdata(), [0, 1, 3])
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [-1, 0, 1])


def test_a_strong_effect_does_not_crowd_out_a_weak_one() -> None:
    curve = evidence().curves["row_variance"]
    many = [replace(ROWS, statistic=f"strong_{i}", z=100.0 + i) for i in range(2 * MOST)]
    weak = replace(ROWS, statistic="weak", z=5.0, explained_by="flicker")
    left = replace(LINE, statistic="left_over", z=-5.5)
    seen = Evidence(curves=dict.fromkeys([m.statistic for m in [*many, weak, left]], curve))
    found = pictures(replace(FOUND, mismatches=(*many, weak), unexplained=(left,), evidence=seen))
    assert len(found) == MOST
    assert {found[1].name, found[2].name} == {"left_over", "weak"}


def test_curve_draws_departures_in_units_and_in_standard_deviations() -> None:
    figure = matplotlib.figure.Figure()
    curve = evidence().curves["row_variance"][0]
    curves.draw(figure, [curve], 4.5)
    left, right = figure.axes
    recorded = next(line for line in left.lines if line.get_label() == "recorded")
    np.testing.assert_array_equal(recorded.get_ydata(), curve.observed - curve.expected_before)
    before, after = right.lines[:2]
    np.testing.assert_allclose(before.get_ydata(), [102, 51, 34, 25.5])
    np.testing.assert_allclose(after.get_ydata(), [-0.4, -0.2, -0.4 / 3, -0.1])
    low, high = right.get_ylim()
    assert low < -4.5
    assert high > 102


@given(st.integers(-31, 31))
def test_a_frequency_of_the_mosaic_shows_folded_in_a_channel(k: int) -> None:
    """Oracle: the spectrum of a sinusoid sampled at every other pixel."""
    wave = np.exp(2j * np.pi * k / 64 * np.arange(64))
    peak = np.fft.fftfreq(32)[int(np.abs(np.fft.fft(wave[::2])).argmax())] / 2
    assert folded(k / 64, 0.25) % 0.5 == pytest.approx(peak % 0.5)


@given(st.floats(-1e6, 1e6), st.floats(1e-4, 1e4))
def test_a_number_is_rounded_by_its_error(value: float, error: float) -> None:
    shown = measured(value, error).replace("\u2212", "-")
    number, uncertainty = (float(part) for part in shown.split(" ± "))
    # Two digits of the error: at most half of a tenth of its leading decade.
    assert abs(number - value) <= 0.0501 * error + 1e-9 * abs(value)
    assert abs(uncertainty - error) <= 0.0501 * error


@given(st.sets(st.integers(0, 40), min_size=1))
def test_frames_are_listed_in_runs(frames: set[int]) -> None:
    listed: set[int] = set()
    for part in numbers_in_short(frames).split(", "):
        first, _, last = part.partition("\u2013")
        listed |= set(range(int(first), int(last or first) + 1))
    assert listed == frames


@pytest.mark.parametrize("kind", sorted({*registry(), "dual_gain"}))
def test_every_effect_has_words(kind: str) -> None:
    assert effect_says(kind).endswith(".")
    assert "_" not in effect_words(kind)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (Key("line_correlation", "pooled", "", "MONO", "rows 8"), "(8 pixels apart along rows)"),
        (Key("line_correlation", "pooled", "", "Gr", "columns 1"), "(1 pixel of one colour apart"),
        (Key("line_correlation", "all", "", "", "rows 1.5"), "(3 pixels apart along rows)"),
        (
            Key("line_correlation", "contrast", "", "", "all rows 4"),
            "of one colour apart along rows",
        ),
    ],
)
def test_correlations_along_lines_say_what_is_apart(key: Key, said: str) -> None:
    """Sums over channels put a word before axis and lag."""
    assert said in sentence(key.statistic, key, 5.0, Where(("flat-0",)))


def test_what_is_gone_beside_all_effects_is_theirs_together() -> None:
    """No effect alone changes it, and nothing is left: it is not said to be unexplained."""
    gone = replace(ROWS, statistic="frame_noise", explained_by=None)
    finding = replace(FOUND, mismatches=(*FOUND.mismatches, gone))
    assert credited(gone, finding) == "all that is named, together"
    assert not credited(gone, replace(finding, unexplained=(gone,)))
    assert not credited(gone, replace(finding, omitted_physics=()))
    page = Page(render(finding, [], ""))
    assert "all that is named, together" in page.text
