"""Odds of bands of rows against 1/f noise: `python benchmarks/mismatch_row_odds.py --count 600`.

Recordings of cameras that have the one or the other are simulated, as many of each, of sizes that
a recording may just show; bands forget over 1.5 to 8 rows. Printed is how often the likelier one,
as `dsis mismatch` asks whole frames for it, is the wrong one, and how often it would be were the
odds exact. What frames hardly show is left out. Resumable: what is done is in WORK/row-odds.jsonl.
"""

import argparse
import sys
from collections.abc import Sequence
from itertools import pairwise
from math import exp, log
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from mismatch_model_nulls import FRAMES, plan
from planter.ledger import versions, work_through
from planter.tables import share, table

from analysis.mismatch.rowlaw import bands, fitted, pink
from analysis.mismatch.rowodds import RowLaw
from analysis.mismatch.rowpower import Size, row_powers
from analysis.mismatch.source import Source
from analysis.mismatch.taking import layout_of
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect
from dsis.effects.pink_noise import PinkNoise
from dsis.effects.row_banding import RowBanding
from dsis.simulate import simulate

ROWS, COLUMNS = 96, 128
LEVELS_DN, DARKS_S = (50.0, 150.0, 400.0, 1000.0, 3000.0), (0.005, 0.05)
READ_DN = 4.0
SIZES = {"pink_noise": (0.05, 0.13), "row_banding": (0.035, 0.09)}  # of read noise
LENGTHS = (1.5, 8.0)  # rows
SEEN = 8.0  # nats over nothing
LIMITS = (0.0, 0.7, 1.4, log(9), log(20), 4.5, np.inf)


def drawn(number: int) -> Effect:
    """Return one of both, in turn."""
    rng = np.random.default_rng(number)
    kind = sorted(SIZES)[number % 2]
    sigma = READ_DN * exp(rng.uniform(*np.log(SIZES[kind])))
    length = exp(rng.uniform(*np.log(LENGTHS)))
    if kind == "pink_noise":
        return PinkNoise(sigma_dn=sigma)
    return RowBanding(sigma_dn=sigma, length_rows=length)


def law_of(effect: Effect, seed: int) -> RowLaw:
    """Return what whole frames of a camera with an effect say of rows."""
    camera = Camera(
        name="true",
        cfa=Cfa.MONO,
        black_level=64.0,
        white_level=65535.0,
        bit_depth=16,
        noise=BaseNoise(segment=(Segment(slope=0.5, intercept=READ_DN**2),)),
        effect=(effect,),
    )
    shots = plan(DARKS_S, LEVELS_DN)
    with TemporaryDirectory() as folder:
        recording = simulate(camera, shots, ROWS, COLUMNS, Path(folder) / "true", seed=seed)
        source, numbers = Source(recording), range(FRAMES)
        layout = layout_of(recording, {e.name: numbers for e in recording.exposures}, source.frames)
        powers = row_powers(layout, lambda name: source.frames(name, numbers))
    return RowLaw(Size(ROWS, COLUMNS), powers)


def told(task: dict[str, Any]) -> dict[str, Any]:
    """Return by how much frames of one recording prefer the true one, and that to nothing, nats."""
    effect = drawn(task["number"])
    law = law_of(effect, task["number"])
    other = next(kind for kind in SIZES if kind != effect.kind)
    none = fitted(law.powers, law.size, [])
    causes = [pink(law.size), bands(law.size, 1.5), bands(law.size, 4.0), bands(law.size, 8.0)]
    some = [own for cause in causes if (own := fitted(law.powers, law.size, [cause])) is not None]
    seen = max((own.loglik for own in some), default=-np.inf) - (none.loglik if none else 0.0)
    odds = law.odds(effect.kind, other, frozenset())
    return {"number": task["number"], "kind": effect.kind, "odds": odds, "seen": float(seen)}


def report(entries: Sequence[dict[str, Any]]) -> None:
    """Print how often the likelier one is wrong."""
    asked = [e for e in entries if e["odds"] is not None and e["seen"] > SEEN]
    rows = []
    for least, most in pairwise(LIMITS):
        own = [e["odds"] for e in asked if least < abs(e["odds"]) <= most]
        chance = sum(1 / (1 + exp(abs(odds))) for odds in own)
        expected = f"{100 * chance / len(own):.1f} %" if own else "-"
        span = f"{exp(least):.0f} to {exp(most):.0f}" if most < np.inf else f"over {exp(least):.0f}"
        rows.append((span, share(sum(odds < 0 for odds in own), len(own)), expected))
    print(table(["odds", "wrong", "were they exact"], rows))
    print(f"\n{len(asked)} recordings of {len(entries)} show either by {SEEN:g} nats and more")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=600, help="recordings")
    parser.add_argument("--seed", type=int, default=1, help="of the first, in hundred thousands")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-row-odds")
    options = parser.parse_args()
    numbers = range(100_000 * options.seed, 100_000 * options.seed + options.count)
    tasks = {f"recording-{number}": {"number": number} for number in numbers}
    done = work_through(options.work / "row-odds.jsonl", tasks, told, options.jobs)
    report(list(done.values()))
    print(versions(done.values()))


if __name__ == "__main__":
    main()
