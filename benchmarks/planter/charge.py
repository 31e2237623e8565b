"""Mechanisms of the collected charge: its counting, its neighbours, its wells."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from planter.view import Image, Mechanism, View, normal


def counted(expected: Image, view: View) -> Image:
    """Return the charge with its shot noise: Gaussian as in the paper, or counted electrons."""
    slope = view.segment_map(lambda segment: segment.slope)
    rng = view.fresh("shot")
    light = np.maximum(expected, 0)
    if view.case.shot == "poisson" or view.case.planted("poisson_shot_noise") is not None:
        return (slope * rng.poisson(light / slope)).astype(np.float32)
    return expected + np.sqrt(slope * light) * normal(rng, view.shape)


def impulse(charge: Image, p: Mapping[str, Any], view: View) -> Image:
    """Let cosmic rays hit single pixels: exponentially distributed charges."""
    rng = view.fresh("impulse")
    hits = rng.poisson(p["per_megapixel_frame"] * charge.size / 1e6)
    out = charge.copy()
    np.add.at(out.ravel(), rng.integers(0, charge.size, hits), rng.exponential(p["mean_dn"], hits))
    return out


def from_neighbours(image: Image, along: str = "both", step: int = 1) -> Image:
    """Return the sum over nearest neighbours of their difference; nothing crosses the border."""
    out = np.zeros_like(image)
    for axis in {"both": (0, 1), "rows": (1,), "columns": (0,)}[along]:
        ahead = np.moveaxis(image, axis, 0)
        gain = np.moveaxis(out, axis, 0)
        difference = ahead[step:] - ahead[:-step]
        gain[:-step] += difference
        gain[step:] -= difference
    return out


def brighter_fatter(charge: Image, p: Mapping[str, Any], view: View) -> Image:
    """Push charge to neighbours with a field that the charge itself makes.

    What crosses a border is proportional to the difference of the squares: at a signal S each
    neighbour takes the share a S of a small excess.
    """
    del view
    return charge + np.float32(p["per_dn"] / 2) * from_neighbours(charge**2)


def crosstalk(charge: Image, p: Mapping[str, Any], view: View) -> Image:
    """Share charge with the nearest neighbours, of whatever colour."""
    del view
    return charge + np.float32(p["fraction"]) * from_neighbours(charge, p.get("along", "both"))


def saturation(charge: Image, p: Mapping[str, Any], view: View) -> Image:
    """Stop at the full well."""
    del view
    return np.minimum(charge, np.float32(p["full_well_dn"]))


def nonlinearity(charge: Image, p: Mapping[str, Any], view: View) -> Image:
    """Bend the response; the largest deviation below 85 % of full scale is as named."""
    full, end = view.case.full_scale_dn, 0.85
    x = charge / np.float32(full)
    bend = {
        "quadratic": lambda u: u * (end - u),
        "cubic": lambda u: u * (end**2 - u**2),
    }[p.get("law", "quadratic")]
    largest = bend(np.linspace(0, end, 1001)).max()
    return charge + (p["percent_full_scale"] / 100 * full / largest * bend(x)).astype(np.float32)


NEIGHBOURS: dict[str, Mechanism] = {
    "impulse": impulse,
    "brighter_fatter": brighter_fatter,
    "crosstalk": crosstalk,
}
WELLS: dict[str, Mechanism] = {"saturation": saturation, "nonlinearity": nonlinearity}
