"""The tables of a report as CSV: which file has which columns; each says what is simulated."""

from dataclasses import replace

import pandas as pd

from analysis.hidden_reference import DMOS_COLUMNS
from analysis.inference import CONTRAST_COLUMNS, EFFECT_COLUMNS
from analysis.likelihood import MODEL_COLUMNS
from analysis.order import ORDER_COLUMNS
from analysis.rejection import PROPOSAL_COLUMNS, keep_decisions
from analysis.report.results import Options, Results
from analysis.scores import MOS_COLUMNS, OBSERVER_COLUMNS
from analysis.screening import REMOVED_COLUMNS
from analysis.screens import SCREEN_COLUMNS
from analysis.table import Column
from analysis.votes import SIMULATED

_COLUMNS: dict[str, tuple[Column, ...]] = {
    "mos.csv": MOS_COLUMNS,
    "observers.csv": OBSERVER_COLUMNS,
    "removed_votes.csv": REMOVED_COLUMNS,
    "dmos.csv": DMOS_COLUMNS,
    "contrasts.csv": CONTRAST_COLUMNS,
    "effects.csv": EFFECT_COLUMNS,
    "models.csv": MODEL_COLUMNS,
    "screens.csv": SCREEN_COLUMNS,
    "rejections.csv": PROPOSAL_COLUMNS,
    "order.csv": ORDER_COLUMNS,
}
TABLES = {
    name: columns
    if any(column.name == SIMULATED.name for column in columns)
    else (*columns, SIMULATED)
    for name, columns in _COLUMNS.items()
}


def columns_of(options: Options) -> dict[str, tuple[Column, ...]]:
    """Return `TABLES`, in the words that hold for the removal of votes by `options`."""
    once = options.passes == 1
    how = "in one pass" if once else f"in at most {options.passes} passes"
    centre = "mos" if once else "the mean of those that the pass before kept"
    judged = "all votes on the stimulus" if once else "the votes on the stimulus before its pass"
    meanings = {
        "n_removed": f"votes removed: further than {options.threshold:g} sd from {centre}, {how}",
        "mean": f"mean of {judged}, this one included",
    }
    return TABLES | {
        name: tuple(
            replace(column, meaning=meanings.get(column.name, column.meaning))
            for column in TABLES[name]
        )
        for name in ("mos.csv", "removed_votes.csv")
    }


def tables_of(results: Results) -> dict[str, pd.DataFrame]:
    """Return the table of each file of `TABLES`."""
    tables = {
        "mos.csv": results.scores,
        "observers.csv": results.observers,
        "removed_votes.csv": results.removed,
        "dmos.csv": results.dmos,
        "contrasts.csv": results.contrasts,
        "effects.csv": results.modelled.effects,
        "models.csv": results.models,
        "screens.csv": results.screens,
        "rejections.csv": keep_decisions(results.proposal, results.options.rejected),
        "order.csv": results.order,
    }
    return {name: _marked(table, results) for name, table in tables.items()}


def _marked(table: pd.DataFrame, results: Results) -> pd.DataFrame:
    """Say of each row whether its votes are simulated: by observer, by stimulus, or of them all."""
    if SIMULATED.name in table:
        return table
    if "observer" in table:
        known = results.observers[["lab", "observer", SIMULATED.name]].to_numpy().tolist()
        people = {(lab, observer): simulated for lab, observer, simulated in known}
        people |= {(one.lab, one.observer): one.simulated for one in results.options.rejected}
        mine = zip(table["lab"], table["observer"], strict=True)
        return table.assign(**{SIMULATED.name: [people[person] for person in mine]})
    if "stimulus" in table:
        stimuli = results.scores.set_index("stimulus")[SIMULATED.name]
        return table.assign(**{SIMULATED.name: table["stimulus"].map(stimuli)})
    return table.assign(**{SIMULATED.name: results.counts.simulated_share > 0})
