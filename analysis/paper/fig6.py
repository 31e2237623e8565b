"""Fig. 6: mean opinion scores, from recorded votes or from simulated observers."""

import csv
import io
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.figures_mos import draw_mos
from analysis.paper.part import Part, Picture, Row
from analysis.paper.published import MOS_LOSS, OBSERVERS, REMOVED_SHARE
from analysis.paper.scene import Scene, scene
from analysis.paper.setting import Setting
from analysis.scale import Scale, describe_test
from analysis.scores import score_table
from analysis.votesfile import read_votes
from dsis.errors import InputError
from dsis.session.robots import robot_votes
from dsis.spec import SHIPPED, read_spec

CONTENTS = ("city", "landscape")
METHODS = ("none", "bilinear")
MARK = "SIMULATED: no person has voted"


@dataclass(frozen=True)
class Scores:
    """Scores of a test with the paper's conditions.

    Attributes
    ----------
    table
        `analysis.score_table`.
    scale
        Of the test.
    simulated_share
        Of the votes.
    votes
        Votes on test stimuli.
    """

    table: pd.DataFrame
    scale: Scale
    simulated_share: float
    votes: int

    @property
    def removed_share(self) -> float:
        """Share of the votes that lie beyond 2 sigma of their stimulus' mean."""
        return float(self.table["n_removed"].sum() / self.table["n"].sum())

    def loss(self, content: str, noise: str) -> tuple[float, float] | None:
        """Return MOS without less MOS with demosaicking after the removal, and its error.

        The mean over the levels and methods that the test has; None where it has no such pair.
        The error takes the votes for independent.
        """
        rows = self.table[(self.table["content"] == content) & (self.table["noise"] == noise)]
        rows = rows[rows["kind"] == "test"]
        without, with_ = rows[rows["demosaic"] == "none"], rows[rows["demosaic"] != "none"]
        if without.empty or with_.empty:
            return None
        square = [
            float((part["sd_trimmed"] ** 2 / (part["n"] - part["n_removed"])).mean() / len(part))
            for part in (without, with_)
        ]
        loss = float(without["mos_trimmed"].mean() - with_["mos_trimmed"].mean())
        return loss, float(np.sqrt(sum(square)))


@lru_cache(maxsize=4)
def scores(setting: Setting) -> Scores:
    """Return the scores of the votes given, or of 18 simulated observers."""
    if setting.votes is not None:
        return _scored(setting.votes, setting.scale)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "votes.csv"
        path.write_text(_robots(setting), encoding="utf-8")
        return _scored(path, (1.0, 10.0))


def recompute(setting: Setting, folder: Path) -> Part:
    """Draw Fig. 6 and compare the losses of MOS with those that the paper states."""
    found = scores(setting)
    draw_mos(found.table, found.scale, found.simulated_share, folder / "fig6")
    mark = MARK if found.simulated_share > 0 else ""
    rows = []
    for (content, noise), printed in MOS_LOSS.items():
        loss = found.loss(content, noise)
        what = f"{content}, {noise.upper()}: MOS lost by demosaicking"
        remark = mark if loss else "the votes hold no such pair of conditions"
        ours, error = loss or (None, None)
        rows.append(Row(what, printed, ours, error, "grades", remark))
    share = 100 * found.removed_share
    error = 100 * float(np.sqrt(found.removed_share * (1 - found.removed_share) / found.votes))
    what = "votes removed beyond 2 sigma"
    rows.append(Row(what, 100 * REMOVED_SHARE, share, error, "%", mark))
    says = [
        (
            f"The paper's {OBSERVERS} participants graded City and Landscape; it states three "
            "differences of MOS and shows the rest in a figure. The votes are not public."
        )
    ]
    if mark:
        says.append(
            f"{MARK}. {OBSERVERS} robots grade by the visible noise energy of each condition; the "
            "constants of that model are assumptions, so that nothing of the paper is confirmed "
            "or refuted here: it shows what the figure will look like. Give --votes FILE for "
            "people's."
        )
    caption = "Mean opinion scores in the manner of the paper's Fig. 6."
    return Part("fig6", "Fig. 6", tuple(says), tuple(rows), (Picture("fig6", caption),))


def _scored(path: Path, scale: tuple[float, float] | None = None) -> Scores:
    test = describe_test(path, scale)
    votes = read_votes(path, scale)
    table = score_table(votes, test.scale)
    if not ((table["kind"] == "test") & (table["noise"] != "")).any():
        fact = "has no test stimuli with the columns content, noise and demosaic"
        raise InputError.of(path, "", fact)
    tests = votes[votes["kind"] == "test"]
    return Scores(table, test.scale, float(tests["simulated"].mean()), len(tests))


def _robots(setting: Setting) -> str:
    """Return the votes of simulated observers on the paper's eight conditions, as CSV."""
    session = read_spec(SHIPPED / "seybold.toml").spec.session
    energies = {
        (name, *condition): energy
        for name in CONTENTS
        for condition, energy in _energies(scene(name, setting, 1)).items()
    }
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["observer", "stimulus", "vote", "content", "noise", "demosaic", "level", "simulated"]
    )
    for number in range(1, OBSERVERS + 1):
        observer = f"robot-{number:03d}"
        votes = robot_votes(list(energies.values()), session, observer, setting.seed)
        for condition, vote in zip(energies, votes.tolist(), strict=True):
            name = "__".join((*condition, "0"))
            writer.writerow([observer, name, vote, *condition, 0, "true"])
    return text.getvalue()


def _energies(content: Scene) -> dict[tuple[str, str], float]:
    """Return the visible noise energy of each (noise, demosaicking), as it is delivered."""
    clean = content.clean(0)
    make = content.rendering
    reference = make.reference(clean)
    seen = content.eye.seen(reference)
    noisy = {"awgn": content.white(reference, 0) * np.float32(255), "sd": content.noisy(clean, 0)}
    return {
        (noise, method): content.eye.difference(
            np.clip(make.shown(noise, noisy[noise], method), 0, 1), seen
        ).energy
        for noise in noisy
        for method in METHODS
    }
