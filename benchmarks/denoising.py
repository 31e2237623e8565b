"""Denoising beside other libraries: `python benchmarks/denoising.py SHARED_DATA [--frame]`.

Grey: PSNR at a noise of 25 codes on Cameraman, House, Lena, Barbara and Boat of Set12, mean over
`--seeds` noises, beside the published values, and the time of each against dsis's BM3D. `--frame`:
one RGB frame of 960 x 540 instead, tiled from Kodak images, noise of 10 codes; the `bm3d` wheel
takes minutes for it. All rows of an image are run in turn. Peers, used where they are installed:
`bm3d` (non-commercial: for comparison only) and scikit-image.
"""

import argparse
import importlib
import os
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from analysis.denoising import bls_gsm, bm3d
from dsis.imagefile import read

YARDSTICK = "dsis bm3d, threads=2"
FILES = {"Cameraman": 1, "House": 2, "Lena": 8, "Barbara": 9, "Boat": 10}
PUBLISHED = {  # Dabov et al. 2007; Portilla et al. 2003
    "dsis bm3d, threads=2": (29.45, 32.86, 32.08, 30.72, 29.90),
    "dsis bls_gsm, threads=2": (None, 31.40, 31.69, 29.13, 29.37),
}

Denoiser = Callable[[np.ndarray, float], np.ndarray]


def denoisers() -> dict[str, Denoiser | None]:
    rows: dict[str, Denoiser | None] = {
        f"dsis {f.__name__}, threads={n}": partial(f, threads=n)
        for f in (bm3d, bls_gsm)
        for n in (1, 2)
    }
    rows |= {"bm3d wheel": None, "scikit-image wavelet": None, "scikit-image NLM": None}
    try:
        wheel = importlib.import_module("bm3d")
        rows["bm3d wheel"] = partial(run_wheel, wheel)
    except ImportError:
        pass
    try:
        restoration = importlib.import_module("skimage.restoration")
        rows["scikit-image wavelet"] = partial(run_wavelet, restoration)
        rows["scikit-image NLM"] = partial(run_nlm, restoration)
    except ImportError:
        pass
    return rows


def run_wheel(wheel: object, image: np.ndarray, sigma: float) -> np.ndarray:
    profile = wheel.BM3DProfile()
    profile.num_threads = os.cpu_count()
    run = wheel.bm3d_rgb if image.ndim == 3 else wheel.bm3d
    return run(image.astype(float), sigma, profile=profile)


def run_wavelet(restoration: object, image: np.ndarray, sigma: float) -> np.ndarray:
    axis = -1 if image.ndim == 3 else None
    options = {"wavelet": "db2", "method": "BayesShrink", "convert2ycbcr": image.ndim == 3}
    return restoration.denoise_wavelet(
        image, sigma, channel_axis=axis, rescale_sigma=True, **options
    )


def run_nlm(restoration: object, image: np.ndarray, sigma: float) -> np.ndarray:
    axis = -1 if image.ndim == 3 else None
    return restoration.denoise_nl_means(
        image, patch_size=5, patch_distance=6, h=0.6 * sigma, sigma=sigma, channel_axis=axis
    )


def psnr(image: np.ndarray, clean: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((image.astype(float) - clean) ** 2)))


def measured(clean: np.ndarray, sigma: float, seeds: int) -> dict[str, tuple[float, float] | None]:
    """Return the mean PSNR and the median seconds of each denoiser."""
    rows = denoisers()
    small = np.ascontiguousarray(clean[:64, :64])
    db: dict[str, list[float]] = {name: [] for name in rows}
    seconds: dict[str, list[float]] = {name: [] for name in rows}
    for denoiser in rows.values():
        if denoiser is not None:
            denoiser(small, sigma)  # compiles
    for seed in range(seeds):
        noise = np.random.default_rng(seed).normal(0, sigma, clean.shape)
        noisy = (clean + noise).astype(np.float32)
        for name, denoiser in rows.items():
            if denoiser is not None:
                start = time.perf_counter()
                found = denoiser(noisy, sigma)
                seconds[name].append(time.perf_counter() - start)
                db[name].append(psnr(found, clean))
    return {
        name: (statistics.mean(db[name]), statistics.median(seconds[name])) if db[name] else None
        for name in rows
    }


def show(title: str, found: dict[str, tuple[float, float] | None], column: int | None) -> None:
    print(f"\n{title:28} {'dB':>7} {'published':>10} {'s':>8}   x {YARDSTICK}")
    for name, row in found.items():
        if row is None:
            print(f"{name:28} not installed")
            continue
        published = PUBLISHED.get(name, [None] * 5)[column] if column is not None else None
        stated = "-" if published is None else f"{published:.2f}"
        ratio = row[1] / found[YARDSTICK][1]
        print(f"{name:28} {row[0]:7.2f} {stated:>10} {row[1]:8.2f} {ratio:8.2f}")


def grey(path: Path) -> np.ndarray:
    samples = read(path)
    return np.ascontiguousarray(samples[..., 0] if samples.ndim == 3 else samples)


def frame(folder: Path) -> np.ndarray:
    left, right = (read(folder / f"kodim{n:02}.png") for n in (1, 23))
    wide = np.concatenate([left, right], 1)
    return np.ascontiguousarray(np.concatenate([wide, wide[::-1]])[:540, 288:1248])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with set12 and kodak")
    parser.add_argument("--frame", action="store_true", help="one RGB frame of 960 x 540")
    parser.add_argument("--seeds", type=int, default=1)
    asked = parser.parse_args()
    if asked.frame:
        found = measured(frame(asked.data / "kodak"), 10 / 255, asked.seeds)
        show("RGB 960 x 540, sigma 10", found, None)
        return
    for column, (name, number) in enumerate(FILES.items()):
        clean = grey(asked.data / "set12" / f"{number:02}.png")
        found = measured(clean, 25 / 255, asked.seeds)
        show(f"{name} {clean.shape[1]} x {clean.shape[0]}, sigma 25", found, column)


if __name__ == "__main__":
    main()
