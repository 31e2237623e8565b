"""Promise: the ordinal mixed model gives published estimates, and recovers what was planted."""

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import approx_fprime
from scipy.special import expit, logit, ndtr
from statsmodels.miscmodels.ordinal_model import OrderedModel

import analysis
from analysis.inference.ordinal import LATENT_SD
from analysis.inference.ordinal_likelihood import Nodes, gather, loglik
from dsis.errors import InputError

STANDARD_ERRORS = 5

# Bitterness of wine, 1..5, nine judges (columns), two bottles for each of cold and warm, without
# and with contact of juice and skins: Randall (1989), as printed in R. H. B. Christensen, "A
# tutorial on fitting cumulative link models with the ordinal package", table 1.
WINE = np.array(
    [
        [2, 1, 2, 3, 2, 3, 1, 2, 1],
        [3, 2, 3, 2, 3, 2, 1, 2, 2],
        [3, 1, 3, 3, 4, 3, 2, 2, 3],
        [4, 3, 2, 2, 3, 2, 2, 3, 2],
        [4, 2, 5, 3, 3, 2, 2, 3, 3],
        [4, 3, 5, 2, 3, 4, 3, 3, 2],
        [5, 5, 4, 5, 3, 5, 2, 3, 4],
        [5, 4, 4, 3, 3, 4, 3, 4, 4],
    ],
    dtype=float,
)


def wine():
    bottle, judge = (index.ravel() for index in np.indices(WINE.shape))
    design = np.column_stack([bottle >= 4, bottle % 4 >= 2]).astype(float)
    return WINE.ravel(), design, judge


def test_wine_as_published():
    """clmm(rating ~ temp + contact + (1|judge)) of R's package ordinal, link logit.

    Its estimates, by Laplace's approximation, as kept in the repository stitchfix/diamond
    (examples/ordinal/fixef_R.txt, intercept_R.txt): three digits, for here is quadrature.
    """
    fit = analysis.fit_ordinal(*wine(), link="logit", nodes=31)
    assert fit.converged
    assert fit.effects == pytest.approx([3.0629966560421, 1.83488493779128], rel=1e-3)
    published = [-1.62366694779619, 1.51336520227968, 4.22852671695733, 6.08877259115472]
    assert fit.thresholds == pytest.approx(published, rel=1e-3)


def test_wine_by_quadrature_as_published():
    """clmm(rating ~ temp + (1|judge), nAGQ = 31), printed in issue 651 of R's ggeffects."""
    vote, design, judge = wine()
    fit = analysis.fit_ordinal(vote, design[:, :1], judge, link="logit", nodes=31)
    assert fit.observer_sd**2 == pytest.approx(0.9045, abs=5e-5)
    assert fit.observer_sd == pytest.approx(0.951, abs=5e-4)
    assert fit.loglik == pytest.approx(-88.70, abs=5e-3)
    assert 2 * 6 - 2 * fit.loglik == pytest.approx(189.41, abs=5e-3)  # AIC, six parameters


@pytest.mark.parametrize("link", ["logit", "probit"])
def test_fifteen_nodes_are_as_good_as_sixty(link):
    few, many = (analysis.fit_ordinal(*wine(), link=link, nodes=n) for n in (15, 60))
    assert few.loglik == pytest.approx(many.loglik, abs=1e-6)
    assert few.effects == pytest.approx(many.effects, abs=1e-5)
    np.testing.assert_allclose(few.covariance, many.covariance, atol=1e-4)


@pytest.mark.parametrize("link", ["logit", "probit"])
def test_the_likelihood_is_the_integral_and_the_gradient_its_derivative(link):
    vote, design, judge = wine()
    data = gather((vote - 1).astype(np.intp), 5, design, judge, link)
    natural = np.array([-1.2, 1.0, 2.9, 4.4, 2.2, 1.1, 0.9])
    nodes = Nodes.standard(40, 9)
    for _ in range(4):
        nodes = nodes.moved(natural, data)
    value, gradient = loglik(natural, data, nodes)
    # a plain sum over a fine grid of z
    z = np.linspace(-9, 9, 4001)
    cumulative = expit if link == "logit" else ndtr
    ends = np.concatenate([[-np.inf], natural[:4], [np.inf]])
    total = 0.0
    for who in range(9):
        mine = judge == who
        predictor = (design[mine] @ natural[4:6])[:, None] + natural[6] * z
        grade = (vote[mine] - 1).astype(int)
        chance = cumulative(ends[grade + 1][:, None] - predictor)
        chance -= cumulative(ends[grade][:, None] - predictor)
        density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
        total += np.log((chance.prod(axis=0) * density).sum() * (z[1] - z[0]))
    assert value == pytest.approx(total, abs=1e-8)
    numeric = approx_fprime(natural, lambda p: loglik(p, data, nodes)[0], 1e-6)
    np.testing.assert_allclose(gradient, numeric, atol=1e-4)


@pytest.mark.parametrize("link", ["logit", "probit"])
def test_without_differences_between_observers_it_is_the_plain_ordered_model(link):
    """statsmodels' OrderedModel has fixed effects only."""
    rng = np.random.default_rng(2)
    design = rng.integers(0, 2, (900, 2)).astype(float)
    latent = design @ [1.0, -0.5] + rng.logistic(size=900)
    vote = np.digitize(latent, [-1.0, 0.2, 1.5]).astype(float)
    observer = rng.permutation(np.repeat(np.arange(30), 30))  # who votes says nothing
    fit = analysis.fit_ordinal(vote, design, observer, link)
    plain = OrderedModel(vote, design, distr=link).fit(method="bfgs", disp=False)
    assert fit.observer_sd < 0.3 * LATENT_SD[link]
    error = np.sqrt(np.diag(plain.cov_params()))[:2]
    assert np.abs(fit.effects - plain.params[:2]).max() < 0.2 * error.min()
    assert fit.effects_se == pytest.approx(error, rel=0.05)


EFFECTS = np.array([-1.5, -0.4, 0.6])  # demosaicked, camera noise, other content; latent sd


def planted(rng, link):
    """40 observers x 2 repetitions x 8 stimuli on ten grades."""
    stimulus = np.tile(np.arange(8), 80)
    observer = np.repeat(np.arange(40), 16)
    design = np.column_stack([stimulus & 1, stimulus >> 1 & 1, stimulus >> 2]).astype(float)
    noise = rng.logistic(size=640) if link == "logit" else rng.normal(size=640)
    sd = LATENT_SD[link]
    latent = design @ (EFFECTS * sd) + 0.7 * sd * rng.normal(size=40)[observer] + noise
    return 1.0 + np.digitize(latent, sd * np.linspace(-2.6, 2.2, 9)), design, observer


@pytest.mark.parametrize("link", ["logit", "probit"])
def test_planted_effects_are_recovered(link):
    """The benchmark has 1000 runs; here 40: bias within its error, coverage within its error."""
    rng = np.random.default_rng(7)
    runs = 40
    fits = [analysis.fit_ordinal(*planted(rng, link), link) for _ in range(runs)]
    assert all(fit.converged for fit in fits)
    sd = LATENT_SD[link]
    effects = np.array([fit.effects for fit in fits]) / sd
    error = effects.std(axis=0, ddof=1) / np.sqrt(runs)
    assert (np.abs(effects.mean(axis=0) - EFFECTS) < 0.05 + STANDARD_ERRORS * error).all()
    se = np.array([fit.effects_se for fit in fits]) / sd
    inside = (np.abs(effects - EFFECTS) < 1.96 * se).mean()
    # three effects of one run are nearly independent
    assert abs(inside - 0.95) < STANDARD_ERRORS * np.sqrt(0.95 * 0.05 / (3 * runs))
    spread = np.array([fit.observer_sd for fit in fits]) / sd
    assert spread.mean() == pytest.approx(0.7, abs=0.05)


def test_only_the_order_of_grades_counts():
    vote, design, judge = wine()
    fit = analysis.fit_ordinal(vote, design, judge)
    bent = analysis.fit_ordinal(vote**3, design, judge)
    assert bent.effects == pytest.approx(fit.effects)
    assert bent.grades.tolist() == [1, 8, 27, 64, 125]


def test_repeated_votes_may_stand_in_any_order():
    vote, design, judge = wine()
    mixed = np.random.default_rng(1).permutation(72)
    fit, other = (
        analysis.fit_ordinal(vote, design, judge),
        analysis.fit_ordinal(vote[mixed], design[mixed], judge[mixed]),
    )
    assert other.effects == pytest.approx(fit.effects, abs=1e-9)


def test_effects_that_run_to_infinity_are_no_fit():
    vote, design, judge = wine()
    apart = np.column_stack([design, vote == 5])  # nobody without it gives a 5, all with it do
    assert not analysis.fit_ordinal(vote, apart, judge).converged
    with pytest.raises(InputError, match="same everywhere"):
        analysis.fit_ordinal(np.full(72, 3.0), design, judge)


def conditions(votes_of):
    """Votes of twelve observers on four conditions of one content."""
    rows = [
        (f"o{o}", f"c__{noise}__{demosaic}", "c", noise, demosaic, votes_of(noise, demosaic, o))
        for noise in ("awgn", "sd")
        for demosaic in ("none", "bilinear")
        for o in range(12)
    ]
    columns = ["observer", "stimulus", "content", "noise", "demosaic", "vote"]
    return pd.DataFrame(rows, columns=columns)


def test_contrasts_that_need_a_stimulus_at_the_end_of_the_scale_say_nothing():
    """All twelve give the best grade to one stimulus: its place is infinite, the others' is not."""

    rng = np.random.default_rng(5)

    def votes_of(noise, demosaic, observer):
        del observer
        if (noise, demosaic) == ("awgn", "none"):
            return 10.0
        return float(np.clip(np.rint(7 - (demosaic == "bilinear") + rng.normal(0, 1.5)), 1, 10))

    found = analysis.ordinal_contrasts(conditions(votes_of), "logit")
    assert found.infinite == ("c__awgn__none",)
    table = found.contrasts.set_index(["question", "grain", "within"])["difference"]
    assert np.isnan(table["demosaicking", "cell", "awgn"])
    assert table["demosaicking", "cell", "sd"] < 0
    assert np.isnan(table["demosaicking", "content", "all"])


def test_effect_sizes_of_contrasts():
    rng = np.random.default_rng(3)

    def votes_of(noise, demosaic, observer):
        del noise, observer
        return float(np.clip(np.rint(6 - 2 * (demosaic == "bilinear") + rng.normal()), 1, 10))

    table = analysis.ordinal_contrasts(conditions(votes_of), "probit").contrasts
    row = table[(table["question"] == "demosaicking") & (table["grain"] == "content")].iloc[0]
    assert row["effect_size"] == row["difference"]  # the probit's latent sd is 1
    assert row["superiority"] == pytest.approx(ndtr(row["difference"] / np.sqrt(2)))
    assert row["ci_low"] < -2 < row["ci_high"]
    assert row["se"] < logit(0.75)
