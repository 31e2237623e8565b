"""Rules that a plan keeps, checked on any plan: drawn here, edited by hand or read from a store."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise

from dsis.manifest import Clip, Manifest
from dsis.session.arrange import unavoidable
from dsis.session.plan import Kind, Presentation, clips_of, succession

_BLOCKS: dict[Kind, int] = {"training": 0, "dummy": 1, "test": 2, "reference": 2}
_ROLE: dict[Kind, str] = {
    "training": "training",
    "dummy": "test",
    "test": "test",
    "reference": "reference",
}


def validate_plan(plan: Sequence[Presentation], manifest: Manifest) -> list[str]:
    """Return the rules that a plan breaks, as sentences; an empty list: none.

    For plans as drawn, before anything is repeated.
    """
    clips = {clip.stimulus: clip for clip in manifest.clips}
    broken = [*_places(plan), *_names(plan, clips)]
    if broken:
        return broken
    return [*_blocks(plan), *_numbers(plan, manifest), *_successions(plan, manifest)]


def _places(plan: Sequence[Presentation]) -> Iterator[str]:
    if [p.place for p in plan] != list(range(1, len(plan) + 1)):
        yield f"places must be 1 to {len(plan)} in order"
    if len({p.seed for p in plan}) > 1:
        yield "presentations have different seeds"


def _names(plan: Sequence[Presentation], clips: dict[str, Clip]) -> Iterator[str]:
    for p in plan:
        clip = clips.get(p.stimulus)
        if clip is None:
            yield f"presentation {p.place}: {p.stimulus} is not in the manifest"
        elif clip.role != _ROLE[p.kind]:
            yield f"presentation {p.place}: {p.stimulus} is a {clip.role} clip, shown as {p.kind}"
        elif p.reference != (clip.reference or clip.stimulus):
            yield (
                f"presentation {p.place}: reference is {p.reference}, must be "
                f"{clip.reference or clip.stimulus}"
            )


def _blocks(plan: Sequence[Presentation]) -> Iterator[str]:
    for before, after in pairwise(plan):
        if _BLOCKS[after.kind] < _BLOCKS[before.kind]:
            yield f"presentation {after.place}: {after.kind} comes after {before.kind}"


def _numbers(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    session = manifest.session
    training = min(session.training, len(clips_of(manifest, "training")))
    for kind, wanted in (("training", training), ("dummy", session.dummies)):
        found = sum(p.kind == kind for p in plan)
        if found != wanted:
            yield f"{found} {kind} presentations, must be {wanted}"
    shown: Counter[tuple[str, str]] = Counter()
    for p in plan:
        shown[p.kind, p.stimulus] += 1
        if p.repetition != shown[p.kind, p.stimulus]:
            yield (
                f"presentation {p.place}: repetition is {p.repetition}, must be "
                f"{shown[p.kind, p.stimulus]}"
            )
        if p.attempt != 1:
            yield f"presentation {p.place}: attempt is {p.attempt}, must be 1"
    for clip in clips_of(manifest, "test"):
        found = shown["test", clip.stimulus]
        if found != session.repetitions:
            yield f"{clip.stimulus} is tested {found} times, must be {session.repetitions}"
    for (kind, stimulus), found in shown.items():
        if kind == "training" and found > 1:
            yield f"{stimulus} is shown {found} times in the training"


def _successions(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    """Yield where neighbours are alike, wherever there are more of them than are forced."""
    tests = clips_of(manifest, "test")
    alike = succession(tests)
    keys = [(p, alike(manifest.clip(p.stimulus))) for p in plan if p.kind != "training"]
    counts = Counter(key for p, key in keys if p.kind != "dummy")
    same = [(b, key) for (a, key), (b, after) in pairwise(keys) if key == after]
    early = [p for p, _ in same if plan[p.place - 2].kind == "dummy"]
    late = [p for p, _ in same if plan[p.place - 2].kind != "dummy"]
    if early and len({alike(clip) for clip in tests}) > 1:
        yield from (_again(p, plan) for p in early)
    if len(late) > unavoidable(counts):
        yield from (_again(p, plan) for p in late)
    yield from _training_successions(plan, manifest)


def _training_successions(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    block = [p for p in plan if p.kind == "training"]
    clips = [manifest.clip(p.stimulus) for p in block]
    alike = succession(clips)
    following = plan[len(block) : len(block) + 1]
    keys = [alike(clip) for clip in clips]
    after = [alike(manifest.clip(p.stimulus)) for p in following]
    same = [b for b, (x, y) in zip(plan[1:], pairwise(keys + after), strict=False) if x == y]
    if len(same) > unavoidable(Counter(keys), after[0] if after else None):
        yield from (_again(p, plan) for p in same)


def _again(p: Presentation, plan: Sequence[Presentation]) -> str:
    before = plan[p.place - 2]
    return f"presentation {p.place}: {p.stimulus} follows {before.stimulus}"
