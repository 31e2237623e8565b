"""What an effect is drawn as, and the z that it is to stand at."""

import numpy as np

from second import strengths_light, strengths_readout, strengths_unlisted
from second.geometry import log_uniform
from second.room import Drawn, Room
from second.vocabulary import PARAMETERS

DRAWS = strengths_light.DRAWS | strengths_readout.DRAWS | strengths_unlisted.DRAWS
LISTED_Z = (8, 60)
UNLISTED_Z = (16, 90)  # its oracle knows the template; a blind search pays for its trials


def draw_effect(kind: str, room: Room, g: np.random.Generator) -> Drawn:
    """Return an effect of this kind, without a size yet where it has a setter."""
    drawn = DRAWS[kind](room, g)
    return drawn._replace(effect={"kind": kind, **drawn.effect})


def target(kind: str, g: np.random.Generator) -> float:
    """Return the z that an effect is to stand at."""
    return log_uniform(g, *(LISTED_Z if kind in PARAMETERS else UNLISTED_Z))
