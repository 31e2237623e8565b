"""The set-up of a laboratory: a TOML file of its own, for one test may be held in several labs.

::

    schema = "dsis-session/1"
    lab = "TUM"
    hidden_references = true
    consent = "I take part of my own free will and may stop at any time."
    [display]
    model = "Sony BVM-E251"
    diagonal_inch = 24.5
    peak_cd_m2 = 100
    distance_heights = 3.0

The store keeps the text that was in force at every moment. What decides the plans cannot change
once somebody has a plan.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field

from dsis.errors import InputError
from dsis.model import Model, read_toml, structure
from dsis.session.store import Store
from dsis.spec import Session

SCHEMA: Literal["dsis-session/1"] = "dsis-session/1"
Positive = Annotated[float, Field(gt=0)]


class Display(Model):
    """The display in front of the observer.

    Attributes
    ----------
    model
        Make, model and serial number.
    diagonal_inch
        Of the visible picture.
    peak_cd_m2, black_cd_m2
        Luminance of full white and of black as measured; None: not measured.
    distance_heights
        Viewing distance in heights of the picture shown.
    room_lux
        Illuminance at the display; None: not measured.
    """

    model: Annotated[str, Field(min_length=1, max_length=200)]
    diagonal_inch: Positive
    peak_cd_m2: Positive
    black_cd_m2: Annotated[float, Field(ge=0)] | None = None
    distance_heights: Positive
    room_lux: Annotated[float, Field(ge=0)] | None = None


class Setup(Model):
    """How a laboratory holds the test.

    Attributes
    ----------
    lab
        Its name, a column of the votes; empty: none.
    hidden_references
        Show every reference as a stimulus too; where the file says nothing, as the test's spec has
        it.
    consent
        What observers agree to before they begin; empty: they are not asked. Likewise.
    instructions
        Shown instead of the page's own explanation; empty: that one.
    grade_words
        A word for every grade, worst first, in the observers' language; empty: the words of the
        scale's ends, or the five-grade impairment scale where the grades are 1 to 5.
    display
        Fills the form for the display, which is confirmed before each sitting.
    """

    schema_: Annotated[Literal["dsis-session/1"], Field(alias="schema")] = SCHEMA
    lab: Annotated[str, Field(pattern=r"^[\w.-]{0,64}$")] = ""
    hidden_references: bool = False
    consent: str = ""
    instructions: str = ""
    grade_words: tuple[str, ...] = ()
    display: Display | None = None

    @property
    def consent_sha256(self) -> str:
        """Hash of the text that is agreed to."""
        return hashlib.sha256(self.consent.encode()).hexdigest()

    def completed(self, session: Session) -> Self:
        """Return the set-up, what it does not say taken from the test's spec."""
        said = self.model_fields_set
        own = {
            name: getattr(session, name)
            for name in ("hidden_references", "consent")
            if name not in said
        }
        return self.model_copy(update=own)


def read_setup(path: Path, scale: tuple[int, int]) -> Setup:
    """Return the set-up in a file; raise `InputError` with all its faults."""
    values = read_toml(path)
    if "schema" not in values:
        raise InputError.of(path, "schema", f'is missing, must be "{SCHEMA}"')
    setup = structure(Setup, values, str(path))
    grades = scale[1] - scale[0] + 1
    if setup.grade_words and len(setup.grade_words) != grades:
        fact = f"has {len(setup.grade_words)} items, must have {grades}: one for every grade"
        raise InputError.of(path, "grade_words", fact)
    return setup


def current_setup(store: Store, session: Session) -> Setup:
    """Return the set-up that is in force; what the test's spec says where none was given."""
    kept = store.events("setup")
    if not kept:
        return Setup().completed(session)
    return Setup.model_validate_json(json.dumps(kept[-1]["setup"]))


def put_in_force(store: Store, setup: Setup, session: Session) -> None:
    """Keep a set-up in the store from now on, completed by the test's spec.

    Raises
    ------
    InputError
        It asks for other plans than those that observers have already.
    """
    setup = setup.completed(session)
    with store.transaction():
        before = current_setup(store, session)
        if setup.hidden_references != before.hidden_references and store.observers():
            fact = (
                f"is {str(setup.hidden_references).lower()}, must stay "
                f"{str(before.hidden_references).lower()}: observers have plans already"
            )
            raise InputError.of("set-up", "hidden_references", fact)
        if setup != before or not store.events("setup"):
            store.log("setup", setup=setup.model_dump(mode="json", by_alias=True))
