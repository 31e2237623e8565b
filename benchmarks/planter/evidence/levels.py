"""Evidence in means and variances against light, signal and exposure time."""

import numpy as np

from planter.evidence.look import Evidence, Look


def means_against_light(look: Look) -> Evidence:
    """Return means by exposure and channel; black level and sensitivities are free."""
    planes = len(look.case.channels())
    values = look.by_channel(lambda e, p: float(look.means[e][p].mean(dtype=float)))
    signals = look.signals()
    channel = np.arange(values.size) % planes
    free = [np.ones(values.size), *(signals * (channel == c) for c in range(planes))]
    if all(look.case.exposures[e].light is None for e in look.exposures("flat")):
        # A flat of unknown light says nothing about the response: its level is free.
        free = [np.ones(values.size), *np.eye(values.size)[signals > 0]]
    return Evidence(values, np.stack(free, 1))


def means_against_time(look: Look) -> Evidence:
    """Return mean levels by exposure; black level and sensitivity are free."""
    places = look.exposures()
    values = np.array([look.means[e].mean(dtype=float) for e in places])
    plans = [look.case.exposures[e] for e in places]
    signals = np.array([plan.signal_dn for plan in plans])
    free = [np.ones(values.size), signals]
    if any(plan.light is None for plan in plans):
        free = [np.ones(values.size), *np.eye(values.size)[signals > 0]]
    return Evidence(values, np.stack(free, 1))


def variances(look: Look) -> Evidence:
    """Return variances by exposure and channel; a line per read-out segment is free."""
    values = look.by_channel(look.variance)
    signals = look.signals()
    edges = [s.upper_dn for s in look.case.segments[:-1]]
    path = np.searchsorted(edges, signals, side="right")
    free = []
    for number in range(len(edges) + 1):
        free += [(path == number) * 1.0, (path == number) * signals]
    return Evidence(values, np.stack(free, 1))


def response(look: Look) -> Evidence:
    """Return means against light and variances against signal, together."""
    return joined(means_against_light(look), variances(look))


def cut(look: Look) -> Evidence:
    """Return variances and third moments of flats: a full well cuts their upper half."""
    third = look.by_channel(
        lambda e, p: float(np.mean(look.residuals[e][:, p[0], p[1]].astype(float) ** 3))
    )
    return joined(variances(look), Evidence(third))


def green_difference(look: Look) -> Evidence:
    """Return the difference of the two greens by exposure."""
    planes = look.case.channels()
    rows = [look.means[e] for e in look.exposures("flat")]
    return Evidence(
        np.array([m[planes["Gr"]].mean(dtype=float) - m[planes["Gb"]].mean() for m in rows])
    )


def joined(first: Evidence, second: Evidence) -> Evidence:
    """Return both, each with its own nuisances."""
    values = np.concatenate([first.values, second.values])
    parts = [part.nuisance for part in (first, second)]
    widths = [0 if part is None else part.shape[1] for part in parts]
    free = np.zeros((values.size, sum(widths)))
    if parts[0] is not None:
        free[: first.values.size, : widths[0]] = parts[0]
    if parts[1] is not None:
        free[first.values.size :, widths[0] :] = parts[1]
    return Evidence(values, free)
