"""`find_mismatch`: split, re-calibrate, locate, name, prove."""

from collections.abc import Callable
from dataclasses import replace


from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.finding import (
    Alternative,
    Change,
    Finding,
    FittedParameter,
    Gain,
    OmittedEffect,
    Proof,
    Verdict,
)
from analysis.mismatch.name import Named, Search
from analysis.mismatch.observe import observe
from analysis.mismatch.recalibrate import layout_of, parameter_errors
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from dsis.camera import Camera
from dsis.recording import Recording

Progress = Callable[[int, int, str], None]
VOCABULARY = frozenset({*CANDIDATES, "dual_gain"})
_LARGE = 2.5e7  # samples from which fewer simulations must do


def find_mismatch(
    camera: Camera,
    recording: Recording,
    *,
    seed: int = 0,
    jobs: int = 1,
    vocabulary: frozenset[str] | None = None,
    maps: object = None,
    progress: Progress | None = None,
) -> Finding:
    """Return where a recording differs from a camera model, and what physics was left out."""
    del maps
    done = 0

    def step(what: str = "simulating") -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, done + 1, what)

    split = Split.of(recording)
    development = split.development
    source = Source(recording)
    layout = layout_of(recording, development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    samples = sum(len(e.numbers) for e in layout.exposures) * layout.rows * layout.columns
    nulls, replicates = (8, 2) if samples > _LARGE else (16, 2)
    setting = Setting(layout, seen, split.interpolated, seed, jobs, nulls, replicates)
    base = State.of(setting, camera, step)
    words = VOCABULARY if vocabulary is None else vocabulary & VOCABULARY
    search = Search(setting, camera, base, words, step)
    final = search.run()
    return _finding(camera, split, base, final, search)


def _finding(
    camera: Camera, split: Split, base: State, final: State, search: Search
) -> Finding:
    errors = parameter_errors(camera, final.calibrated, final.setting.layout)
    omitted = tuple(_omitted(n) for n in search.named)
    unexplained = final.mismatches
    verdict: Verdict = "match"
    if omitted:
        verdict = "omitted_physics"
    elif base.mismatches:
        verdict = "unexplained"
        unexplained = unexplained or base.mismatches
    elif errors:
        verdict = "parameters"
    left = {m.statistic: m.z for m in final.mismatches}
    mismatches = tuple(
        replace(m, z_after=left.get(m.statistic, 0.0)) for m in base.mismatches
    )
    proof = Proof(
        dict(split.locked),
        Change(float("nan"), float("nan")),
        Change(len(base.mismatches), len(final.mismatches)),
        None,
        None,
    )
    return Finding(
        verdict,
        mismatches,
        errors,
        omitted,
        unexplained,
        (),
        proof,
        final.camera,
        (),
    )


def _omitted(named: Named) -> OmittedEffect:
    parameters = {}
    if named.proposal is not None:
        effect = named.proposal.effect
        for name in named.proposal.free:
            parameters[name] = FittedParameter(
                float(getattr(effect, name)), named.errors.get(name, float("inf"))
            )
    nothing = Gain(named.gain, (named.gain, named.gain))
    rivals = tuple(
        Alternative(kind, None, f"explains {worse:.3g} nats less") for kind, worse in named.rivals
    )
    return OmittedEffect(named.kind, parameters, (), nothing, rivals)


