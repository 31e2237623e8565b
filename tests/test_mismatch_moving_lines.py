"""A mean of frames whose lines move keeps some of it: that is no fixed pattern of lines."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.movinglines import moving_lines
from dsis.effects import registry
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

FRAMES, ROWS, COLUMNS = 6, 96, 2000
SIGNAL_DN = {"weak": 200.0, "strong": 800.0}
EFFECTS = registry()


def _state(moving: float, pattern: float, located: bool = True) -> Any:
    """Return a state of drawn columns, in units of a pixel's noise over the root of its column.

    They move from frame to frame, and have fixed gains of the same size at the strong exposure.
    """
    rng = np.random.default_rng(6)
    gains = pattern * rng.standard_normal(COLUMNS)
    temporal, fixed, top, bottom = [], [], np.zeros(COLUMNS), 0.0
    for signal in SIGNAL_DN.values():
        means = moving * rng.standard_normal((FRAMES, COLUMNS))
        means += rng.standard_normal((FRAMES, COLUMNS)) + gains * signal / 800
        temporal.append(np.cbrt(means.var(0, ddof=1).mean()))
        mean = means.mean(0)
        fixed.append(np.cbrt(mean.var() * FRAMES))
        top, bottom = top + mean * signal, bottom + signal**2
    whole = np.cbrt((top / bottom).var() * FRAMES * bottom)
    named = [("column_variance", "exposure", e) for e in SIGNAL_DN]
    named += [("fixed_column_variance", "exposure", e) for e in SIGNAL_DN]
    named += [("fixed_column_variance", "gain", "")]
    named += [("fixed_pixel_variance", "exposure", e) for e in SIGNAL_DN]
    values = np.array([*temporal, *fixed, whole, 1.0, 1.0])
    sd = np.array([(2 / COLUMNS / n) ** 0.5 / 3 for n in (FRAMES, FRAMES, 1, 1, 1, 1, 1)])
    exposures = [SimpleNamespace(name=e, numbers=tuple(range(FRAMES))) for e in SIGNAL_DN]
    places = {(e, "MONO"): s for e, s in SIGNAL_DN.items()}
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(exposures=exposures),
            seen=SimpleNamespace(levels={p: SimpleNamespace(variance_dn2=1.0) for p in places}),
        ),
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=places)),
        vector=SimpleNamespace(
            keys=tuple(Key(s, scope, e, "MONO", "") for s, scope, e in named), values=values
        ),
        null=SimpleNamespace(
            mean=np.array([1.0, 1.0, *fixed, whole, 1.0, 1.0]), sd=sd, known=np.ones(7, bool)
        ),
        mismatches=[SimpleNamespace(statistic="column_variance")] if located else [],
    )


WITHOUT = np.ones(7)


@pytest.mark.parametrize("kind", ["column_fpn", "column_prnu"])
def test_columns_that_move_are_no_pattern(kind: str) -> None:
    said = moving_lines(_state(0.7, 0.0), kind, WITHOUT)
    assert said is not None
    assert abs(said.share) < 0.15


def test_a_pattern_beside_them_is_believed() -> None:
    assert moving_lines(_state(0.7, 1.5), "column_prnu", WITHOUT) is None


def test_what_is_explained_or_another_effect_feigns_nothing() -> None:
    assert moving_lines(_state(0.7, 0.0, located=False), "column_prnu", WITHOUT) is None
    assert moving_lines(_state(0.7, 0.0), "row_prnu", WITHOUT) is None
    assert moving_lines(_state(0.7, 0.0), "prnu", WITHOUT) is None


@pytest.mark.parametrize("seed", range(2))
def test_columns_that_move_and_have_no_word_stay_unexplained(seed: int) -> None:
    hidden = EFFECTS["column_noise"](sigma_dn=0.6)
    found = find_mismatch(
        camera(),
        recorded(camera(hidden), 40 + seed, rows=64, levels=(250.0, 900.0)),
        vocabulary=VOCABULARY - {"column_noise"},
    )
    assert not found.omitted_physics
    assert "column_variance" in {m.statistic for m in found.unexplained}
