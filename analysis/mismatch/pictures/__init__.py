"""What a diagnosis draws: the recording beside simulations of both models."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import scipy.stats

from analysis.mismatch.bank.carryover import AXES
from analysis.mismatch.evidence import Evidence
from analysis.mismatch.layout import Layout
from analysis.mismatch.locate import FAMILY, shares
from analysis.mismatch.model import Model, each, in_threads
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.pictures.album import Album
from analysis.mismatch.pictures.carried import carried
from analysis.mismatch.pictures.curves import curves
from analysis.mismatch.pictures.frames import codes, line_spectra, series, shifts, spectra
from analysis.mismatch.pictures.maps import NOISY, map_name, maps, shown_in
from analysis.mismatch.split import Split
from analysis.mismatch.state import State

__all__ = ["Album", "evidence_of"]

_REPLICATES = 4  # simulations of each model that are averaged
_LARGE = 5e6  # samples from which one must do

Simulated = tuple[Album, Observation]


def evidence_of(
    base: State, final: State, album: Album, split: Split, *, seconds: float | None = None
) -> Evidence:
    """Return what the pictures show.

    Parameters
    ----------
    base, final
        The recording beside the re-calibrated base model and the model with the physics named.
    album
        Has watched the observation of the recording.
    split
        Says which frames are locked.
    seconds
        Time taken.
    """
    layout, seen = base.setting.layout, base.setting.seen
    named = final.camera != base.camera
    axes = _carrying(base)
    before, *rest = _simulated([base, final] if named else [base], samples=bool(axes))
    after = rest[0] if rest else []
    first, later = ([album for album, _ in some] for some in (before, after))
    least = threshold_z(base)
    shown = shown_in([base, final], least)
    names = {map_name(NOISY), *(one.map for one in shown.values())}
    return Evidence(
        curves=curves(base, final if named else None)
        | carried(axes, seen, *([one for _, one in some] for some in (before, after))),
        maps=maps(layout, names, seen, before[0][1], after[0][1] if after else None),
        shown_in=shown,
        spectra=spectra(album, first[:1], later[:1]),
        row_spectra=line_spectra(album, first, later, "rows"),
        column_spectra=line_spectra(album, first, later, "columns"),
        series=series(layout, split, album, first, later),
        shifts=shifts(layout, seen),
        codes=codes(album, first, later),
        signal_dn={
            e.name: float(np.mean([base.fit.signal_dn[e.name, c] for c in layout.channels]))
            for e in layout.uniform
        }
        | {
            e.name: float(np.mean([layout.signal_dn[e.name, c] for c in layout.channels]))
            for e in layout.pictures
        },
        tests=int(base.null.known.sum()) + len(base.null.contrasts.keys),
        simulations=len(base.replicates.vectors),
        threshold_z=least,
        familywise_level=FAMILY,
        seconds=seconds,
    )


def _carrying(base: State) -> list[str]:
    """Return the axes along which samples follow the code before them."""
    if all(m.statistic != "carry_over" for m in base.mismatches):
        return []
    z = {
        axis: max(
            abs(float(base.departures[i]))
            for i, key in enumerate(base.null.keys)
            if key.statistic == "carry_over" and key.detail.startswith(axis)
        )
        for axis in AXES
    }
    return [axis for axis in AXES if z[axis] > threshold_z(base)] or [max(AXES, key=z.__getitem__)]


def threshold_z(state: State) -> float:
    """Return from where on the number of a single exposure is certain to depart; none: a sum."""
    null = state.null
    by_key = zip(null.keys, shares(state.setting.layout, null), strict=True)
    least = min((float(share) for key, share in by_key if key.exposure and share > 0), default=1.0)
    chance = FAMILY * least
    return float(scipy.stats.t.isf(chance / 2, null.degrees))


def _simulated(states: Sequence[State], *, samples: bool) -> list[list[Simulated]]:
    """Return the simulated recordings of each state, observed as the recording was.

    `samples`: with those read before each.
    """
    setting = states[0].setting
    layout = setting.layout
    replicates = _REPLICATES if layout.samples <= _LARGE else 1

    work = partial(_one, layout, setting.seed, samples)
    jobs = [(state.calibrated.model, number) for state in states for number in range(replicates)]
    # More samples would be sent between processes than is won.
    done = (in_threads if samples else each)(work, jobs, setting.jobs)
    return [done[i : i + replicates] for i in range(0, len(done), replicates)]


def _one(layout: Layout, seed: int, samples: bool, job: tuple[Model, int]) -> Simulated:
    model, replicate = job
    album = Album(layout)
    frames = model.frames(layout, replicate, seed)
    return album, observe(layout, frames, album, keep=True, samples=samples)
