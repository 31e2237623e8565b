"""What an observer sees in one presentation of a DSIS test, step by step."""

from dataclasses import dataclass
from typing import Literal

from dsis.spec import Session

FIVE_GRADES = (
    "very annoying",
    "annoying",
    "slightly annoying",
    "perceptible, but not annoying",
    "imperceptible",
)
"""The words of the five-grade impairment scale of BT.500, grade 1 first."""

GREY = "#7e7e7e"  # 8-bit code 126: the mid-grey of DSIS, the same between clips and around them


@dataclass(frozen=True)
class Step:
    """Grey, or one of the two clips.

    Attributes
    ----------
    show
        What is on the screen.
    seconds
        For how long. A clip that is shorter starts again; a longer one is cut.
    label
        Word on the grey: which clip follows.
    """

    show: Literal["grey", "reference", "test"]
    seconds: float
    label: str = ""


def steps(session: Session) -> tuple[Step, ...]:
    """Return the steps up to the vote: grey, reference, grey, test; variant II shows them twice."""
    pair = (
        Step("grey", session.grey_s, "Reference"),
        Step("reference", session.reference_s),
        Step("grey", session.grey_s, "Test"),
        Step("test", session.test_s),
    )
    return pair * (2 if session.variant == "II" else 1)


def presentation_s(session: Session) -> float:
    """Return the duration of a presentation with its vote, in seconds."""
    return sum(step.seconds for step in steps(session)) + session.vote_s


def grade_words(session: Session) -> tuple[str, ...]:
    """Return a word for every grade: those of the five-grade scale if it is that, else none."""
    five = session.scale == (1, 5) and session.labels == (FIVE_GRADES[0], FIVE_GRADES[-1])
    return FIVE_GRADES if five else ()
