"""What draws one number a frame is shown by all frames together, where it is, and only there."""

from dataclasses import replace
from types import SimpleNamespace as Stub
from typing import Any

import pytest

from analysis.mismatch.allframes import once_a_frame, shown_by_all
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.observe import observe
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.trial import Trial
from dsis.effects import Effect, registry
from mismatch_recordings import camera, recorded

# A frame's mean of 48 x 64 pixels scatters by 0.03 % of 1600 DN, and by 0.08 DN in darks.
FLICKER = registry()["flicker"](sigma_percent=0.12)
DRIFT = registry()["black_level_drift"](sigma_dn=0.4)
# Its power at its frequency is a^2 / 4 of 3072 pixels: four times the noise's in darks, 20 DN^2.
WAVE = registry()["periodic_noise"](amplitude_dn=0.32, frequency=(0.2, 0.3))
# 30 pixels, whose jumps are three times the noise of darks.
JUMPS = registry()["rts"](pixel_fraction=0.01, amplitude_dn=14.0)
BANDS = registry()["line_flicker"](depth_percent=0.2, cycles_per_frame=5.3)


def shown(
    true: Effect | None,
    asked: Effect,
    free: tuple[str, ...],
    *,
    some: bool = True,
    own: tuple[Effect, ...] = (),
    nats: float = 0.1,
) -> bool:
    """Return whether all frames of a recording show an effect that was fitted to some.

    `own` are effects that the user's camera has; `nats` is what locked frames gain.
    """
    effects = () if true is None else (true,)
    recording = recorded(camera(*effects), 5, rows=48, columns=64, levels=(400.0, 1600.0))
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    setting = Setting(layout, seen, None, 0, 1, 16, 16, 2, 2, 4)
    final = State.of(setting, camera(*own, asked), lambda: None)
    trial = Trial.of(recording, split, source, setting)
    everything, all_seen = trial.numbers.whole
    whole = replace(setting, layout=everything, seen=all_seen) if some else None
    words = frozenset({asked.kind})
    search = Search(setting, camera(), final, words, lambda: None, whole=whole)
    named = Named(asked.kind, Proposal(asked, free), {}, 10.0, ())
    without = final.camera.model_copy(update={"effect": own})
    return shown_by_all(search, final, named, without, trial, nats)


@pytest.mark.parametrize(
    ("effect", "free"),
    [
        (FLICKER, ("sigma_percent",)),
        (DRIFT, ("sigma_dn",)),
        (WAVE, ()),
        (BANDS, ("depth_percent",)),
        (JUMPS, ("pixel_fraction", "amplitude_dn")),
    ],
)
@pytest.mark.parametrize("there", [True, False])
def test_all_frames_show_what_is_there(
    effect: Effect, free: tuple[str, ...], *, there: bool
) -> None:
    assert shown(effect if there else None, effect, free) == there


@pytest.mark.parametrize("kind", ["prnu", "dsnu"])
@pytest.mark.parametrize(("nats", "there"), [(4.0, True), (2.0, True), (4.0, False)])
def test_a_map_is_shown_where_locked_frames_bear_it_out(
    kind: str, nats: float, *, there: bool
) -> None:
    """What each pixel has for good is in locked frames as well: they must say so, if faintly."""
    size = {"prnu": {"sigma_percent": 0.5}, "dsnu": {"sigma_dn": 1.5}}[kind]
    effect = registry()[kind](**size)
    told = shown(effect if there else None, effect, tuple(size), nats=nats)
    assert told == (there and nats == 4.0)


@pytest.mark.parametrize(
    ("own", "asked"),
    [
        (WAVE, registry()["periodic_noise"](amplitude_dn=0.02, frequency=(0.2, 0.3))),
        (BANDS, registry()["line_flicker"](depth_percent=0.02, cycles_per_frame=5.3)),
    ],
)
def test_a_wave_that_the_camera_has_already_is_not_shown_again(own: Effect, asked: Effect) -> None:
    free = ("depth_percent",) if asked.kind == "line_flicker" else ()
    assert not shown(own, asked, free, own=(own,))


def test_what_is_another_is_not_shown() -> None:
    assert not shown(DRIFT, FLICKER, ("sigma_percent",))
    noisy = registry()["read_noise_spread"](log_sigma=0.3)
    assert not shown(noisy, JUMPS, ("pixel_fraction", "amplitude_dn"))


def test_jumps_that_the_camera_has_already_are_not_shown_again() -> None:
    few = registry()["rts"](pixel_fraction=0.001, amplitude_dn=14.0)
    assert not shown(JUMPS, few, ("pixel_fraction", "amplitude_dn"), own=(JUMPS,))


def test_tails_are_no_jumps() -> None:
    tails = registry()["heavy_tailed_read_noise"](tail_df=4.0)
    assert not shown(tails, JUMPS, ("pixel_fraction", "amplitude_dn"))


@pytest.mark.parametrize("located", [True, False])
@pytest.mark.parametrize("rather", [True, False])
@pytest.mark.parametrize("known", [True, False])
def test_jumps_are_shown_where_frames_locate_or_tell_them(
    located: bool, rather: bool, known: bool
) -> None:
    """Of what may be many pixels none is located; how they move may tell them all the same."""
    lines = Stub(jumping=lambda _: located, jump_rather=lambda _: rather)
    search: Any = Stub(whole=Stub(), least_odds=3.0)
    none: Any = None
    trial: Any = Stub(lines=lines)
    without: Any = Stub(effect=(JUMPS,) if known else ())
    named = Named("rts", Proposal(JUMPS, ("pixel_fraction",)), {}, 10.0, ())
    told = shown_by_all(search, none, named, without, trial, 0.1)
    assert told == ((located or rather) and not known)


def test_of_large_recordings_locked_frames_tell_enough() -> None:
    assert not shown(FLICKER, FLICKER, ("sigma_percent",), some=False)


def test_what_draws_once_a_frame() -> None:
    examples = {
        "flicker": True,
        "black_level_drift": True,
        "line_flicker": True,
        "row_noise": False,
        "dsnu": False,
    }
    made = {
        "flicker": FLICKER,
        "black_level_drift": DRIFT,
        "line_flicker": BANDS,
        "row_noise": registry()["row_noise"](sigma_dn=1.0),
        "dsnu": registry()["dsnu"](sigma_dn=1.0),
    }
    assert {kind: once_a_frame(effect) for kind, effect in made.items()} == examples
    assert once_a_frame(WAVE)
