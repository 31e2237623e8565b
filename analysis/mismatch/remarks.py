"""What limits a diagnosis, in sentences."""

from collections import defaultdict
from collections.abc import Sequence

from analysis.mismatch.finding import Mismatch
from analysis.mismatch.layout import Layout
from analysis.mismatch.taking import STILL
from analysis.mismatch.wholecells import Cropped
from analysis.mismatch.words import effect_words, statistic_words
from dsis.recording import Recording
from dsis.recording.copies import COPIES

NO_FLATS = "No flat could be judged: noise that grows with light, and the response, are unknown."
ONE_LEVEL = (
    "There is one level of light, and no dark that could be judged: slope and intercept of the "
    "noise cannot be told apart, and the response is unknown."
)
_LOCATED = "No physics was looked for: it is only said where recording and model differ."
_STOPPED = "Flats stand still below the white level"
_SHOWN = 8
_ALIKE = 1.05  # times another level: no line is told by levels so near


def remarks_on(recording: Recording, layout: Layout) -> tuple[str, ...]:
    """Return what a reader of the result must know of the frames that were used."""
    found = []
    if isinstance(recording, Cropped):
        size = f"{recording.stored.columns} x {recording.stored.rows}"
        found.append(
            f"Frames of {size} pixels are looked at without their odd last row or column: "
            "colours stand on one grid then."
        )
    found += _on_left_out(recording, layout)
    if layout.moving:
        found.append(
            f"Scenes left out, their picture moves between frames: {_listed(layout.moving)}."
        )
    darks = [e for e in layout.uniform if e.kind == "dark"]
    if not darks:
        there = "No dark could be judged" if recording.of_kind("dark") else "There are no darks"
        found.append(
            f"{there}: the black level is the camera model's, offsets and dark current "
            "cannot be told from it."
        )
    flats = [e for e in layout.uniform if e.kind == "flat"]
    if not flats and not layout.scenes:
        found.append(NO_FLATS)
    if flats and not darks and not layout.scenes and _one_level(layout):
        found.append(ONE_LEVEL)
    if flats and any(e.light is None for e in flats):
        found.append(
            "The light of some flats is unknown: their levels cannot show a bent response."
        )
    if any(e.light is not None and recording.exposure(e.name).light is None for e in flats):
        found.append(
            "The light of the flats is not given. Their levels are in proportion to their exposure "
            "times: it is taken to be the same in all, and what bends the levels to be the camera."
        )
    return tuple(found)


def remarks_on_words(words: frozenset[str], all_words: frozenset[str]) -> tuple[str, ...]:
    """Return which effects were not allowed to be named."""
    if not words:
        return (_LOCATED,)
    without = [effect_words(kind) for kind in sorted(all_words - words)]
    return (f"Not allowed to be named: {_listed(without)}.",) if without else ()


def as_far_as(remarks: Sequence[str]) -> str:
    """Return how far a recording can show that nothing differs; empty where it shows enough."""
    if NO_FLATS in remarks:
        return "in darks"
    if ONE_LEVEL in remarks:
        return "as far as one level of light without a dark can show"
    if any(COPIES in remark for remark in remarks):
        return "as far as exposures without copies can show"
    if any(remark.startswith(_STOPPED) for remark in remarks):
        return "as far as levels below those that stand still can show"
    return ""


def _on_left_out(recording: Recording, layout: Layout) -> list[str]:
    """Return which exposures are left out, those of one reason together."""
    by: dict[str, list[str]] = defaultdict(list)
    for name, why in layout.left_out.items():
        by[_reason(recording, layout, name, why)].append(name)
    return [f"{why}: {_listed(names)}." for why, names in by.items()]


def _reason(recording: Recording, layout: Layout, name: str, why: str) -> str:
    """Return why an exposure is left out; of flats, whether no other reaches their code."""
    code = float(why.removeprefix(STILL).split()[0]) if why.startswith(STILL) else 0.0
    levels = [layout.black_dn + own for own in layout.signal_dn.values()]
    if recording.exposure(name).kind != "dark" and code > max(levels):
        return (
            f"{_STOPPED} of {layout.white_dn:g} DN, at code {code:g}: nothing is known of levels "
            "from there on. Left out"
        )
    return f"Exposures left out, {why}"


def _one_level(layout: Layout) -> bool:
    """Return whether all flats are of one level; in coloured light channels have their own."""
    levels = layout.signal_dn.values()
    return max(levels) <= _ALIKE * min(levels)


def remark_on_sizes(users: Sequence[Mismatch]) -> str:
    """Return what differs with the sizes of the user's camera, where nothing else is wrong."""
    most = max(users, key=lambda m: abs(m.z))
    many = f"{len(users)} statistics depart" if len(users) > 1 else "one statistic departs"
    return (
        f"With sizes of effects as camera.toml has them {many}, most of all: "
        f"{statistic_words(most.statistic)} (z = {most.z:.3g}). With those recorded none does, and "
        "what is said here is said of these."
    )


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more
