"""What was credited with the part of another effect gives it back where both are fitted."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.credited import given_back, joined, kept_up, together
from analysis.mismatch.named import Named, camera_without
from analysis.mismatch.prove.held import hold
from analysis.mismatch.prove.proof import gain_of
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Effect
from dsis.grid import Cfa, PixelGrid
from exposing import effect
from mismatch_recordings import camera, recorded

LAYOUT: Any = SimpleNamespace(rows=96, columns=128)
WHITE, DARK = effect("row_noise", sigma_dn=0.5), effect("dsnu", sigma_dn=1.0)


def _bands(sigma: float) -> Proposal:
    one = effect("row_banding", sigma_dn=sigma, length_rows=2.0)
    return Proposal(one, ("sigma_dn", "length_rows"))


def _named(one: Effect | None, name: str = "row_noise") -> Named:
    proposal = None if one is None else Proposal(one, ("sigma_dn",))
    return Named(name, proposal, {"sigma_dn": 0.01}, 9.0, ())


def test_bands_and_white_rows_have_the_variance_that_white_rows_had() -> None:
    bare, starts = together(camera(DARK, WHITE), _bands(0.3), 1, LAYOUT)
    assert bare.effect == (DARK,)
    assert [one.effect.kind for one in starts] == ["row_banding", "row_noise"]
    sizes: list[Any] = [one.effect.model_dump()["sigma_dn"] for one in starts]
    assert sum(size**2 for size in sizes) == pytest.approx(0.25)
    assert starts[1].free == ("sigma_dn",)


def test_of_bands_larger_than_all_white_rows_keep_little() -> None:
    _, starts = together(camera(WHITE), _bands(0.8), 0, LAYOUT)
    assert starts[1].effect.model_dump()["sigma_dn"] == pytest.approx(0.05)


def test_rows_of_the_users_own_give_nothing_back() -> None:
    """They come first, and are addressed by their places: sizes are fitted there."""
    assert together(camera(WHITE, DARK), _bands(0.3), 2, LAYOUT) == (
        camera(WHITE, DARK),
        [_bands(0.3)],
    )
    both = joined(camera(WHITE, DARK), (_bands(0.3).effect,), 2)
    assert both is not None
    assert both.effect[:2] == (WHITE, DARK)
    assert given_back(camera(WHITE), _bands(0.3).effect, 1, LAYOUT) == camera(WHITE)
    kept = kept_up([_named(effect("row_noise", sigma_dn=0.2))], camera(WHITE), 1)
    assert [n.proposal.effect for n in kept if n.proposal] == [effect("row_noise", sigma_dn=0.2)]


def test_a_glow_and_a_dark_current_have_the_mean_that_the_current_had() -> None:
    """Levels of darks tell their sum; pixels stay as far apart, in DN, as maps show."""
    current = effect("dark_current", dn_per_s=80.0, log_sigma=0.5)
    glow = effect("amp_glow", dn_per_s=150.0, place="top_left", extent=0.3)
    bare, starts = together(
        camera(DARK, current), Proposal(glow, ("dn_per_s", "extent")), 1, LAYOUT
    )
    assert bare.effect == (DARK,)
    assert [one.free for one in starts] == [("dn_per_s", "extent"), ("dn_per_s",)]
    left: Any = starts[1].effect
    y, x = np.mgrid[:96, :128]
    mean = 150.0 * float(np.exp(-np.hypot(y, x) / (0.3 * 128)).mean())
    assert left.dn_per_s == pytest.approx(80.0 - mean)
    apart = [
        rate * np.sqrt(np.expm1(s**2)) for rate, s in ((80.0, 0.5), (80.0 - mean, left.log_sigma))
    ]
    assert apart[0] == pytest.approx(apart[1])
    (back,) = given_back(camera(left), glow, 0, LAYOUT).effect
    assert back.model_dump() == pytest.approx(current.model_dump())


def test_hot_pixels_are_measured_anew_beside_dark_currents_that_differ() -> None:
    """In place of those that had the warm ones; where none were measured, or users', they stay."""
    few, many = (
        effect("hot_pixels", pixel_fraction=share, mean_dn_per_s=mean)
        for share, mean in ((0.01, 300.0), (0.02, 150.0))
    )
    current = effect("dark_current", dn_per_s=25.0, log_sigma=0.3)
    errors = {"pixel_fraction": 0.001, "mean_dn_per_s": 30.0}
    again = Proposal(few, (), errors=errors)
    apart = Proposal(current, ("dn_per_s",), again=again)
    assert together(camera(DARK, many), apart, 1, LAYOUT) == (camera(DARK), [apart, again])
    users = camera(many, DARK)
    assert together(users, apart, 2, LAYOUT) == (users, [apart])
    assert together(users, Proposal(current, ()), 0, LAYOUT)[0] == users
    both = joined(camera(DARK, many), (current, few), 1)
    assert both is not None
    named = [_named(many, "hot_pixels"), Named("dark_current", apart, {}, 9.0, ())]
    kept = kept_up(named, both, 1)
    assert kept[0].effect == few
    assert kept[0].errors == errors
    assert kept[0].proposal == again
    bare = camera_without(both, [current], camera(DARK))
    assert given_back(bare, current, 1, LAYOUT) == bare


def test_without_bands_white_rows_have_all_the_variance_of_rows() -> None:
    """Simulated: no effect gains what a larger one that is there as well would explain."""
    bands = effect("row_banding", sigma_dn=0.4, length_rows=2.0)
    model = camera(DARK, bands, effect("row_noise", sigma_dn=0.3))
    bare = given_back(camera_without(model, [bands], camera(DARK)), bands, 1, LAYOUT)
    assert [one.kind for one in bare.effect] == ["dsnu", "row_noise"]
    wide = [_row_variance(one) for one in (model, bare)]
    assert wide[0] == pytest.approx(wide[1], rel=0.15)  # 512 rows, 31 pairs of frames


def test_bands_that_are_not_there_gain_nothing_on_locked_frames() -> None:
    """Beside white rows that lost what the bands took, they would gain half a nat a frame."""
    white = camera(effect("row_noise", sigma_dn=1.0))
    recording = recorded(white, 9, rows=96, columns=128)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    held = hold(recording, split.development, split.locked)
    signals = {e.name: np.full((2, 2), layout.signal_dn[e.name, "MONO"]) for e in layout.uniform}
    bands = effect("row_banding", sigma_dn=0.73, length_rows=0.73)
    false = camera(effect("row_noise", sigma_dn=float(np.sqrt(1 - 0.73**2))), bands)
    gains = {
        name: gain_of(held, false, bare, signals, seed=1)
        for name, bare in {
            "robbed": camera_without(false, [bands], camera()),
            "fair": given_back(camera_without(false, [bands], camera()), bands, 0, LAYOUT),
        }.items()
    }
    assert gains["robbed"].ci95[0] > 0
    assert gains["fair"].nats_per_frame < 0.1 * gains["robbed"].nats_per_frame


def _row_variance(model: Camera) -> float:
    """Return the variance of row means between two frames, DN^2."""
    grid, draw = PixelGrid(512, 64, Cfa.MONO), Draw(3)
    flat = np.full((512, 64), 500.0, np.float32)
    frames = [model.expose(flat, draw.within("t"), draw.within("s"), i, grid) for i in range(32)]
    rows = np.stack([frame.mean(1) for frame in frames])
    return float((np.diff(rows, axis=0) ** 2).mean() / 2)


@pytest.mark.parametrize("own", [(), (DARK,)])
def test_where_nothing_was_credited_the_camera_stays(own: tuple[Effect, ...]) -> None:
    proposal = _bands(0.3)
    assert together(camera(*own), proposal, 0, LAYOUT) == (camera(*own), [proposal])
    drift = Proposal(effect("black_level_drift", sigma_dn=1.0), ("sigma_dn",))
    assert together(camera(WHITE), drift, 0, LAYOUT) == (camera(WHITE), [drift])


def test_a_camera_has_what_was_fitted_once() -> None:
    bands, less = _bands(0.3).effect, effect("row_noise", sigma_dn=0.4)
    both = joined(camera(DARK, WHITE), (bands, less), 1)
    assert both is not None
    assert sorted(both.effect, key=lambda one: one.kind) == [DARK, bands, less]
    alone = joined(camera(DARK), (bands,), 1)
    assert alone is not None
    assert set(alone.effect) == {DARK, bands}


def test_effects_named_are_those_of_the_camera() -> None:
    less = effect("row_noise", sigma_dn=0.4)
    found = kept_up([_named(WHITE), _named(DARK, "dsnu"), _named(None)], camera(DARK, less), 0)
    assert [n.proposal.effect for n in found if n.proposal is not None] == [less, DARK]
    assert found[0].errors == {"sigma_dn": 0.01}
    assert found[2].proposal is None


def test_of_two_of_a_kind_none_is_mistaken_for_the_other() -> None:
    one, other = effect("row_noise", sigma_dn=0.1), effect("row_noise", sigma_dn=0.2)
    (kept,) = kept_up([_named(WHITE)], camera(one, other), 0)
    assert kept.proposal is not None
    assert kept.proposal.effect == WHITE


def test_a_filter_and_charge_share_what_neighbours_have_in_common() -> None:
    """Each has its own law: a share is given back where they are fitted, but not without one."""
    filtering = effect("spatial_filtering", fraction=0.03)
    charge = effect("crosstalk", fraction=0.02)
    bare, starts = together(camera(DARK, filtering), Proposal(charge, ("fraction",)), 1, LAYOUT)
    assert bare.effect == (DARK,)
    sizes: list[Any] = [one.effect.model_dump()["fraction"] for one in starts]
    assert sizes == pytest.approx([0.02, 0.01])
    _, starts = together(camera(charge), Proposal(filtering, ("fraction",)), 0, LAYOUT)
    assert starts[1].effect.model_dump()["fraction"] == pytest.approx(0.002)
    assert given_back(camera(filtering), charge, 0, LAYOUT) == camera(filtering)
