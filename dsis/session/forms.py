"""What is asked before the first presentation: observer, screening, consent, display."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from dsis.model import Model
from dsis.session.setup import Display

ACUITY_LEAST = 1.0  # "normal or corrected-to-normal": 6/6, 20/20
Note = Annotated[str, Field(max_length=500)]


class ObserverRecord(Model):
    """What is known of an observer: personal data, kept apart from votes.

    Attributes
    ----------
    age
        Age group in years.
    expertise
        `expert`: works with picture quality.
    acuity_chart, acuity
        Chart, and decimal acuity with both eyes (1.0 is 6/6, 20/20); None: not tested.
    corrected
        Glasses or lenses are worn.
    colour_test, colour_plates, colour_read, colour_vision
        Test, plates shown, plates read right, and what follows from them.
    note
        Anything else.
    """

    age: Literal["under 18", "18-24", "25-34", "35-44", "45-54", "55-64", "65 or more", "not said"]
    expertise: Literal["naive", "expert"]
    acuity_chart: Literal["Landolt", "Snellen", "not tested"]
    acuity: Annotated[float, Field(gt=0, le=4)] | None = None
    corrected: bool
    colour_test: Literal["Ishihara", "other", "not tested"]
    colour_plates: Annotated[int, Field(ge=1, le=100)] | None = None
    colour_read: Annotated[int, Field(ge=0, le=100)] | None = None
    colour_vision: Literal["normal", "deficient", "not tested"]
    note: Note = ""

    # The words are those of the form that the experimenter sees.
    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.acuity is None) != (self.acuity_chart == "not tested"):
            message = "Acuity must be given if, and only if, a chart was read"
            raise ValueError(message)
        if (self.colour_vision == "not tested") != (self.colour_test == "not tested"):
            message = "Colour vision must say what the test of colour vision showed"
            raise ValueError(message)
        if (self.colour_plates is None) != (self.colour_read is None):
            message = "Plates shown and Plates read right must be given together"
            raise ValueError(message)
        if (self.colour_read or 0) > (self.colour_plates or 0):
            message = f"Plates read right is {self.colour_read}, more than Plates shown"
            raise ValueError(message)
        return self

    def remarks(self) -> Iterator[str]:
        """Yield why the experimenter may not want this observer; the choice is not made here."""
        if self.acuity is None:
            yield "visual acuity was not tested"
        elif self.acuity < ACUITY_LEAST:
            yield f"visual acuity is {self.acuity:g}, below {ACUITY_LEAST:g}"
        if self.colour_vision != "normal":
            yield f"colour vision: {self.colour_vision}"


class ConsentForm(Model):
    """The observer agrees to the text with this hash."""

    sha256: str


class DisplayForm(Model):
    """The display as confirmed for this sitting, and what the page measured there.

    Attributes
    ----------
    display
        The record.
    steps_seen
        On the check page, the steps next to black and to white differ from them.
    pixels_even
        The lines one pixel wide are even: one pixel of the clip is one pixel of the display.
    note
        What is not as it should be.
    measured
        Refresh rate, pixel ratio, window, browser.
    """

    display: Display
    steps_seen: bool
    pixels_even: bool
    note: Note = ""
    measured: dict[str, Any]
