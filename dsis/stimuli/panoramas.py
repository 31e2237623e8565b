"""The panoramas that a test's windows slide over."""

import math

from dsis.scenes import FEWEST_ROWS, Progress, Strip, panorama
from dsis.spec import Content, Sequence, Test
from dsis.stimuli.jobs import jobs_of
from dsis.workers import Workers


def strip_of(content: Content, size: Sequence) -> Strip | None:
    """Return the panorama that a content's window slides over; None where it is footage."""
    if content.scene is None:
        return None
    travel = math.ceil(abs(content.pan_px_per_frame) * (size.frames - 1))
    rows = max(FEWEST_ROWS, content.scale * size.height)  # of which the window shows the middle
    return Strip(content.scene, content.scene_seed, rows, content.scale * (size.width + travel))


def render_panoramas(
    test: Test, *, threads: int = 1, progress: Progress | None = None, pool: Workers | None = None
) -> None:
    """Render what a test needs and the cache does not hold, by many workers and with a word.

    On that many threads, or by `pool`: threads, processes, or a cluster.
    Without it a panorama is rendered when its content's turn comes, on one thread and silently.
    """
    for job in jobs_of(test):
        strip = strip_of(job.content, test.spec.sequence)
        if strip is not None:
            panorama(strip, threads=threads, progress=progress, pool=pool)
