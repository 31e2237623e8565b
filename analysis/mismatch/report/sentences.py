"""What was found, in sentences: for the page and for the terminal."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import isfinite

import numpy as np

from analysis.mismatch.finding import (
    Alternative,
    Finding,
    FittedParameter,
    Gain,
    Mismatch,
    OmittedEffect,
    ParameterError,
)
from analysis.mismatch.remarks import NO_FLATS, as_far_as
from analysis.mismatch.report.numbers import interval, measured, plain
from analysis.mismatch.words import effect_words, place, statistic_words, unit

_AGREE = "Simulation and recording agree: nothing that is measured differs by more than chance."
_IN_DARKS = "In darks simulation and recording agree; no flat could be judged."
_OFF = "No physics is seen to be missing; numbers of the camera model are off."
_OFF_IN_DARKS = (
    "In darks no physics is seen to be missing, but numbers are off; no flat could be judged."
)
_NAMED = 3
_TOGETHER = "all that is named, together"
_LISTED = 6  # effects that were not allowed
_IN_FULL = 4  # effects that one sentence can hold with their numbers


def verdict(finding: Finding) -> tuple[str, ...]:
    """Return the verdict in a sentence, then what is wrong, left over and not decided."""
    match finding.verdict:
        case "match":
            said = [_agrees(finding)]
        case "parameters":
            said = [_OFF_IN_DARKS if NO_FLATS in finding.remarks else _OFF]
        case "omitted_physics":
            names = _in_short(finding.omitted_physics)
            said = [f"The camera model leaves out {names}.", *unproven(finding)]
        case "unexplained":
            said = [_unknown(finding.without)]
            if not finding.searched:
                said = ["Something differs; which physics that is was not asked."]
    if finding.parameter_errors:
        said.append(_wrong_numbers(finding.parameter_errors, sure=not finding.unexplained))
    if finding.unexplained:
        most = strongest(finding.unexplained)[0]
        rest = len(finding.unexplained)
        departures = "One departure stays" if rest == 1 else f"{rest} departures stay"
        unexplained = " unexplained" if finding.searched else ""
        if not finding.searched:
            departures = "One departure" if rest == 1 else f"{rest} departures"
        said.append(
            f"{departures}{unexplained}, the largest in: {statistic_words(most.statistic)} "
            f"(z = {plain(most.z)}; {place(most.where)})."
        )
    if finding.undecided:
        names = joined((effect_words(a.effect) for a in finding.undecided), "or")
        said.append(f"Not decided: {names}.")
    return tuple(said)


def _agrees(finding: Finding) -> str:
    """Return that nothing differs, and how little was tested where that is so."""
    if NO_FLATS in finding.remarks:
        return _IN_DARKS
    limit = as_far_as(finding.remarks)
    return f"{limit.capitalize()}, {_AGREE[0].lower()}{_AGREE[1:]}" if limit else _AGREE


def _unknown(without: Sequence[str]) -> str:
    """Return that what differs has no name, among those that were allowed."""
    names = [effect_words(kind) for kind in without[:_LISTED]]
    names += [f"{len(without) - _LISTED} more"] if len(without) > _LISTED else []
    allowed = f" that was allowed (without {joined(names)})" if names else ""
    return f"Something differs, and no effect of the vocabulary{allowed} is proven to explain it."


def _wrong_numbers(errors: tuple[ParameterError, ...], *, sure: bool) -> str:
    """Return which numbers are off, and by how much; not `sure`: what is unexplained may do it."""
    said = []
    for error in errors[:_NAMED]:
        value = measured(error.recorded, error.standard_error)
        recorded = f"{value} {unit(error.parameter)}".rstrip()
        said.append(f"{_number_words(error.parameter)} is {recorded}, not {plain(error.model, 5)}")
    more = len(errors) - _NAMED
    rest = [f"{more} more"] if more > 0 else []
    off = "are off" if sure else "seem off, unless what differs shifts them"
    return f"Numbers of the camera model {off}: {'; '.join([*said, *rest])}."


def _number_words(name: str) -> str:
    """Return a number of the camera model in words: of an effect, its kind and what it is of it."""
    section, _, rest = name.partition(".")
    if section != "effect":
        return name
    kind, _, number = rest.partition(".")
    return f"{parameter_words(number)} of {effect_words(kind)}".removeprefix(" of ")


def parameter_words(name: str) -> str:
    """Return a parameter's name without its unit; empty where the unit says it all."""
    alone = ("dn_per_s", "per_dn", "percent_full_scale", "cycles_per_frame", "per_megapixel_frame")
    if name in alone:
        return ""
    if name == "log_sigma":  # its letters say nothing to who has not read the formula
        return "spread over pixels (sigma of the logarithm)"
    for end in ("_dn_per_s", "_percent_full_scale", "_dn", "_percent", "_lsb", "_pixels", "_rows"):
        if name.endswith(end):
            return name.removesuffix(end).replace("_", " ")
    return name.replace("_", " ")


def fitted(name: str, parameter: FittedParameter) -> str:
    """Return a parameter with its standard error and unit, `sigma 3.20 ± 0.10 DN` say."""
    values = np.ravel(parameter.value)
    errors = np.broadcast_to(np.ravel(parameter.standard_error), values.shape)
    known = [float(e) if isfinite(e) else 0.0 for e in errors]
    numbers = [measured(float(v), e) for v, e in zip(values, known, strict=True)]
    text = numbers[0] if len(numbers) == 1 else f"({', '.join(numbers)})"
    not_measured = "" if np.isfinite(errors).all() else "(not measured)"
    said = (parameter_words(name), text, unit(name), not_measured)
    return " ".join(part for part in said if part)


def effect_label(effect: OmittedEffect) -> str:
    """Return the usual name of an effect, with its frequency or edge: there may be several."""
    frequency = effect.parameters.get("frequency")
    words = effect_words(effect.effect)
    if "edge" in effect.choices:
        return f"{words} at the {effect.choices['edge']} edge"
    if frequency is None:
        return words
    return f"{words} at ({', '.join(plain(float(v)) for v in np.ravel(frequency.value))})"


def parameters(effect: OmittedEffect) -> str:
    """Return the parameters of an effect: `edge left; length 6.1 ± 0.2 pixels` say.

    A term of size 0 that was not fitted is no part of it.
    """
    words = (f"{name} {value}".replace("_", " ") for name, value in effect.choices.items())
    terms = {
        name: p for name, p in effect.parameters.items() if p.standard_error or np.any(p.value)
    }
    return "; ".join([*words, *(fitted(name, p) for name, p in terms.items())])


def _in_short(effects: Sequence[OmittedEffect]) -> str:
    """Return the effects in words; where they are many, the table beside has the numbers."""
    if len(effects) <= _IN_FULL:
        return joined(_effect_in_short(e) for e in effects)
    kinds = [effect_words(e.effect) for e in effects]
    return joined(
        f"{kind} ({kinds.count(kind)} of them)" if kinds.count(kind) > 1 else kind
        for kind in dict.fromkeys(kinds)
    )


def _effect_in_short(effect: OmittedEffect) -> str:
    numbers = parameters(effect)
    return f"{effect_words(effect.effect)} ({numbers})" if numbers else effect_words(effect.effect)


def gain(found: Gain | None) -> str:
    """Return a held-out gain with its interval, nats per frame."""
    if found is None:
        return plain(None)
    if not all(map(isfinite, found.ci95)):
        return f"{plain(found.nats_per_frame)}, not proven"
    return f"{plain(found.nats_per_frame)} ({interval(*found.ci95)})"


def unproven(finding: Finding) -> list[str]:
    """Return sentences on named effects whose gain is not known, or is not sure to be one."""
    unknown, weak = [], []
    for effect in finding.omitted_physics:
        low, high = effect.heldout_gain.ci95
        if not (isfinite(low) and isfinite(high)):
            unknown.append(effect_label(effect))
        elif low <= 0:
            weak.append(effect_label(effect))
    said = []
    if unknown:
        said.append(f"Not proven, for lack of locked frames that tell: {joined(unknown)}.")
    if weak:
        said.append(
            f"Weakly proven: {joined(weak)}. The 95 % interval of the gain per locked frame "
            "reaches zero; only the frames together speak for it."
        )
    return said


def because(effect: OmittedEffect) -> str:
    """Return what pointed to an effect."""
    return joined(statistic_words(name) for name in effect.because)


def credited(mismatch: Mismatch, finding: Finding) -> str:
    """Return what explains a departure, in words; empty: nothing does.

    Of one that is gone beside all effects, though none by itself changes its numbers, all together.
    """
    if mismatch.explained_by:
        return effect_words(mismatch.explained_by)
    left = {one.statistic for one in finding.unexplained}
    gone = bool(finding.omitted_physics) and mismatch.statistic not in left
    return _TOGETHER if gone else ""


def considered(finding: Finding) -> list[tuple[str, Alternative]]:
    """Return what was considered and not named, with the effect in whose place it stood."""
    beside = [(e.effect, a) for e in finding.omitted_physics for a in e.alternatives]
    return beside + [("", a) for a in finding.undecided]


def tie(alternative: Alternative) -> str:
    """Return why an effect is not decided, and what would settle it."""
    why, settles = alternative.why_not.removesuffix("."), alternative.would_settle
    said = f"{effect_words(alternative.effect)}: {why}."
    return f"{said} What would settle it: {settles.removesuffix('.')}." if settles else said


def joined(items: Iterable[str], last: str = "and") -> str:
    """Return `a, b and c`."""
    words = list(items)
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def numbers_in_short(numbers: Iterable[int]) -> str:
    """Return frame numbers with runs shortened: `3, 7-9, 15`."""
    ordered = sorted(numbers)
    starts = [0, *(i for i, (a, b) in enumerate(pairwise(ordered), 1) if b != a + 1), len(ordered)]
    runs = [ordered[a:b] for a, b in pairwise(starts)]
    return ", ".join(
        f"{run[0]}\u2013{run[-1]}" if len(run) > 2 else ", ".join(map(str, run))
        for run in runs
        if run
    )


def _size(z: float) -> float:
    return -1.0 if np.isnan(z) else abs(z)


def strongest(mismatches: Iterable[Mismatch]) -> list[Mismatch]:
    """Return mismatches by the size of their departure, largest first."""
    return sorted(mismatches, key=lambda m: -_size(m.z))
