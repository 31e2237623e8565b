"""The ordinal mixed model on simulated votes: bias and coverage of planted effects.

40 observers x 2 repetitions x 8 stimuli (content, noise, demosaicking: two of each), ten grades,
observers with 0.7 of the latent sd. Promise: bias below 0.05 of the latent sd, 95 % intervals that
cover 93 to 97 %.

    python benchmarks/ordinal.py [runs, default 1000]
"""

import sys
import time

import numpy as np

from analysis.inference.ordinal import LATENT_SD, Link, fit_ordinal

EFFECTS = np.array([-1.5, -0.4, 0.6])  # demosaicked, camera noise, other content; latent sd
OBSERVER_SD = 0.7


def planted(rng: np.random.Generator, link: Link) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    stimulus, observer = np.tile(np.arange(8), 80), np.repeat(np.arange(40), 16)
    design = np.column_stack([stimulus & 1, stimulus >> 1 & 1, stimulus >> 2]).astype(float)
    noise = rng.logistic(size=640) if link == "logit" else rng.normal(size=640)
    sd = LATENT_SD[link]
    bias = OBSERVER_SD * sd * rng.normal(size=40)
    latent = design @ (EFFECTS * sd) + bias[observer] + noise
    return 1.0 + np.digitize(latent, sd * np.linspace(-2.6, 2.2, 9)), design, observer


def main(runs: int) -> None:
    links: tuple[Link, ...] = ("logit", "probit")
    for link in links:
        rng = np.random.default_rng(1)
        start = time.perf_counter()
        fits = [fit_ordinal(*planted(rng, link), link) for _ in range(runs)]
        seconds = time.perf_counter() - start
        sd = LATENT_SD[link]
        effects = np.array([fit.effects for fit in fits]) / sd
        se = np.array([fit.effects_se for fit in fits]) / sd
        covered = (np.abs(effects - EFFECTS) < 1.959964 * se).mean(axis=0)
        spread = np.mean([fit.observer_sd for fit in fits]) / sd
        failed = sum(not fit.converged for fit in fits)
        print(f"{link}: {runs} runs, {failed} not converged, {1e3 * seconds / runs:.0f} ms each")
        print(f"  bias of the effects, latent sd   {np.round(effects.mean(axis=0) - EFFECTS, 4)}")
        print(f"  coverage of the 95 % intervals   {np.round(covered, 4)}")
        print(f"  observers' sd {spread:.3f} (planted {OBSERVER_SD})")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
