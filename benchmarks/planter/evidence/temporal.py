"""Evidence in what changes from frame to frame: lines, frames, waves, neighbours, tails."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from planter.evidence.look import Evidence, Look
from planter.readout import residue

Parameters = Mapping[str, Any]


def _by_exposure(look: Look, value: Any, *kinds: str) -> Evidence:
    return Evidence(np.array([value(look.residuals[e]) for e in look.exposures(*kinds)]))


def rows(look: Look) -> Evidence:
    """Return the variance of row means, by exposure."""
    return _by_exposure(look, lambda z: _lines(z, 2))


def columns(look: Look) -> Evidence:
    """Return the variance of column means, by exposure."""
    return _by_exposure(look, lambda z: _lines(z, 1))


def _lines(z: np.ndarray, axis: int) -> float:
    lines = z.mean(axis)
    return float(np.var(lines - lines.mean(1, keepdims=True)))


def neighbouring_rows(look: Look) -> Evidence:
    """Return the covariance of row means one, two and four rows apart, by exposure."""

    def value(z: np.ndarray, apart: int) -> float:
        lines = z.mean(2)
        lines = lines - lines.mean(1, keepdims=True)
        return float(np.mean(lines[:, apart:] * lines[:, :-apart]))

    own = [value(look.residuals[e], apart) for e in look.exposures() for apart in (1, 2, 4)]
    return Evidence(np.array(own))


def frames(look: Look) -> Evidence:
    """Return the variance of frame means, by exposure."""
    return _by_exposure(look, lambda z: float(np.var(z.mean((1, 2), dtype=float))))


def bands(look: Look, p: Parameters) -> Evidence:
    """Return the power of row means at the flicker's frequency, by flat."""
    angle = 2 * np.pi * p["cycles_per_frame"] * np.arange(look.case.rows) / look.case.rows
    carrier = np.exp(-1j * angle)
    # A lit row's brightness on a mosaic depends on its colours: relative rows have one carrier.
    brightness = look.case.response_map().mean(1)

    def power(z: np.ndarray) -> float:
        return float(np.mean(np.abs((z.mean(2) / brightness) @ carrier) ** 2))

    return _by_exposure(look, power, "flat")


def wave(look: Look, p: Parameters) -> Evidence:
    """Return the power at one spatial frequency, by exposure."""
    u, w = p["frequency"]
    along = np.exp(-2j * np.pi * u * np.arange(look.case.columns))
    down = np.exp(-2j * np.pi * w * np.arange(look.case.rows))
    return _by_exposure(look, lambda z: float(np.mean(np.abs(down @ (z @ along).T) ** 2)))


def lags(look: Look, *steps: tuple[int, int]) -> Evidence:
    """Return covariances at spatial lags (rows, columns), by exposure."""
    values = [
        _covariance(look.residuals[e], down, right)
        for e in look.exposures()
        for down, right in steps
    ]
    return Evidence(np.array(values))


def _covariance(z: np.ndarray, down: int, right: int) -> float:
    height, width = z.shape[1] - down, z.shape[2] - right
    return float(np.mean(z[:, :height, :width] * z[:, down:, right:], dtype=float))


def carried(look: Look, p: Parameters) -> Evidence:
    """Return the covariance of samples with the residue of the code before, by exposure."""
    down, right = (0, 1) if p.get("along", "rows") == "rows" else (1, 0)

    def value(e: int) -> float:
        codes, z = look.stacks[e], look.residuals[e]
        left = residue(codes, p)
        left -= left.mean(0)
        height, width = z.shape[1] - down, z.shape[2] - right
        return float(np.mean(left[:, :height, :width] * z[:, down:, right:], dtype=float))

    return Evidence(np.array([value(e) for e in look.exposures()]))


def next_frame(look: Look) -> Evidence:
    """Return the covariance of successive frames, by exposure."""
    return _by_exposure(look, lambda z: float(np.mean(z[:-1] * z[1:], dtype=float)))


def read_out_spectrum(look: Look) -> Evidence:
    """Return the power along the read-out order in octaves, all exposures weighted together."""
    size = look.case.rows * look.case.columns
    edges = np.unique(np.geomspace(1, size // 2, 16).astype(int))
    total, weights = np.zeros(edges.size - 1), 0.0
    for e in look.exposures():
        z = look.residuals[e].reshape(-1, size)
        power = np.mean(np.abs(np.fft.rfft(z, axis=1)) ** 2, 0)
        octaves = np.add.reduceat(power, edges[:-1])[: edges.size - 1] / np.diff(edges)
        variance = float(np.var(z))
        total += octaves / variance**2
        weights += 1 / variance**2
    return Evidence(total / weights)


def moments(look: Look, order: int) -> Evidence:
    """Return a standardised moment of the residuals, by exposure and channel."""

    def value(e: int, place: tuple[slice, slice]) -> float:
        z = look.residuals[e][:, place[0], place[1]].astype(float)
        return float(np.mean(z**order) / np.mean(z**2) ** (order / 2))

    return Evidence(look.by_channel(value))
