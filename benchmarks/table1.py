"""Table 1 on the Kodak images, and the scatter of one noise field: `benchmarks/table1.py DATA`.

Independent fields average out over 24 images; a field that all images share does not. Printed are
our entries with independent fields, the standard deviation of an entry over `--fields` shared ones,
and how many of these the paper's entry and another implementation's lie off.
"""

import argparse
from pathlib import Path

import numpy as np

from analysis.paper.images import image
from analysis.paper.published import TABLE_1
from analysis.paper.setting import KODAK_IMAGES, Setting
from analysis.paper.table1 import CFA, ELSEWHERE, ENTRIES, NAMES, SIGMA, measure
from dsis.cfa import Cfa, mosaic
from dsis.covariance import LagCovariance, averaged, measured_covariance
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid


def shared(setting: Setting, method: str, field: int) -> np.ndarray:
    """Return the pooled matrix where all images have one noise field (turned where they are)."""
    wide = Draw(setting.seed, ("one field",)).normal("awgn", PixelGrid(512, 768, Cfa.MONO), field)
    parts: list[LagCovariance] = []
    for index in range(KODAK_IMAGES):
        clean = mosaic(image(setting, index), CFA)
        noise = wide if clean.shape == wide.shape else wide.T
        noisy = np.ascontiguousarray(clean + np.float32(SIGMA) * noise)
        full = (demosaic(m, CFA, method, full_scale=255.0) for m in (noisy, clean))
        parts.append(measured_covariance(next(full) - next(full)))
    return averaged(parts).pooled()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with kodak")
    parser.add_argument("--fields", type=int, default=8)
    asked = parser.parse_args()
    setting = Setting(kodak=tuple(sorted((asked.data / "kodak").glob("kodim*.png"))))
    found = measure(setting)
    head = f"{'entry':16}{'ours':>9}{'shared sd':>11}{'paper':>9}{'off / sd':>9}"
    print(f"{head}{'elsewhere':>11}{'off / sd':>9}")
    for method, name in NAMES.items():
        ours = averaged(found[method]).pooled()
        sd = np.std([shared(setting, method, n) for n in range(asked.fields)], axis=0, ddof=1)
        for n, at in enumerate(ENTRIES):
            off = (TABLE_1[method][at] - ours[at]) / sd[at]
            line = f"{name} ({at[0]},{at[1]})".ljust(16) + f"{ours[at]:9.4f}{sd[at]:11.4f}"
            line += f"{TABLE_1[method][at]:9.4f}{off:+9.1f}"
            if method in ELSEWHERE:
                other = ELSEWHERE[method][n]
                line += f"{other:11.4f}{(other - ours[at]) / sd[at]:+9.1f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
