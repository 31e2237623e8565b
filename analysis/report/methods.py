"""The methods paragraph of a report: what was really done to these votes, ready to be quoted."""

from collections.abc import Iterator

from analysis.bootstrap import RESAMPLES, SEED
from analysis.inference.ordinal import NODES
from analysis.report.references import REFERENCES
from analysis.report.results import Results
from analysis.scale import Scale
from analysis.screening import THRESHOLD_SD
from dsis import __version__

Paragraph = tuple[str, str]  # heading, text


def methods(results: Results, scale: Scale) -> tuple[list[Paragraph], list[str]]:
    """Return the paragraphs (heading, text) of what was done, and the references they need."""
    used = ["bt500", "p910", "seybold", "bt1788", "clopper", "hesterberg", "sos"]
    paragraphs = [
        ("Votes", _votes(results, scale)),
        ("Removal of votes", _removal(results)),
        ("Scores and intervals", _intervals(results)),
        *_where_done(results),
    ]
    if len(results.contrasts):
        used += ["holm", "pratt"]
    if len(results.modelled.effects):
        used.append("quadrature")
    return paragraphs, [REFERENCES[name] for name in dict.fromkeys(used)]


def _where_done(results: Results) -> Iterator[Paragraph]:
    """Yield what needs no numbers, where it was done."""
    if len(results.dmos):
        yield "DMOS", _DMOS
    yield "Screening", _SCREENS
    yield "Observer models", _OBSERVERS + (_UNBOUNDED if results.p910_degenerate else "")
    if results.retest is not None:
        yield "Test and retest", _RETEST
    if len(results.order):
        yield "Order", _ORDER
    if len(results.contrasts):
        yield "Contrasts", _CONTRASTS
    if len(results.modelled.effects):
        yield "Mixed models", _MODELS


def _votes(results: Results, scale: Scale) -> str:
    counts, n = results.counts, results.scores["n"]
    kind = "simulated observers" if counts.simulated_share >= 1 else "observers"
    if 0 < counts.simulated_share < 1:
        kind += " (some of them simulated)"
    hidden = f", {counts.references} of them hidden references," if counts.references else ""
    each = f"{n.min()}" if n.min() == n.max() else f"{n.min()} to {n.max()}"
    text = (
        f"{counts.observers} {kind} judged {counts.stimuli} sequences{hidden} on a scale from "
        f"{scale}; {counts.scored} votes were scored, {each} per sequence."
    )
    if results.options.rejected:
        who = ", ".join(map(str, results.options.rejected))
        text += f" The votes of {who} were left out by decision of the authors of this report."
    return f"{text} Computed with dsis {__version__}."


def _removal(results: Results) -> str:
    removed, options = len(results.removed), results.options
    papers = (options.threshold, options.passes) == (THRESHOLD_SD, 1)
    passes = "once" if options.passes == 1 else f"in at most {options.passes} passes"
    source = (
        "As in Seybold et al. (2014)" if papers else "By another rule than Seybold et al. (2014)"
    )
    return (
        f"{source}, votes further than {options.threshold:g} sample standard "
        f"deviations from the mean of their sequence were removed, {passes}: {removed} of "
        f"{results.counts.scored} votes ({100 * removed / results.counts.scored:.1f} %). "
        "The removal shortens the standard deviation and moves means near the ends of the scale: "
        f"{_COVERAGE if papers else _NOT_SIMULATED} Therefore scores after the removal stand "
        "beside those of all votes."
    )


def _intervals(results: Results) -> str:
    flat = int((results.scores["ci_method"] == "binomial").sum())
    text = (
        "MOS is the mean of the valid votes, its 95 % interval Student's: "
        "mean \u00b1 t(0.975, n \u2212 1) sd / \u221an."
    )
    if flat:
        text += (
            f" On {flat} sequence{'s' if flat != 1 else ''} without spread the binomial interval "
            "(Clopper-Pearson) stands in its place."
        )
    return (
        f"{text} mos.csv adds the Clopper-Pearson interval of (MOS \u2212 L) / (H \u2212 L), which "
        "is conservative and never leaves the scale, and expanded percentile intervals of "
        f"{RESAMPLES} bootstrap resamples of the observers (seed {SEED}), of all votes and with "
        "the removal repeated inside each resample."
    )


_COVERAGE = (  # of the paper's rule alone
    "in simulations with 8 to 40 observers (votes rounded to 1 \u2026 10), the nominal 95 % "
    "interval after it held the true mean in 77 to 92 % of the cases, that of all votes in 93 to "
    "95 %; faultless observers lose about 3.5 % of their votes at n = 18."
)
_NOT_SIMULATED = (
    "the nominal 95 % interval after it is too short; by how much has not been simulated for this "
    "rule."
)
_DMOS = (
    "Vote minus the same observer's vote on the hidden reference of the content, plus the top of "
    "the scale; mean over observers and Student's interval of these pairs."
)
_SCREENS = (
    "Screens propose, nobody is left out by them. BT.500: for each presentation and observer, P "
    "counts a vote at least \u03b5 sd above the mean, Q one as far below; \u03b5 = 2 where the "
    "kurtosis lies in 2 \u2026 4, else \u221a20; rejected if (P + Q) / n > 5 % and "
    "|P \u2212 Q| / (P + Q) < 0.3, with the sample sd, n the votes cast, presentations without "
    "spread left out, one pass. P.913: the same after each observer's mean deviation is "
    "subtracted. Correlation (after BT.1788): the smaller of Pearson's and Spearman's r with the "
    "MOS is at most the smaller of 0.7 and mean \u2212 sd over the observers. Inconsistency: ln of "
    "P.910's inconsistency lies more than three robust standard deviations (median absolute "
    "deviation) above the median."
)
_OBSERVERS = (
    "P.910: vote = score + bias + inconsistency \u00b7 X, X normal, maximum likelihood by "
    "alternating projection; the interval of a score is \u00b1 1.96 standard errors from the "
    "spread of the residuals on its sequence. Models are compared by AIC and BIC per vote. SOS "
    "parameter: a of variance = a (H \u2212 MOS)(MOS \u2212 L), least squares over sequences."
)
_UNBOUNDED = (
    " P.910's scores and likelihood are not given here: the likelihood grew without limit towards "
    "the votes of single observers, as it may where each has cast few."
)
_RETEST = (
    "Second votes were compared with first ones of the same observer on the same sequence: mean "
    "difference with Student's interval over observers, and the standard deviation of a repeated "
    "vote, the root of half the mean squared difference."
)
_ORDER = (
    "Residuals are votes less the mean of the sequence and the observer's own mean residual. Each "
    "observer's least-squares slope on the place in the order (drift; of the absolute residual: "
    "fatigue) and on the MOS of the presentation before (contrast) was averaged over observers: "
    "Student's interval, p after Holm."
)
_CONTRASTS = (
    "Conditions were compared within observers: paired t (difference, 95 % interval of the one "
    "contrast) and the exact signed-rank test with zeros by Pratt (normal approximation beyond "
    "100 observers); p-values of the pairs of one question, and of its averages by content, were "
    "adjusted by Holm."
)
_MODELS = (
    "Linear mixed model: a mean per sequence, random observers, REML. Ordinal: cumulative link "
    "mixed models, logit and probit, a latent quality per sequence and random observers, maximum "
    f"likelihood with {NODES} nodes of adaptive Gauss-Hermite quadrature; Wald intervals, p not "
    "adjusted. The effect size is the difference over the standard deviation of an observer's "
    "votes. Where observers differ in what they mind, the paired tests are the honest ones."
)
