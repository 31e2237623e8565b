"""Columns of the tables that a session exports: declared once, written and explained from here."""

import math
from dataclasses import dataclass
from typing import Any

from dsis.manifest import Clip
from dsis.session.forms import ObserverRecord
from dsis.session.plan import Presentation
from dsis.session.setup import Display
from dsis.session.store import Vote


@dataclass(frozen=True)
class Column:
    """One column: type as in Table Schema (Frictionless), unit, meaning, where its cells lie."""

    name: str
    type: str
    unit: str
    description: str
    path: str

    def cell(self, entry: object) -> str:
        """Return the cell of a row: blank where nothing is known, the shortest exact number."""
        value: Any = entry
        for name in self.path.split("."):
            value = None if value is None else getattr(value, name)
        if value is None:
            return ""
        if isinstance(value, bool):
            return "true" if value else "false"
        return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)

    def field(self) -> dict[str, str]:
        """Return the column as a field of a Table Schema."""
        return {
            "name": self.name,
            "type": self.type,
            "unit": self.unit,
            "description": self.description,
        }


@dataclass(frozen=True)
class Showing:
    """How a presentation was shown, as far as a player knows; None: nothing is known."""

    started_at: str | None = None
    refresh_hz: float | None = None
    device_pixel_ratio: float | None = None
    full_screen: bool | None = None
    longest_interval_ms: float | None = None


@dataclass(frozen=True)
class Shown:
    """A presentation of an observer with its clip: a row of `PRESENTATIONS`."""

    observer: str
    presentation: Presentation
    clip: Clip
    vote: Vote | None
    lab: str = ""
    showing: Showing = Showing()

    @property
    def state(self) -> str:
        """`planned`, `voted`, or `invalid`: voted on, but with dropped frames."""
        if self.vote is None:
            return "planned"
        return "voted" if self.vote.valid else "invalid"

    @property
    def sha256(self) -> str | None:
        """Hash of the clip as the player shows it, where the manifest has it."""
        player = self.clip.files.get("player")
        return None if player is None else player.sha256


@dataclass(frozen=True)
class Confirmed:
    """A display as confirmed before a sitting: a row of `DISPLAYS`."""

    observer: str
    confirmed_at: str
    display: Display
    steps_seen: bool
    pixels_even: bool
    player: str
    browser: str
    note: str


@dataclass(frozen=True)
class Person:
    """Personal data of an observer: a row of `PEOPLE`."""

    observer: str
    recorded_at: str
    record: ObserverRecord


@dataclass(frozen=True)
class Stimulus:
    """A clip and how it differs from its reference: a row of `STIMULI`."""

    clip: Clip

    @property
    def psnr_db(self) -> float | None:
        """Mean over the frames; None for references, infinite where a frame has no difference."""
        return _mean_db(self.clip.quality.psnr_db)

    @property
    def psnr_demosaicked_db(self) -> float | None:
        """The same against the demosaicked noise-free frame."""
        return _mean_db(self.clip.quality.psnr_demosaicked_db)

    @property
    def effects_psnr_db(self) -> float | None:
        """What effects beyond the base model add to the PSNR of the measured frames."""
        q = self.clip.quality
        base = _mean_db(q.base_psnr_db)
        found = _mean_db(tuple(q.psnr_db[frame] for frame in q.visible_frames))
        return None if base is None or found is None else found - base

    @property
    def effects_visible_ratio(self) -> float | None:
        """Visible noise with effects beyond the base model over that without."""
        q = self.clip.quality
        if not q.base_visible_noise or q.visible_noise is None:
            return None
        return q.visible_noise / q.base_visible_noise


def _mean_db(values: tuple[float | None, ...]) -> float | None:
    if not values:
        return None
    return (
        math.inf if None in values else math.fsum(v for v in values if v is not None) / len(values)
    )


_OBSERVER = Column("observer", "string", "", "pseudonym of the observer", "observer")
_STIMULUS = Column("stimulus", "string", "", "name of the clip judged", "clip.stimulus")
_KIND = Column(
    "kind",
    "string",
    "",
    "test; reference: hidden reference; training, dummy: never scored",
    "presentation.kind",
)
_PLACES = (
    Column("session", "string", "", "viewing session, from 1", "presentation.session"),
    Column(
        "presentation", "integer", "", "place in the observer's order, from 1", "presentation.place"
    ),
    Column(
        "repetition",
        "integer",
        "",
        "which showing to this observer, from 1",
        "presentation.repetition",
    ),
    Column(
        "attempt",
        "integer",
        "",
        "from 1; more where a showing had dropped frames",
        "presentation.attempt",
    ),
)
_SIMULATED = "true: a simulated observer"
STIMULUS_SHA256 = Column(
    "stimulus_sha256", "string", "", "SHA-256 of the clip's frames (player format)", "sha256"
)

VOTES = (
    _OBSERVER,
    _STIMULUS,
    Column("vote", "integer", "grade", "the vote; blank: none was given", "vote.vote"),
    Column("content", "string", "", "what the clip shows", "clip.content"),
    Column("noise", "string", "", "noise model: awgn, sd (signal-dependent)", "clip.noise"),
    Column("demosaic", "string", "", "demosaicking; none: never mosaicked", "clip.demosaic"),
    Column("level", "integer", "stop", "stops of under-exposure", "clip.level"),
    *_PLACES,
    Column(
        "valid",
        "boolean",
        "",
        "false: shown with dropped frames and repeated later; never scored",
        "vote.valid",
    ),
    _KIND,
    Column(
        "reaction_ms", "number", "ms", "from the end of the clip to the vote", "vote.reaction_ms"
    ),
    Column(
        "voted_at",
        "datetime",
        "",
        "ISO 8601 with offset; robots' clocks start in 1970",
        "vote.voted_at",
    ),
    Column(
        "dropped_frames",
        "integer",
        "frame",
        "frames that never were on the screen; blank: nothing was shown",
        "vote.dropped_frames",
    ),
    Column("simulated", "boolean", "", _SIMULATED, "vote.simulated"),
)
PRESENTATIONS = (
    _OBSERVER,
    _STIMULUS,
    Column("reference", "string", "", "name of its reference", "presentation.reference"),
    _KIND,
    *_PLACES,
    Column("seed", "integer", "", "seed of the plan", "presentation.seed"),
    Column("state", "string", "", "planned, voted, or invalid (dropped frames)", "state"),
    Column(
        "started_at", "datetime", "", "when it began, ISO 8601 with offset", "showing.started_at"
    ),
    Column(
        "dropped_frames",
        "integer",
        "frame",
        "frames that never were on the screen",
        "vote.dropped_frames",
    ),
    Column(
        "longest_interval_ms",
        "number",
        "ms",
        "longest time that one frame stayed",
        "showing.longest_interval_ms",
    ),
    Column("refresh_hz", "number", "Hz", "refresh rate of the display", "showing.refresh_hz"),
    Column(
        "device_pixel_ratio",
        "number",
        "",
        "zoom of the page; clips are shown pixel for pixel at any",
        "showing.device_pixel_ratio",
    ),
    Column("full_screen", "boolean", "", "the page filled the screen", "showing.full_screen"),
)
LAB = Column("lab", "string", "", "laboratory", "lab")
OBSERVERS = (
    _OBSERVER,
    Column("simulated", "boolean", "", _SIMULATED, "simulated"),
    Column("seed", "integer", "", "seed of the plan", "seed"),
    Column(
        "created_at",
        "datetime",
        "",
        "when the plan was drawn, ISO 8601 with offset; robots' clocks start in 1970",
        "created_at",
    ),
)
STIMULI = (
    _STIMULUS,
    Column("role", "string", "", "test, training or reference", "clip.role"),
    Column("content", "string", "", "what the clip shows", "clip.content"),
    Column("noise", "string", "", "noise model: awgn, sd (signal-dependent)", "clip.noise"),
    Column("demosaic", "string", "", "demosaicking; none: never mosaicked", "clip.demosaic"),
    Column("level", "integer", "stop", "stops of under-exposure", "clip.level"),
    Column(
        "awgn_sigma", "number", "8-bit code", "standard deviation of white noise", "clip.awgn_sigma"
    ),
    Column("psnr_db", "number", "dB", "against the reference, mean over frames", "psnr_db"),
    Column(
        "psnr_demosaicked_db",
        "number",
        "dB",
        "against the demosaicked noise-free frame",
        "psnr_demosaicked_db",
    ),
    Column(
        "visible_noise",
        "number",
        "Delta E^2",
        "mean squared S-CIELAB difference from the reference",
        "clip.quality.visible_noise",
    ),
    Column(
        "visible_colour",
        "number",
        "Delta E^2",
        "its part in a* and b*",
        "clip.quality.visible_colour",
    ),
    Column(
        "effects_psnr_db",
        "number",
        "dB",
        "what the camera's effects beyond the base model add to the PSNR",
        "effects_psnr_db",
    ),
    Column(
        "effects_visible_ratio",
        "number",
        "",
        "visible noise with those effects over that without",
        "effects_visible_ratio",
    ),
)
DISPLAYS = (
    Column("observer", "string", "", "who sat before it", "observer"),
    Column("confirmed_at", "datetime", "", "ISO 8601 with offset", "confirmed_at"),
    Column("model", "string", "", "make, model, serial number", "display.model"),
    Column("diagonal_inch", "number", "inch", "of the picture", "display.diagonal_inch"),
    Column("peak_cd_m2", "number", "cd/m^2", "luminance of white", "display.peak_cd_m2"),
    Column("black_cd_m2", "number", "cd/m^2", "luminance of black", "display.black_cd_m2"),
    Column(
        "distance_heights",
        "number",
        "picture height",
        "viewing distance",
        "display.distance_heights",
    ),
    Column("room_lux", "number", "lx", "illuminance at the display", "display.room_lux"),
    Column("steps_seen", "boolean", "", "steps next to black and white differ", "steps_seen"),
    Column("pixels_even", "boolean", "", "lines one pixel wide are even", "pixels_even"),
    Column("player", "string", "", "what shows the clips, with its version", "player"),
    Column("browser", "string", "", "browser of the page, as it names itself", "browser"),
    Column("note", "string", "", "the experimenter's", "note"),
)
PEOPLE = (
    Column("observer", "string", "", "pseudonym of the observer", "observer"),
    Column("recorded_at", "datetime", "", "ISO 8601 with offset", "recorded_at"),
    Column("age", "string", "year", "age group", "record.age"),
    Column("expertise", "string", "", "naive or expert", "record.expertise"),
    Column("acuity_chart", "string", "", "Landolt, Snellen, not tested", "record.acuity_chart"),
    Column("acuity", "number", "", "decimal acuity, both eyes", "record.acuity"),
    Column("corrected", "boolean", "", "glasses or lenses are worn", "record.corrected"),
    Column("colour_test", "string", "", "Ishihara, other, not tested", "record.colour_test"),
    Column("colour_plates", "integer", "", "plates shown", "record.colour_plates"),
    Column("colour_read", "integer", "", "plates read right", "record.colour_read"),
    Column("colour_vision", "string", "", "normal, deficient, not tested", "record.colour_vision"),
    Column("note", "string", "", "the experimenter's", "record.note"),
)
