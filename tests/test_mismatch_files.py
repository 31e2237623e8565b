"""Promise: what `dsis mismatch` leaves on disk is complete, the same every time, and of use."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch import folders
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.evidence import (
    Curve,
    Evidence,
    Histogram,
    LineSpectrum,
    Map,
    Series,
    Shown,
    Spectrum,
)
from analysis.mismatch.files import write_finding
from analysis.mismatch.finding import (
    Alternative,
    Change,
    Finding,
    FittedParameter,
    Gain,
    Mismatch,
    OmittedEffect,
    ParameterError,
    Proof,
    Where,
)
from analysis.mismatch.jsonfile import finding_values, write_json
from analysis.mismatch.report.figures import MOST, curves, pictures, series
from analysis.mismatch.report.figures.spectra import folded
from analysis.mismatch.report.numbers import measured
from analysis.mismatch.report.sentences import numbers_in_short
from analysis.mismatch.report.words import effect_says, effect_words
from dsis.camera import BaseNoise, Camera, Segment, read_camera
from dsis.cfa import Cfa
from dsis.cli import main
from dsis.effects import registry
from dsis.recording import read_recording
from dsis.simulate import dark, flat, simulate
from dsis.simulate.maps import SensorMaps

NAN = float("nan")
WHERE_KEYS = [  # contracts, section 4
    "exposures",
    "kind",
    "channel",
    "signal_dn",
    "rows",
    "columns",
    "spatial_frequency",
    "frames",
    "pixels",
]
BASE = Camera(
    name="planted",
    cfa=Cfa.MONO,
    black_level=100.0,
    white_level=4095.0,
    bit_depth=12,
    noise=BaseNoise(segment=(Segment(slope=0.5, intercept=20.0),)),
)
CAMERA = BASE.model_copy(update={"effect": (registry()["row_noise"](sigma_dn=3.2),)})
ROWS = Mismatch(
    "row_variance",
    41.2,
    1e-9,
    Where(("flat-1", "flat-2"), "flat", "MONO", (100.0, 700.0)),
    "Whole rows move together <from frame to frame> & in every flat.",
    "row_noise",
    0.7,
)
LINE = Mismatch(
    "spectral_peak",
    np.float64(9.0),
    0.0,
    Where(spatial_frequency=(0.2, -0.1), frames=(1, 2), pixels=((3, 4),), rows=(2, 5)),
    "One spatial frequency stands out.",
)
NAMED = OmittedEffect(
    "row_noise",
    {"sigma_dn": FittedParameter(3.2, 0.1)},
    ("row_variance",),
    Gain(120.4, (101.0, 139.8)),
    (Alternative("line_flicker", None, "It does not grow with the signal.", "A second level."),),
)
FOUND = Finding(
    verdict="omitted_physics",
    mismatches=(ROWS, LINE),
    parameter_errors=(ParameterError("noise.slope", 0.6, 0.5, 0.002),),
    omitted_physics=(NAMED,),
    unexplained=(LINE,),
    undecided=(Alternative("flicker", Gain(2.0, (NAN, NAN)), "It ties with drift.", "Darks."),),
    proof=Proof(
        {"flat-1": (1, 3)}, Change(-3.412, -3.377), Change(14, 0), None, Change(0.97, 0.51)
    ),
    camera=CAMERA,
    remarks=("Exposure time and light grow together.",),
)
NOTHING = replace(
    FOUND,
    verdict="match",
    mismatches=(),
    parameter_errors=(),
    omitted_physics=(),
    unexplained=(),
    undecided=(),
    proof=Proof({}, Change(NAN, NAN), Change(0, 0), None, None),
    camera=BASE,
    remarks=(),
)


def evidence() -> Evidence:
    rng = np.random.default_rng(1)
    levels = np.array([-0.2, 100.0, 300.0, 700.0])
    zero, sd = np.zeros(4), np.array([0.1, 0.2, 0.3, 0.4])
    curve = Curve("MONO", "signal_dn", levels, zero + 10.2, zero, zero + 10.24, sd, "DN^2")
    image = rng.normal(size=(24, 32))
    power = rng.gamma(8, 1 / 8, (24, 17))
    means = Series("MONO", rng.normal(size=8), 0.1, 1.0, (3, 7))
    line = LineSpectrum("MONO", power[:, 3], 8.0, np.ones(24))
    return Evidence(
        curves={"row_variance": (curve,)},
        maps={"gain_map": (Map("MONO", "1", image, image, image),)},
        shown_in={"fixed_pixel_variance": Shown("gain_map")},
        spectra={"pooled": (Spectrum("MONO", power, power),)},
        row_spectra={"flat-1": (line,)},
        series={"flat-1": (means,), "dark": (means,)},
        codes={"flat-1": (Histogram("MONO", 90, np.arange(50.0)),)},
        tests=40,
        simulations=100,
        seconds=1.5,
    )


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


def strict(path: Path) -> dict[str, Any]:
    def refuse(word: str) -> None:
        raise AssertionError(word)  # NaN and Infinity are no JSON

    values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    return values


def test_json_is_that_of_the_contract(tmp_path: Path) -> None:
    write_json(FOUND, tmp_path / "mismatch.json")
    values = strict(tmp_path / "mismatch.json")
    assert values["schema"] == "dsis-mismatch/1"
    assert values["verdict"] == "omitted_physics"
    first, second = values["mismatches"]
    assert {"statistic", "z", "p_adjusted", "explained_by", "where", "says"} <= first.keys()
    assert [key for key in first["where"] if key in WHERE_KEYS] == WHERE_KEYS
    assert first["where"]["signal_dn"] == [100, 700]
    assert first["where"]["rows"] is None
    assert second["explained_by"] is None
    assert second["where"]["pixels"] == [[3, 4]]
    assert values["parameter_errors"] == [
        {"parameter": "noise.slope", "model": 0.6, "recorded": 0.5, "standard_error": 0.002}
    ]
    assert values["omitted_physics"] == [
        {
            "effect": "row_noise",
            "parameters": {"sigma_dn": {"value": 3.2, "standard_error": 0.1}},
            "because": ["row_variance"],
            "heldout_gain": {"nats_per_frame": 120.4, "ci95": [101.0, 139.8]},
            "alternatives": [
                {
                    "effect": "line_flicker",
                    "heldout_gain": None,
                    "why_not": "It does not grow with the signal.",
                    "would_settle": "A second level.",
                }
            ],
        }
    ]
    assert values["unexplained"][0].keys() == {"statistic", "z", "where", "says"}
    assert values["undecided"][0]["heldout_gain"] == {
        "nats_per_frame": 2.0,
        "ci95": [None, None],
    }
    fit = values["fit"]
    assert fit["heldout_frames"] == {"flat-1": [1, 3]}
    assert fit["loglik_per_pixel"] == {"before": -3.412, "after": -3.377}
    assert json.dumps(fit["discrepancies"]) == '{"before": 14, "after": 0}'
    assert fit["gap_closed"] is None
    assert fit["classifier_auc"] == {"before": 0.97, "after": 0.51}


@given(st.floats(), st.floats(), st.integers(0, 2**40))
def test_any_number_has_a_place_in_json(z: float, before: float, frame: int) -> None:
    where = Where(frames=(frame, np.int64(frame)))  # type: ignore[arg-type] # as analysis makes it
    mismatch = replace(ROWS, z=np.float64(z), where=where)
    proof = replace(FOUND.proof, discrepancies=Change(before, 0.0))
    values = finding_values(replace(FOUND, mismatches=(mismatch,), proof=proof))
    again = json.loads(json.dumps(values, allow_nan=False))
    assert again["mismatches"][0]["z"] == (z if np.isfinite(z) else None)
    assert again["mismatches"][0]["where"]["frames"] == [frame, frame]
    found = again["fit"]["discrepancies"]["before"]
    assert found == (before if np.isfinite(before) else None)


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


def test_same_finding_same_bytes(tmp_path: Path) -> None:
    for name, seconds in (("one", 1.0), ("two", 2.0)):
        seen = replace(evidence(), seconds=seconds)
        write_finding(replace(FOUND, evidence=seen), tmp_path / name, "Recording")
    one, two = (
        {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        for folder in (tmp_path / "one", tmp_path / "two")
    )
    assert one == two
    assert {Path("mismatch.json"), Path("report.html"), Path("camera.toml")} < one.keys()


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


# From files to files, through the command, with a search that is made up.


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("mismatch") / "recording"
    shots = [
        dark("dark", frames=2, exposure_time_s=0.01),
        flat("flat-1", 300.0, frames=2, exposure_time_s=0.01, light=300.0),
    ]
    simulate(BASE, shots, 16, 24, out, seed=5)
    return out


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """Return a camera.toml; it comes from a diagnosis, as it may."""
    write_finding(NOTHING, tmp_path / "model", maps=half_maps())
    return tmp_path / "model" / "camera.toml"


def half_maps() -> SensorMaps:
    """Return maps of a sensor whose right half sees 1.5 times as much."""
    gains = np.where(np.arange(24) < 12, 0.8, 1.2) * np.ones((16, 1))
    return SensorMaps(np.zeros((16, 24), np.float32), gains.astype(np.float32))


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return what the search was asked; it finds row noise in everything."""
    asked: list[dict[str, Any]] = []

    def find(camera: Camera, recording: object, **rest: Any) -> Finding:
        rest["progress"](1, 2, "searching")
        asked.append({"camera": camera, "recording": recording, **rest})
        return FOUND

    monkeypatch.setattr(folders, "find_mismatch", find)
    return asked


def test_command_writes_a_model_that_simulates(
    recording: Path, model: Path, searches: list[dict[str, Any]], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    arguments = ["mismatch", str(model), str(recording), "-o", str(out)]
    without = ["--without", "dsnu", "prnu"]
    assert main([*arguments, "--seed", "3", "--jobs", "2", *without]) == 0
    (asked,) = searches
    assert (asked["seed"], asked["jobs"]) == (3, 2)
    assert asked["vocabulary"] == VOCABULARY - {"dsnu", "prnu"}
    found = out / "camera.toml"
    assert read_camera(found) == CAMERA
    assert "row_noise: sigma 3.20 ± 0.10 DN" in found.read_text(encoding="utf-8")
    assert "not allowed to be named: dsnu, prnu" in found.read_text(encoding="utf-8")
    made = str(tmp_path / "made")
    like = ["camera", "simulate", str(found), "--like", str(recording), "-o", made]
    assert main([*like, "--same-sensor"]) == 0
    again = read_recording(Path(made))
    mean = np.mean([f - 100.0 for f in again.frames(again.exposure("flat-1"))], axis=0)
    # Halves of 300 DN, 13 DN of noise in 384 samples each and common rows: 0.5 % of the ratio.
    assert mean[:, 12:].mean() / mean[:, :12].mean() == pytest.approx(1.5, abs=5 * 1.5 * 0.005)


@pytest.mark.parametrize("finding", [FOUND, NOTHING])
def test_status_is_0_whatever_is_found(
    finding: Finding,
    recording: Path,
    model: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(folders, "find_mismatch", lambda *_, **__: finding)
    assert main(["mismatch", str(model), str(recording), "-o", str(tmp_path / "out")]) == 0
    assert f"**{finding.verdict}**" in capsys.readouterr().out
    assert strict(tmp_path / "out" / "mismatch.json")["verdict"] == finding.verdict


@pytest.mark.usefixtures("searches")
def test_several_recordings_get_a_folder_each_and_a_table(
    recording: Path, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    both = [str(recording), str(recording)]
    assert main(["mismatch", str(model), *both, "-o", str(out), "--jobs", "1"]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["recording", "recording-2"]
    first, second = (strict(p / "mismatch.json") for p in sorted(out.iterdir()))
    assert first == second
    table = [line for line in capsys.readouterr().out.splitlines() if "| omitted_physics |" in line]
    assert [line.split(" | ")[0] for line in table] == ["| recording", "| recording-2"]


def test_recordings_side_by_side_are_those_one_by_one(
    recording: Path, model: Path, tmp_path: Path
) -> None:
    made = []
    for jobs in ("1", "2"):
        out = tmp_path / jobs
        command = ["mismatch", str(model), str(recording), str(recording), "-o", str(out)]
        assert main([*command, "--jobs", jobs]) == 0
        made.append([(folder / "mismatch.json").read_bytes() for folder in sorted(out.iterdir())])
    assert len(made[0]) == 2
    assert made[0] == made[1]


def test_bad_input_is_refused_before_the_search(
    recording: Path,
    model: Path,
    searches: list[dict[str, Any]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out, ours = tmp_path / "out", tmp_path / "precious"
    ours.mkdir()
    (ours / "thesis.tex").write_text("years of work")
    other = tmp_path / "bayer.toml"
    text = model.read_text(encoding="utf-8").replace("MONO", "RGGB").replace("4095", "1023")
    other.write_text(text.replace("bit_depth = 12", "bit_depth = 10"), encoding="utf-8")
    good = [str(model), str(recording), "-o"]
    cases = {
        "did you mean row_noise": [*good, str(out), "--without", "row_nose", "dsnu"],
        "holds no mismatch.json": [*good, str(ours)],
        "sensor.white_level": [str(other), str(recording), "-o", str(out)],
        "sensor.cfa": [str(other), str(recording), "-o", str(out)],
        "none.toml": [str(tmp_path / "none.toml"), str(tmp_path / "nowhere"), "-o", str(out)],
        "nowhere": [str(tmp_path / "none.toml"), str(tmp_path / "nowhere"), "-o", str(out)],
    }
    for says, arguments in cases.items():
        assert main(["mismatch", *arguments]) == 2
        said = capsys.readouterr().err
        assert says in said
        assert all(line.startswith("dsis: ") for line in said.splitlines())
    assert not searches
    assert not out.exists()
    assert (ours / "thesis.tex").read_text() == "years of work"


def test_an_earlier_result_stays_until_the_next_is_complete(
    recording: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    write_finding(FOUND, out)
    before = (out / "mismatch.json").read_bytes()

    def breaks(*_: object, **__: object) -> Finding:
        raise KeyboardInterrupt

    arguments = ["mismatch", str(model), str(recording), "-o", str(out)]
    monkeypatch.setattr(folders, "find_mismatch", breaks)
    assert main(arguments) == 130
    assert (out / "mismatch.json").read_bytes() == before
    monkeypatch.setattr(folders, "find_mismatch", lambda *_, **__: NOTHING)
    assert main(arguments) == 0
    assert strict(out / "mismatch.json")["verdict"] == "match"
    assert not (tmp_path / "out.partial").exists()
    (out / "notes.txt").write_text("mine")
    assert main(arguments) == 2
    assert (out / "notes.txt").read_text() == "mine"
