"""Mechanisms that add an offset: fixed or fresh, of lines, frames, pixels, waves."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len

from planter.view import Image, Mechanism, View, normal


def row_noise(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fresh offset to every row."""
    return signal + np.float32(p["sigma_dn"]) * normal(view.fresh("row"), (view.case.rows, 1))


def column_noise(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fresh offset to every column."""
    return signal + np.float32(p["sigma_dn"]) * normal(view.fresh("column"), (1, view.case.columns))


def row_fpn(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fixed offset to every row."""
    return signal + np.float32(p["sigma_dn"]) * normal(
        view.of_sensor("row_fpn"), (view.case.rows, 1)
    )


def column_fpn(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fixed offset to every column."""
    return signal + np.float32(p["sigma_dn"]) * normal(
        view.of_sensor("column_fpn"), (1, view.case.columns)
    )


def dsnu(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fixed offset to every pixel."""
    return signal + np.float32(p["sigma_dn"]) * normal(view.of_sensor("dsnu"), view.shape)


def black_level_drift(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Move the whole frame: independent offsets, or a walk that returns to zero."""
    keep = p.get("persistence", 0.0)
    steps = view.of_exposure("drift").standard_normal(view.frame + 2)
    offset = steps[0]
    for step in steps[1:]:
        offset = keep * offset + np.sqrt(1 - keep**2) * step
    return signal + np.float32(p["sigma_dn"] * offset)


def pink_noise(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add 1/f noise along the read-out order; sigma is that of the series over two frames."""
    size = next_fast_len(2 * signal.size, real=True)
    rng = view.fresh("pink")
    frequency = np.arange(1, size // 2 + 1)
    parts = rng.standard_normal((2, frequency.size)) / np.sqrt(frequency)
    spectrum = np.concatenate([[0], parts[0] + 1j * parts[1]])
    # irfft's mean square is sum of 2 |X|^2 / size^2, and E |X|^2 = 2 / frequency.
    unit = np.sqrt(4 * np.sum(1 / frequency)) / size
    series = irfft(spectrum, size)[: signal.size].reshape(view.shape)
    return signal + (p["sigma_dn"] / unit * series).astype(np.float32)


def wave_angle(view: View, frequency: tuple[float, float]) -> np.ndarray:
    """Return the phase of a plane wave, rad; `frequency` is (x, y) in cycles per pixel."""
    rows, columns = view.shape
    y, x = np.arange(rows)[:, None], np.arange(columns)[None, :]
    return 2 * np.pi * (frequency[0] * x + frequency[1] * y)


def periodic_noise(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add interference: one plane wave, its phase free in every frame."""
    phase = view.fresh("periodic").uniform(0, 2 * np.pi)
    wave = np.sin(wave_angle(view, p["frequency"]) + phase)
    return signal + (p["amplitude_dn"] * wave).astype(np.float32)


def bistable_pattern(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a fixed pattern whose sign is thrown in every frame."""
    sign = 1 if view.fresh("bistable").random() < 0.5 else -1
    pattern = np.cos(wave_angle(view, p["frequency"]))
    return signal + (sign * p["amplitude_dn"] * pattern).astype(np.float32)


def row_banding(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add offsets that rows share: normal deviates under the root of their covariance."""
    root = _root_of_rows(view.case.rows, p["length_rows"])
    offsets = root @ view.fresh("banding").standard_normal(view.case.rows)
    return signal + (p["sigma_dn"] * offsets[:, None]).astype(np.float32)


@lru_cache(maxsize=8)
def _root_of_rows(rows: int, length: float) -> np.ndarray:
    """Return the triangular root of exp(-distance / length) of all pairs of rows."""
    y = np.arange(rows)
    return np.linalg.cholesky(np.exp(-np.abs(y[:, None] - y) / length))


OFFSETS: dict[str, Mechanism] = {
    "dsnu": dsnu,
    "row_fpn": row_fpn,
    "column_fpn": column_fpn,
    "row_noise": row_noise,
    "row_banding": row_banding,
    "column_noise": column_noise,
    "black_level_drift": black_level_drift,
    "pink_noise": pink_noise,
    "periodic_noise": periodic_noise,
    "bistable_pattern": bistable_pattern,
}
