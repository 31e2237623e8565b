"""The plan of an observer: which presentations, in which order.

Training, then dummies that settle the observer's judgement, then every test clip as often as the
spec says, and every hidden reference as often if asked. The same content is never shown twice in
succession where there are several (with one: the same stimulus), as far as the numbers allow. What
lasts longer than a viewing session is cut into several (`sittings`), each with dummies of its own.

Every second observer sees the test in the reverse order of the one before: over such a pair each
stimulus is exactly as often early as late, which order effects (fatigue, practice) then cannot
favour. A plan is a function of manifest, observer, seed and the observer whose order is reversed.
"""

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dsis.errors import InputError
from dsis.manifest import MANIFEST, Clip, Manifest
from dsis.session.arrange import arrange, unavoidable
from dsis.session.sittings import begins_another, dummies_in, sittings
from dsis.session.steps import presentation_s

Kind = Literal["training", "dummy", "test", "reference"]
SCORED: tuple[Kind, ...] = ("test", "reference")
ATTEMPTS_MAX = 3  # a display that always drops frames would keep an observer for ever


@dataclass(frozen=True)
class Presentation:
    """One presentation: a reference and a stimulus, then a vote.

    Attributes
    ----------
    place
        Place in the observer's order, from 1.
    kind
        `test`; `reference` (hidden: judged against itself); `training` and `dummy` are never
        scored.
    stimulus, reference
        Names of the clips.
    repetition
        Which showing of this kind of the stimulus to the observer, from 1.
    attempt
        From 1; more where a showing had dropped frames.
    seed
        Seed of the plan.
    session
        Viewing session, from 1.
    """

    place: int
    kind: Kind
    stimulus: str
    reference: str
    repetition: int
    attempt: int
    seed: int
    session: int = 1


def draw_plan(
    manifest: Manifest,
    observer: str,
    seed: int,
    *,
    mirrors: str | None = None,
    hidden_references: bool = False,
) -> tuple[Presentation, ...]:
    """Return the plan of an observer; the order of the test is uniform over the allowed ones.

    Parameters
    ----------
    manifest, observer, seed
        What the plan is a function of.
    mirrors
        Observer of the same seed whose order of the test is reversed here.
    hidden_references
        Show each reference of the test as a stimulus too, against itself.

    Raises
    ------
    InputError
        The manifest has no test clip, or a viewing session is too short for one.
    """
    tests = clips_of(manifest, "test")
    if not tests:
        raise InputError.of(MANIFEST, "clips", "has no clip with role 'test', needs at least one")
    judged = tests + (references_of(manifest) if hidden_references else [])
    rng = _rng(seed, observer)
    order = _in_order(
        judged * manifest.session.repetitions,
        tests,
        None,
        rng if mirrors is None else _rng(seed, mirrors),
    )
    if mirrors is not None:
        order.reverse()
    chosen = _training(manifest, rng)
    parts = sittings(order, len(chosen), manifest.session)
    dummies = [
        _dummies(tests, dummies_in(number, manifest.session), part[0], rng)
        for number, part in enumerate(parts, 1)
    ]
    training = _in_order(chosen, chosen, (dummies[0] + order)[0], rng)[::-1]
    shown: Counter[tuple[Kind, str]] = Counter()
    plan: list[Presentation] = []

    def append(kind: Kind, clip: Clip, number: int) -> None:
        shown[kind, clip.stimulus] += 1
        repetition = shown[kind, clip.stimulus]
        reference = clip.reference or clip.stimulus
        plan.append(
            Presentation(len(plan) + 1, kind, clip.stimulus, reference, repetition, 1, seed, number)
        )

    for clip in training:
        append("training", clip, 1)
    for number, part in enumerate(parts, 1):
        for clip in dummies[number - 1]:
            append("dummy", clip, number)
        for clip in part:
            append("reference" if clip.role == "reference" else "test", clip, number)
    return tuple(plan)


def repeat(
    plan: Sequence[Presentation], failed: Presentation, manifest: Manifest
) -> tuple[Presentation, ...]:
    """Return what to append to `plan` because the showing of `failed` had dropped frames.

    A new attempt; before it a dummy of another content where it would follow its own content, or
    the dummies of a new viewing session where the last one is full. Nothing for training and
    dummies, nor after `ATTEMPTS_MAX` attempts.
    """
    if failed.kind not in SCORED or failed.attempt >= ATTEMPTS_MAX:
        return ()
    tests = clips_of(manifest, "test")
    alike = succession(tests)
    last, again = manifest.clip(plan[-1].stimulus), manifest.clip(failed.stimulus)
    number, parting = plan[-1].session, 0
    if alike(last) == alike(again) and any(alike(clip) != alike(again) for clip in tests):
        parting = 1
    if begins_another(plan, parting + 1, manifest.session):
        number, parting = number + 1, dummies_in(number + 1, manifest.session)
    added: list[Presentation] = []
    rng = _rng(failed.seed, f"repeat {plan[-1].place}")
    shown = Counter(p.stimulus for p in plan if p.kind == "dummy")
    for clip in _dummies(tests, parting, again, rng):
        shown[clip.stimulus] += 1
        reference = clip.reference or clip.stimulus
        values = (clip.stimulus, reference, shown[clip.stimulus], 1, failed.seed, number)
        added.append(Presentation(plan[-1].place + len(added) + 1, "dummy", *values))
    place = plan[-1].place + len(added) + 1
    attempt = failed.attempt + 1
    return (*added, replace(failed, place=place, attempt=attempt, session=number))


def plan_remarks(plan: Sequence[Presentation], manifest: Manifest) -> tuple[str, ...]:
    """Return what an experimenter should know about a plan before it is used."""
    session, remarks = manifest.session, []
    tests = clips_of(manifest, "test")
    alike = succession(tests)
    scored = [manifest.clip(p.stimulus) for p in plan if p.kind in SCORED]
    forced = unavoidable(Counter(alike(clip) for clip in scored))
    if forced:
        what = "content" if _several_contents(tests) else "stimulus"
        remarks.append(f"the same {what} follows itself {forced} times: no order has fewer")
    training = sum(p.kind == "training" for p in plan)
    if training < session.training:
        remarks.append(f"{training} training presentations, {session.training} are asked for")
    last = plan[-1].session
    if last > 1:
        minutes = len(plan) * presentation_s(session) / 60
        limit = session.session_minutes_max
        remarks.append(
            f"lasts {minutes:.0f} minutes: {last} viewing sessions, "
            f"session_minutes_max is {limit:g}"
        )
    clip_s = manifest.sequence.frames / manifest.sequence.fps
    for key, shown_s in (("reference_s", session.reference_s), ("test_s", session.test_s)):
        if round(shown_s * manifest.sequence.fps) != manifest.sequence.frames:
            then = "start again" if shown_s > clip_s else "are cut"
            remarks.append(f"clips of {clip_s:g} s {then}: {key} is {shown_s:g}")
    return tuple(remarks)


def clips_of(manifest: Manifest, role: str) -> list[Clip]:
    """Return the clips of a role as the manifest lists them."""
    return [clip for clip in manifest.clips if clip.role == role]


def references_of(manifest: Manifest) -> list[Clip]:
    """Return the references of the test clips, once each."""
    names = dict.fromkeys(clip.reference for clip in clips_of(manifest, "test") if clip.reference)
    return [manifest.clip(name) for name in names]


def early_and_late(plans: Sequence[Sequence[Presentation]]) -> dict[str, tuple[int, int]]:
    """Return how often each scored stimulus is in the first and in the second half of the plans.

    The middle of an odd number of scored presentations is neither. Over observers in pairs, the
    two numbers are equal.
    """
    counts: dict[str, list[int]] = {}
    for plan in plans:
        scored = [p for p in plan if p.kind in SCORED and p.attempt == 1]
        for place, p in enumerate(scored):
            halves = counts.setdefault(p.stimulus, [0, 0])
            if 2 * place + 1 != len(scored):
                halves[int(2 * place + 1 > len(scored))] += 1
    return {stimulus: (early, late) for stimulus, (early, late) in sorted(counts.items())}


def succession(clips: Sequence[Clip]) -> Callable[[Clip], str]:
    """Return what must differ between neighbours: the content, or with one the stimulus."""
    if _several_contents(clips):
        return lambda clip: clip.content
    return lambda clip: clip.stimulus


def _several_contents(clips: Sequence[Clip]) -> bool:
    return len({clip.content for clip in clips}) > 1


def _rng(seed: int, name: str) -> np.random.Generator:
    key = f"{seed}\x1f{name}".encode()
    return np.random.default_rng(int.from_bytes(hashlib.sha256(key).digest(), "little"))


def _in_order(
    items: list[Clip], family: list[Clip], neighbour: Clip | None, rng: np.random.Generator
) -> list[Clip]:
    """Return `items` in random order, after `neighbour`; `family` says what must differ."""
    alike = succession(family)
    shuffled = [items[i] for i in rng.permutation(len(items))]
    counts = Counter(alike(clip) for clip in items)
    word = arrange(counts, rng, None if neighbour is None else alike(neighbour))
    pools = {key: [clip for clip in shuffled if alike(clip) == key] for key in counts}
    return [pools[key].pop() for key in word]


def _training(manifest: Manifest, rng: np.random.Generator) -> list[Clip]:
    """Return the training clips; where the manifest has more than asked, some over the range."""
    clips = clips_of(manifest, "training")
    asked = manifest.session.training
    if len(clips) <= asked:
        return clips
    return [stratum[rng.integers(len(stratum))] for stratum in _strata(clips, asked)]


def _dummies(
    tests: list[Clip], count: int, following: Clip, rng: np.random.Generator
) -> list[Clip]:
    """Return `count` test clips over the range of quality, in random order, before `following`.

    Chosen from the last to the first: from its part of the range one that differs from what
    follows; else the nearest that does.
    """
    alike = succession(tests)
    ranked = _ranked(tests)
    dummies = [following]
    for stratum in (_strata(tests, count)[i] for i in rng.permutation(count)):
        other = [clip for clip in ranked if alike(clip) != alike(dummies[0])]
        fitting = [clip for clip in other if clip in stratum]
        middle = ranked.index(stratum[0])
        nearest = sorted(other, key=lambda clip: abs(ranked.index(clip) - middle))[:1]
        pool = fitting or nearest or stratum
        dummies.insert(0, pool[rng.integers(len(pool))])
    return dummies[:-1]


def _strata(clips: list[Clip], count: int) -> list[list[Clip]]:
    """Return `count` neighbouring parts of the clips' range of quality, none of them empty."""
    ranked, n = _ranked(clips), len(clips)
    starts = [i * n // count for i in range(count)]
    return [ranked[a : max(a + 1, (i + 1) * n // count)] for i, a in enumerate(starts)]


def _ranked(clips: list[Clip]) -> list[Clip]:
    """Return clips by visible noise; as the manifest lists them where it is not known of all."""
    energies = {clip.stimulus: clip.quality.visible_noise for clip in clips}
    if None in energies.values():
        return list(clips)
    return sorted(clips, key=lambda clip: energies[clip.stimulus] or 0.0)
