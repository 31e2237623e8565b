"""What camera.toml should have said: the truth behind a parameter error."""

from collections.abc import Mapping
from typing import Any

from planter.case import Case
from planter.disk import camera_values

SAME = 1e-6  # relative: numbers went through text


def truth_of(case: Case, entry: Mapping[str, Any]) -> tuple[str, tuple[float, float]] | None:
    """Return the parameter's plain name and the range that its true value lies in.

    The segment is the one whose number in camera.toml the entry quotes. A switch is known up to
    the gap between the levels around it.
    """
    name, quoted = entry["parameter"], entry["model"]
    if name.startswith("effect."):
        _, kind, size = name.split(".")
        true = (case.planted(kind) or {}).get(size)
        return None if true is None else (name, (true, true))
    if "black" in name:
        return "black_level", (case.black_level, case.black_level)
    segments = camera_values(case)["noise"]["segment"]
    for key, plain in (("slope", "noise.slope"), ("intercept", "noise.intercept")):
        if key in name:
            for written, true in zip(segments, case.segments, strict=True):
                if abs(written[key] - quoted) <= SAME * max(abs(quoted), SAME):
                    return plain, (getattr(true, key), getattr(true, key))
    if "switch" in name or "upper" in name:
        return "noise.switch_dn", switch_gap(case)
    return None


def switch_gap(case: Case) -> tuple[float, float]:
    """Return the levels on either side of the true switch, of any channel."""
    switch = case.true_segments[0].upper_dn or 0.0
    weights = set(case.response)
    signals = [p.signal_dn * w for p in case.exposures if p.kind == "flat" for w in weights]
    below = max((s for s in signals if s < switch), default=0.0)
    return below, min((s for s in signals if s >= switch), default=case.full_scale_dn)


def covered(entry: Mapping[str, Any], truth: tuple[float, float], errors: float = 1.96) -> bool:
    """Tell whether the recorded value's 95 % interval reaches the true range."""
    reach = errors * (entry["standard_error"] or 0.0)
    return truth[0] - reach <= entry["recorded"] <= truth[1] + reach
