"""The levels of a recording as the fit sees them: above black, before rounding, used or not."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from analysis.photon_transfer.black import DarkLine, dark_line
from analysis.photon_transfer.lines import Points
from analysis.photon_transfer.rounding import as_coded, unrounded
from analysis.photon_transfer.segments import SegmentFit
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.recording.hygiene import CLIPPED_SHARE

COLLAPSE = 0.5  # variance below this share of its maximum, for good: the charge is full
WANDER_P = 1e-3  # frame means that wander more than chance does so often do wander


@dataclass(frozen=True)
class FittedLevel:
    """One level of one channel as the fit saw it.

    Attributes
    ----------
    statistics
        What was measured, in raw codes.
    x_dn, x_se_dn
        Level above black, before rounding.
    noise_dn2, noise_se_dn2
        Temporal variance before rounding.
    left_out
        Why the fit does not use it; empty where it does.
    z
        (noise - fitted line) in standard errors.
    """

    statistics: LevelStatistics
    x_dn: float
    x_se_dn: float
    noise_dn2: float
    noise_se_dn2: float
    left_out: str
    z: float


def spoiled(s: LevelStatistics) -> str:
    """Return why a level's mean cannot be used; empty where it can."""
    reasons = (
        (s.frames < 2, "one frame only: no noise to be seen"),
        (s.clipped_high > CLIPPED_SHARE, "more than 0.01 % of its samples are at the white level"),
        (s.clipped_low > CLIPPED_SHARE, "more than 0.01 % of its samples are at code 0"),
        (s.copies and s.repeated_frames > 0, "frames equal the frame before bit for bit"),
        (s.copies, "a frame occurs elsewhere in the recording bit for bit"),
        (not (s.variance_dn2 > 0 or s.frame_sd_dn > 0), "its frames do not vary"),
    )
    return next((why for holds, why in reasons if holds), "")


def useless(s: LevelStatistics) -> str:
    """Return why a level's noise cannot be used; empty where it can."""
    if why := spoiled(s):
        return why
    if not s.variance_dn2 > 0:
        used = ", and its mean is used alone" if s.kind == "dark" else ""
        return f"its frames vary as a whole only{used}"
    return "" if s.variance_se_dn2 > 0 else "its frames do not vary"


def dark_of(
    measured: Sequence[LevelStatistics], channel: str, step_dn: int = 1, phase_dn: int = 0
) -> DarkLine | None:
    """Return the black level of one channel, from the darks that are not clipped at code 0."""
    usable = [s for s in measured if s.kind == "dark" and s.channel == channel and not spoiled(s)]
    if not usable:
        return None
    times, levels, errors, hidden = [], [], [], False
    for s in usable:
        plain = unrounded(
            s.level_dn,
            s.level_se_dn,
            s.variance_dn2,
            s.variance_se_dn2,
            s.fixed_dn2,
            step_dn,
            phase_dn,
        )
        hidden |= not plain.recovered
        # A frame offset that wanders moves the mean more than the pixels' noise does.
        wanders = stats.f.sf(s.wander, s.frames - 1, 1e6) < WANDER_P
        error = plain.level_se_dn * (np.sqrt(s.wander) if wanders else 1.0)
        if not s.variance_dn2 > 0:  # the same, where there is nothing but the wander
            error = s.frame_sd_dn / np.sqrt(s.frames)
        times.append(s.exposure_time_s)
        levels.append(plain.level_dn)
        errors.append(float(error))
    line = dark_line(times, levels, errors)
    if not hidden:
        return line
    # Codes hide where between two of them the mean lies: alike in all darks, so nothing averages.
    return replace(line, black_se_dn=float(np.hypot(line.black_se_dn, step_dn / np.sqrt(12))))


def levels_of(
    measured: Iterable[LevelStatistics],
    darks: dict[str, DarkLine | None],
    nominal_dn: float,
    step_dn: int = 1,
    phase_dn: int = 0,
) -> list[FittedLevel]:
    """Return every measured level above black and before rounding, with why it is of no use."""
    levels = []
    for s in measured:
        dark, why = darks[s.channel], useless(s)
        numbers = (s.level_dn, s.level_se_dn, s.variance_dn2, s.variance_se_dn2)
        plain = as_coded(*numbers) if why else unrounded(*numbers, s.fixed_dn2, step_dn, phase_dn)
        if not why and not plain.recovered:
            why = "its noise is too small beside one code to be recovered from rounding"
        x = plain.level_dn - (dark.black_dn if dark else nominal_dn)
        if s.kind == "dark":
            if dark is None:
                why = why or "no usable dark of this channel"
            else:
                # The wander of the offset is no signal; only a dark current is.
                x = _dark_signal(dark, s.exposure_time_s)
        levels.append(
            FittedLevel(
                s,
                x,
                plain.level_se_dn,
                plain.variance_dn2,
                plain.variance_se_dn2,
                why,
                float("nan"),
            )
        )
    return levels


def _dark_signal(dark: DarkLine, exposure_time_s: float) -> float:
    current, error = dark.current_dn_per_s, dark.current_se_dn_per_s
    if current is None or error is None or current < 3 * error:
        return 0.0
    return current * exposure_time_s


def saturation_of(levels: Sequence[FittedLevel]) -> float | None:
    """Return the level (DN above black) at which charge stops growing below the white level.

    Seen where the variance falls below half of its maximum at a higher level and stays there.
    """
    plateaus = []
    for channel in {level.statistics.channel for level in levels}:
        flats = sorted(
            (
                level
                for level in levels
                if level.statistics.kind == "flat"
                and level.statistics.channel == channel
                and level.statistics.frames > 1
                and level.statistics.clipped_high <= CLIPPED_SHARE
            ),
            key=lambda level: level.x_dn,
        )
        if len(flats) < 3:
            continue
        variance = np.array([level.statistics.variance_dn2 for level in flats])
        top = int(np.argmax(variance))
        full = [f for f, v in zip(flats[top + 1 :], variance[top + 1 :], strict=True)
                if v < COLLAPSE * variance[top]]  # fmt: skip
        if full and variance[-1] < COLLAPSE * variance[top]:
            plateaus.append(float(np.mean([level.x_dn for level in full])))
    return float(np.mean(plateaus)) if plateaus else None


def leave_out(
    levels: Sequence[FittedLevel], saturation: float | None, remarks: list[str]
) -> list[FittedLevel]:
    """Mark the levels at saturation and say, once for each reason, what is left out."""
    kept = []
    for level in levels:
        why = level.left_out
        # Closer than 3.7 sd, more than 1e-4 of the pixels are full.
        near = 3.7 * np.sqrt(max(level.noise_dn2, 0.0) + max(level.statistics.fixed_dn2, 0.0))
        if not why and saturation is not None and level.x_dn + near > saturation:
            why = f"the charge is full at {saturation:.5g} DN"
        kept.append(replace(level, left_out=why))
    reasons: dict[str, list[str]] = {}
    for level in kept:
        if level.left_out:
            s = level.statistics
            reasons.setdefault(level.left_out, []).append(f"{s.exposure} ({s.channel})")
    for reason, which in reasons.items():
        shown = ", ".join(which[:12]) + (f" and {len(which) - 12} more" if which[12:] else "")
        remarks.append(f"Left out, {reason}: {shown}.")
    return kept


def points_of(levels: Sequence[FittedLevel]) -> Points:
    """Return the levels that are not left out, as the points to fit."""
    used = [level for level in levels if not level.left_out]
    return Points.of(
        x_dn=np.array([level.x_dn for level in used], float),
        variance_dn2=np.array([level.noise_dn2 for level in used], float),
        relative_se=np.array(
            [level.noise_se_dn2 / max(level.noise_dn2, 1e-9) for level in used], float
        ),
        x_se_dn=np.array([level.x_se_dn for level in used], float),
        channel=np.array([level.statistics.channel for level in used], np.str_),
        black_share=np.array(
            [0.0 if level.statistics.kind == "dark" else -1.0 for level in used], float
        ),
    )


def with_residual(level: FittedLevel, fit: SegmentFit) -> FittedLevel:
    """Return the level with its distance from the fitted line, in standard errors."""
    line = float(fit.variance_dn2(np.array([level.x_dn]))[0])
    error = abs(line) * level.noise_se_dn2 / max(level.noise_dn2, 1e-9)
    z = (level.noise_dn2 - line) / error if error > 0 else float("nan")
    return replace(level, z=z)
