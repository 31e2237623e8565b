"""Simulated observers: a stated model of how noise that is seen becomes a grade.

Nothing here is fitted to the mean opinion scores of any test of camera noise. All constants are
assumptions, and every vote of a robot is marked as simulated. On a scale from worst L to best H:

- **Quality.** With d the root mean square S-CIELAB difference (the root of the visible noise
  energy), the mean observer's latent grade is L + (H - L) / (1 + (d / d_half)^2): imperceptible at
  none, a logistic function of log d. A difference of 1 is meant to be just noticeable: half of all
  observers see something there and give one grade less. On ten grades that is half a grade below
  the top, hence d_half = 4.
- **Spread.** Total variance a (H - x)(x - L) at latent grade x, the SOS law (Hossfeld, Schatz &
  Egger, QoMEX 2011), and an observer's bias N(0, s_b^2) common to all that the observer votes on;
  what bias leaves of the total is inconsistency from vote to vote. Both numbers are those of the
  public Netflix votes, a DSIS test of video compression on grades 1..5: a = 0.19, s_b^2 = 0.089.
- **Grade.** Rounded to the nearest, kept on the scale. In one vote of a hundred (a lapse of
  attention, Wichmann & Hill, Perception & Psychophysics 63, 2001) all grades are equally likely.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.errors import Fault, InputError
from dsis.grid import PixelGrid
from dsis.manifest import MANIFEST, Clip, Manifest, read_manifest
from dsis.session.plan import Presentation, draw_plan
from dsis.session.setup import Setup, current_setup, put_in_force
from dsis.session.steps import presentation_s
from dsis.session.store import Store, Vote, open_store
from dsis.spec import Session

HALF_SCALE_DELTA_E = 4.0
SOS = 0.19
BIAS_VARIANCE = 0.089 / (5 - 1) ** 2  # of the squared width of the scale
LAPSES = 0.01
ROBOT = "robot-"
"""How the names of robots begin."""
CLOCK_START = datetime(1970, 1, 1, tzinfo=UTC)  # robots vote on a clock of their own

_Grades = NDArray[np.float64]


def latent_grade(visible_noise: ArrayLike, session: Session) -> _Grades:
    """Return the mean observer's grade before rounding, from visible noise energy (Delta E^2)."""
    worst, best = session.scale
    energy = np.asarray(visible_noise, np.float64)
    return np.asarray(worst + (best - worst) / (1.0 + energy / HALF_SCALE_DELTA_E**2))


def expected_vote(visible_noise: ArrayLike, session: Session) -> _Grades:
    """Return the exact mean vote of all robots on stimuli of that visible noise energy.

    Bias and inconsistency are normal, so is the latent grade; the mean after rounding and clipping
    is the worst grade and, for each grade above it, the chance to reach it.
    """
    worst, best = session.scale
    grade = latent_grade(visible_noise, session)
    bias_sd, inconsistency = _spread(grade, session)
    steps = np.arange(worst, best) + 0.5
    reached = ndtr(
        (grade[..., np.newaxis] - steps) / np.hypot(bias_sd, inconsistency)[..., np.newaxis]
    )
    attentive = worst + reached.sum(axis=-1)
    return np.asarray((1.0 - LAPSES) * attentive + LAPSES * (worst + best) / 2)


def robot_votes(
    visible_noise: ArrayLike, session: Session, observer: str, seed: int
) -> NDArray[np.int64]:
    """Return the votes of one robot on presentations 1, 2, 3 ... of that visible noise energy.

    Each vote is a function of its own energy and of (seed, observer, place): more presentations,
    more observers or another order of work change none of the others.
    """
    worst, best = session.scale
    grade = latent_grade(visible_noise, session)
    bias_sd, inconsistency = _spread(grade, session)
    draw = Draw(seed, ("robot", observer))
    places = PixelGrid(len(grade), 1, Cfa.MONO)
    bias = float(draw.normal("bias", PixelGrid(1, 1, Cfa.MONO))[0, 0])
    latent = grade + bias_sd * bias + inconsistency * draw.normal("vote", places)[:, 0]
    votes = np.floor(latent + 0.5)
    anything = worst + np.floor((best - worst + 1) * draw.uniform("any grade", places)[:, 0])
    votes = np.where(draw.uniform("lapse", places)[:, 0] < LAPSES, anything, votes)
    return np.clip(votes, worst, best).astype(np.int64)


def _spread(grade: _Grades, session: Session) -> tuple[float, _Grades]:
    """Return the standard deviations of bias and, per grade, of inconsistency."""
    worst, best = session.scale
    total = SOS * (best - grade) * (grade - worst)
    bias = BIAS_VARIANCE * (best - worst) ** 2
    return float(np.sqrt(bias)), np.sqrt(np.maximum(total - bias, 0.0))


def run_robots(folder: Path, observers: int, seed: int, setup: Setup | None = None) -> None:
    """Let robots robot-001, robot-002 ... do the test: plan, votes and store are those of people.

    Robots that are there already with this seed are left as they are. Their clock starts at
    1970-01-01 and goes on by the spec's durations, so that votes depend on nothing but the seed.

    Raises
    ------
    InputError
        The manifest does not say how visible the noise of a clip is, or an observer of that name
        is there with another seed.
    """
    manifest = read_manifest(folder)
    energies = _energies(manifest, folder)
    with open_store(folder, manifest) as store:
        if setup is not None:
            put_in_force(store, setup, manifest.session)
        hidden = current_setup(store, manifest.session).hidden_references
        for number in range(1, observers + 1):
            name = f"{ROBOT}{number:03d}"
            known = store.observer(name)
            if known is None:
                mirrors = None if number % 2 else f"{ROBOT}{number - 1:03d}"
                plan = draw_plan(manifest, name, seed, mirrors=mirrors, hidden_references=hidden)
                _run(store, name, plan, energies, manifest.session)
            elif not known.simulated or known.seed != seed:
                fact = f"{name} is there already with seed {known.seed}; give that seed"
                raise InputError.of(store.path, "observer", fact)


def _run(
    store: Store,
    name: str,
    plan: Sequence[Presentation],
    energies: dict[str, float],
    session: Session,
) -> None:
    """Store a robot with its plan and all of its votes, in one transaction."""
    seed = plan[0].seed
    votes = robot_votes([energies[p.stimulus] for p in plan], session, name, seed).tolist()
    with store.transaction():
        store.add_observer(name, plan, simulated=True, created_at=CLOCK_START.isoformat())
        for row, vote in zip(store.rows(name), votes, strict=True):
            elapsed = timedelta(seconds=row.presentation.place * presentation_s(session))
            at = (CLOCK_START + elapsed).isoformat(timespec="milliseconds")
            store.record_vote(row.id, Vote(vote, None, at, True, None, True))


def _energies(manifest: Manifest, folder: Path) -> dict[str, float]:
    """Return the visible noise energy of every clip; a reference has none."""
    found = {clip.stimulus: _energy(clip) for clip in manifest.clips}
    missing = [
        Fault(
            str(folder / MANIFEST),
            f"clips[{i}].quality.visible_noise",
            f"is missing: robots judge {clip.stimulus} by it; people can vote without",
        )
        for i, clip in enumerate(manifest.clips)
        if found[clip.stimulus] is None
    ]
    if missing:
        raise InputError(missing)
    return {stimulus: energy for stimulus, energy in found.items() if energy is not None}


def _energy(clip: Clip) -> float | None:
    return 0.0 if clip.role == "reference" else clip.quality.visible_noise
