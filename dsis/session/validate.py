"""Rules that a plan keeps, checked on any plan: drawn here, edited by hand or read from a store."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise

from dsis.manifest import Clip, Manifest
from dsis.session.arrange import unavoidable
from dsis.session.plan import (
    SCORED,
    Kind,
    Presentation,
    clips_of,
    early_and_late,
    references_of,
    succession,
)
from dsis.session.sittings import dummies_in
from dsis.session.steps import presentation_s

_BLOCKS: dict[Kind, int] = {"training": 0, "dummy": 1, "test": 2, "reference": 2}
_ROLE: dict[Kind, str] = {
    "training": "training",
    "dummy": "test",
    "test": "test",
    "reference": "reference",
}


def validate_plan(
    plan: Sequence[Presentation], manifest: Manifest, *, hidden_references: bool = False
) -> list[str]:
    """Return the rules that a plan breaks, as sentences; an empty list: none.

    For plans as drawn, before anything is repeated.
    """
    clips = {clip.stimulus: clip for clip in manifest.clips}
    broken = [*_places(plan), *_names(plan, clips)]
    if broken:
        return broken
    return [
        *_blocks(plan),
        *_sittings(plan, manifest),
        *_leads(plan, manifest),
        *_counts(plan),
        *_numbers(plan, manifest, hidden_references=hidden_references),
        *_successions(plan, manifest),
    ]


def validate_panel(plans: Sequence[Sequence[Presentation]]) -> list[str]:
    """Return where the plans of a panel are unbalanced: stimuli that come too often early or late.

    An odd observer out may move each stimulus by as often as one plan shows it.
    """
    allowed = max(Counter((p.kind, p.stimulus) for p in plans[0]).values()) if len(plans) % 2 else 0
    return [
        f"{stimulus}: {early} times in the first half of the test, {late} times in the second"
        for stimulus, (early, late) in early_and_late(plans).items()
        if abs(early - late) > allowed
    ]


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
        if after.session == before.session and _BLOCKS[after.kind] < _BLOCKS[before.kind]:
            yield f"presentation {after.place}: {after.kind} comes after {before.kind}"
        if after.session > 1 and after.kind == "training":
            yield f"presentation {after.place}: training after the first viewing session"


def _sittings(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    numbers = [p.session for p in plan]
    if sorted(set(numbers)) != list(range(1, max(numbers, default=0) + 1)):
        yield "viewing sessions must be numbered from 1"
    if numbers != sorted(numbers):
        yield "viewing sessions must follow one another"
    limit = manifest.session.session_minutes_max
    for number, held in sorted(Counter(numbers).items()):
        minutes = held * presentation_s(manifest.session) / 60
        if minutes > limit * (1 + 1e-9):  # sums of decimal fractions
            yield f"viewing session {number} lasts {minutes:.1f} minutes, must be at most {limit:g}"


def _leads(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    """Yield where training or dummies are too few or too many."""
    session = manifest.session
    training = min(session.training, len(clips_of(manifest, "training")))
    found = sum(p.kind == "training" for p in plan)
    if found != training:
        yield f"{found} training presentations, must be {training}"
    for number in sorted({p.session for p in plan}):
        found = sum(p.kind == "dummy" and p.session == number for p in plan)
        wanted = dummies_in(number, session)
        if found != wanted:
            yield f"{found} dummy presentations in viewing session {number}, must be {wanted}"
    shown = Counter(p.stimulus for p in plan if p.kind == "training")
    for stimulus, found in shown.items():
        if found > 1:
            yield f"{stimulus} is shown {found} times in the training"


def _counts(plan: Sequence[Presentation]) -> Iterator[str]:
    """Yield where repetitions or attempts are miscounted."""
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


def _numbers(
    plan: Sequence[Presentation], manifest: Manifest, *, hidden_references: bool
) -> Iterator[str]:
    """Yield what is judged too often or not often enough."""
    wanted: set[tuple[Kind, str]] = {("test", clip.stimulus) for clip in clips_of(manifest, "test")}
    if hidden_references:
        wanted |= {("reference", clip.stimulus) for clip in references_of(manifest)}
    shown = Counter((p.kind, p.stimulus) for p in plan if p.kind in SCORED)
    for kind, stimulus in sorted(wanted | set(shown)):
        found, asked = shown[kind, stimulus], manifest.session.repetitions
        must = asked if (kind, stimulus) in wanted else 0
        judged = "tested" if kind == "test" else "judged as a hidden reference"
        if found != must:
            yield f"{stimulus} is {judged} {found} times, must be {must}"


def _successions(plan: Sequence[Presentation], manifest: Manifest) -> Iterator[str]:
    """Yield where neighbours are alike, wherever there are more of them than are forced.

    A break between viewing sessions parts neighbours.
    """
    tests = clips_of(manifest, "test")
    alike = succession(tests)
    keys = [(p, alike(manifest.clip(p.stimulus))) for p in plan if p.kind != "training"]
    counts = Counter(key for p, key in keys if p.kind in SCORED)
    same = [
        (before, after)
        for (before, key), (after, key_after) in pairwise(keys)
        if key == key_after and before.session == after.session
    ]
    early = [after for before, after in same if before.kind == "dummy"]
    late = [after for before, after in same if before.kind != "dummy"]
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
