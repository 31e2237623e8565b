"""How likely a line's projections are: of one phase but for its sign, of any phase, of noise.

A frame's projection is m + a s u + noise or m + a exp(i phi) + noise, the noise's mean square 1: m
is what all frames share, a fixed pattern at the line's frequency, and is known from few frames only
so badly that it is integrated out; u is one phase, s a random sign, phi a random phase, or one that
moves on from frame to frame by the same share of a turn.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.optimize
import scipy.special
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]
_PHASES = 32  # of half a turn that are tried
_TURNS = 4  # shares of a turn that are tried, by frame: a quarter of what tells two apart
_FINER = 64  # places from one such share to the next, once it is found
_STRENGTHS = np.array([0.7, 0.9, 1.1, 1.4])  # of an amplitude that is not exact
_WITHIN, _EXACT, _ASIDE = (0.4, 1.6), 2e-3, 0.02  # of an amplitude by its mean square
_STEP = 0.5  # of m at most, in standard deviations of the noise
_REACH = 3.5  # standard deviations of m
_AT_ONCE = 256  # frames whose factors, each of half to one, a product of them holds
_MOST = 6.0  # amplitude of one frame beyond which less noise tells no more


def kept_rather_than_free(found: Sequence[Complex], amplitudes: Sequence[float]) -> float:
    """Return the log-likelihood of a phase that is kept but for its sign, less that of a free one.

    Both are means over amplitudes about those given, the first also over the phase that is kept.

    Parameters
    ----------
    found
        Projections of the frames of each exposure: (frame,), noise of mean square 1.
    amplitudes
        The line's amplitude in each, in the same unit.
    """
    kept, free = np.zeros((_STRENGTHS.size, _PHASES)), np.zeros(_STRENGTHS.size)
    for own, amplitude in zip(found, amplitudes, strict=True):
        for i, strength in enumerate(_STRENGTHS):
            scale = _MOST / max(strength * amplitude, _MOST)
            kept[i] += _of_kept(own * scale, strength * amplitude * scale)
            free[i] += _of_free(own * scale, strength * amplitude * scale)
    both = (scipy.special.logsumexp(x) - np.log(x.size) for x in (kept, free))
    return float(next(both) - next(both))


def there(
    found: Sequence[Complex], amplitudes: Sequence[float], *, kept: bool, real: bool
) -> float:
    """Return the log-likelihood of a line of one kind of phase, less that of noise alone.

    A mean over amplitudes about those given, and over the phase that is kept. What frames of an
    exposure share is integrated out of both, so that it speaks for neither. Of strong lines less is
    returned: more is not needed.

    Parameters
    ----------
    found, amplitudes
        As above.
    kept
        Whether the phase is kept but for its sign; else it is another in each frame.
    real
        Whether all samples of the pattern are real: projections are, noise and all; then it has no
        phase but its sign.
    """
    pairs = zip(found, amplitudes, strict=True)
    return of_exposures([there_in(*pair, kept=kept, real=real) for pair in pairs])


def there_in(own: Complex, amplitude: float, *, kept: bool, real: bool) -> Array:
    """Return what one exposure adds to `there`: by amplitude and by phase."""
    phases = tuple(_phases()) if kept and not real else (1.0 + 0.0j,)
    unit = np.sqrt(0.5) if real else 1.0
    line = np.empty((_STRENGTHS.size, len(phases)))
    for i, strength in enumerate(_STRENGTHS):
        scale = unit * _MOST / max(strength * amplitude, _MOST)
        seen, size = own * scale, strength * amplitude * scale
        likely = _of_kept(seen, size, phases) if kept or real else _of_free(seen, size)
        line[i] = likely - _of_free(seen, 0.0)
    return line


def of_exposures(parts: Sequence[Array]) -> float:
    """Return the log-likelihood of all exposures: a mean over amplitudes and phases."""
    line = sum(parts, np.zeros_like(parts[0]))
    return float(scipy.special.logsumexp(line) - np.log(line.size))


def moving_on(
    found: Sequence[Complex], numbers: Sequence[Array], amplitudes: Sequence[float]
) -> float:
    """Return the log-likelihood of a line whose phase moves on steadily, less that of noise alone.

    As lamps on mains do where frames follow one another at one rate. A mean over amplitudes about
    those given; over the first phase and the share of a turn, of each exposure its own. What frames
    of an exposure share is integrated out: of the line too, where w are its turns, so that it has
    a^2 sum |w - mean w|^2 left, and the mean over the first phase is a Bessel function. Of strong
    lines less is returned, as by `there`: some turn fits few phases of any line that is strong.

    Parameters
    ----------
    found, amplitudes
        As above.
    numbers
        Of the frames in their exposure: whole.
    """
    parts = zip(found, numbers, amplitudes, strict=True)
    return of_exposures([moving_on_in(*part) for part in parts])


def moving_on_in(own: Complex, number: Array, amplitude: float) -> Array:
    """Return what one exposure adds to `moving_on`: by amplitude."""
    moved, square = _turned(own, number)
    line = np.empty(_STRENGTHS.size)
    for i, strength in enumerate(_STRENGTHS):
        scale = _MOST / max(strength * amplitude, _MOST)
        a, seen = strength * amplitude * scale, moved * scale
        each = np.log(scipy.special.i0e(2 * a * seen)) + 2 * a * seen - a**2 * square
        line[i] = scipy.special.logsumexp(each) - np.log(moved.size)
    return line


def turns_of(own: Complex, number: Array, amplitude: float) -> tuple[float, float]:
    """Return the share of a turn by which a phase moves on from frame to frame, and its error.

    The one that explains most of projections (frame,), noise at 1, of frames of such numbers, and
    the error of a frequency in white noise (Rife & Boorstyn, 1974).
    """
    moved, square = _turned(own, number)
    explained = moved**2 / np.maximum(square, 1.0)
    # Of a strong line the place is known far better than the distance from one share to the next.
    step = 1 / moved.size
    near = explained.argmax() * step + np.linspace(-step, step, 2 * _FINER + 1)
    waves = np.exp(-2j * np.pi * np.outer(near, number - number.min()))
    mean = waves.mean(1)
    left = np.maximum(own.size * (1 - np.abs(mean) ** 2), 1.0)
    best = near[(np.abs(waves @ own - mean * own.sum()) ** 2 / left).argmax()] % 1.0
    frames = float(np.ptp(number)) + 1
    error = np.sqrt(6 / frames**3) / (2 * np.pi * max(amplitude, 1e-12))
    return float(best), float(max(error, step / _FINER))


def _turned(own: Complex, number: Array) -> tuple[Array, Array]:
    """Return sums over frames turned back by each share of a turn, and what a line has there.

    Less what the mean frame has of both: a Fourier transform.
    """
    first, size = int(number.min()), own.size
    series = np.zeros((2, _TURNS * int(np.ptp(number) + 1)), np.complex128)
    series[:, number.astype(np.intp) - first] = own, np.full(size, 1 / size)
    summed, mean = np.fft.fft(series)
    return np.abs(summed - mean * own.sum()), size * (1 - np.abs(mean) ** 2)


def strength_of(
    found: Sequence[Complex], amplitudes: Sequence[float], *, real: bool
) -> tuple[float, float]:
    """Return by how much the amplitudes of a kept phase are to be multiplied, and its error.

    The most likely strength, and the curvature there. Of strong lines, whose noise tells no more,
    all strengths are asked at one scale of the noise.

    Parameters
    ----------
    found, amplitudes
        As above.
    real
        Whether all samples of the pattern are real: projections are, noise and all.
    """
    phases = (1.0 + 0.0j,) if real else tuple(_phases())
    most = 2 * _MOST if real else _MOST  # one phase is soon asked
    scales = [
        most / max(amplitude, most) * (np.sqrt(0.5) if real else 1.0) for amplitude in amplitudes
    ]

    def unlikely(strength: float) -> float:
        total = np.zeros(len(phases))
        for own, amplitude, scale in zip(found, amplitudes, scales, strict=True):
            total += _of_kept(own * scale, strength * amplitude * scale, phases)
        return -float(scipy.special.logsumexp(total))

    best = scipy.optimize.minimize_scalar(
        unlikely, bounds=_WITHIN, method="bounded", options={"xatol": _EXACT}
    )
    beside = [unlikely(best.x + side * _ASIDE) for side in (-1, 1)]
    bend = max((sum(beside) - 2 * float(best.fun)) / _ASIDE**2, 1 / (_WITHIN[1] - _WITHIN[0]) ** 2)
    return float(best.x), 1 / float(np.sqrt(bend))


def _of_kept(found: Complex, amplitude: float, phases: Sequence[complex] | None = None) -> Array:
    """Return the log-likelihood of each phase that is kept, up to a constant: (phase,)."""
    shared, squares = _shared(found, amplitude)
    turned = 2 * amplitude * np.array(tuple(_phases()) if phases is None else phases)
    kept = np.zeros((len(turned), shared.size))
    for some in np.array_split(found, -(-found.size // _AT_ONCE)):
        halves = np.ones_like(kept)
        for apart in (one - shared for one in some):
            along = np.abs(np.outer(turned.real, apart.real) - np.outer(turned.imag, apart.imag))
            kept += along
            halves *= 0.5 + 0.5 * np.exp(-2 * along)  # cosh is exp times this
        kept += np.log(halves)
    return np.asarray(scipy.special.logsumexp(kept + squares, axis=1))


def _of_free(found: Complex, amplitude: float) -> float:
    """Return the log-likelihood of free phases, up to the same constant."""
    shared, squares = _shared(found, amplitude)
    for apart in (one - shared for one in found):
        turned = 2 * amplitude * np.abs(apart)
        squares += np.log(scipy.special.i0e(turned)) + turned
    return float(scipy.special.logsumexp(squares))


def _shared(found: Complex, amplitude: float) -> tuple[Complex, Array]:
    """Return what all frames may share, and the log-likelihood of noise about it and a line."""
    centre = found.mean()
    reach = _REACH * (amplitude + 1) / np.sqrt(found.size)
    reach = min(reach, amplitude + _REACH)
    step = min(_STEP, 1 / np.sqrt(found.size))
    side = np.arange(-reach, reach + step, step)
    shared = (centre + side[:, np.newaxis] + 1j * side).reshape(-1)
    # About the mean: squares of the frames, and of the mean itself.
    about = float((np.abs(found - centre) ** 2).sum()) + found.size * np.abs(shared - centre) ** 2
    return shared, -about - found.size * amplitude**2


def _phases() -> Iterator[complex]:
    yield from np.exp(-1j * np.pi * np.arange(_PHASES) / _PHASES)
