"""Findings of `dsis mismatch` that are made up: one with everything, one with nothing."""

from dataclasses import replace

import numpy as np

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.evidence import (
    Curve,
    Evidence,
    Histogram,
    LineSpectrum,
    Map,
    Series,
    Shown,
    Spectrum,
)
from analysis.mismatch.finding import (
    Alternative,
    Change,
    Finding,
    FittedParameter,
    Gain,
    Mismatch,
    OmittedEffect,
    ParameterError,
    Proof,
    Where,
)
from analysis.mismatch.named import Named
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import registry

NAN = float("nan")
BASE = Camera(
    name="planted",
    cfa=Cfa.MONO,
    black_level=100.0,
    white_level=4095.0,
    bit_depth=12,
    noise=BaseNoise(segment=(Segment(slope=0.5, intercept=20.0),)),
)
CAMERA = BASE.model_copy(update={"effect": (registry()["row_noise"](sigma_dn=3.2),)})
ROWS = Mismatch(
    "row_variance",
    41.2,
    1e-9,
    Where(("flat-1", "flat-2"), "flat", "MONO", (100.0, 700.0)),
    "Whole rows move together <from frame to frame> & in every flat.",
    "row_noise",
    0.7,
)
LINE = Mismatch(
    "spectral_peak",
    np.float64(9.0),
    0.0,
    Where(spatial_frequency=(0.2, -0.1), frames=(1, 2), pixels=((3, 4),), rows=(2, 5)),
    "One spatial frequency stands out.",
)
NAMED = OmittedEffect(
    "row_noise",
    {"sigma_dn": FittedParameter(3.2, 0.1)},
    ("row_variance",),
    Gain(120.4, (101.0, 139.8)),
    (Alternative("line_flicker", None, "It does not grow with the signal.", "A second level."),),
)
FOUND = Finding(
    verdict="omitted_physics",
    mismatches=(ROWS, LINE),
    parameter_errors=(ParameterError("noise.slope", 0.6, 0.5, 0.002),),
    omitted_physics=(NAMED,),
    unexplained=(LINE,),
    undecided=(Alternative("flicker", Gain(2.0, (NAN, NAN)), "It ties with drift.", "Darks."),),
    proof=Proof(
        {"flat-1": (1, 3)}, Change(-3.412, -3.377), Change(14, 0), None, Change(0.97, 0.51)
    ),
    camera=CAMERA,
    remarks=("Exposure time and light grow together.",),
)
NOTHING = replace(
    FOUND,
    verdict="match",
    mismatches=(),
    parameter_errors=(),
    omitted_physics=(),
    unexplained=(),
    undecided=(),
    proof=Proof({}, Change(NAN, NAN), Change(0, 0), None, None),
    camera=BASE,
    remarks=(),
)


def evidence() -> Evidence:
    rng = np.random.default_rng(1)
    levels = np.array([-0.2, 100.0, 300.0, 700.0])
    zero, sd = np.zeros(4), np.array([0.1, 0.2, 0.3, 0.4])
    curve = Curve("MONO", "signal_dn", levels, zero + 10.2, zero, zero + 10.24, sd, "DN^2")
    image = rng.normal(size=(24, 32))
    power = rng.gamma(8, 1 / 8, (24, 17))
    means = Series("MONO", rng.normal(size=8), 0.1, 1.0, (3, 7))
    line = LineSpectrum("MONO", power[:, 3], 8.0, np.ones(24))
    return Evidence(
        curves={"row_variance": (curve,)},
        maps={"gain_map": (Map("MONO", "1", image, image, image),)},
        shown_in={"fixed_pixel_variance": Shown("gain_map")},
        spectra={"pooled": (Spectrum("MONO", power, power),)},
        row_spectra={"flat-1": (line,)},
        series={"flat-1": (means,), "dark": (means,)},
        codes={"flat-1": (Histogram("MONO", 90, np.arange(50.0)),)},
        tests=40,
        simulations=100,
        seconds=1.5,
    )


def decay(gain: float, error: float) -> Named:
    """Return a named decay at an edge, of a gain and its standard error, per cent."""
    effect = registry()["line_settling"](gain_percent=gain, length_pixels=5.0)
    proposal = Proposal(effect, ("gain_percent", "length_pixels"), frozenset({"gain_percent"}))
    errors = {"gain_percent": error, "length_pixels": 0.1}
    return Named("line_settling", proposal, errors, 9.0, ())
