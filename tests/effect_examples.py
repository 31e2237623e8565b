"""Every effect of the registry, the example that it declares, the camera that it is tried on."""

import pytest

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect, registry

Z_MAX = 5.0
REPEATS, FRAMES, ROWS, COLUMNS = 3, 64, 96, 64
SLOPE_DN, SWITCH_DN, INTERCEPTS_DN2 = 1.5, 1000.0, (30.0, 80.0)

BACKGROUND = Camera(
    name="background",
    cfa=Cfa.MONO,
    black_level=500.0,
    white_level=65535.0,
    bit_depth=16,
    noise=BaseNoise(
        segment=(
            Segment(upper_dn=SWITCH_DN, slope=SLOPE_DN, intercept=INTERCEPTS_DN2[0]),
            Segment(slope=SLOPE_DN, intercept=INTERCEPTS_DN2[1]),
        )
    ),
)

KINDS = registry()
every_kind = pytest.mark.parametrize("name", KINDS)


def example_of(kind: type[Effect]) -> Effect:
    """Return an effect with the examples that its fields declare."""
    fields = {n: f for n, f in kind.model_fields.items() if n != "kind"}
    missing = [n for n, f in fields.items() if f.is_required() and not f.examples]
    assert not missing, f"{kind.__name__}: no example of {missing}"
    return kind(**{name: f.examples[0] for name, f in fields.items() if f.examples})


def camera_with(*effects: Effect) -> Camera:
    """Return the background with effects: monochrome unless an effect needs colours."""
    unfit = any(effect.unfit_for(BACKGROUND.read_out) for effect in effects)
    cfa = Cfa.RGGB if unfit else Cfa.MONO
    return BACKGROUND.model_copy(update={"effect": effects, "cfa": cfa})
