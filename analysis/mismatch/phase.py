"""What whole frames say of a line: that it is there, its phase, and which alias it is.

The frames are projected on the pattern. A pattern whose sign alone changes gives numbers on one
line through zero of the complex plane, free phases give a circle: |sum c^2| / sum |c|^2 is 1 or 0.
Where noise hides that, the likelihoods of both decide. In white noise |c|^2 is exponential, so that
the chance of the largest of all frequencies is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.aliases import aliases, strongest
from analysis.mismatch.asked import FramesAsked
from analysis.mismatch.bandgain import gain_of_bands, place_of_bands, turns_of_bands
from analysis.mismatch.instance import Frequency, frequency_of, of_pixels, same_line
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import LEAST, SURE, FramesOf, Power, projections
from analysis.mismatch.undone import NARROW
from dsis.effects import Effect
from dsis.effects.line_flicker import LineFlicker
from dsis.effects.rts import Rts

Measured = tuple[Mapping[str, object], Mapping[str, float]]
"""Parameters, and their standard errors."""
_CLEAR_POWER = 3.0  # standard errors of a line's power from which its amplitude is known
_NEAR = (-2, -1, 1, 2)  # bins to those that a line leaves as they are
_FAR = (-23, -17, -13, -9, 9, 13, 17, 23)  # bins to those that say what lines have in common
_CROSS = ((-1 / 3, 0.0), (1 / 3, 0.0), (0.0, -1 / 3), (0.0, 1 / 3))  # bins, beside the best
_MOST_CREST = 1.21  # power between steps: sinc(1/6)^-4, a sixth of a bin off on both axes
_BETWEEN = (-1 / 3, 0.0, 1 / 3)  # bins by which a frequency may be off
_BESIDE = 4.0  # errors by which the top of a line lies beside a frequency of few pixels
_CHANCE = 0.05  # of a line as strong among all frequencies
_SLOWEST = 3.0  # waves of a frame, beside which noise may rise as 1 / f
_FEWEST_WAVES = 1.5  # of a frame, that a pattern has
_SHORTER = 5, 24  # waves of a frame, that say by how much
_FEW = 32  # multiples of an eighth, at which patterns of few pixels lie
_PHASE_WORDS = {
    "periodic_noise": "the pattern's phase is the same in all frames but for its sign",
    "bistable_pattern": "the pattern's phase is another in every frame",
}
ABSENT = "the frames show nothing there that noise does not show at some frequency"
_BY_CHANCE = "it would be at a frequency of single pixels by chance only"
_UNTOLD = "frames do not tell whether its phase is kept"
_OF_LIGHT = "it grows with the light, as no pattern of the read-out does"
_SMOOTH = "frames have less than a wave and a half of it, as of any smooth surface that moves"
_ANY_SIZE = "the pattern's size is another in every frame, and not its sign alone"
_BROAD = "frequencies beside it are raised as well: it is no line"


@dataclass(frozen=True)
class WholeFrames(FramesAsked):
    """What whole frames say of lines, and of pixels that jump, asked once for each."""

    _shown: dict[Frequency, bool] = field(default_factory=dict)
    _looks: dict[Frequency, "Look"] = field(default_factory=dict)
    _gains: dict[tuple[Frequency, bool], float] = field(default_factory=dict)
    _bands: dict[float, float] = field(default_factory=dict)

    def shown(self, effect: Effect) -> bool:
        """Return whether an effect is no line of a mosaic, or the one that whole frames show."""
        frequency, layout = frequency_of(effect), self.layout
        if frequency is None or len(layout.channels) == 1:
            return True
        wrapped = ((frequency[0] + 0.5) % 1 - 0.5, (frequency[1] + 0.5) % 1 - 0.5)
        if wrapped not in self._shown:
            alike = aliases(wrapped)
            clearest = strongest(layout, self.frames_of, alike)
            for one in alike:
                self._shown[one] = same_line(one, clearest, layout.rows, layout.columns)
        return self._shown[wrapped]

    def denial(self, effect: Effect) -> str | None:
        """Return why an effect is no line, or one of the other kind of phase; None: it may be.

        Interference and a bistable pattern are alike in power.
        """
        frequency = frequency_of(effect)
        if frequency is None:
            return None
        if effect.kind == "bistable_pattern" and self._waves(frequency) < _FEWEST_WAVES:
            return _SMOOTH
        if frequency not in self._looks:
            self._looks[frequency] = look(self.layout, self.frames_of, frequency)
        seen = self._looks[frequency]
        if seen.absent or seen.broad:
            return ABSENT if seen.absent else _BROAD
        if seen.grows:
            return _OF_LIGHT
        return self._other_phase(seen, frequency, kept=effect.kind == "bistable_pattern")

    def _other_phase(self, seen: "Look", frequency: Frequency, *, kept: bool) -> str | None:
        """Return why a line is none whose phase is kept, or is not; None: it may be."""
        line = seen.line if kept and seen.kept is not False else None
        if line is not None and line.of_any_size(real=_is_real(frequency)):
            return _ANY_SIZE
        if seen.kept is not None:
            kind = "bistable_pattern" if kept else "periodic_noise"
            return None if seen.kept == kept else _PHASE_WORDS[kind]
        if kept and seen.exact and not of_pixels(frequency, 4):
            return _UNTOLD
        if not kept and seen.exact and seen.line is not None:
            odds = self._gain(frequency, kept=True) - self._gain(frequency, kept=False)
            return _BY_CHANCE if odds > SURE else None
        return None

    def measured(self, effect: Effect) -> Measured | None:
        """Return what frames tell of a line, bands or pixels that jump; None: too little is seen.

        The parameters that are so known, and their errors.
        """
        if isinstance(effect, Rts):
            seen = self.telegraph
            sure = seen is not None and seen.gain >= SURE and seen.known
            return (seen.values, seen.errors) if seen is not None and sure else None
        if isinstance(effect, LineFlicker):
            share = self.layout.seen_cycles(1.0)
            cycles = effect.cycles_per_frame * share
            place = place_of_bands(self.layout, self.frames_of, cycles)
            turns = turns_of_bands(self.layout, self.frames_of, cycles)
            told = [] if place is None else [("cycles_per_frame", [own / share for own in place])]
            told += [] if turns is None else [("turns_per_frame", list(turns))]
            known = {name: own for name, (own, _) in told}, {name: own for name, (_, own) in told}
            return known if told else None
        line = self.line(effect)
        if line is None:
            return None
        # Of a wave that is small beside a code rounding leaves more or less, as the noise may be.
        hidden = {"amplitude_dn"} if min(self.layout.variance_dn2.values()) < NARROW else set()
        values = {name: own for name, own in line.values.items() if name not in hidden}
        return values, {name: own for name, own in line.errors.items() if name not in hidden}

    def line(self, effect: Effect) -> "Line | None":
        """Return amplitude and frequency of a line; None: too little is seen.

        What frames of an exposure have in common is taken off: free phases that agree by chance are
        an error, signs are integrated over. Errors of frequencies are those of a sinusoid in white
        noise (Rife & Boorstyn, 1974), larger since powers of frames are added, not amplitudes.
        """
        frequency = frequency_of(effect)
        if frequency is None or self.denial(effect) is not None:
            return None
        seen = self._looks[frequency]
        power = 0.0 if seen.line is None else float(seen.line.excess[0])
        if seen.line is None or not power > _CLEAR_POWER * seen.line.error:
            return None
        kept, real = effect.kind == "bistable_pattern", _is_real(frequency)
        strength, error = seen.line.strength(power, kept=kept, real=real)
        # A cosine has a quarter of its power at +f; samples that are all real have all of it there.
        pixels = self.layout.rows * self.layout.columns
        unit = float(np.sqrt(power * seen.crest / (pixels if real else pixels / 4)))
        at = frequency if seen.frequency is None else seen.frequency
        off = 0.0 if at == frequency else seen.line.bins_apart(power) / min(self._size)
        return Line(unit * strength, unit * error, at, off)

    def gain(self, effect: Effect) -> float:
        """Return the log-likelihood that frames gain by a line at a frequency not known before.

        Of all frequencies that could be as likely, the line's takes the share to which the frames
        tell it: 2 pi times its squared error, of a bin's area (Laplace). Patterns of single pixels
        have few. Interference, which knows nothing of pixels, may be at any: it pays for all of
        them there too. Minus infinity where frames deny the line, or cannot tell.
        """
        if isinstance(effect, Rts):
            return -np.inf if self.telegraph is None else self.telegraph.gain
        if isinstance(effect, LineFlicker):
            at = self.layout.seen_cycles(effect.cycles_per_frame)
            if at not in self._bands:
                self._bands[at] = gain_of_bands(self.layout, self.frames_of, at)
            return self._bands[at]
        frequency = frequency_of(effect)
        if frequency is None or self.denial(effect) is not None:
            return -np.inf
        return self._gain(frequency, kept=effect.kind == "bistable_pattern")

    def _gain(self, frequency: Frequency, *, kept: bool) -> float:
        """Return the gain of a line whose phase is kept but for its sign, or of another in each."""
        if (frequency, kept) not in self._gains:
            self._gains[frequency, kept] = self._gained(frequency, kept=kept)
        return self._gains[frequency, kept]

    def _gained(self, frequency: Frequency, *, kept: bool) -> float:
        line = self._looks[frequency].line
        power = 0.0 if line is None else float(line.excess[0])
        if line is None or not power > 0:
            return -np.inf
        real = _is_real(frequency)
        share = min(2 * np.pi * line.bins(power) ** 2, 1.0)
        anywhere = float(np.log(self.layout.rows * self.layout.columns / 2 / share))
        chosen = float(np.log(_FEW)) if kept and self._looks[frequency].exact else anywhere
        return line.there(power, kept=kept, real=real) - chosen

    def _waves(self, frequency: Frequency) -> float:
        """Return how many waves of a line lie in a frame, along the axis that has more."""
        across, down = frequency
        return max(abs(across) * self.layout.columns, abs(down) * self.layout.rows)

    @property
    def _size(self) -> tuple[int, int]:
        return self.layout.rows, self.layout.columns


@dataclass(frozen=True)
class Line:
    """Amplitude (DN) and frequency (cycles per pixel, x and y) of a line, with standard errors."""

    amplitude_dn: float
    amplitude_error_dn: float
    frequency: Frequency
    frequency_error: float

    @property
    def values(self) -> Mapping[str, object]:
        """Its parameters."""
        return {"amplitude_dn": self.amplitude_dn, "frequency": self.frequency}

    @property
    def errors(self) -> Mapping[str, float]:
        """Their standard errors."""
        return {"amplitude_dn": self.amplitude_error_dn, "frequency": self.frequency_error}


@dataclass(frozen=True)
class Look:
    """What whole frames show at a frequency.

    Attributes
    ----------
    absent
        Whether no more stands out than chance does at one of all frequencies.
    broad
        Whether frequencies beside it are raised as well.
    kept
        Whether the phase is kept but for its sign; None where the frames cannot tell.
    grows
        Whether it is in proportion to the signal.
    line
        Projections at the frequency looked at that shows most; None: of too few frames.
    crest
        Power between the frequencies looked at over that of `line`, 1 or more.
    frequency
        Where that is; None: where it was looked for.
    exact
        Whether it is of what repeats over two, four or eight pixels, and nowhere beside that.
    """

    absent: bool
    broad: bool
    kept: bool | None
    grows: bool = False
    line: "Power | None" = None
    crest: float = 1.0
    frequency: Frequency | None = None
    exact: bool = False


def look(
    layout: Layout, frames_of: FramesOf, frequency: Frequency, *, anywhere: bool = False
) -> Look:
    """Return what whole frames show at a frequency, cycles per pixel along x and y.

    What repeats over few pixels lies where it lies, unless it is to be looked for `anywhere` near:
    so is what shows beside that.
    """
    fx, fy = frequency
    columns, rows = layout.columns, layout.rows
    exact = of_pixels(frequency) and not anywhere
    steps = (0.0,) if exact else _BETWEEN
    tried = [(fx + u / columns, fy + w / rows) for u in steps for w in steps]
    power = Power.of(layout, projections(layout, frames_of, tried))
    if power.frames < LEAST:
        return Look(absent=False, broad=False, kept=None, exact=exact)
    best = int(power.excess.argmax())
    own, (fx, fy) = power.at([best]), tried[best]
    axes = [
        [(fx + k / columns, fy) for k in (*_NEAR, *_FAR)],
        [(fx, fy + k / rows) for k in (*_NEAR, *_FAR)],
    ]
    beside = [(fx + u / columns, fy + w / rows) for u, w in _CROSS]
    looked_at = [*axes[0], *axes[1], *beside]
    around = Power.of(layout, projections(layout, frames_of, looked_at))
    count = len(axes[0])
    crest, off = _top(float(power.excess[best]), around.excess[-len(_CROSS) :])
    around = around.at(range(2 * count))
    # What rows or columns have in common is noise beside which a line must stand out.
    far = [slice(i * count + len(_NEAR), (i + 1) * count) for i in (0, 1)]
    ground = max(float(np.median(around.excess[one])) for one in far)
    level = min(max(float(np.median(around.level[one])) for one in far), 1.0)
    among, around = own.above(ground, level), around.above(ground, level)
    own = own.above(max(ground, _wandering(layout, frames_of, (fx, fy))), level)
    real = _is_real((fx, fy))
    bins = _FEW if exact else rows * columns / 2
    broad = False
    for i, axis in enumerate(axes):
        # The mean of a frame is no neighbour, nor is the same real wave, which runs backwards.
        some = [
            i * count + k
            for k, f in enumerate(axis[: len(_NEAR)])
            if all(_apart(layout, f, other) for other in ((0.0, 0.0), (-fx, -fy)))
        ]
        if exact or not some:
            continue
        broad |= around.crowded(some, float(among.excess[0]))
    absent = own.chance(real=real) * bins > _CHANCE
    kept, grows = own.keeps_phase(real=real), own.grows(layout, real=real)
    if exact:
        found = float(own.excess[0])
        error = own.bins(found) if found > 0 else np.inf
        single = of_pixels(frequency, 4)  # one or two pixels: interference is hardly there
        if not single and float(np.linalg.norm(off)) > _BESIDE * error:
            return look(layout, frames_of, frequency, anywhere=True)
        return Look(absent, broad, kept, grows, own, exact=True)
    there = (fx + off[0] / columns, fy + off[1] / rows)
    # What lies along an axis of the frequencies, as stripes do, stays there.
    asked = zip(frequency, there, strict=True)
    x, y = (f if (2 * f) % 1 == 0 else (at + 0.5) % 1 - 0.5 for f, at in asked)
    return Look(absent, broad, kept, grows, own, crest, (x, y))


def _is_real(frequency: Frequency) -> bool:
    """Return whether all samples of a pattern are real: of none or half a cycle on either axis."""
    return all((2 * f) % 1 == 0 for f in frequency)


def _wandering(layout: Layout, frames_of: FramesOf, at: Frequency) -> float:
    """Return the power that noise which rises as 1 / f has at a slow wave of rows or of columns.

    By least squares of its power at shorter waves, over white noise; 0 of waves that are not slow.
    """
    sizes = np.array([layout.columns, layout.rows])
    waves = np.abs(np.array(at)) * sizes
    if waves.min() > 0 or not 0 < waves.max() <= _SLOWEST:
        return 0.0
    axis = int(waves.argmax())
    shorter = np.arange(*_SHORTER)
    shorter = shorter[shorter < sizes[axis] / 2]
    looked_at = [(k / sizes[0], 0.0) if axis == 0 else (0.0, k / sizes[1]) for k in shorter]
    excess = Power.of(layout, projections(layout, frames_of, looked_at)).excess
    rising = waves.max() / shorter
    return float(excess @ rising / (rising @ rising)) if shorter.size else 0.0


def _top(at: float, beside: NDArray[np.float64]) -> tuple[float, list[float]]:
    """Return the power at the top of a line over that at a frequency, and how far off it is.

    In bins, along x and y; `beside` the frequency as `_CROSS` has. Between three equidistant ones
    the logarithm of the power is a parabola, nearly.
    """
    found, off = 1.0, [0.0, 0.0]
    for axis, (below, above) in enumerate((beside[:2], beside[2:])):
        if min(below, at, above) <= 0:
            continue
        low, high = np.log(below / at), np.log(above / at)
        if low + high < 0:
            found *= float(np.exp(-((low - high) ** 2) / (8 * (low + high))))
            farthest = _CROSS[1][0] / 2
            step = _CROSS[1][0] * (low - high) / (2 * (low + high))
            off[axis] = float(np.clip(step, -farthest, farthest))
    return min(found, _MOST_CREST), off


def _apart(layout: Layout, one: Frequency, other: Frequency) -> bool:
    """Return whether two frequencies are more than half a bin apart along an axis."""
    across, down = ((a - b + 0.5) % 1 - 0.5 for a, b in zip(one, other, strict=True))
    return abs(across) * layout.columns > 0.5 or abs(down) * layout.rows > 0.5
