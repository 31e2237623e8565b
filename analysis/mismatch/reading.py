"""How a recording is read: whole cells, without copies and spikes, with light where levels tell."""

from dataclasses import dataclass

from analysis.mismatch.copied import copies_of, remark_on_copies, without_copies
from analysis.mismatch.source import Source
from analysis.mismatch.spikes import Spikes, without_spikes
from analysis.mismatch.steadylight import with_steady_light
from analysis.mismatch.wholecells import whole_cells
from dsis.camera import Camera
from dsis.recording import Recording


@dataclass(frozen=True)
class Read:
    """A recording as it is looked at.

    Attributes
    ----------
    whole
        As it lies on disk, whole cells of it.
    stored
        The same without the exposures that hold copies.
    recording, source
        Without spikes, and with light where levels tell it.
    spikes
        None: there are none.
    remarks
        What was left out.
    """

    whole: Recording
    stored: Recording
    recording: Recording
    source: Source
    spikes: Spikes | None
    remarks: tuple[str, ...]


def read(recorded: Recording, camera: Camera) -> Read:
    """Return a recording as it is looked at; raise `InputError` where copies are in all of it."""
    stored = whole = whole_cells(recorded)
    remarks: tuple[str, ...] = ()
    recording, source, spikes = without_spikes(stored, camera)
    copies = copies_of(stored, source)
    if copies:  # spikes are told by how many frames have one: those of copies do not count
        remarks = (remark_on_copies(copies),)
        stored = without_copies(stored, copies)
        del recording, source, spikes  # no frame is held twice
        recording, source, spikes = without_spikes(stored, camera)
    return Read(whole, stored, with_steady_light(recording, source), source, spikes, remarks)
