"""Promise: a build that goes on makes damaged frames again."""

from pathlib import Path

import numpy as np
import pytest

from delivered import COLUMNS, ROWS, flat, spec_in
from dsis.imagefile import read, write
from dsis.stimuli import build_stimuli


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
