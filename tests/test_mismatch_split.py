"""Promise: every frame has one part, and what only the brightest exposure shows is looked at."""

import pytest

from analysis.mismatch.split import Split
from mismatch_recordings import camera, recorded


@pytest.mark.parametrize("levels", range(1, 10))
@pytest.mark.parametrize("frames", [2, 3, 5, 6, 17])
def test_the_brightest_exposure_is_looked_at(levels: int, frames: int) -> None:
    light = tuple(100.0 * (1 + i) for i in range(levels))
    recording = recorded(camera(), 1, rows=8, columns=8, frames=frames, levels=light)
    split = Split.of(recording)
    for exposure in recording.exposures:
        parts = [own.get(exposure.name, ()) for own in (split.train, split.select, split.locked)]
        assert sorted(sum(parts, ())) == list(range(len(exposure.frames)))
    brightest = max(recording.of_kind("flat"), key=lambda e: e.light or e.exposure_time_s)
    assert split.development.get(brightest.name)
    assert bool(split.locked) == (frames >= 3 or levels >= 4)
    # Two darks: where they have few frames some of each are locked, for no other are.
    assert ("dark-0" in split.locked) == ("dark-1" in split.locked) == (frames >= 3)
    if frames in (3, 5):
        last = (frames - 1,)
        assert split.locked["dark-0"] == last
        assert ("flat-0" in split.locked) == (levels < 4)
        assert split.locked[brightest.name] == last  # what only that shows is proven too
