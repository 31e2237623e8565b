"""The order of presentations keeps its rules, and is otherwise as random as it can be."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dsis.errors import InputError
from dsis.manifest import Clip, ClipFiles, Manifest, Quality
from dsis.session import draw_plan, plan_remarks, validate_panel, validate_plan
from dsis.session.arrange import arrange, unavoidable
from dsis.session.plan import ATTEMPTS_MAX, SCORED, early_and_late, repeat
from dsis.session.sittings import sittings
from dsis.spec import Sequence, Session

FILES = {"player": ClipFiles(path="clip.rgb")}
COUNTS = st.dictionaries(st.sampled_from("abcdef"), st.integers(1, 7), min_size=1)


def clip(content, role, number=0, energy=None):
    reference = f"{content}__reference"
    return Clip(
        stimulus=reference if role == "reference" else f"{content}__{role}__{number}",
        content=content,
        role=role,
        reference=None if role == "reference" else reference,
        files=FILES,
        quality=Quality(visible_noise=energy),
    )


def manifest_of(counts, *, practice=("meadow",), energies=True, **session):
    """So many test clips of each content; two training clips of each content of `practice`."""
    clips = [clip(content, "reference") for content in dict.fromkeys([*counts, *practice])]
    for content, count in counts.items():
        clips += [clip(content, "test", i, 1.5 * i if energies else None) for i in range(count)]
    for content in practice:
        clips += [clip(content, "training", i) for i in range(2)]
    return Manifest(
        schema="dsis-manifest/1",
        sequence=Sequence(width=16, height=16, fps=25.0, seconds=10.0),
        session=Session(**session),
        clips=tuple(clips),
    )


def alike(word):
    return sum(a == b for a, b in pairwise(word))


def contents_of(plan, *kinds):
    return [p.stimulus.split("__")[0] for p in plan if p.kind in kinds]


@settings(max_examples=80, deadline=None)
@given(
    counts=COUNTS,
    practice=st.sampled_from([(), ("meadow",), ("meadow", "shore"), ("a",)]),
    energies=st.booleans(),
    session=st.fixed_dictionaries(
        {
            "repetitions": st.integers(1, 3),
            "dummies": st.integers(0, 5),
            "training": st.integers(0, 5),
            "session_minutes_max": st.sampled_from([12.0, 30.0]),
        }
    ),
    seed=st.integers(0, 2**63 - 1),
    hidden=st.booleans(),
    mirrors=st.sampled_from([None, "bert"]),
)
def test_every_plan_keeps_the_rules(counts, practice, energies, session, seed, hidden, mirrors):
    manifest = manifest_of(counts, practice=practice, energies=energies, **session)
    how = {"mirrors": mirrors, "hidden_references": hidden}
    plan = draw_plan(manifest, "anna", seed, **how)
    assert validate_plan(plan, manifest, hidden_references=hidden) == []
    assert plan == draw_plan(manifest, "anna", seed, **how)

    tests = contents_of(plan, "test")
    assert Counter(tests) == {c: n * session["repetitions"] for c, n in counts.items()}
    asked = dict.fromkeys(counts, session["repetitions"]) if hidden else {}
    assert Counter(contents_of(plan, "reference")) == asked
    scored = contents_of(plan, "test", "reference")
    if len(counts) > 1:
        # n items of one content need n - 1 others between them
        most, n = max(Counter(scored).values()), len(scored)
        assert alike(scored) == max(0, 2 * most - n - 1)
        for number in {p.session for p in plan}:
            mine = [p for p in plan if p.session == number]
            border = contents_of(mine, "dummy") + contents_of(mine, "test", "reference")[:1]
            assert alike(border) == 0
    for number in {p.session for p in plan}:  # a presentation lasts 57 s
        assert sum(p.session == number for p in plan) * 57 <= 60 * session["session_minutes_max"]


@settings(max_examples=60, deadline=None)
@given(
    length=st.integers(1, 120),
    training=st.integers(0, 5),
    dummies=st.integers(0, 5),
    minutes=st.floats(11, 40),
)
def test_a_long_test_is_cut_into_as_few_even_sessions_as_there_must_be(
    length, training, dummies, minutes
):
    session = Session(dummies=dummies, session_minutes_max=minutes)
    room = int(60 * minutes / 57)
    leads = [training + dummies] + [min(dummies, 3)] * length
    parts = sittings(range(length), training, session)
    assert [i for part in parts for i in part] == list(range(length))
    held = [len(part) + lead for part, lead in zip(parts, leads, strict=False)]
    assert max(held) <= room
    needed = next(n for n in range(1, length + 1) if n * room - sum(leads[:n]) >= length)
    assert len(parts) == needed
    assert max(held) - min(held) <= 1 or min(map(len, parts)) == 1


def test_a_session_too_short_for_a_presentation_is_refused():
    manifest = manifest_of({"city": 4, "land": 4}, session_minutes_max=5.0)
    with pytest.raises(InputError, match=r"session_minutes_max: is 5, must be at least 5\.7"):
        draw_plan(manifest, "anna", 1)


@settings(max_examples=30, deadline=None)
@given(counts=COUNTS, repetitions=st.integers(1, 3), hidden=st.booleans(), seed=st.integers(0, 99))
def test_over_a_pair_every_stimulus_is_as_often_early_as_late(counts, repetitions, hidden, seed):
    manifest = manifest_of(counts, repetitions=repetitions)
    first = draw_plan(manifest, "anna", seed, hidden_references=hidden)
    second = draw_plan(manifest, "bert", seed, mirrors="anna", hidden_references=hidden)
    orders = [[p.stimulus for p in plan if p.kind in SCORED] for plan in (first, second)]
    assert orders[0] == orders[1][::-1]
    assert all(early == late for early, late in early_and_late([first, second]).values())
    assert validate_panel([first, second]) == []
    assert validate_panel([first, first]) != [] or len(orders[0]) == 1 or repetitions > 1


def test_two_contents_of_equal_size_alternate_strictly_from_the_first_dummy_on():
    plan = draw_plan(manifest_of({"city": 4, "land": 4}, dummies=3), "anna", 1)
    order = contents_of(plan, "dummy", "test")
    assert len(order) == 11
    assert alike(order) == 0
    assert [p.kind for p in plan] == ["training"] * 2 + ["dummy"] * 3 + ["test"] * 8
    assert [p.place for p in plan] == list(range(1, 14))


@settings(max_examples=60, deadline=None)
@given(
    counts=st.dictionaries(st.sampled_from("abcd"), st.integers(1, 4), min_size=1).filter(
        lambda counts: sum(counts.values()) <= 7
    ),
    previous=st.sampled_from([None, "a", "b", "z"]),
    seed=st.integers(0, 2**32),
)
def test_no_order_has_fewer_alike_neighbours(counts, previous, seed):
    front = [] if previous is None else [previous]
    items = [content for content, n in counts.items() for _ in range(n)]
    fewest = min(alike(front + list(word)) for word in set(permutations(items)))
    word = arrange(counts, np.random.default_rng(seed), previous)
    assert sorted(word) == sorted(items)
    assert alike(front + word) == fewest == unavoidable(counts, previous)


@pytest.mark.parametrize(
    ("counts", "previous"),
    [
        ({"a": 3, "b": 2, "c": 2}, None),
        ({"a": 2, "b": 2, "c": 1}, "a"),
        ({"a": 4, "b": 1, "c": 1}, None),
        ({"a": 3, "b": 1}, "a"),
    ],
)
def test_all_allowed_orders_are_equally_likely(counts, previous):
    front = [] if previous is None else [previous]
    items = [content for content, n in counts.items() for _ in range(n)]
    words = {word: alike(front + list(word)) for word in set(permutations(items))}
    allowed = [word for word, found in words.items() if found == min(words.values())]
    rng = np.random.default_rng(7)
    draws = 60 * len(allowed)
    found = Counter(tuple(arrange(counts, rng, previous)) for _ in range(draws))
    assert set(found) == set(allowed)
    chi2 = sum((found[word] - 60) ** 2 / 60 for word in allowed)
    # chi2 of k classes has mean k - 1 and variance 2 (k - 1): z < 5
    degrees = len(allowed) - 1
    assert abs(chi2 - degrees) < 5 * np.sqrt(2 * max(degrees, 1))


def test_the_plan_depends_on_observer_and_seed():
    manifest = manifest_of({"city": 6, "land": 6})
    plans = {draw_plan(manifest, name, seed) for name in ("anna", "bert") for seed in (1, 2)}
    assert len(plans) == 4


def test_every_stimulus_is_as_often_early_as_late():
    manifest = manifest_of({"city": 3, "land": 3}, dummies=0)
    first = Counter()
    for seed in range(600):
        plan = draw_plan(manifest, "anna", seed)
        first[next(p.stimulus for p in plan if p.kind == "test")] += 1
    expected, sd = 600 / 6, np.sqrt(600 * (1 / 6) * (5 / 6))
    assert len(first) == 6
    assert all(abs(n - expected) < 5 * sd for n in first.values())


def test_dummies_cover_the_range_of_quality():
    manifest = manifest_of({"city": 9, "land": 9}, dummies=3)
    for seed in range(20):
        plan = draw_plan(manifest, "anna", seed)
        numbers = sorted(int(p.stimulus[-1]) for p in plan if p.kind == "dummy")
        # thirds of nine levels, and the two neighbours that a border may fall on
        assert numbers[0] <= 3
        assert 2 <= numbers[1] <= 6
        assert numbers[2] >= 5


def test_one_content_never_shows_the_same_stimulus_twice_in_succession():
    manifest = manifest_of({"city": 3}, repetitions=4, dummies=3)
    for seed in range(30):
        plan = [p for p in draw_plan(manifest, "anna", seed) if p.kind != "training"]
        assert alike([p.stimulus for p in plan]) == 0


def test_what_cannot_be_kept_is_remarked():
    manifest = manifest_of({"city": 5, "land": 1}, training=1)
    plan = draw_plan(manifest, "anna", 3)
    assert plan_remarks(plan, manifest) == (
        "the same content follows itself 3 times: no order has fewer",
    )
    long = manifest_of({"city": 20, "land": 20}, training=8, reference_s=20.0, test_s=4.0)
    assert plan_remarks(draw_plan(long, "anna", 1), long) == (
        "2 training presentations, 8 are asked for",
        "lasts 52 minutes: 2 viewing sessions, session_minutes_max is 30",
        "clips of 10 s start again: reference_s is 20",
        "clips of 10 s are cut: test_s is 4",
    )


def test_a_manifest_without_test_clips_is_refused():
    with pytest.raises(InputError, match="no clip with role 'test'"):
        draw_plan(manifest_of({}), "anna", 1)


def test_the_validator_finds_what_is_broken():
    manifest = manifest_of({"city": 4, "land": 4})
    plan = draw_plan(manifest, "anna", 1)
    tests = [p for p in plan if p.kind == "test"]

    def broken(change):
        changed = change(list(plan))
        return "\n".join(
            validate_plan([replace(p, place=i) for i, p in enumerate(changed, 1)], manifest)
        )

    def swapped(p):
        p[-1], p[-2] = p[-2], p[-1]
        return p

    def changed(at, **values):
        return lambda p: [replace(x, **values) if i == at else x for i, x in enumerate(p)]

    assert broken(list) == ""
    assert "follows" in broken(swapped)
    assert "is tested 0 times, must be 1" in broken(lambda p: p[:-1])
    assert "2 dummy presentations in viewing session 1, must be 3" in broken(
        lambda p: [*p[:2], *p[3:]]
    )
    assert "1 training presentations, must be 2" in broken(lambda p: p[1:])
    assert "training comes after test" in broken(lambda p: [*p[1:], p[0]])
    assert "repetition is 2, must be 1" in broken(changed(-1 + len(plan), repetition=2))
    assert "attempt is 2, must be 1" in broken(changed(6, attempt=2))
    assert "is not in the manifest" in broken(changed(6, stimulus="city__sd"))
    assert "is a test clip, shown as training" in broken(changed(0, stimulus=tests[0].stimulus))
    assert "reference is x, must be" in broken(changed(6, reference="x"))
    assert "different seeds" in broken(changed(6, seed=9))
    assert "shown 2 times in the training" in broken(lambda p: [p[0], *p[:1], *p[2:]])
    assert "viewing sessions must follow one another" in broken(changed(8, session=2))
    assert "viewing sessions must be numbered from 1" in broken(changed(-1 + len(plan), session=3))
    assert "training after the first viewing session" in broken(changed(1, session=2))
    short = manifest_of({"city": 4, "land": 4}, session_minutes_max=10.0)
    assert "viewing session 1 lasts 12.3 minutes, must be at most 10" in validate_plan(plan, short)
    hidden = draw_plan(manifest, "anna", 1, hidden_references=True)
    assert "as a hidden reference 1 times, must be 0" in "".join(validate_plan(hidden, manifest))
    missed = "".join(validate_plan(plan, manifest, hidden_references=True))
    assert "city__reference is judged as a hidden reference 0 times, must be 1" in missed
    assert validate_plan(plan[1:], manifest) == ["places must be 1 to 12 in order"]


def test_the_last_dummy_and_the_first_test_are_neighbours_too():
    manifest = manifest_of({"city": 4, "land": 4})
    plan = list(draw_plan(manifest, "anna", 1))
    first = next(i for i, p in enumerate(plan) if p.kind == "test")
    same = plan[first].stimulus.split("__")[0]
    other = next(
        p for p in plan if p.kind == "test" and p.stimulus.startswith(same) and p != plan[first]
    )
    plan[first - 1] = replace(
        plan[first - 1], stimulus=other.stimulus, reference=other.reference, repetition=1
    )
    found = validate_plan(plan, manifest)
    assert any(fault.startswith(f"presentation {first + 1}:") for fault in found)


def test_a_failed_showing_comes_again_at_the_end():
    manifest = manifest_of({"city": 4, "land": 4})
    plan = draw_plan(manifest, "anna", 1)
    last, before = plan[-1], plan[-2]
    (again,) = repeat(plan, before, manifest)
    assert again == replace(before, place=14, attempt=2)
    dummy, after = repeat(plan, last, manifest)
    assert (dummy.kind, dummy.place) == ("dummy", 14)
    assert contents_of([dummy], "dummy") != contents_of([last], "test")
    assert after == replace(last, place=15, attempt=2)
    assert repeat(plan, replace(before, attempt=ATTEMPTS_MAX), manifest) == ()
    full = manifest_of({"city": 4, "land": 4}, session_minutes_max=13 * 57 / 60)
    *dummies, later = repeat(plan, before, full)  # no time is left in the first session
    assert [p.kind for p in dummies] == ["dummy"] * 3
    assert later == replace(before, place=17, attempt=2, session=2)
    assert {p.session for p in dummies} == {2}
    assert alike(contents_of([*dummies, later], "dummy", "test")) == 0
    assert repeat(plan, plan[0], manifest) == ()
