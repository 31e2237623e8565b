"""Dark currents that differ between pixels: the effect, its law in maps, and camera fit."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import lognorm

from analysis import currentspread
from analysis.currentlaw import Body, of_all
from analysis.currentspread import current_spread
from analysis.photon_transfer import fit_camera
from dsis.camera import read_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects.dark_current import DarkCurrent
from dsis.effects.effect import Exposure, ReadOut
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.noise import Segments
from dsis.recording import read_recording
from dsis.simulate.maps import SensorMaps, read_maps, with_maps, write_maps

ROWS, COLUMNS = 96, 128
NOTHING = np.zeros((ROWS, COLUMNS), bool)


def charge_of(effect: DarkCurrent, sensor: int, time_s: float) -> np.ndarray:
    """Return what a sensor collects in darkness, DN."""
    grid = PixelGrid(ROWS, COLUMNS, Cfa.MONO)
    dark = np.zeros((ROWS, COLUMNS), np.float32)
    read_out = ReadOut(Cfa.MONO, Segments.of([(0.0, 1.0, 1.0)]), 0.0, 4095.0)
    exposure = Exposure(grid, 0, Draw(0), Draw(sensor), dark, read_out, lambda _: dark, time_s)
    return effect.apply(dark, exposure)


def currents(mean: float, sigma: float, seed: int) -> np.ndarray:
    """Return dark currents by numpy's own log-normal law: (row, column)."""
    law = np.random.default_rng(seed)
    made: np.ndarray = law.lognormal(np.log(mean) - sigma**2 / 2, sigma, (ROWS, COLUMNS))
    return made


def test_pixels_follow_the_log_normal_law_of_scipy_and_grow_with_time() -> None:
    """Quantiles against scipy's; the same pixels are bright at every time and in every frame."""
    effect = DarkCurrent(dn_per_s=50.0, log_sigma=0.7)
    short, long = charge_of(effect, 3, 0.1), charge_of(effect, 3, 0.4)
    np.testing.assert_allclose(long, 4 * short, rtol=1e-5)
    law = lognorm(0.7, scale=20 * np.exp(-(0.7**2) / 2))
    shares = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    error = np.sqrt(shares * (1 - shares) / long.size)
    below = [(long < law.ppf(share)).mean() for share in shares]
    assert (np.abs(np.array(below) - shares) < 4 * error).all()
    assert long.mean() == pytest.approx(20, abs=4 * law.std() / np.sqrt(long.size))


def test_equal_dark_currents_stay_as_they_were() -> None:
    """Without a spread nothing is drawn, and camera files say nothing of one."""
    effect = DarkCurrent(dn_per_s=50.0)
    assert (charge_of(effect, 3, 0.4) == np.float32(20)).all()
    assert "log_sigma" not in effect.model_dump()
    assert effect.changes == {"level", "pixel_variance"}
    assert "fixed_pixel_variance" in DarkCurrent(dn_per_s=50.0, log_sigma=0.1).changes


@pytest.mark.parametrize("sigma", [0.15, 0.6, 1.2])
@pytest.mark.parametrize("shot", [0.0, 0.6])
def test_a_spread_is_measured_as_it_was_drawn(sigma: float, shot: float) -> None:
    """Of numpy's currents with noise, some of which is their own shot noise: within 4 errors."""
    mean, noise = 12.0, 2.0
    for seed in range(3):
        own = currents(mean, sigma, seed)
        law = np.random.default_rng(100 + seed)
        scale = noise * np.sqrt(1 - shot + shot * own / mean)
        image = own + scale * law.standard_normal(own.shape)
        found = current_spread([(image, noise, NOTHING)], float(own.mean()), 0.0, shot)
        assert found is not None
        assert abs(found.log_sigma - sigma) < 4 * found.error + 0.01 * sigma
        assert found.error < 0.1 * sigma
        assert found.gain > 50


def test_lines_and_glows_are_no_spread() -> None:
    """Row noise and what is smooth leave equal currents equal, and others as they are."""
    law = np.random.default_rng(5)
    noise = law.standard_normal((ROWS, COLUMNS))
    lines = 3 * law.standard_normal((ROWS, 1)) + 20 * np.exp(-np.arange(COLUMNS) / 30)
    found = current_spread([(noise + lines, 1.0, NOTHING)], 5.0)
    assert found is None or found.gain < 3
    own = currents(8.0, 0.4, 6)
    found = current_spread([(own + noise + lines, 1.0, NOTHING)], 8.0)
    assert found is not None
    assert found.log_sigma == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize(("share", "mean"), [(0.01, 60), (0.005, 500), (0.002, 1000)])
def test_hot_pixels_alone_are_no_spread_and_beside_one_leave_it(share: float, mean: float) -> None:
    """An exponential few: of all pixels' law nothing is said, or what it is without them.

    Though they have up to a quarter of the mean of all.
    """
    law = np.random.default_rng(7)
    few = law.random((ROWS, COLUMNS)) < share
    hot = np.where(few, law.exponential(mean, (ROWS, COLUMNS)), 0)
    noise = law.standard_normal((ROWS, COLUMNS))
    found = current_spread([(5 + hot + noise, 1.0, NOTHING)], 5 + float(hot.mean()))
    assert found is None or found.gain < 3
    image = currents(8.0, 0.5, 8) + hot
    found = current_spread([(image + noise, 1.0, NOTHING)], float(image.mean()))
    assert found is not None
    # About the mean of all: the others' spread is as many DN.
    expected = of_all(0.5, 8.0 / float(image.mean()))
    assert found.log_sigma == pytest.approx(expected, abs=4 * found.error)


def test_a_mean_that_may_be_far_off_tells_no_spread_beyond_all_bounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Hot pixels and a glow alone: a wide spread of few pixels leaves their mean open."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:48, :64]
    rate = (rng.random((48, 64)) < 0.01) * rng.exponential(300, (48, 64))
    rate += 60 * np.exp(-np.hypot(47 - y, 63 - x) / 13)
    seen = rate + rng.normal(0, 2.5, (48, 64))
    monkeypatch.setattr(currentspread, "_own", lambda *_: 60.0)
    found = current_spread([(seen - seen.mean(), 2.5, np.zeros((48, 64), bool))], 0.1, shot=1.0)
    assert found is not None
    assert 1.0 < found.error < np.inf


def test_errors_know_that_the_law_is_another() -> None:
    """Normal currents, 30 % of the mean apart: an error three times as large, and nearly that."""
    law = np.random.default_rng(9)
    image = 40 * (1 + 0.3 * law.standard_normal((ROWS, COLUMNS)))
    own = currents(40.0, 0.294, 9)
    noise = law.standard_normal((ROWS, COLUMNS))
    found = [
        current_spread([(one + noise, 1.0, NOTHING)], float(one.mean())) for one in (image, own)
    ]
    assert found[0] is not None
    assert found[1] is not None
    assert found[0].error > 2 * found[1].error
    assert found[0].log_sigma == pytest.approx(0.294, rel=0.2)


def test_no_map_says_nothing() -> None:
    """Nor does one without noise, or pixels, or a mean."""
    image = np.random.default_rng(1).standard_normal((ROWS, COLUMNS))
    assert current_spread([], 5.0) is None
    assert current_spread([(image, 0.0, NOTHING)], 5.0) is None
    assert current_spread([(image, 1.0, ~NOTHING)], 5.0) is None
    assert current_spread([(image, 1.0, NOTHING)], 0.0) is None


@settings(max_examples=40, deadline=None)
@given(
    mean=st.floats(0.05, 300.0), sigma=st.floats(0.01, 2.0), width=st.floats(0.7, 2.0),
    shot=st.floats(0.0, 0.9),
)  # fmt: skip
def test_the_body_is_a_density_about_its_median(
    mean: float, sigma: float, width: float, shot: float
) -> None:
    """It integrates to 1, and half of it lies below 0."""
    body = Body(mean, sigma, shot)
    reach = 12 * (width + mean * np.exp(3 * sigma))
    x = np.sort(
        np.concatenate([np.linspace(-60 - mean, 60, 20001), np.geomspace(60, reach + 61, 3000)])
    )
    density = body.density(x, width)
    own = np.concatenate([[0.0], np.cumsum(np.diff(x) * (density[1:] + density[:-1]) / 2)])
    assert own[-1] == pytest.approx(1.0, abs=0.01)
    assert np.interp(0.0, x, own) == pytest.approx(0.5, abs=0.01)


def recorded(folder: Path, sigma: float) -> Path:
    """Write darks of three times and flats of a numpy camera: 40 DN/s, offsets of 0.6 DN."""
    law = np.random.default_rng(11)
    own, k, read, black = currents(40.0, sigma, 12), 0.5, 3.0, 100
    prnu = 1 + 0.006 * law.standard_normal((ROWS, COLUMNS))
    dsnu = 0.6 * law.standard_normal((ROWS, COLUMNS))
    text = ['[sensor]\nname = "numpy"\ncfa = "MONO"\nblack_level = 100\nwhite_level = 4095\n']
    text.append("bit_depth = 12\n")
    times = [("dark-0", 0.005, 0), ("dark-1", 0.1, 0), ("dark-2", 0.4, 0)]
    times += [(f"flat-{i}", 0.02, light) for i, light in enumerate((300, 1000, 2500, 5000))]
    for name, time, light in times:
        for t in range(6):
            electrons = law.poisson(prnu * light + own * time / k)
            signal = k * (electrons + read * law.standard_normal(own.shape)) + dsnu
            codes = np.clip(np.round(black + signal), 0, 4095).astype(np.uint16)
            np.save(folder / f"{name}_{t}.npy", codes)
        kind = "flat" if light else "dark"
        text.append(f'[[exposure]]\nname = "{name}"\nkind = "{kind}"\nexposure_time_s = {time}\n')
        text.append((f"light = {light}.0\n" if light else "") + f'frames = ["{name}_*.npy"]\n')
    (folder / "recording.toml").write_text("".join(text))
    return folder


@pytest.mark.parametrize("sigma", [0.0, 0.7])
def test_camera_fit_tells_offsets_and_gains_from_dark_currents(
    tmp_path: Path, sigma: float
) -> None:
    """Pixels' own currents are in no offset and in no gain: 8 times the offsets' spread, else."""
    fit = fit_camera(read_recording(recorded(tmp_path, sigma)))
    found = {effect.kind: effect for effect in fit.effects}
    current = found["dark_current"]
    assert abs(current.value - 40) < 4 * current.standard_error
    assert current.effect.log_sigma == pytest.approx(sigma, abs=max(4 * current.beside_error, 1e-9))
    assert found["dsnu"].value == pytest.approx(0.6, abs=0.04)
    assert found["prnu"].value == pytest.approx(0.6, abs=0.03)
    assert ("log_sigma" in current.beside) == bool(sigma)


def test_the_same_sensor_has_its_own_dark_currents(tmp_path: Path) -> None:
    """Maps beside the camera hold them: simulated again, long darks are as they were recorded."""
    recording = read_recording(recorded(tmp_path, 0.7))
    fit = fit_camera(recording)
    assert fit.maps is not None
    current = fit.maps.dark_current_dn_per_s
    assert current is not None
    assert np.corrcoef(current.ravel(), currents(40.0, 0.7, 12).ravel())[0, 1] > 0.98
    (tmp_path / "fit").mkdir()
    file = tmp_path / "fit" / "camera.toml"
    write_maps(fit.maps, file)
    again = read_maps(file)
    assert again.dark_current_dn_per_s is not None
    np.testing.assert_array_equal(again.dark_current_dn_per_s, current)
    grid = PixelGrid(ROWS, COLUMNS, Cfa.MONO)
    same = with_maps(fit.camera, again, grid)
    assert "dark_current" not in {effect.kind for effect in same.effect}
    dark = np.zeros((ROWS, COLUMNS), np.float32)
    frames = [same.expose(dark, Draw(1), Draw(2), t, grid, exposure_time_s=0.4) for t in range(6)]
    exposure = next(e for e in recording.exposures if e.name == "dark-2")
    seen = np.mean([recording.frame(exposure, t) for t in range(6)], 0)
    assert np.corrcoef(np.mean(frames, 0).ravel(), seen.ravel())[0, 1] > 0.97
    assert np.mean(frames) == pytest.approx(seen.mean() - fit.black_dn, abs=0.1)


@pytest.mark.parametrize(
    ("array", "says"),
    [(np.full((2, 3), -1.0), "holds a current < 0"), (np.ones((3, 3)), "must be \\(2, 3\\)")],
)
def test_a_map_that_is_no_dark_current_is_refused(
    tmp_path: Path, array: np.ndarray, says: str
) -> None:
    ones = np.ones((2, 3), np.float32)
    write_maps(SensorMaps(ones, ones, 0.0, 0.0, array), tmp_path / "camera.toml")
    with pytest.raises(InputError, match=says):
        read_maps(tmp_path / "camera.toml")


def test_a_camera_file_holds_the_spread(tmp_path: Path) -> None:
    """What is fitted is what is read."""
    path = tmp_path / "camera.toml"
    path.write_text(
        'schema = "dsis-camera/1"\nname = "a"\ncfa = "MONO"\nblack_level = 100.0\n'
        "white_level = 4095.0\nbit_depth = 12\n[noise]\n[[noise.segment]]\nslope = 0.5\n"
        'intercept = 2.0\n[[effect]]\nkind = "dark_current"\ndn_per_s = 40.0\nlog_sigma = 0.7\n'
    )
    (effect,) = read_camera(path).effect
    assert effect == DarkCurrent(dn_per_s=40.0, log_sigma=0.7)
