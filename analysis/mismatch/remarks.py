"""What limits a diagnosis, in sentences."""

from collections.abc import Mapping, Sequence

from analysis.mismatch.finding import Mismatch
from analysis.mismatch.layout import Layout
from analysis.mismatch.wholecells import Cropped
from analysis.mismatch.words import statistic_words
from dsis.recording import Recording

NO_FLATS = "No flat could be judged: noise that grows with light, and the response, are unknown."
_SHOWN = 8


def remarks_on(
    recording: Recording, development: Mapping[str, Sequence[int]], layout: Layout
) -> tuple[str, ...]:
    """Return what a reader of the result must know of the frames that were used."""
    used = {e.name for e in layout.uniform}
    used |= {*layout.scenes, *layout.moving}
    unfit = [e.name for e in recording.exposures if e.name in development and e.name not in used]
    found = []
    if isinstance(recording, Cropped):
        size = f"{recording.stored.columns} x {recording.stored.rows}"
        found.append(
            f"Frames of {size} pixels are looked at without their odd last row or column: "
            "colours stand on one grid then."
        )
    if unfit:
        found.append(
            "Exposures left out, clipped at the white level, of a single frame or of copies: "
            f"{_listed(unfit)}."
        )
    if layout.moving:
        found.append(
            f"Scenes left out, their picture moves between frames: {_listed(layout.moving)}."
        )
    if not recording.of_kind("dark"):
        found.append(
            "There are no darks: the black level is the camera model's, offsets and dark current "
            "cannot be told from it."
        )
    flats = [e for e in layout.uniform if e.kind == "flat"]
    if not flats and not layout.scenes:
        found.append(NO_FLATS)
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
