"""A named effect as a finding has it: what was fitted of it, its words, and what came near."""

import numpy as np

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.finding import Alternative, FittedParameter, Gain, OmittedEffect
from analysis.mismatch.instance import unmeasured
from analysis.mismatch.named import Named
from analysis.mismatch.segments import as_settled
from analysis.mismatch.settle import would_settle
from analysis.mismatch.state import State

_NEAR = 8.0  # of log-likelihood: a rival worth naming a recording that would decide
_TAKEN = frozenset({"switch_probability"})  # one of few values is taken where frames do not tell


def omitted_effect(named: Named, why: tuple[str, ...], gain: Gain, final: State) -> OmittedEffect:
    """Return an effect with its parameters, statistics that it explains, gain and alternatives.

    A term of size 0 that was not fitted, with an error of 0, is no part of it. A value that was
    taken, and not fitted, may be any: its error is infinite.
    """
    parameters, choices = {}, {}
    if named.proposal is not None:
        effect = named.proposal.effect
        for name, value in effect.model_dump(exclude={"kind"}).items():
            if isinstance(value, str):
                choices[name] = value
            elif name == "field":
                choices |= {name: "as measured"} if value else {}
            elif named.light is not None and name not in named.proposal.errors:
                continue  # the field has it
            elif isinstance(value, tuple):
                least = unmeasured(value, final.setting.layout) if name == "frequency" else 0.0
                parameters[name] = FittedParameter(value, named.proposal.errors.get(name, least))
            elif isinstance(value, (int, float)) and not isinstance(value, bool):
                error = _error(named, named.proposal, name)
                parameters[name] = FittedParameter(float(value), error)
    else:
        switch = as_settled(final.calibrated, named.switch_dn, named.errors["switch_dn"])
        parameters["switch_dn"] = FittedParameter(*switch)
    rivals = tuple(
        Alternative(
            kind,
            None,
            f"explains the numbers {worse:.3g} nats worse",
            would_settle(named.kind, kind) if worse < _NEAR else "",
        )
        for kind, worse in named.rivals
    )
    return OmittedEffect(named.kind, parameters, why, gain, rivals, choices)


def _error(named: Named, own: Proposal, name: str) -> float:
    """Return the standard error of a parameter; 0: it is exact, or no part of the effect."""
    if name in named.errors:
        return float(named.errors[name])
    if name in own.free:
        return np.inf
    return float(own.errors.get(name, np.inf if name in _TAKEN else 0.0))
