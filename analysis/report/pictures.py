"""The figures of a report: which there are, and where they go."""

from pathlib import Path

import numpy as np
import pandas as pd

from analysis.figures_mos import draw_mos
from analysis.figures_observers import draw_flagged, draw_observers, draw_scale_use
from analysis.figures_votes import draw_contrasts, draw_order, draw_votes
from analysis.models import p910
from analysis.order import residuals
from analysis.report.remarks import observer_name
from analysis.report.results import Results
from analysis.scale import Scale

FIGURES = ("mos", "votes", "observers", "scale_use", "flagged", "order", "contrasts")
CONTRASTS_DRAWN = 80


def draw_all(votes: pd.DataFrame, results: Results, scale: Scale, folder: Path) -> dict[str, bytes]:
    """Draw the figures into `folder`, and return the SVG of each by name.

    `flagged` only where a screen proposes to reject somebody, `order` where the order is known,
    `contrasts` where there are any, and not more than `CONTRASTS_DRAWN`.
    """
    share = results.counts.simulated_share
    names = observer_name(results.observers)
    proposed = set(zip(results.proposal["lab"], results.proposal["observer"], strict=True))
    people = zip(results.observers["lab"], results.observers["observer"], strict=True)
    flagged = np.array([person in proposed for person in people])
    draw_mos(results.scores, scale, share, folder / "mos")
    draw_votes(votes, results.removed, scale, share, folder / "votes")
    draw_observers(p910(votes).observers, names, flagged, share, folder / "observers")
    draw_scale_use(votes, names, scale, share, folder / "scale_use")
    if flagged.any():
        draw_flagged(votes, names, flagged, scale, share, folder / "flagged")
    if len(results.order):
        draw_order(*residuals(votes), results.order, share, folder / "order")
    if 0 < len(results.contrasts) <= CONTRASTS_DRAWN:
        draw_contrasts(results.contrasts, share, folder / "contrasts")
    drawn = [(name, folder / f"{name}.svg") for name in FIGURES]
    return {name: file.read_bytes() for name, file in drawn if file.is_file()}
