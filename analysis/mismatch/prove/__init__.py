"""The proof on locked frames: held-out log-likelihood, its gains, the gap closed, a classifier.

Read the frames once (`hold`), score camera models (`loglik_of`), compare (`heldout_gain`); `prove`
does all of it for a base and a final model. Nothing here is fitted to locked frames.
"""

from analysis.mismatch.prove.classifier import Auc, auc_of
from analysis.mismatch.prove.gain import heldout_gain
from analysis.mismatch.prove.gap import gap_closed
from analysis.mismatch.prove.held import Held, hold
from analysis.mismatch.prove.likelihood import (
    LikelihoodModel,
    Loglik,
    frame_loglik,
    likelihood_model,
)
from analysis.mismatch.prove.proof import (
    ProofNumbers,
    gain_of,
    hold_seen,
    loglik_of,
    prove,
    prove_held,
)

__all__ = [
    "Auc",
    "Held",
    "LikelihoodModel",
    "Loglik",
    "ProofNumbers",
    "auc_of",
    "frame_loglik",
    "gain_of",
    "gap_closed",
    "heldout_gain",
    "hold",
    "hold_seen",
    "likelihood_model",
    "loglik_of",
    "prove",
    "prove_held",
]
