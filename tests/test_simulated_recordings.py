"""Promise: a simulated recording has the layout, the levels and the noise it is asked for."""

from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pytest

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, Stage, registry
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.recording import (
    ExposurePlan,
    Recording,
    Sensor,
    origin_of,
    read_recording,
    write_recording,
)
from dsis.simulate import Shot, dark, flat, simulate, simulate_like, simulated_frames
from folder_bytes import every_byte
from simulated_stacks import (
    BLACK,
    COLUMNS,
    INTERCEPT,
    ROWS,
    SHOTS,
    SITES,
    WHITE,
    Z_MAX,
    camera_of,
    recorded,
    site,
    stack,
    variance_dn2,
)


class Falloff(Effect):
    """Light that falls off linearly to 60 % along the columns: shifts every mean by a factor."""

    kind: Literal["test_falloff"] = "test_falloff"
    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "this file"
    measures: ClassVar[frozenset[str]] = frozenset({"level"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply columns by 1 .. 0.6."""
        return image * np.linspace(1, 0.6, exposure.grid.columns, dtype=np.float32)


class Thermal(Effect):
    """Charge in proportion to exposure time, without light."""

    kind: Literal["test_thermal"] = "test_thermal"
    dn_per_s: float = 3000.0
    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "this file"
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the dark signal."""
        return image + np.float32(self.dn_per_s * exposure.exposure_time_s)


class Bend(Effect):
    """A response that loses 10 % at 3000 DN."""

    kind: Literal["test_bend"] = "test_bend"
    stage: ClassVar[Stage] = Stage.CHARGE
    reference: ClassVar[str] = "this file"
    measures: ClassVar[frozenset[str]] = frozenset({"level"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Subtract a parabola."""
        del exposure
        bent: Image = image - np.float32(0.1 / 3000) * image**2
        return bent


def assert_mean(values: np.ndarray, expected: float, variance: float, extra: float = 0.0) -> None:
    """`extra` is the variance that the expectation itself has."""
    z = (values.mean() - expected) / np.sqrt(variance / values.size + extra)
    assert abs(z) < Z_MAX, f"{values.mean():.4f}, expected {expected:.4f}"


class TestStatedLayout:
    @pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GBRG])
    def test_levels_and_variances_are_those_of_the_model(self, tmp_path: Path, cfa: Cfa) -> None:
        made = simulate(camera_of(cfa), SHOTS, ROWS, COLUMNS, tmp_path / "r", seed=4)
        assert [e.plan for e in made.exposures] == [shot.plan for shot in SHOTS]
        assert made.sensor.cfa == cfa
        levels = {"dark": 0.0, "low": 50.0, "colours": np.array([[900, 400], [410, 200]])}
        for name, level in levels.items():
            frames = stack(made, name)
            for place in SITES:
                wanted = float(np.broadcast_to(level, (2, 2))[place])
                values, variance = site(frames, place), variance_dn2(wanted)
                assert_mean(values, wanted + BLACK, variance)
                # Every frame against the mean of all: T - 1 degrees of freedom a pixel.
                found = values.var(axis=0, ddof=1)
                error = variance * np.sqrt(2 / (values.shape[0] - 1) / found.size)
                assert abs(found.mean() - variance) < Z_MAX * error

    def test_a_seed_fixes_every_byte_whatever_the_jobs(self, tmp_path: Path) -> None:
        effects = (registry()["prnu"](sigma_percent=2.0), registry()["row_noise"](sigma_dn=3.0))
        camera, made = camera_of(effects=effects), []
        for jobs in (1, 2, 3):
            simulate(camera, SHOTS, ROWS, COLUMNS, tmp_path / f"{jobs}", seed=9, jobs=jobs)
            made.append(every_byte(tmp_path / f"{jobs}"))
        assert made[0] == made[1] == made[2]
        simulate(camera, SHOTS, ROWS, COLUMNS, tmp_path / "other", seed=10)
        assert every_byte(tmp_path / "other") != made[0]

    def test_frames_without_files_are_those_of_the_files(self, tmp_path: Path) -> None:
        made = simulate(camera_of(), SHOTS, ROWS, COLUMNS, tmp_path / "r", seed=2)
        grid = PixelGrid(ROWS, COLUMNS, Cfa.RGGB)
        frames = simulated_frames(camera_of(), SHOTS, grid, seed=2, jobs=2)
        read = [codes for e in made.exposures for codes in made.frames(e)]
        np.testing.assert_array_equal(list(frames), read)

    def test_one_sensor_serves_all_exposures_and_each_has_its_own_noise(
        self, tmp_path: Path
    ) -> None:
        shots = [flat(n, 1000.0, frames=8, exposure_time_s=0.01) for n in ("a", "b")]
        camera = camera_of(Cfa.MONO, [registry()["prnu"](sigma_percent=2.0)])
        means, noise = {}, {}
        for seed in (1, 2):
            made = simulate(camera, shots, ROWS, COLUMNS, tmp_path / f"{seed}", seed=seed)
            for name in ("a", "b"):
                frames = stack(made, name)
                means[seed, name] = frames.mean(0)
                noise[seed, name] = frames[0] - frames[1]

        def correlation(one: np.ndarray, two: np.ndarray) -> float:
            return float(np.corrcoef(one.ravel(), two.ravel())[0, 1])

        limit = Z_MAX / np.sqrt(ROWS * COLUMNS)
        # Pattern (20 DN)^2 against noise 530 / 8 DN^2 in each mean frame.
        assert abs(correlation(means[1, "a"], means[1, "b"]) - 400 / (400 + 530 / 8)) < limit
        assert abs(correlation(means[1, "a"], means[2, "a"])) < limit
        assert abs(correlation(noise[1, "a"], noise[1, "b"])) < limit

    def test_an_exposure_is_the_same_whatever_stands_beside_it(self, tmp_path: Path) -> None:
        whole = simulate(camera_of(), SHOTS, ROWS, COLUMNS, tmp_path / "whole", seed=1)
        alone = simulate(camera_of(), SHOTS[1:2], ROWS, COLUMNS, tmp_path / "alone", seed=1)
        np.testing.assert_array_equal(stack(whole, "low"), stack(alone, "low"))

    @pytest.mark.parametrize("black", [63.7, 255.31, 0.1])
    def test_black_levels_of_a_fraction_still_give_whole_codes(self, black: float) -> None:
        """Codes leave the camera less black, in float32; they are whole again with black added."""
        top = {"white_level": 65535.0, "bit_depth": 16}
        camera = camera_of(Cfa.MONO, black=black).model_copy(update=top)
        grid = PixelGrid(200, 300, Cfa.MONO)
        shot = flat("a", 30000.0, frames=1, exposure_time_s=0.01)
        (codes,) = simulated_frames(camera, [shot], grid, seed=3)
        noise = Draw(3).within("exposure", "a"), Draw(3).within("sensor")
        image = camera.expose(shot.clean(grid), *noise, 0, grid, exposure_time_s=0.01)
        np.testing.assert_array_equal(codes, np.rint(image.astype(np.float64) + black))


def assert_levels_agree(made: Recording, like: Recording, black_made: float) -> None:
    """Each site's mean above black agrees within the noise of both recordings."""
    for e in like.of_kind("flat"):
        ours, theirs = stack(made, e.name), stack(like, e.name)
        darks = [d.name for d in like.of_kind("dark") if d.exposure_time_s == e.exposure_time_s]
        for place in SITES:
            values = site(theirs, place)
            black = site(stack(like, darks[0]), place) if darks else np.array([100.0])
            wanted = values.mean() - black.mean() + black_made
            extra = values.var() / values.size + black.var() / black.size
            # 0.05 DN: the solver stops at 0.02 DN, its own noise is 1 DN / sqrt(1536).
            assert_mean(site(ours, place), wanted, site(ours, place).var(), extra + 0.05**2)


class TestLike:
    @pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
    def test_layout_and_levels_are_those_of_the_recording(self, tmp_path: Path, cfa: Cfa) -> None:
        flats = SHOTS[1:2] if cfa is Cfa.MONO else SHOTS[1:]
        shots = (SHOTS[0], *flats, dark("dark2", frames=6, exposure_time_s=0.02))
        like = recorded(tmp_path / "real", shots, cfa)
        made = simulate_like(camera_of(cfa), like, tmp_path / "made", seed=3, jobs=2)
        assert [e.plan for e in made.exposures] == [e.plan for e in like.exposures]
        assert (made.rows, made.columns, made.sensor.cfa) == (ROWS, COLUMNS, cfa)
        assert_levels_agree(made, like, BLACK)
        assert_mean(stack(made, "dark"), BLACK, variance_dn2(0))

    def test_seed_and_jobs(self, tmp_path: Path) -> None:
        like = recorded(tmp_path / "real", SHOTS)
        camera = camera_of(effects=[Falloff()])
        for name, seed, jobs in (("a", 1, 1), ("b", 1, 3), ("c", 2, 1)):
            simulate_like(camera, like, tmp_path / name, seed=seed, jobs=jobs)
        assert every_byte(tmp_path / "a") == every_byte(tmp_path / "b")
        assert every_byte(tmp_path / "a") != every_byte(tmp_path / "c")

    @pytest.mark.parametrize("effects", [[Falloff()], [Bend()], [Falloff(), Bend(), Thermal()]])
    def test_what_the_cameras_own_effects_do_to_a_mean_is_taken_off(
        self, tmp_path: Path, effects: list[Effect]
    ) -> None:
        shots = [
            dark("dark", frames=8, exposure_time_s=0.02),
            flat("low", 100.0, frames=8, exposure_time_s=0.02),
            flat("high", [[2000, 1500], [1400, 800]], frames=8, exposure_time_s=0.02),
        ]
        like = recorded(tmp_path / "real", shots)
        made = simulate_like(camera_of(effects=effects), like, tmp_path / "made")
        # Darks show what the camera adds without light; flats stand above that as they were.
        added = 3000 * 0.02 if len(effects) == 3 else 0.0
        bend = 0.1 / 3000 * added**2 if len(effects) == 3 else 0.0
        darkness = stack(made, "dark").mean() - BLACK
        # The bend acts on the shot noise too: E[x^2] = mean^2 + variance, 0.001 DN here.
        assert_mean(stack(made, "dark"), BLACK + added - bend, variance_dn2(added), 0.002**2)
        assert_levels_agree(made, like, BLACK + darkness)

    def test_without_darks_the_nominal_black_holds_and_dark_signal_is_part_of_the_level(
        self, tmp_path: Path
    ) -> None:
        shots = [flat("a", 300.0, frames=8, exposure_time_s=0.02)]
        like = recorded(tmp_path / "real", shots, effects=[Thermal()])
        assert abs(stack(like, "a").mean() - (100 + 300 + 60)) < 1
        made = simulate_like(camera_of(effects=[Thermal()]), like, tmp_path / "made")
        assert_levels_agree(made, like, BLACK)

    def test_a_wrong_nominal_black_does_not_matter_where_there_are_darks(
        self, tmp_path: Path
    ) -> None:
        """Thermal signal and pedestal are interpolated between darks at other times."""
        shots = [
            dark("d1", frames=8, exposure_time_s=0.01),
            dark("d3", frames=8, exposure_time_s=0.03),
            flat("a", 300.0, frames=8, exposure_time_s=0.02),
        ]
        source = recorded(tmp_path / "source", shots, effects=[Thermal()])
        wrong = Sensor(**(source.sensor.model_dump() | {"black_level": 0.0}))
        frames = [codes for e in source.exposures for codes in source.frames(e)]
        like = write_recording(tmp_path / "r", wrong, [shot.plan for shot in shots], frames)
        made = simulate_like(camera_of(), like, tmp_path / "made")
        # Three levels enter, each with its own noise.
        error = variance_dn2(400) * 3 / (8 * ROWS * COLUMNS)
        assert_mean(stack(made, "a"), BLACK + 300, variance_dn2(300), error)

    def test_clipped_flats_follow_the_light(self, tmp_path: Path) -> None:
        shots = [
            flat("a", [[2000, 1000], [1000, 500]], frames=4, exposure_time_s=0.01, light=10.0),
            flat("b", [[6000, 3000], [3000, 1500]], frames=4, exposure_time_s=0.03, light=30.0),
            flat("c", 9000.0, frames=4, exposure_time_s=0.01, light=90.0),
        ]
        like = recorded(tmp_path / "real", shots, Cfa.GBRG)
        made = simulate_like(camera_of(Cfa.GBRG), like, tmp_path / "made")
        assert (stack(made, "c") == WHITE).all()
        assert (site(stack(made, "b"), (0, 0)) == WHITE).all()
        values = site(stack(made, "b"), (0, 1))
        assert_mean(values, BLACK + 3000, variance_dn2(3000), variance_dn2(3000) / values.size)

    @pytest.mark.parametrize("effects", [[], [Falloff()]])
    def test_flats_that_fill_the_pixels_follow_the_light(
        self, tmp_path: Path, effects: list[Effect]
    ) -> None:
        """Below the white level no code is clipped; of the noise read noise alone is left."""
        full = 2000.0
        shots = (
            SHOTS[0],
            flat("half", 1000.0, frames=6, exposure_time_s=0.01, light=1.0),
            flat("full", 4000.0, frames=6, exposure_time_s=0.01, light=4.0),
        )
        camera = camera_of(Cfa.MONO, effects).model_copy(update={"saturation_dn": full})
        like = simulate(camera, shots, ROWS, COLUMNS, tmp_path / "real", seed=77)
        made = simulate_like(camera, like, tmp_path / "made", seed=3)
        codes = stack(made, "full")
        variance = INTERCEPT + 1 / 12
        assert_mean(codes, BLACK + full, variance)
        assert abs(codes.var() / variance - 1) < Z_MAX * np.sqrt(2 / codes.size)
        assert abs(stack(made, "half").mean() - stack(like, "half").mean()) < 1.0

    def test_a_scene_is_its_mean_frame_above_black(self, tmp_path: Path) -> None:
        rng = np.random.default_rng(0)
        picture = rng.uniform(100, 3000, (ROWS, COLUMNS)).astype(np.float32)
        shots = [
            dark("dark", frames=8, exposure_time_s=0.01),
            Shot(ExposurePlan("scene", "scene", 0.01, 8), lambda _: picture.copy()),
        ]
        like = recorded(tmp_path / "real", shots)
        made = simulate_like(camera_of(), like, tmp_path / "made")
        found = (stack(made, "scene").mean(0) - BLACK - picture) / np.sqrt(variance_dn2(picture))
        # Noise of eight frames each: of the recorded mean and of the simulated one.
        n = found.size
        assert abs(found.var() - 2 / 8) < Z_MAX * (2 / 8) * np.sqrt(2 / n)
        assert abs(found.mean()) < Z_MAX * np.sqrt(2 / 8 / n)


class TestRefused:
    def test_what_does_not_fit_in_one_message(self, tmp_path: Path) -> None:
        like = recorded(tmp_path / "real", SHOTS)
        before = every_byte(tmp_path / "real")
        camera = camera_of(Cfa.BGGR).model_copy(update={"bit_depth": 20})
        with pytest.raises(InputError) as refused:
            simulate_like(camera, like, tmp_path / "real")
        message = str(refused.value)
        assert "cfa: is BGGR, must be RGGB as in the recording" in message
        assert "bit_depth: is 20, must be at most 16" in message
        assert "is the recording itself" in message
        assert every_byte(tmp_path / "real") == before

    def test_a_folder_that_holds_the_recording(self, tmp_path: Path) -> None:
        """Its description, or frames that are described elsewhere."""
        out = tmp_path / "out"
        simulate(camera_of(), SHOTS, 8, 8, out)
        inside = recorded(out / "real", SHOTS)
        elsewhere = tmp_path / "elsewhere" / "recording.toml"
        elsewhere.parent.mkdir()
        text = (out / "recording.toml").read_text(encoding="utf-8")
        elsewhere.write_text(text.replace('frames = "', f'frames = "{out.as_posix()}/'))
        before = every_byte(out)
        for like in (inside, read_recording(elsewhere)):
            with pytest.raises(InputError, match="holds the recording that is read"):
                simulate_like(camera_of(), like, out)
        assert every_byte(out) == before

    def test_a_white_level_that_would_clip_what_was_recorded(self, tmp_path: Path) -> None:
        like = recorded(tmp_path / "real", SHOTS)
        low = camera_of().model_copy(update={"white_level": WHITE - 1})
        wanted = f"white_level: is {WHITE - 1:g}, must be {WHITE:g} or more as in the recording"
        with pytest.raises(InputError, match=wanted):
            simulate_like(low, like, tmp_path / "made")
        high = camera_of().model_copy(update={"white_level": WHITE + 1, "bit_depth": 16})
        assert simulate_like(high, like, tmp_path / "made").sensor.white_level == WHITE + 1

    def test_progress_counts_every_frame(self, tmp_path: Path) -> None:
        told: list[tuple[int, int, str]] = []
        simulate(camera_of(), SHOTS, 8, 8, tmp_path / "r", progress=lambda *said: told.append(said))
        assert [done for done, _, _ in told] == list(range(1, 19))
        assert told[-1] == (18, 18, "colours")


@pytest.mark.parametrize("mark", [None, "", "[]", "{}", '{"origin": 7}', '"text"', "{", "\xff\xfe"])
def test_how_frames_came_about_is_known_or_not(tmp_path: Path, mark: str | None) -> None:
    shots = [dark("d", frames=1, exposure_time_s=0.01)]
    made = recorded(tmp_path / "made", shots)
    assert origin_of(made).startswith("simulated from camera model")
    place = made.folder / "provenance.json"
    if mark is None:
        place.unlink()
    else:
        place.write_bytes(mark.encode("latin-1"))
    assert origin_of(made) == ""
