"""Of large recordings few simulations rule out what is far behind, and only what is near is fitted
further.
"""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import proposed
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.polish import Polished
from analysis.mismatch.proposed import STRONG, WORTH_IT, _screened, all_fitted
from dsis.effects.row_noise import RowNoise


def _predictor(gains: dict[str, float], replicates: int) -> Any:
    """Return what gains so much by cameras of some names, and remembers what it was asked."""
    asked: list[str | None] = []
    return Stub(
        replicates=replicates,
        asked=asked,
        ready=asked.extend,
        mean=lambda camera: camera,
        gain=lambda mean, of_pixels: gains[mean] + (of_pixels or 0.0),
    )


@pytest.mark.parametrize(
    ("best", "kept"),
    [
        (-np.inf, ["strong", "near", "pixels"]),  # beside the strongest of them
        (1000.0, []),
        (STRONG / 2, ["strong", "near", "pixels"]),
    ],
)
def test_what_is_far_behind_is_simulated_no_more(best: float, kept: list[str]) -> None:
    gains = {"strong": 100.0, "near": 100 * WORTH_IT, "far": 100 * WORTH_IT - 1, "pixels": 1.0}
    few, many = _predictor(gains, 1), _predictor(gains, 4)
    effect = RowNoise(sigma_dn=1.0)
    fresh: Any = [(i, effect, camera, many) for i, camera in enumerate([*gains, None])]
    of_pixels = [None, None, None, 60.0, None]
    found = _screened(few, fresh, of_pixels, best)
    assert few.asked == [*gains, None]
    assert [one[:3] for one in found] == [one[:3] for one in fresh]
    assert [one[2] for one in found if one[3] is many and one[2]] == kept


def test_beside_nothing_strong_all_are_simulated() -> None:
    gains = {"weak": STRONG, "none": -5.0}
    few, many = _predictor(gains, 1), _predictor(gains, 4)
    fresh: Any = [(i, RowNoise(sigma_dn=1.0), camera, many) for i, camera in enumerate(gains)]
    assert all(one[3] is many for one in _screened(few, fresh, [None, None], -np.inf))


@pytest.mark.parametrize("large", [True, False])
def test_what_is_near_the_best_is_fitted_further(
    monkeypatch: pytest.MonkeyPatch, large: bool
) -> None:
    """Of a large recording; not what did not move, nor beside what no camera of this size has."""
    logliks = {1.0: 100.0, 2.0: 95.0, 3.0: 60.0, 4.0: 99.0, 5.0: 300.0}
    still, insane = 4.0, 5.0
    some = [Proposal(RowNoise(sigma_dn=size), ("sigma_dn",)) for size in (*logliks, 6.0)]
    asked: list[tuple[float, bool]] = []

    def fitted(_state: Any, which: tuple[Proposal, Polished | None]) -> Polished | None:
        size = which[0].effect.model_dump()["sigma_dn"]
        asked.append((size, which[1] is not None))
        if size not in logliks:
            return None
        new = size if size == still else size + 0.01 * (1 + (which[1] is not None))
        return Polished((RowNoise(sigma_dn=new),), logliks[size], np.zeros(1), ({},))

    sane = Stub(sane=lambda _layout, effect: effect.sigma_dn < insane)
    monkeypatch.setattr(proposed, "_fitted", fitted)
    monkeypatch.setattr(proposed, "CANDIDATES", {"row_noise": sane})
    state: Any = Stub(setting=Stub(jobs=1, large=large, layout=None))
    made = all_fitted(state, some, 15.0)
    further = [size for size, again in asked if again]
    assert further == ([1.0, 2.0, 5.0] if large else [])
    sizes = [None if own is None else own.effects[0].model_dump()["sigma_dn"] for own in made]
    step = 0.02 if large else 0.01
    expected = [1 + step, 2 + step, 3.01, 4.0, 5 + step, None]
    assert sizes[-1] is None
    np.testing.assert_allclose(sizes[:-1], expected[:-1])  # type: ignore[arg-type]
