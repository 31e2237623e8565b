"""Time of a large test: 10^5 votes to a report, 10^6 votes read; promise: a report in under 20 s.

python benchmarks/votes_scale.py
"""

import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import analysis
from analysis.models import fit_p910
from analysis.votes import index_votes


def made(stimuli: int, observers: int) -> pd.DataFrame:
    rng = np.random.default_rng(1)
    quality, bias = rng.uniform(1.5, 9.5, stimuli), rng.normal(0, 0.6, observers)
    spread = rng.uniform(0.6, 1.6, observers)
    latent = quality[:, None] + bias + spread * rng.normal(size=(stimuli, observers))
    return pd.DataFrame(
        {
            "observer": np.tile([f"o{i}" for i in range(observers)], stimuli),
            "stimulus": np.repeat([f"s{j}" for j in range(stimuli)], observers),
            "vote": np.clip(np.rint(latent), 1, 10).ravel(),
        }
    )


def timed(name: str, work) -> object:
    start = time.perf_counter()
    result = work()
    print(f"{name:<42} {time.perf_counter() - start:8.3f} s", flush=True)
    return result


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        made(1000, 100).to_csv(folder / "votes.csv", index=False)
        made(10_000, 100).to_csv(folder / "million.csv", index=False)
        votes = timed(
            "10^5 votes: read", lambda: analysis.read_votes(folder / "votes.csv", (1, 10))
        )
        scored = index_votes(votes)
        timed("10^5 votes: P.910, first call (compiles)", lambda: fit_p910(scored))
        timed("10^5 votes: P.910", lambda: fit_p910(scored))
        for function in (analysis.mos, analysis.screen_bt500, analysis.bootstrap_scores):
            timed(f"10^5 votes: {function.__name__}", lambda function=function: function(votes))
        report = folder / "report"
        timed(
            "10^5 votes: whole report",
            lambda: analysis.write_report(folder / "votes.csv", report, (1, 10)),
        )
        million = timed(
            "10^6 votes: read", lambda: analysis.read_votes(folder / "million.csv", (1, 10))
        )
        timed("10^6 votes: MOS", lambda: analysis.mos(million))
        assert len(million) == 10**6  # noqa: S101


if __name__ == "__main__":
    main()
