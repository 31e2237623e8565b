"""A recording without its spikes: what its pixels have in the other frames stands there instead."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.source import Source
from analysis.mismatch.spikes.hits import Hits
from analysis.mismatch.spikes.population import Spikes, spikes_of
from analysis.mismatch.spikes.shared import with_shares
from dsis.camera import Camera
from dsis.recording import RecordedExposure, Recording
from dsis.recording.model import Codes

Key = tuple[str, int]
Patch = tuple[NDArray[np.intp], NDArray[np.intp], Codes]


@dataclass(frozen=True)
class Cleaned(Recording):
    """A recording some of whose samples are replaced.

    Attributes
    ----------
    stored
        The recording as it is read.
    patches
        By exposure and frame: rows, columns and codes.
    """

    stored: Recording
    patches: Mapping[Key, Patch]

    def frame(self, exposure: RecordedExposure, index: int) -> Codes:
        """Return one frame as `Recording.frame` does, without spikes."""
        return self.patched((exposure.name, index), self.stored.frame(exposure, index))

    def patched(self, key: Key, frame: Codes) -> Codes:
        """Return a frame without spikes; the frame itself where it has none."""
        if key not in self.patches:
            return frame
        rows, columns, codes = self.patches[key]
        made = frame.copy()
        made[rows, columns] = codes
        return made


def cleaned(recording: Recording, replaced: Hits) -> Cleaned:
    """Return a recording whose `replaced` samples are as in their pixels' other frames."""
    patches = {}
    for number, exposure in enumerate(recording.exposures):
        own = replaced.of(replaced.exposure == number)
        for frame in np.unique(own.frame):
            here = own.of(own.frame == frame)
            patches[exposure.name, int(frame)] = (here.row, here.column, here.instead)
    values = {field.name: getattr(recording, field.name) for field in fields(Recording)}
    return Cleaned(**values, stored=recording, patches=patches)


def without_spikes(recording: Recording, camera: Camera) -> tuple[Recording, Source, Spikes | None]:
    """Return a recording and its source without spikes, and these; None: there are none.

    What was read to find them is not read again.
    """
    source = Source(recording)
    spikes = spikes_of(recording, source, camera)
    if spikes is None:
        return recording, source, None
    own, made = _without(spikes, recording, source)
    spikes = with_shares(spikes, own, made, camera)
    if spikes.shares is not None:
        del own, made  # no frame is held three times
        own, made = _without(spikes, recording, source)
    return own, made, spikes


def _without(spikes: Spikes, recording: Recording, source: Source) -> tuple[Cleaned, Source]:
    own = cleaned(recording, spikes.replaced)
    made = Source(own)
    made.identities = source.identities  # of what lies on disk
    made.kept = {key: own.patched(key, frame) for key, frame in source.kept.items()}
    return own, made
