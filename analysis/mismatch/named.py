"""What a search has taken in, and cameras without it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.instance import instance
from dsis.camera import Camera
from dsis.effects import Effect


@dataclass(frozen=True)
class Named:
    """An effect taken in.

    Attributes
    ----------
    kind
        Its name; `dual_gain` is a second read-out segment.
    proposal
        The effect with its free parameters; None for `dual_gain`.
    errors
        Standard errors of the parameters.
    gain
        Log-likelihood of the bank's numbers that it is worth beside the others.
    rivals
        Other effects tried in its place: kind, and by how much they were worse.
    """

    kind: str
    proposal: Proposal | None
    errors: dict[str, float]
    gain: float
    rivals: tuple[tuple[str, float], ...]
    switch_dn: float = float("nan")

    @property
    def name(self) -> str:
        """Its kind, and of a line its frequency, of a decay its edge: there may be several."""
        return instance(self.kind, None if self.proposal is None else self.proposal.effect)


def renewed(named: Named, proposal: Proposal, effect: Effect, errors: dict[str, float]) -> Named:
    """Return an effect named with other parameters and their errors."""
    return replace(
        named,
        proposal=replace(proposal, effect=effect),
        errors=errors,
    )


def camera_without(camera: Camera, effects: Sequence[Effect], given: Camera) -> Camera:
    """Return a camera without some of its effects; those that the user's camera has stay."""
    left = list(camera.effect)
    for effect in effects:
        for i in range(len(left) - 1, len(given.effect) - 1, -1):
            if left[i] == effect:
                del left[i]
                break
    return camera.model_copy(update={"effect": tuple(left)})
