"""How far whole frames wander, and how long that lasts: numpy's own autoregressive walks."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import temporal
from analysis.mismatch.framewalk import FrameMeans, Walk, share_of_light, shown, walk_of
from exposing import effect

NEW_DN2 = 0.04**2
FRAMES = [n for n in range(10) if n not in (3, 7)]  # locked frames are not looked at


def _walk(rng: np.random.Generator, sigma: float, persistence: float) -> Walk | None:
    return walk_of(_means(rng, sigma, persistence))


def _means(
    rng: np.random.Generator, sigma: float, persistence: float, exposures: int = 10
) -> list[FrameMeans]:
    found = []
    for _ in range(exposures):
        walk = [rng.standard_normal()]
        for _ in range(9):
            walk.append(
                persistence * walk[-1] + np.sqrt(1 - persistence**2) * rng.standard_normal()
            )
        means = 100 + sigma * np.array(walk) + np.sqrt(NEW_DN2) * rng.standard_normal(10)
        found.append(FrameMeans(np.array(FRAMES, float), means[FRAMES], NEW_DN2))
    return found


@pytest.mark.parametrize("persistence", [0.0, 0.6, 0.8])
def test_size_and_persistence_are_those_planted(persistence: float) -> None:
    rng = np.random.default_rng(3)
    found = [_walk(rng, 0.2, persistence) for _ in range(40)]
    walks = [own for own in found if own is not None]
    assert len(walks) == len(found)
    inside = [abs(own.sigma_dn - 0.2) < 1.96 * own.errors["sigma_dn"] for own in walks]
    lasting = [
        abs(own.persistence - persistence) < 1.96 * own.errors["persistence"] + 0.011
        for own in walks  # half a step of those tried
    ]
    assert np.mean(inside) > 0.88  # 95 % of 40, two standard deviations below
    assert np.mean(lasting) > 0.88
    assert np.median([own.sigma_dn for own in walks]) == pytest.approx(0.2, rel=0.1)
    if not persistence:
        assert np.median([own.white_dn for own in walks]) == pytest.approx(0.2, rel=0.1)
    sure = np.mean([own.gain > 3.0 for own in walks])
    assert sure > 0.7 if persistence else sure < 0.05


def test_frames_that_stand_still_do_not_wander() -> None:
    rng = np.random.default_rng(5)
    means = 50 + 1e-3 * rng.standard_normal(8)
    assert walk_of([FrameMeans(np.arange(8.0), means, NEW_DN2)]) is None
    assert walk_of([]) is None


def test_frames_show_a_wander_by_how_far_it_goes() -> None:
    """Of frames that stand still the gain is that of two numbers that are not needed."""
    rng = np.random.default_rng(8)
    still, restless = ([shown(_means(rng, sigma, 0.5)) for _ in range(60)] for sigma in (0.0, 0.12))
    assert min(still) >= 0
    assert np.mean(np.array(still) > 3.0) <= 0.05  # chi-squared of two, half of it above zero
    assert min(restless) > 10.0
    assert shown([]) == 0.0


def test_light_that_flickers_twice_flickers_by_both() -> None:
    lights = [effect("flicker", sigma_percent=s) for s in (0.3, 0.4)]
    assert share_of_light([*lights, effect("row_noise", sigma_dn=1.0)]) == pytest.approx(0.005)
    assert share_of_light([]) == 0.0


WALK = Walk(0.3, 0.9, {"sigma_dn": 0.1, "persistence": 0.2}, 0.5, 0.07)


@pytest.mark.parametrize(
    ("variance", "walk", "sigma_dn", "persistence"),
    [
        (0.04, None, 0.2, 0.0),
        (0.04, WALK, 0.2, 0.0),  # that it lasts is chance
        (-0.01, WALK, 0.07, 0.0),  # a quiet exposure outweighs a restless one
        (-0.01, replace(WALK, gain=3.0), 0.3, 0.9),
        (-0.01, None, None, None),
    ],
)
def test_a_search_for_drift_starts_where_frames_wander(
    variance: float,
    walk: Walk | None,
    sigma_dn: float | None,
    persistence: float | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(temporal, "_walk", lambda _: walk)
    clues: Any = SimpleNamespace(amplitude=lambda *_: (variance, 0.01))
    found = [own.effect for own in temporal._drift(clues)]
    expected = [] if sigma_dn is None else [(pytest.approx(sigma_dn), persistence)]
    assert [(one.sigma_dn, one.persistence) for one in found] == expected
