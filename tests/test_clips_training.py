"""Promise: training shows neither a picture nor the noise of the test."""

import math
from pathlib import Path

import numpy as np
import pytest

from delivered import COLUMNS, ROWS, Z_MAX, built, codes_of
from dsis.manifest import read_manifest

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
