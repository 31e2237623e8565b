"""Levels of frames that wander are known no better than that allows, and all colours alike."""

from collections.abc import Sequence

import numpy as np
import pytest

from analysis.mismatch import VOCABULARY, find_mismatch
from analysis.mismatch.bank.home import TIME
from analysis.mismatch.bank.key import Key
from analysis.mismatch.contrasts import Contrasts
from analysis.mismatch.null import _wandering, null_of
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

SIZE = {"rows": 32, "columns": 48, "frames": 8, "levels": (200.0, 700.0)}
DRIFT = registry()["black_level_drift"](sigma_dn=1.0)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_sums_of_levels_scatter_as_is_said(cfa: str) -> None:
    """Of 16 recordings of a drift, in the null of a model without one."""
    without, own = camera(cfa=cfa), camera(DRIFT, cfa=cfa)
    still = state_of(recorded(without, 1, **SIZE), without)
    moving = [state_of(recorded(own, seed, **SIZE), own) for seed in (2, 3)]
    z = []
    for one in (vector for state in moving for vector in state.replicates.vectors):
        null = null_of(still.setting.layout, still.replicates.vectors, one)
        z.append(null.departures(one)[_of_levels(null.keys)])
    squares = np.square(z).mean(0)
    assert (squares < 3.0).all()  # a scatter that eight frames tell is half as wide again
    assert 0.4 < squares[-1] < 3.0  # of darks, which no fit of the light follows


def _of_levels(keys: Sequence[Key]) -> list[int]:
    """Return the sums of levels, last that over times."""
    which = [i for i, k in enumerate(keys) if (k.statistic, k.scope) == ("level", "contrast")]
    assert keys[which[-1]].detail == TIME
    return which


def test_what_frames_share_adds_up_over_their_channels() -> None:
    rng = np.random.default_rng(4)
    state = state_of(recorded(camera(cfa="RGGB"), 1, **SIZE), camera(cfa="RGGB"))
    keys = state.vector.keys
    part = np.array([0.5 * (k.statistic == "level") * k.exposure.startswith("dark") for k in keys])
    moved = {name: rng.standard_normal(4000) for name in ("dark-0", "dark-1")}
    each = np.array([part[i] * moved.get(k.exposure, np.zeros(4000)) for i, k in enumerate(keys)])
    sums: Contrasts = state.null.contrasts
    scatter = (sums.matrix @ each).var(1)
    assert scatter.max() > 0.1
    assert _wandering(sums, part, keys) == pytest.approx(scatter, rel=0.08, abs=1e-9)


@pytest.mark.long
def test_a_drift_without_its_word_is_no_dark_current() -> None:
    true = camera(DRIFT, cfa="RGGB")
    found = find_mismatch(
        camera(cfa="RGGB"),
        recorded(true, 7, rows=64, columns=64, levels=(200.0, 700.0)),
        vocabulary=VOCABULARY - {"black_level_drift"},
        seed=1,
    )
    assert not found.omitted_physics
    assert {one.statistic for one in found.unexplained} == {"frame_variance"}
