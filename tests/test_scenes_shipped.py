"""What comes with dsis is what its renderers give, and all that the demo needs."""

from dataclasses import replace

import numpy as np
import pytest

from dsis.scenes import Strip, panorama, render
from dsis.scenes.shipped import FOLDER, SHIPPED, as_shipped
from dsis.spec import SHIPPED as SPECS
from dsis.spec import read_spec
from dsis.stimuli.jobs import jobs_of
from dsis.stimuli.panoramas import strip_of

HALF = 2.0**-11  # half floats round to 11 bits of mantissa
# Another processor or libm may place a point on the other side of an edge in a few pixels.
MOST = 0.999


@pytest.mark.parametrize("strip", SHIPPED, ids=lambda strip: f"{strip.scene}-{strip.seed}")
def test_it_is_what_the_renderer_gives(strip: Strip) -> None:
    """The first columns; all of them: `python benchmarks/scenes.py --check-shipped`."""
    narrow = replace(strip, columns=48)
    held = as_shipped(narrow)
    assert held is not None
    rendered = render(narrow)
    near = np.abs(held - rendered) <= HALF * rendered + 1e-7  # half floats below 6e-5 are steps
    assert near.mean() > MOST


def test_the_demo_renders_nothing() -> None:
    test = read_spec(SPECS / "demo.toml")
    for job in jobs_of(test):
        strip = strip_of(job.content, test.spec.sequence)
        assert strip is not None
        assert as_shipped(strip) is not None, strip


def test_what_is_shipped_comes_before_the_cache() -> None:
    """Otherwise a wider panorama in one cache would change the bytes of a test."""
    strip = replace(SHIPPED[0], columns=20)
    held = as_shipped(strip)
    assert held is not None
    assert panorama(strip).tobytes() == held.tobytes()
    assert not held.flags.writeable
    wide = replace(SHIPPED[0], columns=SHIPPED[0].columns + 1)
    assert as_shipped(wide) is None
    assert as_shipped(replace(strip, samples=5)) is None


def test_the_wheel_stays_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 12e6  # of 15 MB for the wheel
