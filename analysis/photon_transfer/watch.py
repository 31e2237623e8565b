"""What the frames say of each other while they stream: copies, and steps between codes."""

from collections import defaultdict

import numpy as np

from dsis.recording.hygiene import Inspection


class Watch(Inspection):
    """An inspection that also says which exposures hold copies, and the step of all codes."""

    def copied(self) -> frozenset[str]:
        """Return the exposures that hold a frame which occurs twice in the recording."""
        places: dict[bytes, list[str]] = defaultdict(list)
        for name, frames in self._seen.items():
            for frame in frames.values():
                if frame.least < frame.largest:  # a constant frame may well occur twice
                    places[frame.digest].append(name)
        return frozenset(name for names in places.values() if len(names) > 1 for name in names)

    def step_dn(self) -> int:
        """Return the power of two of which all codes are multiples; 1 for ordinary codes."""
        bits = [frame.bits for frames in self._seen.values() for frame in frames.values()]
        common = int(np.bitwise_or.reduce(bits or [0]))
        return max(common & -common, 1)
