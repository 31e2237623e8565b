"""What noise and demosaicking do to votes: contrasts within observers, and mixed models."""

from analysis.inference.contrasts import CONTRAST_COLUMNS, test_contrasts
from analysis.inference.design import Contrast, list_contrasts, not_comparable
from analysis.inference.linear import LinearFit, fit_linear
from analysis.inference.ordinal import Link, OrdinalFit, fit_ordinal
from analysis.inference.ordinal_contrasts import (
    EFFECT_COLUMNS,
    OrdinalContrasts,
    effect_table,
    ordinal_contrasts,
)
from analysis.inference.sentences import conclusions

__all__ = [
    "CONTRAST_COLUMNS",
    "EFFECT_COLUMNS",
    "Contrast",
    "LinearFit",
    "Link",
    "OrdinalContrasts",
    "OrdinalFit",
    "conclusions",
    "effect_table",
    "fit_linear",
    "fit_ordinal",
    "list_contrasts",
    "not_comparable",
    "ordinal_contrasts",
    "test_contrasts",
]
