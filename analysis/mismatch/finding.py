"""What a diagnosis found: the values of `mismatch.json`, and what its pictures are drawn from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from dsis.camera import Camera

SCHEMA = "dsis-mismatch/1"
Verdict = Literal["match", "parameters", "omitted_physics", "unexplained"]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Where:
    """Where a recording differs from the simulation; None: everywhere, or not a matter of it.

    Attributes
    ----------
    exposures
        Names of the exposures.
    kind
        `dark`, `flat`, `scene`; None where several kinds are concerned.
    channel
        MONO, R, Gr, Gb, B; None: all alike.
    signal_dn
        Range of the signal, DN above black.
    rows, columns
        First and last row (column).
    spatial_frequency
        Cycles per pixel of the mosaic along x and y.
    frames
        Numbers of the frames, from 0.
    pixels
        The (row, column) of single pixels, the most conspicuous first.
    exposure_time_s
        Range of the exposure time, s, where it matters.
    """

    exposures: tuple[str, ...] = ()
    kind: str | None = None
    channel: str | None = None
    signal_dn: Interval | None = None
    rows: tuple[int, int] | None = None
    columns: tuple[int, int] | None = None
    spatial_frequency: Interval | None = None
    frames: tuple[int, ...] | None = None
    pixels: tuple[tuple[int, int], ...] | None = None
    exposure_time_s: Interval | None = None


@dataclass(frozen=True)
class Mismatch:
    """One statistic in which the recording differs.

    Attributes
    ----------
    statistic
        Its name: one of `dsis.measures.MEASURES` or of `analysis.mismatch.bank`; or what whole
        frames show besides, see `jumping`.
    z
        Departure in standard deviations of the null.
    p_adjusted
        Probability of any such departure in a recording that differs in nothing.
    where, says
        Where, and one plain sentence.
    explained_by
        The effect that explains it; None: nothing does.
    z_after
        The largest departure from the final model, of either sign as `z`; nan where nothing was
        named, or frames alone would say.
    """

    statistic: str
    z: float
    p_adjusted: float
    where: Where
    says: str
    explained_by: str | None = None
    z_after: float = float("nan")


@dataclass(frozen=True)
class ParameterError:
    """A number of the camera model that the recording contradicts."""

    parameter: str
    model: float
    recorded: float
    standard_error: float


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of a named effect, several numbers for one such as a frequency (x, y).

    `standard_error` is in its unit, that of each number.
    """

    value: float | tuple[float, ...]
    standard_error: float


@dataclass(frozen=True)
class Gain:
    """Gain of log-likelihood on the locked frames, nats per frame, with its 95 % interval.

    Of what moves whole frames, where few locked ones leave it open: of all, each told by the rest.
    """

    nats_per_frame: float
    ci95: Interval


@dataclass(frozen=True)
class Alternative:
    """An effect that was considered and not named, or that ties with the one named."""

    effect: str
    heldout_gain: Gain | None
    why_not: str
    would_settle: str = ""


@dataclass(frozen=True)
class OmittedEffect:
    """Physics that the camera model leaves out, as it was fitted and proven."""

    effect: str
    parameters: Mapping[str, FittedParameter]
    because: tuple[str, ...]
    heldout_gain: Gain
    alternatives: tuple[Alternative, ...] = ()
    choices: Mapping[str, str] = field(default_factory=dict)
    """Of its parameters those that are words: an edge, the regions of amplifiers."""


@dataclass(frozen=True)
class Change:
    """A number before and after physics was added."""

    before: float
    after: float


@dataclass(frozen=True)
class Proof:
    """How much better the final model predicts the locked frames; see contracts, section 4."""

    heldout_frames: Mapping[str, tuple[int, ...]]
    loglik_per_pixel: Change
    discrepancies: Change
    gap_closed: float | None
    classifier_auc: Change | None
    photon_transfer_chi2: Change | None = None


@dataclass(frozen=True)
class Finding:
    """The result of a diagnosis.

    Attributes
    ----------
    verdict
        The first that applies of omitted_physics, unexplained, parameters, match.
    mismatches
        Where the re-calibrated base model fails, the largest departure first.
    parameter_errors
        Numbers of the camera model that the recording contradicts.
    omitted_physics
        Effects named, the largest gain first.
    unexplained
        What is left after them.
    undecided
        Effects that tie: none of them is named.
    proof
        Before and after on the locked frames.
    camera
        The camera model re-calibrated, with the effects named.
    remarks
        What limits the result, in sentences.
    searched
        Whether physics was looked for.
    without
        Effects that were not allowed to be named, where it was.
    evidence
        What the report draws: `analysis.mismatch.evidence.Evidence`; no part of the JSON.
    """

    verdict: Verdict
    mismatches: tuple[Mismatch, ...]
    parameter_errors: tuple[ParameterError, ...]
    omitted_physics: tuple[OmittedEffect, ...]
    unexplained: tuple[Mismatch, ...]
    undecided: tuple[Alternative, ...]
    proof: Proof
    camera: Camera
    remarks: tuple[str, ...] = ()
    searched: bool = True
    without: tuple[str, ...] = ()
    evidence: Any = field(default=None, compare=False, repr=False)

    def values(self) -> dict[str, Any]:
        """Return what `mismatch.json` holds: plain values, None for what is not known."""
        from analysis.mismatch.jsonfile import finding_values  # noqa: PLC0415 # it imports this file

        return finding_values(self)
