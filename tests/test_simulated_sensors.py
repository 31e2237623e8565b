"""Promise: a sensor whose maps are known is simulated again, with no other pattern."""

from pathlib import Path

import numpy as np
import pytest

from dsis.effects import registry
from dsis.errors import InputError
from dsis.recording import ExposurePlan
from dsis.simulate import SensorMaps, Shot, dark, flat, read_maps, simulate_like, write_maps
from simulated_stacks import (
    BLACK,
    COLUMNS,
    ROWS,
    SHOTS,
    SITES,
    Z_MAX,
    camera_of,
    recorded,
    site,
    stack,
    variance_dn2,
)


class TestSameSensor:
    def maps(self) -> SensorMaps:
        rng = np.random.default_rng(5)
        offsets = rng.normal(0, 12, (ROWS, COLUMNS)).astype(np.float32)
        gains = rng.normal(1, 0.03, (ROWS, COLUMNS)).astype(np.float32)
        for row, column in SITES:
            site(offsets, (row, column))[:] -= site(offsets, (row, column)).mean()
            site(gains, (row, column))[:] /= site(gains, (row, column)).mean()
        return SensorMaps(offsets, gains)

    def test_mean_frames_show_the_maps_and_no_other_pattern(self, tmp_path: Path) -> None:
        maps = self.maps()
        shots = [
            dark("dark", frames=12, exposure_time_s=0.01),
            flat("flat", 1500.0, frames=12, exposure_time_s=0.01),
        ]
        like = recorded(tmp_path / "real", shots)
        camera = camera_of(effects=[registry()["prnu"](sigma_percent=5.0)])
        made = simulate_like(camera, like, tmp_path / "made", maps=maps)
        for name, level in (("dark", 0.0), ("flat", 1500.0)):
            signal = level * maps.prnu_gain
            left = stack(made, name).mean(0) - BLACK - signal - maps.dsnu_dn
            z = (left - left.mean()) / np.sqrt(variance_dn2(signal) / 12)
            assert abs(z.var() - 1) < Z_MAX * np.sqrt(2 / z.size)

    def test_a_scene_gets_the_pattern_once(self, tmp_path: Path) -> None:
        maps = self.maps()
        light = np.full((ROWS, COLUMNS), 1500, np.float32) * maps.prnu_gain + maps.dsnu_dn
        shots = [
            dark("dark", frames=12, exposure_time_s=0.01),
            Shot(ExposurePlan("scene", "scene", 0.01, 12), lambda _: light.copy()),
        ]
        like = recorded(tmp_path / "real", shots)
        made = simulate_like(camera_of(), like, tmp_path / "made", maps=maps)
        left = stack(made, "scene").mean(0) - BLACK - light
        variance = 2 * variance_dn2(1500) / 12
        assert abs(left.var() - variance) < Z_MAX * variance * np.sqrt(2 / left.size)

    def test_maps_are_read_as_written(self, tmp_path: Path) -> None:
        maps = self.maps()
        write_maps(maps, tmp_path / "camera.toml")
        again = read_maps(tmp_path / "camera.toml")
        np.testing.assert_array_equal(again.dsnu_dn, maps.dsnu_dn)
        np.testing.assert_array_equal(again.prnu_gain, maps.prnu_gain)
        first = (tmp_path / "maps.npz").read_bytes()
        write_maps(maps, tmp_path / "camera.toml")
        assert (tmp_path / "maps.npz").read_bytes() == first

    def test_maps_that_cannot_be_used(self, tmp_path: Path) -> None:
        camera_file = tmp_path / "camera.toml"
        with pytest.raises(InputError, match=r"maps\.npz: is missing"):
            read_maps(camera_file)
        (tmp_path / "maps.npz").write_bytes(b"PK and no more")
        with pytest.raises(InputError, match="is damaged"):
            read_maps(camera_file)
        np.savez(tmp_path / "maps.npz", dsnu_dn=np.full((3, 4), np.nan))
        with pytest.raises(InputError) as refused:
            read_maps(camera_file)
        assert len(refused.value.faults) == 2
        write_maps(SensorMaps(np.zeros((3, 4)), np.zeros((3, 4))), camera_file)
        with pytest.raises(InputError, match="gain <= 0"):
            read_maps(camera_file)
        like = recorded(tmp_path / "real", SHOTS)
        small = SensorMaps(np.zeros((3, 4), np.float32), np.ones((3, 4), np.float32))
        with pytest.raises(InputError, match="is of 3 x 4 pixels, must be of 64 x 96"):
            simulate_like(camera_of(), like, tmp_path / "made", maps=small)
