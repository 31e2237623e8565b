"""Likelihood of the cumulative link mixed model and its gradient, by quadrature over observers."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray
from scipy.special import expit, ndtr

_FAR = 1e3  # on the latent scale: beyond every threshold
_TINY = 1e-300


@dataclass(frozen=True)
class Data:
    """Votes, sorted by observer; equal votes of an observer are one row with a weight.

    Attributes
    ----------
    grade
        (row,): 0, 1 ... `grades` - 1.
    design
        (row, column).
    observer
        (row,): 0, 1 ... `observers` - 1, ascending.
    weight
        (row,): how many votes.
    starts
        (observer,): first row of each.
    link
        `logit` or `probit`.
    """

    grade: NDArray[np.intp]
    grades: int
    design: NDArray[np.float64]
    observer: NDArray[np.intp]
    observers: int
    weight: NDArray[np.float64]
    starts: NDArray[np.intp]
    link: str


def gather(
    grade: NDArray[np.intp],
    grades: int,
    design: NDArray[np.float64],
    observer: NDArray[np.intp],
    link: str,
) -> Data:
    """Return the votes as `Data`; observers without votes are left out."""
    who = np.unique(observer, return_inverse=True)[1].reshape(-1)
    keys = np.column_stack([who, grade, design])
    rows, weight = np.unique(keys, axis=0, return_counts=True)
    people = rows[:, 0].astype(np.intp)
    return Data(
        rows[:, 1].astype(np.intp),
        grades,
        np.ascontiguousarray(rows[:, 2:]),
        people,
        int(people[-1]) + 1,
        weight.astype(np.float64),
        np.searchsorted(people, np.arange(people[-1] + 1)).astype(np.intp),
        link,
    )


@dataclass(frozen=True)
class Nodes:
    """Where the quadrature looks: z = mean + sd x for each observer.

    Attributes
    ----------
    x, log_weight
        (node,): Gauss-Hermite, for the weight exp(-x^2 / 2); exp(log_weight) times that density.
    mean, sd
        (observer,).
    """

    x: NDArray[np.float64]
    log_weight: NDArray[np.float64]
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]

    @classmethod
    def standard(cls, nodes: int, observers: int) -> Self:
        """Return the nodes of the prior, N(0, 1) for everybody."""
        x, weight = hermegauss(nodes)
        return cls(x, np.log(weight) + x**2 / 2, np.zeros(observers), np.ones(observers))

    def z(self) -> NDArray[np.float64]:
        """Return the values of z, (observer, node)."""
        return self.mean[:, None] + self.sd[:, None] * self.x

    def moved(self, natural: NDArray[np.float64], data: Data) -> "Nodes":
        """Return nodes at each observer's posterior mean and sd under these parameters."""
        posterior = _posterior(natural, data, self)[1]
        z = self.z()
        mean = (posterior * z).sum(axis=1)
        variance = (posterior * (z - mean[:, None]) ** 2).sum(axis=1)
        return Nodes(self.x, self.log_weight, mean, np.sqrt(np.maximum(variance, 1e-4)))


def loglik(
    natural: NDArray[np.float64], data: Data, nodes: Nodes
) -> tuple[float, NDArray[np.float64]]:
    """Return log-likelihood and gradient at (thresholds, effects, observer sd).

    The gradient is the posterior mean, over the nodes, of that of the votes given z.
    """
    value, posterior, upper, lower, chance = _posterior(natural, data, nodes)
    share = posterior[data.observer] * data.weight[:, None] / chance
    d_upper = share * _density(data.link, upper)
    d_lower = share * _density(data.link, lower)
    by_threshold = np.bincount(data.grade, d_upper.sum(axis=1), data.grades)[:-1]
    by_threshold -= np.bincount(data.grade, d_lower.sum(axis=1), data.grades)[1:]
    shift = d_lower - d_upper  # by the linear predictor
    by_effect = shift.sum(axis=1) @ data.design
    by_sd = float((shift * nodes.z()[data.observer]).sum())
    return value, np.concatenate([by_threshold, by_effect, [by_sd]])


def _posterior(
    natural: NDArray[np.float64], data: Data, nodes: Nodes
) -> tuple[
    float,
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
]:
    """Return log-likelihood, posterior (observer, node), both ends and chance of each vote."""
    split = data.grades - 1
    ends = np.concatenate([[-_FAR], natural[:split], [_FAR]])
    z = nodes.z()
    predictor = (data.design @ natural[split:-1])[:, None] + natural[-1] * z[data.observer]
    upper = ends[data.grade + 1][:, None] - predictor
    lower = ends[data.grade][:, None] - predictor
    chance = np.maximum(_between(data.link, lower, upper), _TINY)
    votes = np.add.reduceat(data.weight[:, None] * np.log(chance), data.starts, axis=0)
    joint = votes + nodes.log_weight + np.log(nodes.sd)[:, None] - z**2 / 2
    joint -= 0.5 * np.log(2 * np.pi)
    top = joint.max(axis=1, keepdims=True)
    relative = np.exp(joint - top)
    total = relative.sum(axis=1, keepdims=True)
    return float((top + np.log(total)).sum()), relative / total, upper, lower, chance


def _between(
    link: str, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return F(upper) - F(lower), from the tail that is nearer: no digits are lost far out."""
    flip = lower > 0
    first = np.where(flip, -upper, lower)
    last = np.where(flip, -lower, upper)
    if link == "logit":
        return np.asarray(expit(last) - expit(first))
    return np.asarray(ndtr(last) - ndtr(first))


def _density(link: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    if link == "logit":
        half = expit(-np.abs(x))
        return np.asarray(half * (1 - half))
    return np.asarray(np.exp(-0.5 * np.minimum(x**2, 1400.0)) / np.sqrt(2 * np.pi))
