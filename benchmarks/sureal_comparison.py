"""P.910 beside the program sureal on the same votes: scores and time, in one run.

sureal runs in an environment of its own, where `pip install sureal` was done:

    python benchmarks/sureal_comparison.py PYTHON-OF-SUREAL [stimuli observers, default 1000 100]
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.models import fit_p910
from analysis.scale import Scale
from analysis.surealfile import write_sureal
from analysis.votes import index_votes

RUNS = 25
THEIRS = """
import contextlib, io, json, sys, time
from sureal.dataset_reader import RawDatasetReader
from sureal.subjective_model import (
    MaximumLikelihoodEstimationModelContentObliviousAlternativeProjection2 as P910,
)
from sureal.tools.misc import import_json_file

reader = RawDatasetReader(import_json_file(sys.argv[1]))
seconds = []
for _ in range(int(sys.argv[2])):
    with contextlib.redirect_stdout(io.StringIO()):
        start = time.perf_counter()
        result = P910(reader).run_modeling()
        seconds.append(time.perf_counter() - start)
names = [video["path"] for video in reader.dis_videos]
print(json.dumps([min(seconds), result["num_iter"], names, list(result["quality_scores"])]))
"""


def made(stimuli: int, observers: int) -> pd.DataFrame:
    rng = np.random.default_rng(1)
    quality, bias = rng.uniform(1.5, 9.5, stimuli), rng.normal(0, 0.6, observers)
    spread = rng.uniform(0.6, 1.6, observers)
    latent = quality[:, None] + bias + spread * rng.normal(size=(stimuli, observers))
    return pd.DataFrame(
        {
            "observer": np.tile([f"o{i}" for i in range(observers)], stimuli),
            "stimulus": np.repeat([f"s{j}" for j in range(stimuli)], observers),
            "content": "all",
            "vote": np.clip(np.rint(latent), 1, 10).ravel(),
        }
    )


def main(python: str, stimuli: int, observers: int) -> None:
    votes = made(stimuli, observers)
    with tempfile.TemporaryDirectory() as temporary:
        file = Path(temporary) / "votes.json"
        write_sureal(votes, file, Scale(1.0, 10.0))
        command = [python, "-c", THEIRS, str(file), str(RUNS)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    theirs, rounds, names, scores = json.loads(done.stdout)
    scored = index_votes(votes)
    fit_p910(scored)  # compiles
    ours = []
    for _ in range(RUNS):
        start = time.perf_counter()
        fit = fit_p910(scored)
        ours.append(time.perf_counter() - start)
    mine = fit.scores.set_index("stimulus").loc[names, "score"].to_numpy()
    print(f"{len(votes)} votes, best of {RUNS}")
    print(f"sureal {1e3 * theirs:8.2f} ms, {rounds} rounds")
    print(f"dsis   {1e3 * min(ours):8.2f} ms, {fit.rounds} rounds")
    print(f"ratio  {theirs / min(ours):8.1f}")
    print(f"largest difference of a score {np.abs(mine - np.array(scores)).max():.1e}")


if __name__ == "__main__":
    size = [int(text) for text in sys.argv[2:4]] or [1000, 100]
    main(sys.argv[1], *size)
