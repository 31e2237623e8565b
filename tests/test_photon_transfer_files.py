"""Promise: a fitted camera is written whole: what reads it back makes the same recording again."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.photon_transfer import fit_camera, fit_values, summary, write_fit
from dsis.camera import read_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import registry
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.simulate import read_maps
from dsis.simulate.maps import owner_of
from folder_bytes import every_byte
from planted_camera import ONE, TWO, Z_MAX, record


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


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text + '\n[[effect]]\nkind = "row_noise"\nsigma_dn = 3.2\n',
        lambda text: text.replace("slope = ", "slope = 1", 1),
        lambda _: "[notes]\n",
    ],
)
def test_what_dsis_did_not_write_is_not_overwritten(
    tmp_path: Path, change: Callable[[str], str]
) -> None:
    fit, path = fit_camera(record(ONE, 2)), tmp_path / "camera.toml"
    write_fit(fit, path)
    path.write_text(change(path.read_text()))
    before = every_byte(tmp_path)
    with pytest.raises(InputError) as refused:
        write_fit(fit, path)
    says = str(refused.value)
    assert says.startswith(f"{path}: has no checksum of dsis")
    assert says.endswith("or was changed since, and would be lost: give another name")
    assert every_byte(tmp_path) == before


def test_an_empty_file_holds_nothing_that_would_be_lost(tmp_path: Path) -> None:
    path = tmp_path / "camera.toml"
    path.touch()
    write_fit(fit_camera(record(ONE, 2)), path)
    assert path.stat().st_size


def test_a_place_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match=r"camera\.toml: lies below .*file, which is a file"):
        write_fit(fit_camera(record(ONE, 2)), tmp_path / "file" / "camera.toml")


def test_a_file_that_was_copied_with_other_ends_of_lines_is_unchanged(tmp_path: Path) -> None:
    fit, path = fit_camera(record(ONE, 2)), tmp_path / "camera.toml"
    write_fit(fit, path)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    write_fit(fit, path)
    assert b"\r" not in path.read_bytes()


def test_the_maps_of_another_camera_are_not_overwritten(tmp_path: Path) -> None:
    fit = fit_camera(record(TWO, 2))
    write_fit(fit, tmp_path / "a.toml")
    maps = tmp_path / "maps.npz"
    for other in (fit, replace(fit, maps=None)):
        assert maps not in write_fit(other, tmp_path / "b.toml")
        assert read_camera(tmp_path / "b.toml").noise == fit.camera.noise
        assert owner_of(maps) == "a.toml"
    (tmp_path / "a.toml").unlink()
    write_fit(fit, tmp_path / "b.toml")
    assert owner_of(tmp_path / "maps.npz") == "b.toml"
    (tmp_path / "maps.npz").write_bytes(b"a map of mine")
    with pytest.raises(InputError, match=r"maps\.npz: camera: does not say whose patterns"):
        write_fit(fit, tmp_path / "b.toml")
    assert (tmp_path / "maps.npz").read_bytes() == b"a map of mine"


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
