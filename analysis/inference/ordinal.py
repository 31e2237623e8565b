"""Cumulative link mixed model: grades as ordered categories, observers random.

P(grade <= g) = F(theta_g - x beta - sigma z), F logistic or normal, one z ~ N(0, 1) per observer.
The likelihood integrates over z by Gauss-Hermite quadrature whose nodes are moved to each
observer's own posterior mean and spread (adaptive quadrature: Rabe-Hesketh, Skrondal & Pickles,
Journal of Econometrics 128, 2005); its gradient is exact for given nodes.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.inference.ordinal_likelihood import Data, Nodes, gather, loglik
from dsis.errors import InputError

Link = Literal["logit", "probit"]
LATENT_SD = {"logit": np.pi / np.sqrt(3.0), "probit": 1.0}
NODES = 15
_ROUNDS_MAX = 20  # of moving the nodes
_SETTLED = 1e-7  # nats: nodes that moved change the likelihood no more
_FLAT = 1e-3  # nats: the gain that a Newton step from the end may still promise
_STEP = 1e-4  # of the differences that give the curvature, in units of the parameters


@dataclass(frozen=True)
class OrdinalFit:
    """A fitted model.

    Attributes
    ----------
    link
        `logit` or `probit`.
    grades
        The grades that were used, ascending, (grade,).
    thresholds
        Between them, on the latent scale, (grade - 1,).
    effects
        (column of the design,): how far each lifts the latent quality.
    observer_sd
        Of the random observers, on the latent scale.
    covariance
        Of (thresholds, effects, observer_sd); from the observed information.
    loglik
        At the maximum, nats.
    converged
        False: no maximum was found (effects that run to infinity, too few votes); do not use it.
    """

    link: Link
    grades: NDArray[np.float64]
    thresholds: NDArray[np.float64]
    effects: NDArray[np.float64]
    observer_sd: float
    covariance: NDArray[np.float64]
    loglik: float
    converged: bool

    @property
    def latent_sd(self) -> float:
        """Standard deviation of an observer's repeated votes, on the latent scale."""
        return float(LATENT_SD[self.link])

    @property
    def effects_se(self) -> NDArray[np.float64]:
        """Standard errors of `effects`."""
        at = slice(len(self.thresholds), len(self.thresholds) + len(self.effects))
        return np.sqrt(np.diag(self.covariance)[at])

    @property
    def effects_covariance(self) -> NDArray[np.float64]:
        """Covariance of `effects`."""
        at = slice(len(self.thresholds), len(self.thresholds) + len(self.effects))
        return self.covariance[at, at]


def fit_ordinal(
    vote: NDArray[np.float64],
    design: NDArray[np.float64],
    observer: NDArray[np.intp],
    link: Link = "logit",
    nodes: int = NODES,
) -> OrdinalFit:
    """Fit the model by maximum likelihood.

    Parameters
    ----------
    vote
        (vote,): grades; only their order matters.
    design
        (vote, column): without a constant, which the thresholds hold.
    observer
        (vote,): number of the observer.
    link
        `logit`: proportional odds; `probit`: normal latent quality.
    nodes
        Of the quadrature.

    Raises
    ------
    InputError
        All votes are equal.
    """
    grades, grade = np.unique(vote, return_inverse=True)
    if len(grades) < 2:
        raise InputError.of("votes", "vote", "is the same everywhere: no ordinal model exists")
    data = gather(grade.reshape(-1), len(grades), design, observer, link)
    natural, value, found = _maximise(_start(data), data, nodes)
    information = _information(natural, data, found)
    covariance, gain = _invert(information, loglik(natural, data, found)[1])
    split = len(grades) - 1
    return OrdinalFit(
        link,
        grades,
        natural[:split],
        natural[split:-1],
        abs(float(natural[-1])),
        covariance,
        value,
        bool(np.isfinite(covariance).all() and gain < _FLAT),
    )


def _start(data: Data) -> NDArray[np.float64]:
    """Return thresholds of the pooled votes, no effects, and observers of half a latent sd."""
    share = np.cumsum(np.bincount(data.grade, data.weight, data.grades))[:-1] / data.weight.sum()
    thresholds = np.log(share / (1 - share)) * LATENT_SD[data.link] / LATENT_SD["logit"]
    return np.concatenate(
        [thresholds, np.zeros(data.design.shape[1]), [0.5 * LATENT_SD[data.link]]]
    )


def _maximise(
    natural: NDArray[np.float64], data: Data, nodes: int
) -> tuple[NDArray[np.float64], float, Nodes]:
    """Alternate between maximising with fixed nodes and moving the nodes."""
    split = data.grades - 1
    found = Nodes.standard(nodes, data.observers)
    for _ in range(3):
        found = found.moved(natural, data)
    before = -np.inf
    for _ in range(_ROUNDS_MAX):
        fixed = found

        def negative(
            free: NDArray[np.float64], fixed: Nodes = fixed
        ) -> tuple[float, NDArray[np.float64]]:
            value, gradient = loglik(_ordered(free, split), data, fixed)
            return -value, -_pull_back(gradient, free, split)

        result = minimize(negative, _freed(natural, split), jac=True, method="BFGS")
        natural = _ordered(result.x, split)
        found = found.moved(natural, data)
        value = loglik(natural, data, found)[0]
        if abs(value - before) < _SETTLED:
            break
        before = value
    return natural, value, found


def _freed(natural: NDArray[np.float64], split: int) -> NDArray[np.float64]:
    """Return the parameters with thresholds as a first one and logarithms of steps."""
    free = natural.copy()
    free[1:split] = np.log(np.diff(natural[:split]))
    return free


def _ordered(free: NDArray[np.float64], split: int) -> NDArray[np.float64]:
    natural = free.copy()
    steps = np.exp(np.minimum(free[1:split], 50.0))  # a line search may try anything
    natural[1:split] = free[0] + np.cumsum(steps)
    return natural


def _pull_back(
    gradient: NDArray[np.float64], free: NDArray[np.float64], split: int
) -> NDArray[np.float64]:
    """Return the gradient by the free parameters from that by the natural ones."""
    pulled = gradient.copy()
    beyond = np.cumsum(gradient[:split][::-1])[::-1]  # a step moves all thresholds above it
    pulled[0] = beyond[0]
    pulled[1:split] = beyond[1:] * np.exp(np.minimum(free[1:split], 50.0))
    return pulled


def _information(natural: NDArray[np.float64], data: Data, nodes: Nodes) -> NDArray[np.float64]:
    """Return the observed information: central differences of the gradient."""
    size = len(natural)
    information = np.empty((size, size))
    for at in range(size):
        step = np.zeros(size)
        step[at] = _STEP
        ahead, behind = (loglik(natural + s, data, nodes)[1] for s in (step, -step))
        information[at] = (behind - ahead) / (2 * _STEP)
    return (information + information.T) / 2


def _invert(
    information: NDArray[np.float64], gradient: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return the covariance, nan where there is none, and the gain that a step would promise."""
    values = np.linalg.eigvalsh(information)
    if not (values > 1e-9 * values.max()).all():
        return np.full_like(information, np.nan), np.inf
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return covariance, float(gradient @ covariance @ gradient) / 2
