"""What whole frames say of pixels that jump, of pairs and rows of frames, and of bursts."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from analysis.mismatch.burst import Bursts, bursts_of
from analysis.mismatch.columncodes import ColumnCodes, column_codes
from analysis.mismatch.jumping import LEAST, Jumping
from analysis.mismatch.layout import Layout
from analysis.mismatch.ordinary import Ordinary, ordinary_pixels
from analysis.mismatch.paired import Pairs, pairs_of
from analysis.mismatch.projections import FramesOf
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.repeated import Repeated, repeats_of
from analysis.mismatch.rowodds import RowLaw
from analysis.mismatch.rowpower import Size, row_powers
from analysis.mismatch.sampletails import Ring, ring_of
from analysis.mismatch.sidedneighbours import Sided, sided
from analysis.mismatch.telegraph import Telegraph, could_jump
from analysis.mismatch.telegraph import telegraph as find_telegraph
from dsis.effects.rts import Rts


@dataclass(frozen=True)
class FramesAsked:
    """Frames that are asked once for each of these: what `WholeFrames` begins with.

    Attributes
    ----------
    layout, frames_of
        The frames.
    jobs
        Threads that look at them.
    """

    layout: Layout
    frames_of: FramesOf
    jobs: int = 1

    @cached_property
    def telegraph(self) -> Telegraph | None:
        """The pixels that jump; of a large recording nothing is asked."""
        if self.layout.large:
            return None
        return find_telegraph(self.layout, self.frames_of, self.jobs)

    def spread_rather(self, sure: float) -> float:
        """Return by how much frames prefer read noises that spread to pixels that jump, nats.

        What one gains that is `sure` where the other is not told, negative of jumps; else 0.
        """
        seen = self.telegraph
        if seen is None or min(seen.spread, seen.jumping) > TOLD_APART:
            return 0.0
        if max(seen.spread, seen.jumping) <= sure:
            return 0.0
        return seen.spread if seen.spread > sure else -seen.jumping

    def jump_rather(self, sure: float) -> bool:
        """Return whether frames are `sure` that pixels jump rather than are noisy otherwise, nats.

        And that they may be few: jumps of more are told by sums.
        """
        seen = self.telegraph
        return seen is not None and seen.jumping > sure and seen.few

    def no_jumps(self, sure: float) -> bool:
        """Return whether frames are `sure` that noisy pixels do not jump, nats."""
        return self.telegraph is not None and self.telegraph.jumping < -sure

    def jumping(self, least: float) -> bool:
        """Return whether frames show pixels that jump, and rather than are noisy otherwise.

        `least` is by how much they must be likelier with them, nats.
        """
        seen = self.telegraph
        return seen is not None and seen.gain >= least and seen.jumping > TOLD_APART

    @property
    def located(self) -> Jumping | None:
        """That few pixels of a small recording jump; None: frames do not show it."""
        if self.layout.large or not could_jump(self.layout, self.frames_of, LEAST):
            return None
        seen = self.telegraph
        if seen is None or not self.jumping(LEAST):
            return None
        return Jumping.of(seen.gain, [exposure.name for exposure in self.layout.uniform])

    @property
    def jumps(self) -> Rts | None:
        """The pixels that jump, of their mean numbers; None: nothing is asked."""
        seen = self.telegraph
        return None if seen is None else Rts.model_validate({"kind": "rts", **seen.values})

    @cached_property
    def pairs(self) -> Pairs:
        """What successive frames share, of even and of odd numbers."""
        return pairs_of(self.layout, self.frames_of)

    @cached_property
    def ordinary(self) -> Ordinary:
        """Whether ordinary pixels differ in how noisy they are; of a large recording: unknown."""
        if self.layout.large:
            return Ordinary()
        return ordinary_pixels(self.layout, self.frames_of)

    @cached_property
    def bursts(self) -> Bursts:
        """How much of their tails lies in single lines."""
        return bursts_of(self.layout, self.frames_of)

    @cached_property
    def column_codes(self) -> ColumnCodes | None:
        """Whether columns share which of their codes are uneven; None: they do not tell."""
        return column_codes(self.layout, self.frames_of)

    @cached_property
    def ring(self) -> Ring:
        """How many samples of darks are moderately far out."""
        return ring_of(self.layout, self.frames_of)

    @cached_property
    def sided(self) -> Sided:
        """How much more alike neighbours are on one side than on the other."""
        return sided(self.layout, self.frames_of)

    @cached_property
    def repeats(self) -> Mapping[str, Repeated]:
        """How far offsets of a dark are repeated by other exposures, of each kind."""
        return repeats_of(self.layout, self.frames_of)

    @cached_property
    def rows(self) -> RowLaw:
        """What they say of the causes that make rows alike."""
        powers = row_powers(self.layout, self.frames_of)
        return RowLaw(Size(self.layout.rows, self.layout.columns), powers)
