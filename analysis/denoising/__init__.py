"""Denoisers: functions (image, noise) -> image, for white and for correlated noise.

`bm3d` and `bls_gsm` (arguments: see `Denoiser`) are told the noise as a standard deviation or as a
`NoiseSpectrum`; `stabilised` wraps either for noise whose variance depends on the signal. All work
in any unit, clip nothing, and give the same bytes for any number of threads.
"""

from analysis.denoising.arguments import Denoiser
from analysis.denoising.bls_gsm import bls_gsm
from analysis.denoising.bm3d import bm3d
from analysis.denoising.spectrum import NoiseSpectrum
from analysis.denoising.stabilise import VarianceStabiliser, stabilised

__all__ = ["Denoiser", "NoiseSpectrum", "VarianceStabiliser", "bls_gsm", "bm3d", "stabilised"]
