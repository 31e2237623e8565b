"""Promise: white noise is as strong as the spec says, at every level, or refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dsis.errors import InputError
from dsis.imagefile import write
from dsis.spec import SHIPPED, read_spec
from dsis.stimuli import build_stimuli
from written_spec import SHORT


@pytest.fixture
def solved(spec: Callable[..., Path], tmp_path: Path) -> Path:
    """Build one frame with matched white noise; return its manifest."""
    path = spec(*SHORT)
    build_stimuli(read_spec(path), tmp_path / "out")
    return tmp_path / "out" / "manifest.json"


def test_solved_white_noise_is_not_kept_for_other_footage_or_seeds(solved: Path) -> None:
    assert read_spec(solved).sigma["still", 0] > 0
    assert read_spec(solved, seed=2).sigma == {}
    assert read_spec(solved, [solved.parents[1] / "still.exr"]).sigma == {}


@pytest.mark.parametrize("wrong", ["-1", "Infinity", "NaN", "true", '"1"', "1e300"])
def test_a_manifests_sigma_is_checked(solved: Path, wrong: str) -> None:
    text = solved.read_text(encoding="utf-8")
    sigma = repr(read_spec(solved).sigma["still", 0])
    solved.write_text(text.replace(f'"0": {sigma}', f'"0": {wrong}'), encoding="utf-8")
    with pytest.raises(InputError, match=r"awgn_sigma\.still\.0: is .*, must be"):
        read_spec(solved)


def test_a_given_sigma_doubles_with_every_stop(spec: Callable[..., Path], tmp_path: Path) -> None:
    """Of three levels, sigma from the frames: 5 standard errors, where clipping takes no part."""
    path = spec(*SHORT, ('match = "psnr"', "sigma = 1.5"), ("levels = [0]", "levels = [0, 1, 3]"))
    manifest = build_stimuli(read_spec(path), tmp_path / "out")
    for level in (0, 1, 3):
        clip = manifest.clip(f"still__awgn__none__{level}")
        assert clip.awgn_sigma == 1.5 * 2**level
        measured = 255 / 10 ** (clip.quality.psnr_float_db[0] / 20)
        assert abs(measured / clip.awgn_sigma - 1) < 5 / np.sqrt(2 * 64 * 48 * 3)


@pytest.mark.parametrize("rule", ["psnr", "visibility"])
def test_strong_under_exposure_is_matched(
    spec: Callable[..., Path], tmp_path: Path, rule: str
) -> None:
    """Sigma is solved to 0.001 of a code; PSNR changes by 8.7 dB per relative change at most."""
    path = spec(*SHORT, ("levels = [0]", "levels = [9, 16]"), ('"psnr"', f'"{rule}"'))
    manifest = build_stimuli(read_spec(path), tmp_path / "out")
    for level in (9, 16):
        white, camera = (manifest.clip(f"still__{n}__none__{level}") for n in ("awgn", "sd"))
        if rule == "psnr":
            assert abs(white.quality.psnr_db[0] - camera.quality.psnr_db[0]) < 0.005
        else:
            assert white.quality.visible_noise == pytest.approx(
                camera.quality.visible_noise, rel=1e-3
            )


AFAR = "diagonal_inch = 23\ndistance_heights = 300\npeak_cd_m2 = 100"


@pytest.mark.parametrize("rule", ["psnr", "visibility"])
def test_a_level_that_white_noise_cannot_reach_is_refused(
    spec: Callable[..., Path], tmp_path: Path, rule: str
) -> None:
    """A nearly noiseless camera 16 stops under shows black for white; noise shows half of it.

    From afar an eye sees the half as grey: less of a difference than black is.
    """
    text = (SHIPPED / "cameras" / "single_gain.toml").read_text(encoding="utf-8")
    text = text.replace("slope = 0.4", "slope = 1e-9").replace("intercept = 6.0", "intercept = 0")
    (tmp_path / "dark.toml").write_text(text, encoding="utf-8")
    path = spec(
        *SHORT,
        ("levels = [0]", "levels = [16]"),
        ("cameras/dual_gain_cinema.toml", "dark.toml"),
        ('"psnr"', f'"{rule}"'),
        ("[camera]", f"[viewing]\n{AFAR}\n[camera]"),
    )
    write(tmp_path / "still.exr", np.full((60, 70, 3), 0.9, np.float32), "exr")
    with pytest.raises(InputError, match=r"conditions\.levels.*awgn\.match") as raised:
        build_stimuli(read_spec(path), tmp_path / "out")
    message = str(raised.value)
    assert "at level 16 sd of content 'still' has" in message
    assert ("dB" if rule == "psnr" else "visible noise energy") in message
