"""Coverage of the intervals: what 20 000 simulated cells of each kind say, beside the notes' table.

Votes are normal, rounded to 1..10 and kept on the scale; the true mean is that of such votes. Of
each row: share of intervals that hold it, for Student's t (the default; where all agree, the
binomial interval), for Clopper-Pearson's, for t after the 2-sigma removal, and for the bootstrap
over observers of all votes and with the removal inside each resample. The last is also asked for
the mean that the removal aims at: the trimmed mean of a very large panel.

    python benchmarks/interval_coverage.py [cells of the bootstrap, default 2000]
"""

import sys
import time

import numpy as np
from scipy import stats

from analysis.bootstrap import bootstrap_interval, draw_resamples
from analysis.intervals import Interval, binomial_interval, default_interval, student_interval
from analysis.scale import Scale

TEN = Scale(1.0, 10.0)
CELLS = 20_000
RESAMPLES = 1000
LARGE = 2_000_000
ROWS = [(n, mu, sd) for n in (8, 10, 15, 20, 24, 40) for mu, sd in ((5.5, 1.6), (9.2, 1.2))]


def votes_of(rng: np.random.Generator, shape: tuple[int, ...], mu: float, sd: float) -> np.ndarray:
    return np.clip(np.rint(rng.normal(mu, sd, shape)), 1, 10)


def true_mean(mu: float, sd: float) -> float:
    return float(1 + stats.norm.sf((np.arange(1, 10) + 0.5 - mu) / sd).sum())


def trimmed(votes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return number, mean and sd of each row after the 2-sigma removal."""
    mean, sd = votes.mean(1, keepdims=True), votes.std(1, ddof=1, keepdims=True)
    kept = np.abs(votes - mean) <= 2 * sd * (1 + 1e-9)
    n = kept.sum(1)
    after = (votes * kept).sum(1) / n
    squares = (kept * (votes - after[:, None]) ** 2).sum(1)
    return n, after, np.sqrt(squares / np.maximum(n - 1, 1))


def covered(interval: Interval, truth: float) -> float:
    return float(np.mean((interval.low <= truth) & (truth <= interval.high)))


def main(boot_cells: int) -> None:
    print("     n  mean   sd |     t  binomial  t trimmed | bootstrap  trimmed  of trimmed | flat")
    start = time.perf_counter()
    for n, mu, sd in ROWS:
        rng = np.random.default_rng([n, int(10 * mu)])
        votes, truth = votes_of(rng, (CELLS, n), mu, sd), true_mean(mu, sd)
        spread = votes.std(1, ddof=1)
        default, method = default_interval(np.full(CELLS, n), votes.mean(1), spread, TEN)
        binomial = binomial_interval(np.full(CELLS, n), votes.mean(1), TEN)
        after = student_interval(*trimmed(votes))
        drawn = draw_resamples(n, RESAMPLES, 1)
        aimed = trimmed(votes_of(rng, (1, LARGE), mu, sd))[1].item()
        inside = np.zeros(3)
        for row in votes[:boot_cells]:
            plain, inner = (bootstrap_interval(row, drawn, limit) for limit in (None, 2.0))
            inside += [
                covered(plain, truth),
                covered(inner, truth),
                covered(inner, aimed),
            ]
        boot = inside / boot_cells
        print(
            f"{n:6} {mu:5} {sd:4} | {covered(default, truth):.4f}  {covered(binomial, truth):.4f}"
            f"     {covered(after, truth):.4f} |    {boot[0]:.4f}   {boot[1]:.4f}      "
            f"{boot[2]:.4f} | {int((method == 'binomial').sum())}",
            flush=True,
        )
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
