"""Promise: what observers look at is what the test says: light, optics, noise, training, picture.

Nearly all is read back from the delivered 8-bit clips. The view `Raw` shows scene light as it is,
so that a clip's codes are 255 x light, rounded, and closed forms can be held against them.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from scipy.stats import norm

from dsis.camera import BaseNoise, Camera, Segment, read_camera, write_camera
from dsis.cfa import Cfa, pattern
from dsis.color import Color, DisplayTransform
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.effects.prnu import Prnu
from dsis.grid import PixelGrid
from dsis.imagefile import read, write
from dsis.manifest import read_manifest
from dsis.optics import Optics, through_optics, transfer
from dsis.spec import SHIPPED, Test, read_spec
from dsis.stimuli import build_stimuli

Z_MAX = 5.0
Z_MAX_OF_MANY = 6.0  # of 10^5 z-values at once: one in 5000 sets of them reaches that by chance
ROWS, COLUMNS = 48, 64
FPS = 25

WHITE_DN, SLOPE, INTERCEPT = 1000.0, 2.0, 100.0
CAMERA = Camera(
    name="plain",
    cfa=Cfa.RGGB,
    black_level=64.0,
    white_level=4095.0,
    bit_depth=12,
    diffuse_white_dn=WHITE_DN,
    noise=BaseNoise(segment=(Segment(slope=SLOPE, intercept=INTERCEPT),)),
)
CODES_PER_DN = 255 / WHITE_DN
# Sheppard: rounding to whole steps adds 1/12 to the variance of noise far wider than a step.
ROUNDING = 1 / 12

CINEMA = Optics(
    f_number=5.6,
    wavelength_nm=550.0,
    pitch_um=8.25,
    low_pass_spot_separation_px=0.75,
    fill_factor=1.0,
)
# Gain 1 within 1e-6 at all frequencies: nothing but the sampling.
NO_OPTICS = Optics(
    f_number=0.01,
    wavelength_nm=1.0,
    pitch_um=8.25,
    low_pass_spot_separation_px=0.0,
    fill_factor=1e-6,
)


def spec_in(
    folder: Path,
    contents: Mapping[str, Mapping[str, Any]],
    *,
    frames: int,
    size: tuple[int, int] = (ROWS, COLUMNS),
    camera: Camera = CAMERA,
    optics: Optics = NO_OPTICS,
    view: str = "Raw",
    awgn: Mapping[str, Any] | None = None,
    training: int = 0,
    formats: tuple[str, ...] = ("player",),
    **conditions: object,
) -> Test:
    """Write a spec, read it; a content's `light` becomes the file that it shows."""
    write_camera(camera, folder / "camera.toml")
    listed = []
    for name, given in contents.items():
        entry = {"name": name, **given}
        if "light" in entry:
            write(folder / f"{name}.exr", entry.pop("light").astype(np.float32), "exr")
            entry["files"] = f"{name}.exr"
        listed.append(entry)
    shown_s = 1 / FPS
    values = {
        "schema": "dsis-test/1",
        "seed": 11,
        "formats": formats,
        "sequence": {"height": size[0], "width": size[1], "fps": FPS, "seconds": frames / FPS},
        "content": listed,
        "camera": {"model": "camera.toml"},
        "optics": optics.model_dump(),
        "color": {
            "display": "Rec.1886 Rec.709 - Display",
            "view": view,
            "scene_space": "Linear Rec.709 (sRGB)",
        },
        "awgn": awgn or {"sigma": 6.0},
        "conditions": {"noise": ["sd"], "demosaic": ["none"], "levels": [0], **conditions},
        "session": {"reference_s": shown_s, "test_s": shown_s, "training": training},
    }
    (folder / "spec.toml").write_text(tomli_w.dumps(values), encoding="utf-8")
    return read_spec(folder / "spec.toml")


def built(folder: Path, contents: Mapping[str, Mapping[str, Any]], **settings: Any) -> Path:
    folder.mkdir(exist_ok=True)
    build_stimuli(spec_in(folder, contents, **settings), folder / "out", jobs=2)
    return folder / "out"


def codes_of(out: Path, stimulus: str) -> np.ndarray:
    """Return a delivered clip, (frame, row, column, 3), exact in float64."""
    manifest = read_manifest(out)
    size = manifest.sequence
    data = np.fromfile(out / manifest.clip(stimulus).files["player"].path, np.uint8)
    return data.reshape(-1, size.height, size.width, 3).astype(np.float64)


def flat(light: float) -> np.ndarray:
    return np.full((ROWS, COLUMNS, 3), light)


def z_of_share(found: np.ndarray, probability: float) -> float:
    """Return how many standard errors a share of independent samples is off its probability."""
    return (found.mean() - probability) / math.sqrt(probability * (1 - probability) / found.size)


# --- From light to codes: what a camera clips and how it rounds


def test_clean_raw_is_clipped_at_black_and_at_saturation() -> None:
    scene = np.array([[[-1.0, -0.03, 0.5], [0.9, 3.0, 90.0]]], np.float32)
    free = [[[-64.0, -30.0, 500.0], [900.0, 3000.0, 4095.0 - 64.0]]]
    np.testing.assert_allclose(CAMERA.clean_raw(scene), free, rtol=1e-6)
    full = CAMERA.model_copy(update={"saturation_dn": 800.0})
    np.testing.assert_allclose(full.clean_raw(scene), np.minimum(free, 800.0), rtol=1e-6)


def noise_free(**changes: object) -> Camera:
    silent = BaseNoise(segment=(Segment(slope=0.0, intercept=0.0),))
    return CAMERA.model_copy(update={"noise": silent, **changes})


@pytest.mark.parametrize("black", [64.0, 65.0])
def test_codes_are_rounded_half_to_even(black: float) -> None:
    """Python's `round` is the oracle: half to even, on codes, black included."""
    clean = (np.arange(400, dtype=np.float32) / 2 - 20).reshape(20, 20)
    raw = noise_free(black_level=black).expose(clean, Draw(1), Draw(1), 0, PixelGrid(20, 20))
    np.testing.assert_array_equal(raw + black, [[round(c + black) for c in r] for r in clean])


def test_no_code_lies_below_zero() -> None:
    """Noise of 20 DN on a pedestal of 10: 32 % of the codes are the lowest one, 0."""
    noise = BaseNoise(segment=(Segment(slope=0.0, intercept=400.0),))
    camera = CAMERA.model_copy(update={"black_level": 10.0, "noise": noise})
    clean = np.zeros((400, 400), np.float32)
    codes = camera.expose(clean, Draw(1), Draw(1), 0, PixelGrid(400, 400)) + 10
    assert codes.min() == 0
    assert abs(z_of_share(codes == 0, norm.cdf(-9.5 / 20))) < Z_MAX


# --- Noise of delivered clips


FLAT_FRAMES = 20  # more than 16: no short cycle of the fields goes unseen
FLATS = {"one": 0.5, "two": 0.45}
FLAT_LEVELS = (0, 2)


@pytest.fixture(scope="module")
def flats(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two uniform greys: no code of them comes near 0 or 255."""
    return built(
        tmp_path_factory.mktemp("flats"),
        {name: {"light": flat(light)} for name, light in FLATS.items()},
        frames=FLAT_FRAMES,
        awgn={"match": "psnr"},
        noise=["awgn", "sd"],
        levels=list(FLAT_LEVELS),
    )


def noise_clips(out: Path) -> dict[str, np.ndarray]:
    clips = [clip for clip in read_manifest(out).clips if clip.role == "test"]
    return {clip.stimulus: codes_of(out, clip.stimulus) for clip in clips}


def test_noise_is_new_in_every_frame_channel_clip_and_content(flats: Path) -> None:
    """Every pair of 480 planes is uncorrelated: frames, channels, levels, contents, both noises."""
    clips = np.concatenate(list(noise_clips(flats).values()))
    planes = clips.transpose(0, 3, 1, 2).reshape(-1, ROWS * COLUMNS)
    assert len(planes) == len(FLATS) * 2 * len(FLAT_LEVELS) * FLAT_FRAMES * 3
    z = np.corrcoef(planes) * math.sqrt(ROWS * COLUMNS)
    np.fill_diagonal(z, 0)
    assert np.abs(z).max() < Z_MAX_OF_MANY


def test_noise_is_white_within_a_frame(flats: Path) -> None:
    """The circular autocorrelation at every lag, averaged over frames and channels of a clip."""
    for name, clip in noise_clips(flats).items():
        residual = clip - clip.mean(axis=(1, 2), keepdims=True)
        power = np.abs(np.fft.fft2(residual / residual.std(), axes=(1, 2))) ** 2
        correlation = np.fft.ifft2(power, axes=(1, 2)).real.mean(axis=(0, 3)) / (ROWS * COLUMNS)
        z = correlation * math.sqrt(clip.size)
        z[0, 0] = 0
        # A lag that is its own opposite counts every product twice.
        z[[0, 0, ROWS // 2, ROWS // 2], [0, COLUMNS // 2, 0, COLUMNS // 2]] /= math.sqrt(2)
        assert np.abs(z).max() < Z_MAX, name


@pytest.mark.parametrize("content", FLATS)
@pytest.mark.parametrize("level", FLAT_LEVELS)
def test_delivered_noise_has_the_stated_strength(flats: Path, content: str, level: int) -> None:
    """Of the manifest's sigma (white noise), of m x + t at x / 2^level (camera noise)."""
    sigma = read_manifest(flats).clip(f"{content}__awgn__none__{level}").awgn_sigma
    signal_dn = FLATS[content] * WHITE_DN
    raw_dn2 = SLOPE * signal_dn / 2**level + INTERCEPT + ROUNDING
    expected = {"awgn": sigma**2, "sd": raw_dn2 * (2**level * CODES_PER_DN) ** 2}
    for noise, variance in expected.items():
        codes = codes_of(flats, f"{content}__{noise}__none__{level}")
        total = variance + ROUNDING
        z_mean = (codes.mean() - FLATS[content] * 255) / math.sqrt(total / codes.size)
        z_variance = (codes.var() / total - 1) / math.sqrt(2 / codes.size)
        assert abs(z_mean) < Z_MAX, noise
        assert abs(z_variance) < Z_MAX, noise


def test_one_sensor_takes_all_contents_and_levels(tmp_path: Path) -> None:
    """Fixed gains of 5 % are the same pattern in all clips; the expected r is its share of all."""
    gain, frames = 0.05, 8
    camera = CAMERA.model_copy(update={"effect": (Prnu(sigma_percent=100 * gain),)})
    contents = {name: {"light": flat(light)} for name, light in FLATS.items()}
    out = built(tmp_path, contents, frames=frames, camera=camera, levels=[0, 1])
    patterns, shares = [], []
    for content, light in FLATS.items():
        for level in (0, 1):
            clip = codes_of(out, f"{content}__sd__none__{level}")
            patterns.append(clip.mean(axis=0).ravel())
            signal = light * WHITE_DN
            temporal = (SLOPE * signal / 2**level + INTERCEPT + ROUNDING) * 4**level
            temporal += ROUNDING / CODES_PER_DN**2
            shares.append(1 / (1 + temporal / frames / (gain * signal) ** 2))
    expected = np.sqrt(np.outer(shares, shares))
    z = (np.corrcoef(patterns) - expected) * math.sqrt(len(patterns[0])) / (1 - expected**2)
    np.fill_diagonal(z, 0)
    assert expected.min() > 0.6
    assert np.abs(z).max() < Z_MAX


# --- The reference


def test_the_reference_shows_what_a_display_can(tmp_path: Path) -> None:
    """White noise falls to both sides of the reference: half of it is seen at white and black."""
    sigma, third = 8.0, COLUMNS // 4
    light = flat(0.5)
    light[:, :third], light[:, -third:] = -0.2, 1.4
    settings = {"frames": 2, "noise": ["awgn"], "awgn": {"sigma": sigma}}
    out = built(tmp_path, {"stripes": {"light": light}}, **settings, formats=("player", "exr"))
    shown = read(out / "exr" / "stripes__reference" / "00000.exr")
    assert (shown[:, : third - 1] == 0).all()
    assert (shown[:, 1 - third :] == 1).all()
    noisy = codes_of(out, "stripes__awgn__none__0")
    beyond_half_a_code = norm.sf(0.5 / sigma)
    assert abs(z_of_share(noisy[:, :, : third - 1] > 0, beyond_half_a_code)) < Z_MAX
    assert abs(z_of_share(noisy[:, :, 1 - third :] < 255, beyond_half_a_code)) < Z_MAX


PAN_FRAMES, PAN_PX = 6, 2


@pytest.mark.parametrize("sign", [1, -1])
def test_a_window_moving_right_moves_the_picture_left(sign: int, tmp_path: Path) -> None:
    """A still with no room to spare: the window goes from one of its ends to the other."""
    travel = PAN_PX * (PAN_FRAMES - 1)
    light = np.full((ROWS, COLUMNS + travel, 3), 0.1)
    light[:, 40] = 0.9
    content = {"light": light, "pan_px_per_frame": float(sign * PAN_PX)}
    settings = {"frames": PAN_FRAMES, "noise": ["awgn", "sd"], "demosaic": ["none", "bilinear"]}
    out = built(tmp_path, {"line": content}, **settings)
    first = 40 if sign > 0 else 40 - travel
    places = [first - sign * PAN_PX * frame for frame in range(PAN_FRAMES)]
    for clip in read_manifest(out).clips:
        brightest = codes_of(out, clip.stimulus).mean(axis=(1, 3)).argmax(axis=1)
        assert brightest.tolist() == places, clip.stimulus


# One grating per channel, (cycles per pixel down, right): along, across and oblique to the pan.
GRATINGS = ((0.0131, 0.1237), (0.2113, 0.0173), (0.1731, 0.2477))
SPARE_PX = 128  # around the window: the reflected borders are far away


def gratings(scale: int, travel: int) -> np.ndarray:
    rows, columns = ROWS + SPARE_PX, COLUMNS + SPARE_PX + travel
    y, x = np.mgrid[0 : rows * scale, 0 : columns * scale] / scale
    waves = [np.cos(2 * np.pi * (fy * y + fx * x)) for fy, fx in GRATINGS]
    return 0.5 + 0.4 * np.stack(waves, axis=2)


@pytest.mark.parametrize(("pan", "scale"), [(0.25, 1), (-0.7, 1), (0.25, 2), (0.5, 2), (3.0, 1)])
def test_gratings_pan_by_parts_of_a_pixel_at_the_contrast_of_the_optics(
    pan: float, scale: int, tmp_path: Path
) -> None:
    """Each frame is the analytic wave, 8-bit rounding apart; `transfer` has its own tests."""
    light = gratings(scale, math.ceil(abs(pan) * (PAN_FRAMES - 1)))
    content = {"light": light, "pan_px_per_frame": pan, "oversampling": scale}
    out = built(tmp_path, {"waves": content}, frames=PAN_FRAMES, optics=CINEMA)
    clip = codes_of(out, "waves__reference")
    y, x = np.mgrid[0:ROWS, 0:COLUMNS]
    for channel, (fy, fx) in enumerate(GRATINGS):
        contrast = 0.4 * float(transfer(CINEMA, np.array(fy), np.array(fx)))
        phases = []
        for frame, picture in enumerate(clip[..., channel]):
            moved = 2 * np.pi * (fy * y + fx * (x + pan * frame))
            known = np.stack([np.ones(x.size), np.cos(moved).ravel(), np.sin(moved).ravel()], 1)
            fit = np.linalg.lstsq(known, picture.ravel(), rcond=None)[0]
            # Rounding to codes 0.5, of light to half floats 0.06, tails of the borders 0.09.
            assert np.abs(known @ fit - picture.ravel()).max() < 0.65
            assert fit[0] == pytest.approx(127.5, abs=0.1)
            assert math.hypot(fit[1], fit[2]) == pytest.approx(255 * contrast, abs=0.1)
            phases.append(math.atan2(fit[2], fit[1]))
        turned = np.angle(np.exp(1j * (np.array(phases) - phases[0])))
        # A tenth of a code, as above.
        assert np.abs(turned).max() < 0.1 / (255 * contrast)


# --- Training


TRAINED = {
    "one scene": {"city": {"scene": "city"}},
    "both scenes": {"a": {"scene": "city", "scene_seed": 5}, "b": {"scene": "landscape"}},
    "footage": {"still": {"light": np.random.default_rng(1).random((ROWS, COLUMNS, 3))}},
}


@pytest.mark.parametrize("case", TRAINED)
def test_training_shows_no_picture_of_the_test(case: str, tmp_path: Path) -> None:
    """Nor does its noise return: it would be recognised."""
    out = built(tmp_path, TRAINED[case], frames=2, training=1)
    manifest = read_manifest(out)
    trained = [clip for clip in manifest.clips if clip.role == "training"]
    assert len(trained) == 1
    rehearsed = codes_of(out, trained[0].reference)
    assert rehearsed.std() > 5, "a picture, not a uniform field"
    rehearsed_noise = codes_of(out, trained[0].stimulus) - rehearsed
    for clip in manifest.clips:
        if clip.role == "test":
            reference = codes_of(out, clip.reference)
            difference = np.abs(reference[:, np.newaxis] - rehearsed).mean(axis=(2, 3, 4))
            assert difference.min() > 5, clip.reference
            noise = codes_of(out, clip.stimulus) - reference
            r = np.corrcoef(noise.reshape(2, -1), rehearsed_noise.reshape(2, -1))
            # Rounding differences between planes of unlike strength do not correlate either.
            assert np.abs(r[:2, 2:]).max() * math.sqrt(noise[0].size) < Z_MAX


# --- What is logged and drawn of them


def demosaicked(picture: np.ndarray, cfa: Cfa, method: str, full_scale: float) -> np.ndarray:
    """Sample a full-colour picture at the colour filters and interpolate it again."""
    sites = np.tile(pattern(cfa), (ROWS // 2, COLUMNS // 2))[:, :, np.newaxis].astype(np.intp)
    sampled = np.take_along_axis(picture, sites, axis=2)[:, :, 0]
    return demosaic(sampled.astype(np.float32), cfa, method, full_scale=full_scale)


def clean_codes(light: np.ndarray, camera: Camera, method: str, color: Color) -> dict[str, Any]:
    """Return noise-free frames that went through the mosaic, step by step, as 8-bit codes."""
    gains, matrix = np.array(camera.white_balance), np.array(camera.camera_from_scene)
    k = camera.diffuse_white_dn
    top = min(camera.white_level - camera.black_level, camera.saturation_dn or math.inf)
    raw = np.clip(k * np.einsum("cs,yxs->yxc", matrix, light) / gains, -camera.black_level, top)

    def display(balanced: np.ndarray) -> np.ndarray:
        scene = np.einsum("sc,yxc->yxs", np.linalg.inv(matrix) / k, balanced)
        shown = DisplayTransform(color).display_from_scene(scene.astype(np.float32))
        return 255 * np.clip(shown.astype(np.float64), 0, 1)

    frames = {
        "sd": display(demosaicked(raw * gains, camera.cfa, method, k)),
        "awgn": demosaicked(display(raw * gains), camera.cfa, method, 255.0),
    }
    return {noise: np.floor(np.clip(codes, 0, 255) + 0.5) for noise, codes in frames.items()}


@pytest.mark.parametrize("method", ["bilinear", "dlmmse"])
def test_psnr_against_the_demosaicked_clean_frame(method: str, tmp_path: Path) -> None:
    """Recomputed from the delivered clip; one flipped rounding in 9216 moves it by 1e-4 dB."""
    camera = read_camera(SHIPPED / "cameras" / "dual_gain_cinema.toml")
    view = "ACES 1.0 - SDR Video"
    y, x = np.mgrid[0:ROWS, 0:COLUMNS]
    edges = 0.15 * np.stack([x // 5 % 2, (x + y) // 7 % 2, y // 3 % 2], axis=2) + 0.1
    settings = {"frames": 2, "camera": camera, "optics": CINEMA, "view": view}
    noises = {"noise": ["awgn", "sd"], "demosaic": ["none", method], "levels": [0, 1]}
    out = built(tmp_path, {"edges": {"light": edges}}, **settings, **noises)
    color = Color(view=view, scene_space="Linear Rec.709 (sRGB)")
    light = through_optics(read(tmp_path / "edges.exr"), CINEMA).astype(np.float64)
    manifest = read_manifest(out)
    for noise, clean in clean_codes(light, camera, method, color).items():
        for level in (0, 1):
            clip = manifest.clip(f"edges__{noise}__{method}__{level}")
            error = codes_of(out, clip.stimulus) - clean
            psnr = 10 * np.log10(255**2 / (error**2).mean(axis=(1, 2, 3)))
            np.testing.assert_allclose(clip.quality.psnr_demosaicked_db, psnr, atol=0.002)
            # The edges suffer from the mosaic: against the reference it is another figure.
            assert np.abs(np.subtract(clip.quality.psnr_db, psnr)).min() > 0.05
            plain = manifest.clip(f"edges__{noise}__none__{level}").quality
            assert plain.psnr_demosaicked_db == plain.psnr_db


GAP_PX, CROP_PX, ENLARGED = 6, 128, 3


def test_figure_5_is_made_of_the_delivered_frames(tmp_path: Path) -> None:
    """Upper row: middle crops of the middle frame, thrice as large; lower: difference x 4 + 128."""
    rows, columns, methods = 141, 152, ["none", "bilinear", "lu_tan"]
    y, x = np.mgrid[0:rows, 0:columns]
    light = 0.3 + 0.4 * np.stack([x / columns, y / rows, (x + y) % 40 / 40], axis=2)
    settings = {"frames": 3, "size": (rows, columns), "awgn": {"sigma": 20.0}, "levels": [1]}
    noises = {"noise": ["awgn", "sd"], "demosaic": methods}
    out = built(tmp_path, {"ramps": {"light": light}}, **settings, **noises)
    top, left = (rows - CROP_PX) // 2, (columns - CROP_PX) // 2

    def crop(stimulus: str) -> np.ndarray:
        return codes_of(out, stimulus)[1, top : top + CROP_PX, left : left + CROP_PX]

    for noise in ("awgn", "sd"):
        picture = read(out / "figures" / f"fig5__ramps__{noise}__1.png") * 255
        side = CROP_PX * ENLARGED
        assert picture.shape == (2 * side + GAP_PX, len(methods) * (side + GAP_PX) - GAP_PX, 3)
        expected = np.full(picture.shape, 255.0)
        for i, method in enumerate(methods):
            seen = crop(f"ramps__{noise}__{method}__1")
            scaled = np.clip(4 * (seen - crop("ramps__reference")) + 128, 0, 255)
            at = slice(i * (side + GAP_PX), i * (side + GAP_PX) + side)
            expected[:side, at] = np.kron(seen, np.ones((ENLARGED, ENLARGED, 1)))
            expected[side + GAP_PX :, at] = np.kron(scaled, np.ones((ENLARGED, ENLARGED, 1)))
            assert {0, 128, 255} <= set(scaled.ravel()), "differences of no and of much size"
        np.testing.assert_array_equal(np.rint(picture), expected)


# --- Going on after an interruption


class Stopped(Exception):  # noqa: N818 - raised by the test, no error
    """The user gave up."""


@pytest.mark.parametrize("damage", ["player", "png8", "absent"])
def test_a_frame_damaged_since_is_made_again(damage: str, tmp_path: Path) -> None:
    frames, shown = 6, {"still": {"light": flat(0.4)}}
    test = spec_in(tmp_path, shown, frames=frames, formats=("player", "png8"))
    build_stimuli(test, tmp_path / "undisturbed")

    def stop(done: int, _: int, __: str) -> None:
        if done >= 4:
            raise Stopped

    with pytest.raises(Stopped):
        build_stimuli(test, tmp_path / "out", progress=stop)
    partial = tmp_path / "out.partial"
    clip = "still__sd__none__0"
    if damage == "player":
        path = partial / "player" / f"{clip}.rgb"
        data = bytearray(path.read_bytes())
        data[ROWS * COLUMNS * 3 + 100] ^= 1  # in frame 1
        path.write_bytes(data)
    elif damage == "png8":
        path = partial / "png8" / clip / "00001.png"
        write(path, read(path) * np.float32(0.99), "png8")
    else:
        (partial / "png8" / "still__reference" / "00001.png").unlink()
    told: list[int] = []
    build_stimuli(test, tmp_path / "out", progress=lambda done, _, __: told.append(done))
    assert 0 < told[1] < frames, "some are kept, and not the damaged one"
    for path in sorted((tmp_path / "undisturbed").rglob("*.*")):
        again = tmp_path / "out" / path.relative_to(tmp_path / "undisturbed")
        assert again.read_bytes() == path.read_bytes(), again
