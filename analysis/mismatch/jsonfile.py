"""`mismatch.json`: what a diagnosis found, as values that other programs read."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from analysis.mismatch.finding import (
    SCHEMA,
    Alternative,
    Finding,
    FittedParameter,
    Mismatch,
    OmittedEffect,
    Proof,
)

Values = dict[str, Any]
_ANYTHING = 1000.0  # of a size


def finding_values(finding: Finding) -> Values:
    """Return a finding as JSON holds it; what is not known (nan) or no number (inf) is None.

    Beyond the fixed keys: `undecided`, effects that tie; `remarks`; per mismatch `z_after`; in
    `where` the `exposure_time_s`; in `fit` the `photon_transfer_chi2`.
    """
    values: Values = {
        "schema": SCHEMA,
        "verdict": finding.verdict,
        "mismatches": [_mismatch(m) for m in finding.mismatches],
        "parameter_errors": [vars(error) for error in finding.parameter_errors],
        "omitted_physics": [_omitted(effect) for effect in finding.omitted_physics],
        "unexplained": [_unexplained(m) for m in finding.unexplained],
        "undecided": [_alternative(a) for a in finding.undecided],
        "fit": _proof(finding.proof),
        "remarks": finding.remarks,
    }
    plain: Values = _plain(values)
    return plain


def write_json(finding: Finding, path: Path) -> None:
    """Write `mismatch.json`; the same finding gives the same bytes."""
    text = json.dumps(finding_values(finding), indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8", newline="")


def _mismatch(m: Mismatch) -> Values:
    return {
        "statistic": m.statistic,
        "z": m.z,
        "p_adjusted": m.p_adjusted,
        "explained_by": m.explained_by,
        "where": vars(m.where),
        "says": m.says,
        "z_after": m.z_after,
    }


def _unexplained(m: Mismatch) -> Values:
    return {"statistic": m.statistic, "z": m.z, "where": vars(m.where), "says": m.says}


def _omitted(effect: OmittedEffect) -> Values:
    return {
        "effect": effect.effect,
        "parameters": {name: _fitted(fitted) for name, fitted in effect.parameters.items()},
        "because": effect.because,
        "heldout_gain": vars(effect.heldout_gain),
        "alternatives": [_alternative(a) for a in effect.alternatives],
        **({"choices": dict(effect.choices)} if effect.choices else {}),
    }


def _fitted(fitted: FittedParameter) -> Values:
    """Return value and error; what may be anything has an error of a thousand times its size."""
    known = math.isfinite(fitted.standard_error)
    sizes = fitted.value if isinstance(fitted.value, tuple) else (fitted.value,)
    most = max(abs(size) for size in sizes)
    error = fitted.standard_error if known else _ANYTHING * most
    return {"value": fitted.value, "standard_error": error}


def _alternative(a: Alternative) -> Values:
    return {
        "effect": a.effect,
        "heldout_gain": None if a.heldout_gain is None else vars(a.heldout_gain),
        "why_not": a.why_not,
        "would_settle": a.would_settle,
    }


def _proof(proof: Proof) -> Values:
    chi2 = proof.photon_transfer_chi2
    return {
        "heldout_frames": proof.heldout_frames,
        "loglik_per_pixel": vars(proof.loglik_per_pixel),
        "discrepancies": {name: _count(n) for name, n in vars(proof.discrepancies).items()},
        "gap_closed": proof.gap_closed,
        "classifier_auc": None if proof.classifier_auc is None else vars(proof.classifier_auc),
        "photon_transfer_chi2": None if chi2 is None else vars(chi2),
    }


def _count(number: float) -> float | int:
    return int(number) if float(number).is_integer() else number


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value
