"""False alarms beside effects: `python benchmarks/mismatch_model_nulls.py --simulations 256`.

For each effect of the vocabulary, of the strength that its fields give as example, recordings of
one camera that has it are simulated. Each in turn is held against a null of the others, as `dsis
mismatch` takes it of all frames: of 16, and of 64 where all that departs does so little. The model
is true: what is said to differ is a false alarm. Pixels that jump, and codes of which a model does
not know how often they come, are left out. Resumable: finished ones are in WORK/model-nulls.jsonl.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter.ledger import versions, work_through
from planter.tables import share, table

from analysis.mismatch.layout import Layout
from analysis.mismatch.locate import FAMILY, tested
from analysis.mismatch.null import Null, null_of
from analysis.mismatch.observe import observe
from analysis.mismatch.source import Source
from analysis.mismatch.state import SUREST, Setting, State, nearly
from analysis.mismatch.taking import layout_of
from analysis.mismatch.vector import Vector
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect, registry
from dsis.simulate import Shot, dark, flat, simulate

FEW, FRAMES, ROWS, COLUMNS = 16, 8, 96, 64
LEVELS_DN, DARKS_S = (250.0, 900.0, 4900.0), (0.005, 0.05)
ONE = (Segment(slope=0.5, intercept=20.0),)
TWO = (Segment(upper_dn=700.0, slope=0.5, intercept=20.0), Segment(slope=0.8, intercept=120.0))
NONE = "none"


def model_of(kind: str, cfa: Cfa) -> Camera:
    """Return a camera with an effect of the vocabulary; of two segments where it needs them."""
    camera = Camera(
        name="true",
        cfa=cfa,
        black_level=64.0,
        white_level=65535.0,
        bit_depth=16,
        noise=BaseNoise(segment=TWO if kind == "dual_gain_mismatch" else ONE),
    )
    return camera if kind == NONE else camera.model_copy(update={"effect": (example(kind),)})


def example(kind: str) -> Effect:
    """Return an effect with the examples that its fields give."""
    of = registry()[kind]
    return of(**{name: f.examples[0] for name, f in of.model_fields.items() if f.examples})


def plan(darks_s: Sequence[float], levels_dn: Sequence[float]) -> list[Shot]:
    """Return darks of some exposure times, s, and flats of some levels, DN, of known light."""
    shots: list[Shot] = [
        dark(f"dark-{i}", frames=FRAMES, exposure_time_s=time) for i, time in enumerate(darks_s)
    ]
    return shots + [
        flat(f"flat-{i}", level, frames=FRAMES, exposure_time_s=0.01 * (i + 1), light=level)
        for i, level in enumerate(levels_dn)
    ]


def layout_and_setting(camera: Camera, seed: int, simulations: int) -> tuple[Layout, Setting]:
    """Return the layout of a small recording of a camera, and what was observed of it."""
    shots = plan(DARKS_S, LEVELS_DN)
    with TemporaryDirectory() as folder:
        recording = simulate(camera, shots, ROWS, COLUMNS, Path(folder) / "true", seed=seed)
        source, numbers = Source(recording), {e.name: range(FRAMES) for e in recording.exposures}
        layout = layout_of(recording, numbers, source.frames)
        seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    return layout, Setting(layout, seen, None, seed, 1, simulations, simulations, 2, 2, 4)


def mistaken(task: dict[str, Any]) -> dict[str, Any]:
    """Simulate, hold each recording against others, return how many differ and by what."""
    cfa = Cfa.RGGB if task["kind"] == "channel_imbalance" else Cfa(task["cfa"])
    camera = model_of(task["kind"], cfa)
    layout, setting = layout_and_setting(camera, task["seed"], task["simulations"])
    made = State.of(setting, camera, lambda: None).replicates.vectors
    alarms, asked = held_against_others(layout, made)
    name = task["kind"] if cfa.value == task["cfa"] else f"{task['kind']} ({cfa.value})"
    return {"kind": name, "asked": asked, "alarms": dict(alarms)}


def held_against_others(layout: Layout, made: Sequence[Vector]) -> tuple[Counter[str], int]:
    """Return by what recordings differ from others, how many each, and how many were asked.

    By the statistic that differs most, from many where from few nothing is far off.
    """
    size, asked, alarms = len(made), 0, Counter[str]()
    for start in range(0, size - FEW + 1, FEW):
        others = [made[(start + i) % size] for i in range(SUREST)]
        few, sure = null_of(layout, others[:FEW], others[0]), null_of(layout, others, others[0])
        for own in (made[(start + i) % size] for i in range(SUREST, size)):
            said, asked = differing(layout, few, own), asked + 1
            if nearly([z for _, z in said]):
                said = differing(layout, sure, own)
            if said:
                alarms[max(said, key=lambda one: abs(one[1]))[0]] += 1
    return alarms, asked


def differing(layout: Layout, null: Null, seen: Vector) -> Sequence[tuple[str, float]]:
    """Return statistics, with the scopes, that differ for certain, and by how much."""
    z, chances = tested(layout, null, seen)
    keys = null.keys
    return [
        (f"{keys[i].statistic} ({keys[i].scope})", float(z[i]))
        for i in np.flatnonzero(chances < FAMILY)
    ]


def report(entries: Sequence[dict[str, Any]]) -> None:
    """Print shares of false alarms."""
    rows = [
        (e["kind"], share(sum(e["alarms"].values()), e["asked"]), _most(e["alarms"]))
        for e in sorted(entries, key=lambda e: -sum(e["alarms"].values()) / e["asked"])
    ]
    print(table(["effect in the true model", "said to differ", "most often by"], rows))
    every = [sum(e["alarms"].values()) / e["asked"] for e in entries]
    print(f"\nmean {100 * np.mean(every):.2f} %, median {100 * np.median(every):.2f} %")
    print(f"The same {FEW} or {SUREST} recordings judge all others: shares hang together.")


def _most(alarms: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in Counter(alarms).most_common(3))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--simulations", type=int, default=256)
    parser.add_argument("--kinds", nargs="+", default=[NONE, *registry()], metavar="KIND")
    parser.add_argument("--cfa", choices=[cfa.value for cfa in Cfa], default=Cfa.MONO.value)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-model-nulls")
    options = parser.parse_args()
    if options.simulations <= SUREST:
        parser.error(f"--simulations: {options.simulations}, must be more than {SUREST}")
    common = {name: getattr(options, name) for name in ("cfa", "seed", "simulations")}
    tasks = {
        f"{kind}-{options.cfa}-{options.seed}-{options.simulations}": {**common, "kind": kind}
        for kind in options.kinds
    }
    done = work_through(options.work / "model-nulls.jsonl", tasks, mistaken, options.jobs)
    report(list(done.values()))
    print(versions(done.values()))


if __name__ == "__main__":
    main()
