"""`find_mismatch`: split, re-calibrate, locate, name, prove."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.apart import wrong_spread
from analysis.mismatch.beside import fitted_beside
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.confirmed import proven, undenied_by_all, undenied_by_many
from analysis.mismatch.description import remarks_on_description
from analysis.mismatch.evidence import Evidence
from analysis.mismatch.explain import because, changes, explained
from analysis.mismatch.finding import (
    Alternative,
    Change,
    Finding,
    Gain,
    Proof,
    Verdict,
)
from analysis.mismatch.instance import kind_of
from analysis.mismatch.jumping import Jumping
from analysis.mismatch.layout import Layout
from analysis.mismatch.model import both, processes
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.observe import observe
from analysis.mismatch.omitted import omitted_effect
from analysis.mismatch.own import wrong_sizes
from analysis.mismatch.parameters import parameter_errors
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.pictures import Album, evidence_of
from analysis.mismatch.reading import read
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.remarks import remark_on_sizes, remarks_on, remarks_on_words
from analysis.mismatch.rowtold import EITHER, SINGLE_ROWS, as_likely, beside_undecided
from analysis.mismatch.segments import second_path
from analysis.mismatch.settle import would_settle
from analysis.mismatch.source import Source
from analysis.mismatch.spikes import left_dn4, told_besides, with_spikes
from analysis.mismatch.split import Split
from analysis.mismatch.state import SUREST, Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.thinned import stages, with_all_frames
from analysis.mismatch.trial import Trial
from analysis.mismatch.unsettled import told_beside, unsettled, with_first_frames, without
from analysis.mismatch.words import effect_words
from dsis.blas import one_thread
from dsis.camera import Camera
from dsis.effects.rts import Rts
from dsis.freed import keep_freed
from dsis.recording import Recording

Progress = Callable[[int, int, str], None]
VOCABULARY = frozenset({*CANDIDATES, "dual_gain"})
_SMALL = 1e6  # samples


def find_mismatch(
    camera: Camera,
    recording: Recording,
    *,
    seed: int = 0,
    jobs: int = 1,
    vocabulary: frozenset[str] | None = None,
    progress: Progress | None = None,
) -> Finding:
    """Return where a recording differs from a camera model, and what physics was left out.

    With `jobs` above 1, simulations run in processes that are started afresh: a program that calls
    this needs its `__main__` guard. From then on it keeps some freed memory (`keep_freed`), and
    linear algebra has one thread (`one_thread`).
    """
    done = 0

    def step(what: str = "simulating") -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, done + 1, what)

    words = VOCABULARY if vocabulary is None else vocabulary & VOCABULARY
    jobs = processes_for(recording, jobs)
    keep_freed()
    one_thread()
    with processes(jobs):
        return _found(camera, recording, (seed, jobs), words, step)


def processes_for(recording: Recording, jobs: int) -> int:
    """Return how many of so many processes a recording is worth: they take longer to start."""
    samples = sum(len(e.frames) for e in recording.exposures) * recording.rows * recording.columns
    return jobs if samples > _SMALL else 1


def _found(
    camera: Camera,
    recording: Recording,
    how: tuple[int, int],
    words: frozenset[str],
    step: Callable[[], None],
) -> Finding:
    """Return the finding; `how` is the seed and the number of processes."""
    asked, taken = words, read(recording, camera)
    stored, recording, source, spikes = taken.stored, taken.recording, taken.source, taken.spikes
    first = unsettled(recording, source)
    words = told_besides(told_beside(words, first), spikes)
    split, layout = _taken(recording, source, without(Split.of(recording), first))
    development = split.development
    numbers = {e.name: e.numbers for e in layout.exposures}
    remarks = (
        *taken.remarks,
        *remarks_on(taken.whole, layout),
        *remarks_on_words(asked, VOCABULARY),
    )
    # What is left out proves nothing either: copies of a frame are told from any simulation.
    split = split.without(development.keys() - {e.name for e in layout.exposures})
    album, frames_of = Album(layout), partial(_frames_of, source, numbers)
    seen = observe(layout, frames_of, album, keep=True, threads=how[1])
    remarks += remarks_on_description(taken.whole, layout, seen, source)
    large = layout.large
    setting = Setting.of(layout, seen, split.interpolated, *how)
    setting = replace(setting, given=len(camera.effect), asked_again=not large)

    trial = Trial.of(recording, split, source, setting)
    # Of a large recording lines are looked for, and measured, in the same frames.
    frames = WholeFrames(with_all_frames(layout) if large else layout, frames_of, how[1])
    lines = frames if large else trial.lines
    setting = replace(
        setting,
        jumping=_jumping(camera, trial.lines, frames),
        noisy_rows=partial(_noisy_rows, camera, lines),
        low_spikes_dn4=left_dn4(spikes, stored),
    )
    whole = State.of(setting if large else _of_all_frames(setting, trial), camera, step)
    if not (words and whole.mismatches):
        search = Search(setting, camera, whole, words, step)
        calibrated = _calibrated_to(setting, whole, camera)
        album = album if large else trial.numbers.album
        proof, evidence = both(
            partial(_proof_without, trial, whole, calibrated, step, source),
            partial(evidence_of, whole, whole, album, split),
            setting.jobs,
        )
        found = with_first_frames(_finding(camera, whole, whole, search, {}, proof), first)
        found = with_spikes(found, spikes, stored, split, asked)
        return _said(found, remarks, evidence, asked)
    base = whole if large else State.of(setting, camera, step)
    search = Search(
        setting,
        camera,
        replace(base, mismatches=whole.mismatches),
        words,
        step,
        whole=None if large else whole.setting,
        lines=lines,
        measuring=frames,
    )
    final = _searched(search, source) if large else search.run()
    if large:  # simulations of large recordings tell more, and cost more
        search.setting = replace(setting, nulls=setting.drafts)
        final = undenied_by_many(search, final, whole)
    final, gains = proven(search, search.settle(final), trial, judged=large)
    everything: State | None = None
    if not large:
        final, gains, everything = undenied_by_all(search, final, gains, trial, whole)
    users, whole = whole.mismatches, search.rebased(whole)
    if users and not whole.mismatches:  # all that differed
        remarks = (*remarks, remark_on_sizes(users))
    proof, evidence = both(
        partial(trial.proof, search.base, final, step, source),
        partial(evidence_of, search.base, final, album, split),
        setting.jobs,
    )
    if not large:
        final = whole if everything is None else everything
        departures = Change(len(whole.mismatches), len(final.mismatches))
        proof = replace(proof, discrepancies=departures)
    search.named = [_beside_undecided(search, one, lines, final.camera) for one in search.named]
    found = with_first_frames(_finding(camera, whole, final, search, gains, proof), first)
    found = with_spikes(found, spikes, stored, split, asked)
    return _said(found, remarks, evidence, asked)


def _taken(recording: Recording, source: Source, split: Split) -> tuple[Split, Layout]:
    """Return the split without scenes that move, and the layout of what may be looked at."""
    # What moves in a locked frame only is no static scene either.
    moving = layout_of(recording, split.all_of_development, source.frames).moving
    split = split.without(moving)
    layout = layout_of(recording, split.development, source.frames)
    return split, replace(layout, moving=(*moving, *layout.moving))


def _said(
    found: Finding, remarks: tuple[str, ...], evidence: Evidence, words: frozenset[str]
) -> Finding:
    """Return a finding with what is to be remarked and shown."""
    said = (*remarks, *found.remarks)
    without = tuple(sorted(VOCABULARY - words)) if words else ()
    return replace(found, remarks=said, searched=bool(words), without=without, evidence=evidence)


def _of_all_frames(setting: Setting, trial: Trial) -> Setting:
    """Return the setting of all frames, the locked ones too.

    Whether anything differs is asked of all; what it is, of those that are not locked.
    """
    layout, seen = trial.numbers.whole
    return replace(setting, layout=layout, seen=seen, asked_again=False, surest=SUREST)


def _jumping(camera: Camera, lines: WholeFrames, measuring: WholeFrames) -> Jumping | None:
    """Return pixels that jump, as all frames show them, by numbers of those that are not locked.

    None: frames do not show them, or the camera has some.
    """
    if any(isinstance(one, Rts) for one in camera.effect):
        return None
    found = lines.located
    return None if found is None else replace(found, effect=measuring.jumps)


def _noisy_rows(camera: Camera, lines: WholeFrames) -> float:
    """Return by how much likelier frames are with noise of single rows beside bands of any law."""
    return lines.rows.beside_either(SINGLE_ROWS, frozenset(own.kind for own in camera.effect))


def _beside_undecided(search: Search, named: Named, lines: WholeFrames, camera: Camera) -> Named:
    """Return an effect with an error that allows for what is undecided; see `beside_undecided`."""

    def size_dn() -> float | None:
        return lines.rows.size_besides(named.kind, frozenset(own.kind for own in camera.effect))

    return beside_undecided(named, search.ties, size_dn)


def _calibrated_to(setting: Setting, whole: State, camera: Camera) -> Calibrated:
    """Return the model with base numbers that saw no locked frame."""
    if whole.setting is setting:
        return whole.calibrated
    return setting.calibrated(camera)


def _proof_without(
    trial: Trial, whole: State, calibrated: Calibrated, step: Callable[[], None], source: Source
) -> Proof:
    """Return the proof where nothing is named: of a gap nothing is closed."""
    model = replace(whole, setting=trial.numbers.setting, calibrated=calibrated, mismatches=())
    left = Change(len(whole.mismatches), len(whole.mismatches))
    proof = trial.proof(model, model, step, source)
    return replace(proof, discrepancies=left, gap_closed=0.0 if whole.mismatches else None)


def _searched(search: Search, source: Source) -> State:
    """Return the final state of a large recording: sought on some of its frames, judged on all.

    What is strong is found on few frames, and what is weak beside it on more.
    """
    whole, base, camera = search.setting, search.base, search.camera
    *_, last = looks = stages(whole.layout)
    for layout, search.least in looks:
        if layout == whole.layout:
            break
        numbers = {e.name: e.numbers for e in layout.exposures}
        frames_of = partial(_frames_of, source, numbers)
        seen = observe(layout, frames_of, keep=True, threads=whole.jobs)
        # All states here are on the way: what is found is judged on all frames.
        search.setting = replace(whole, layout=layout, seen=seen, nulls=whole.drafts)
        state = State.of(search.setting, camera, search.step)
        if not search.named:
            search.base = state
        found = (search.resumed if layout == last[0] else search.begun)(state)
        camera = found.camera if search.named else search.camera
    search.setting, search.base = whole, base
    some = search.named or search.own
    final = State.of(whole, camera, search.step, draft=True) if some else base
    return search.resumed(final) if layout == whole.layout else _switched(search, search.lit(final))


def _switched(search: Search, state: State) -> State:
    """Return the state with the switch of a second read-out path as all levels tell it."""
    for i, named in enumerate(search.named):
        if named.proposal is not None:
            continue
        bare = State.of(search.setting, search.without(state, named), search.step, draft=True)
        path = second_path(bare)
        if path is not None:
            error = {"switch_dn": path.error_dn}
            search.named[i] = replace(named, errors=error, switch_dn=path.switch_dn)
            state = State.of(search.setting, path.camera, search.step)
    return state


def _frames_of(
    source: Source, numbers: Mapping[str, Sequence[int]], name: str
) -> Iterator[NDArray[np.uint16]]:
    return source.frames(name, numbers[name])


def _finding(
    camera: Camera,
    base: State,
    final: State,
    search: Search,
    gains: dict[str, Gain],
    proof: Proof,
) -> Finding:
    """Return the finding."""
    fits = camera, final.calibrated, final.setting.layout, final.replicates.fits
    errors = parameter_errors(*fits)
    if errors and (search.named or search.own):
        errors = parameter_errors(*fits, fitted_beside(final, search.named, search.own))
    errors += wrong_sizes(search.own) + wrong_spread(search.unlike, final.camera)
    missing = [named for named in search.named if named.name not in search.changes]
    own = changes(base, final, missing, partial(search.without, final))
    own |= {name: change / base.null.sd for name, change in search.changes.items()}
    explanations = explained(base, final, {one.name: own[one.name] for one in search.named})
    mismatches = tuple(
        replace(m, explained_by=None if name is None else kind_of(name), z_after=after)
        for m in base.mismatches
        for name, after in [explanations[m.statistic]]
    )
    omitted = tuple(
        omitted_effect(n, because(explanations, n.name), gains[n.name], final) for n in search.named
    )
    verdict: Verdict = "match"
    if omitted:
        verdict = "omitted_physics"
    elif base.mismatches:
        verdict = "unexplained"
    elif errors:
        verdict = "parameters"
    named = {one.name for one in search.named}
    left = {m.statistic for m in final.mismatches}
    tied = as_likely(search.refused, left) if named.isdisjoint(EITHER) else {}
    tied |= {one.name: other.kind for pair in search.ties for one, other in (pair, pair[::-1])}
    undecided = tuple(
        Alternative(
            kind_of(name),
            None,
            f"explains the recording no better than {effect_words(other)}",
            would_settle(kind_of(name), other),
        )
        for name, other in tied.items()
        if name not in named and kind_of(name) in search.vocabulary
    )
    return Finding(
        verdict,
        mismatches,
        errors,
        tuple(sorted(omitted, key=lambda one: -one.heldout_gain.nats_per_frame)),
        final.mismatches,
        undecided,
        proof,
        final.camera,
        search.considered(tied),
    )
