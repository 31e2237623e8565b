"""Scored votes as a dataset of the program sureal, JSON: `ref_videos`, `dis_videos` with votes."""

from collections.abc import Sequence
from typing import Any

from dsis.manifest import Manifest
from dsis.session.columns import Shown
from dsis.session.plan import SCORED

SIMULATED_OBSERVERS = "simulated_observers"
"""Key of a dataset, which sureal passes over: the observers that are simulated."""


def sureal_dataset(manifest: Manifest, shown: Sequence[Shown]) -> dict[str, Any]:
    """Return the valid votes of the test by stimulus and observer; JSON can hold it.

    Observers with repeated presentations have a list of votes. A hidden reference is the video
    whose path is its content's reference. `simulated_observers`, which sureal passes over, names
    the observers that are simulated.
    """
    clips = {clip.stimulus: clip for clip in manifest.clips}
    scores: dict[str, dict[str, dict[int, int]]] = {}
    robots: set[str] = set()
    for entry in shown:
        p, vote = entry.presentation, entry.vote
        if p.kind not in SCORED or vote is None or not vote.valid or vote.vote is None:
            continue
        by_observer = scores.setdefault(p.stimulus, {})
        by_observer.setdefault(entry.observer, {})[p.repetition] = vote.vote
        if vote.simulated:
            robots.add(entry.observer)
    contents = list(dict.fromkeys(clips[stimulus].content for stimulus in sorted(scores)))
    references = {c.content: c.reference or c.stimulus for c in map(clips.__getitem__, scores)}
    return {
        "dataset_name": manifest.title,
        "yuv_fmt": "notyuv",
        "width": manifest.sequence.width,
        "height": manifest.sequence.height,
        "ref_score": manifest.session.scale[1],
        SIMULATED_OBSERVERS: sorted(robots),
        "ref_videos": [
            {"content_id": number, "content_name": content, "path": references[content]}
            for number, content in enumerate(contents)
        ],
        "dis_videos": [
            {
                "content_id": contents.index(clips[stimulus].content),
                "asset_id": number,
                "asset_name": stimulus,
                "path": stimulus,
                "os": {who: _listed(votes) for who, votes in sorted(scores[stimulus].items())},
            }
            for number, stimulus in enumerate(sorted(scores))
        ],
    }


def _listed(votes: dict[int, int]) -> int | list[int | None]:
    """Return one vote, or with repetitions a list, None where one is missing."""
    last = max(votes)
    return votes[1] if last == 1 else [votes.get(repetition) for repetition in range(1, last + 1)]
