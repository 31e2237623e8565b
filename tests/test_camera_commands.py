"""Promise: from a recording to a camera model and back, by the two commands that users type."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from analysis.photon_transfer import fit_camera
from dsis.camera import BaseNoise, Camera, Segment, read_camera, write_camera
from dsis.cfa import Cfa
from dsis.cli import main
from dsis.effects import registry
from dsis.recording import read_recording
from dsis.simulate import dark, flat, simulate, simulate_like
from folder_bytes import every_byte

LEVELS_DN = (100.0, 300.0, 700.0, 1500.0, 2600.0)
PLANTED = Camera(
    name="planted",
    cfa=Cfa.RGGB,
    black_level=100.0,
    white_level=4095.0,
    bit_depth=12,
    noise=BaseNoise(segment=(Segment(slope=0.5, intercept=20.0),)),
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("camera") / "recording"
    levels = [
        flat(f"flat-{level:g}", level, frames=8, exposure_time_s=0.01, light=level)
        for level in LEVELS_DN
    ]
    shots = [dark("dark", frames=8, exposure_time_s=0.01), *levels]
    simulate(PLANTED, shots, 64, 96, out, seed=5, jobs=2)
    return out


def test_fit_and_simulate_close_the_loop(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "camera.toml"
    assert main(["camera", "fit", str(recording), "-o", str(model)]) == 0
    assert "slope" in capsys.readouterr().out
    segment = read_camera(model).noise.segment[0]
    assert abs(segment.slope - 0.5) < 5 * segment.slope_se
    assert abs(segment.intercept - 20.0) < 5 * segment.intercept_se
    out = tmp_path / "simulated"
    assert main(["camera", "simulate", str(model), "--like", str(recording), "-o", str(out)]) == 0
    made, given = read_recording(out), read_recording(recording)
    assert [e.name for e in made.exposures] == [e.name for e in given.exposures]
    for a, b in zip(made.exposures, given.exposures, strict=True):
        levels = [np.mean([f.mean() for f in r.frames(e)]) for r, e in ((made, a), (given, b))]
        # The mean of 8 frames of 6144 pixels is known to a fifth of a code even at full light.
        assert abs(levels[0] - levels[1]) < 1.0, a.name


def test_effects_can_be_appended_to_what_a_fit_wrote(recording: Path, tmp_path: Path) -> None:
    model = tmp_path / "camera.toml"
    assert main(["camera", "fit", str(recording), "-o", str(model)]) == 0
    with model.open("a", encoding="utf-8") as file:
        file.write('\n[[effect]]\nkind = "row_noise"\nsigma_dn = 3.0\n')
    assert registry()["row_noise"](sigma_dn=3.0) in read_camera(model).effect


def test_the_description_of_a_recording_is_not_overwritten_by_a_fit(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = tmp_path / "made"
    shutil.copytree(recording, made)
    before = every_byte(made)
    assert main(["camera", "fit", str(made), "-o", str(made / "recording.toml")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        f"dsis: {made / 'recording.toml'}: has no checksum of dsis (of another hand, "
    )
    assert every_byte(made) == before


def test_what_cannot_be_fitted_gets_a_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments in (
        ["camera", "fit", str(tmp_path), "-o", str(tmp_path / "camera.toml")],
        ["camera", "simulate", str(tmp_path / "no.toml"), "--like", str(tmp_path), "-o", "x"],
    ):
        assert main(arguments) == 2
        assert capsys.readouterr().err.startswith("dsis: ")


def test_messages_name_the_file_that_was_given(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    few, mono = tmp_path / "few", tmp_path / "mono.toml"
    simulate(PLANTED, [flat("flat", 900.0, frames=2, exposure_time_s=0.01)], 8, 8, few, seed=1)
    write_camera(PLANTED.model_copy(update={"cfa": Cfa.MONO}), mono)
    for arguments, file, key in (
        (["fit", str(few), "-o", str(tmp_path / "camera.toml")], few, "exposure"),
        (["simulate", str(mono), "--like", str(recording), "-o", "x"], mono, "cfa"),
    ):
        assert main(["camera", *arguments]) == 2
        assert capsys.readouterr().err.startswith(f"dsis: {file}: {key}: ")


def test_a_simulated_recording_that_was_fitted_in_place_keeps_its_model(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = tmp_path / "made"
    shutil.copytree(recording, made)
    assert main(["camera", "fit", str(made), "-o", str(made / "camera.toml")]) == 0
    before = every_byte(made)
    again = ["camera", "simulate", str(made / "camera.toml"), "--like", str(recording)]
    assert main([*again, "-o", str(made)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"dsis: {made}: holds camera-distribution.png, camera-fit.json, ")
    assert said.endswith(" and 1 more, which would be lost: give another folder\n")
    assert every_byte(made) == before


def test_the_same_sensor_with_the_recordings_own_seed(tmp_path: Path) -> None:
    """Neither its noise, which is in the maps, nor its pattern, which they miss, comes twice."""
    sigma = {"dsnu": 1.0, "prnu": 0.5}
    effects = (
        registry()["dsnu"].model_validate({"sigma_dn": sigma["dsnu"]}),
        registry()["prnu"].model_validate({"sigma_percent": sigma["prnu"]}),
    )
    shots = [dark("dark", frames=8, exposure_time_s=0.01)]
    shots += [flat(f"flat-{n}", n, frames=8, exposure_time_s=0.01) for n in (500, 1500, 2500)]
    made = PLANTED.model_copy(update={"effect": effects})
    first = simulate(made, shots, 64, 96, tmp_path / "first", seed=5)
    fit = fit_camera(first)
    again = fit_camera(simulate_like(fit.camera, first, tmp_path / "again", seed=5, maps=fit.maps))
    for kind, planted in sigma.items():
        for found in (e for f in (fit, again) for e in f.effects if e.kind == kind):
            assert abs(found.value - planted) < 5 * found.standard_error, kind


def test_a_new_sensor_with_the_recordings_own_seed(tmp_path: Path) -> None:
    """Neither pattern nor noise of a simulated recording comes again, nor that of the one before.

    Oracle: correlation of 6144 pixels, whose standard error is 1 / sqrt(6144).
    """
    effects = (registry()["dsnu"].model_validate({"sigma_dn": 20.0}),)
    made = PLANTED.model_copy(update={"effect": effects})
    shots = [dark("dark", frames=2, exposure_time_s=0.01)]
    generations = [simulate(made, shots, 64, 96, tmp_path / "0", seed=5)]
    for n in (1, 2):
        generations.append(simulate_like(made, generations[-1], tmp_path / f"{n}", seed=5))
    frames = [r.frame(r.exposures[0], 0).ravel() for r in generations]
    other = np.corrcoef(frames)[np.triu_indices(3, 1)]
    assert np.abs(other).max() < 5 / np.sqrt(64 * 96)
