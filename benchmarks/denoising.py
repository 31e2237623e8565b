"""Denoising beside other libraries: `python benchmarks/denoising.py SHARED_DATA [--frame]`.

Grey: PSNR at a noise of 25 codes on Cameraman, House, Lena, Barbara and Boat of Set12 beside the
published values. Each of `--seeds` noise fields is another sample: printed are their mean, its
standard error and the standard deviation of one field, since a published value is that of one; then
how far the mean is off the published value, and the time of each against dsis's BM3D.
`--frame`: one RGB frame of 960 x 540 instead, tiled from Kodak images, noise of 10 codes; the
`bm3d` wheel takes minutes for it. All rows of an image are run in turn.

Peers: scikit-image where it is installed, and `--peer PYTHON`, the Python of an environment that
holds the `bm3d` wheel (non-commercial: for comparison only). `--only WORD ...` takes the rows that
hold one of the words, `--images NAME ...` some of the images.
"""

import argparse
import importlib
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from analysis.denoising import bls_gsm, bm3d
from dsis.imagefile import read

YARDSTICK = "dsis bm3d, threads=2"
FILES = {"Cameraman": 1, "House": 2, "Lena": 8, "Barbara": 9, "Boat": 10}
BM3D = (29.45, 32.86, 32.08, 30.72, 29.90)  # Dabov et al. 2007
PUBLISHED = {
    "dsis bm3d, threads=2": BM3D,
    "bm3d wheel, 2 threads": BM3D,
    "dsis bls_gsm, threads=2": (None, 31.40, 31.69, 29.13, 29.37),  # Portilla et al. 2003
}

WHEEL = """
import sys, time, bm3d, numpy as np
folder, sigma = sys.argv[1], float(sys.argv[2])
image = np.load(folder + "/noisy.npy").astype(float)
profile = bm3d.BM3DProfile()
profile.num_threads = 2
run = bm3d.bm3d_rgb if image.ndim == 3 else bm3d.bm3d
start = time.perf_counter()
found = run(image, sigma, profile=profile)
print(time.perf_counter() - start)
np.save(folder + "/found.npy", found)
"""

Timed = tuple[np.ndarray, float]
Denoiser = Callable[[np.ndarray, float], Timed]


@dataclass(frozen=True)
class Row:
    """What one denoiser did on one image: PSNR by noise field, and the median seconds."""

    db: tuple[float, ...]
    seconds: float

    @property
    def mean(self) -> float:
        """Over the noise fields."""
        return statistics.mean(self.db)

    @property
    def sd(self) -> float:
        """Of one noise field."""
        return statistics.stdev(self.db) if len(self.db) > 1 else float("nan")

    def __str__(self) -> str:
        return f"{self.mean:7.3f} {self.sd / len(self.db) ** 0.5:6.3f} {self.sd:6.3f}"


def denoisers(peer: str | None, only: list[str]) -> dict[str, Denoiser]:
    rows: dict[str, Denoiser] = {
        f"dsis {f.__name__}, threads={n}": timed(partial(f, threads=n))
        for f in (bm3d, bls_gsm)
        for n in (1, 2)
    }
    if peer is not None:
        rows["bm3d wheel, 2 threads"] = partial(run_wheel, peer)
    try:
        restoration = importlib.import_module("skimage.restoration")
        rows["scikit-image wavelet"] = timed(partial(run_wavelet, restoration))
        rows["scikit-image NLM"] = timed(partial(run_nlm, restoration))
    except ImportError:
        pass
    return {n: row for n, row in rows.items() if not only or any(word in n for word in only)}


def timed(denoise: Callable[[np.ndarray, float], np.ndarray]) -> Denoiser:
    denoise(np.zeros((64, 64), np.float32), 1.0)  # compiles

    def run(image: np.ndarray, sigma: float) -> Timed:
        start = time.perf_counter()
        found = denoise(image, sigma)
        return found, time.perf_counter() - start

    return run


def run_wheel(python: str, image: np.ndarray, sigma: float) -> Timed:
    with tempfile.TemporaryDirectory() as folder:
        np.save(f"{folder}/noisy.npy", image)
        words = [python, "-c", WHEEL, folder, str(sigma)]
        done = subprocess.run(words, check=True, capture_output=True, text=True)
        return np.load(f"{folder}/found.npy"), float(done.stdout.split()[-1])


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


def measured(
    rows: dict[str, Denoiser], clean: np.ndarray, sigma: float, seeds: int
) -> dict[str, Row]:
    """Return what each denoiser does with the same noise fields."""
    db: dict[str, list[float]] = {name: [] for name in rows}
    seconds: dict[str, list[float]] = {name: [] for name in rows}
    for seed in range(seeds):
        noise = np.random.default_rng(seed).normal(0, sigma, clean.shape)
        noisy = (clean + noise).astype(np.float32)
        for name, denoiser in rows.items():
            found, took = denoiser(noisy, sigma)
            seconds[name].append(took)
            db[name].append(psnr(found, clean))
    return {name: Row(tuple(db[name]), statistics.median(seconds[name])) for name in rows}


def show(title: str, found: dict[str, Row], column: int | None) -> None:
    head = f"{'mean dB':>7} {'s.e.':>6} {'sd':>6} {'published':>10} {'off dB':>9} {'s':>8}"
    print(f"\n{title:28} {head}   x {YARDSTICK}")
    for name, row in found.items():
        published = PUBLISHED.get(name, [None] * 5)[column] if column is not None else None
        stated, off = "-", "-"
        if published is not None:
            stated, off = f"{published:.2f}", f"{row.mean - published:+.3f}"
        times = row.seconds / found[YARDSTICK].seconds if YARDSTICK in found else float("nan")
        print(f"{name:28} {row} {stated:>10} {off:>9} {row.seconds:8.2f} {times:8.2f}")


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
    parser.add_argument("--seeds", type=int, default=5, help="noise fields (default: 5)")
    parser.add_argument("--peer", help="a Python that has the bm3d wheel")
    parser.add_argument("--only", nargs="*", default=[], help="words of the rows wanted")
    parser.add_argument("--images", nargs="*", default=list(FILES), choices=FILES)
    asked = parser.parse_args()
    rows = denoisers(asked.peer, asked.only)
    if asked.frame:
        found = measured(rows, frame(asked.data / "kodak"), 10 / 255, asked.seeds)
        show("RGB 960 x 540, sigma 10", found, None)
        return
    for column, (name, number) in enumerate(FILES.items()):
        if name not in asked.images:
            continue
        clean = grey(asked.data / "set12" / f"{number:02}.png")
        found = measured(rows, clean, 25 / 255, asked.seeds)
        show(f"{name} {clean.shape[1]} x {clean.shape[0]}, sigma 25", found, column)


if __name__ == "__main__":
    main()
