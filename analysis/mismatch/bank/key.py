"""What a number of the bank is, and where it was taken."""

from dataclasses import dataclass

MOSAIC = "in all channels"
_HIGHEST = ("spectrum_peak", "spectral_peak", "outlying_patch", "scene_motion")


@dataclass(frozen=True)
class Key:
    """The name of one number.

    Attributes
    ----------
    statistic
        One of `dsis.measures.MEASURES`, or one of the bank's own.
    scope
        What the number is of: `exposure`, `scene` (an exposure to a picture), or a coherent sum
        over exposures (`offset`, `gain`, `time`, `pooled` and the weighting of a contrast).
    exposure
        Name of the exposure; empty for sums over exposures.
    channel
        Name of the channel; empty for sums over channels.
    detail
        What else tells it apart: a lag, an axis.
    """

    statistic: str
    scope: str
    exposure: str = ""
    channel: str = ""
    detail: str = ""

    @property
    def is_score(self) -> bool:
        """Whether it is a normal score of the highest of many bins, patches or slow waves."""
        return self.statistic.endswith(_HIGHEST)

    @property
    def is_cube_root(self) -> bool:
        """Whether it is the cube root of a mean square, 1 where there is white noise alone."""
        return is_cube_root(self.statistic)

    @property
    def place(self) -> tuple[str, str]:
        """Exposure and channel; of a range of signal in a scene: exposure, channel and range."""
        return self.exposure, f"{self.channel} {self.detail}".strip()


def is_cube_root(statistic: str) -> bool:
    """Return whether a statistic's numbers are cube roots of mean squares."""
    return statistic.endswith("variance") and statistic != "pixel_variance"


def split_name(name: str) -> tuple[str, str]:
    """Return statistic and detail of a name such as `parity of rows`."""
    for mark in (" of ", " along "):
        if mark in name:
            statistic, detail = name.split(mark, 1)
            return statistic, detail
    return name, ""
