"""The concealed cases: which camera, which effects, how strong, with which decoys; dealt fairly."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from planter.case import Case
from planter.chain import KINDS
from planter.layout import Choice, draw_case
from planter.onreal import PLANTABLE
from planter.recipes import RECIPES

WITHOUT_EFFECT, ONE, TWO = 0.3, 0.5, 0.3  # shares: of all; of those with effects
OUT_OF_VOCABULARY, REAL, WRONG, WEAK, DECOYED = 0.12, 0.1, 0.2, 0.15, 0.2
PLANTABLE_SHARE = 0.25  # about, of hands that real frames can take
WEAKEST, STRONGEST = 4.0, 50.0
# Together they make no camera: one converter, one switch, one law of shot noise.
APART = (
    {"quantisation", "adc_dnl"},
    {"dual_gain", "dual_gain_mismatch"},
)
# Effects that camera.toml has already, strong enough that a wrong size shows.
OWN = {
    "dsnu": "sigma_dn",
    "prnu": "sigma_percent",
    "column_fpn": "sigma_dn",
    "row_noise": "sigma_dn",
}
OWNED, OFF, OWN_STRENGTH = 0.2, 0.5, 50.0
DECOYS = ("poisson camera", "coarse codes", "two segments", "scene", "unknown light", "none")
CAMERAS = 200


@dataclass(frozen=True)
class Deal:
    """What a concealed case is to hold.

    Attributes
    ----------
    kinds, strengths
        Effects and the z of each.
    out
        An effect that is taken out of the vocabulary.
    decoy
        What looks like physics, and is in camera.toml.
    real
        Planted into real frames.
    wrong
        Numbers of camera.toml that are off, in standard errors; sizes of effects by their share.
    own
        An effect that is in camera.toml already.
    """

    number: int
    kinds: tuple[str, ...] = ()
    strengths: tuple[float, ...] = ()
    out: str | None = None
    decoy: str = "none"
    real: bool = False
    wrong: Mapping[str, float] = field(default_factory=dict)
    own: str | None = None


def deal(seed: int, cases: int, only: str | None = None) -> list[Deal]:
    """Return the cases in order; every effect comes up as often as every other, give or take one.

    `only` plants that effect alone, in every case that has an effect.
    """
    rng = np.random.default_rng([seed, 51])
    nulls = round(WITHOUT_EFFECT * cases)
    counts = [1] * round(ONE * (cases - nulls)) + [2] * round(TWO * (cases - nulls))
    counts += [3] * (cases - nulls - len(counts))
    hands = [(only,)] * len(counts) if only else _hands(rng, counts)
    deals = [_with_effects(rng, kinds) for kinds in hands] + [
        Deal(0, decoy=DECOYS[i % len(DECOYS)]) for i in range(nulls)
    ]
    order = rng.permutation(len(deals))
    dealt = [
        replace(deals[place], number=number, wrong=_wrong(rng, deals[place]))
        for number, place in enumerate(order)
    ]
    rng = np.random.default_rng([seed, 53])
    return [_with_own(rng, one) for one in dealt]


def _hands(rng: np.random.Generator, counts: list[int]) -> list[tuple[str, ...]]:
    """Deal kinds from decks that hold every kind once; what cannot go together waits."""
    waiting: list[str] = []
    hands = []
    for count in counts:
        hand: list[str] = []
        while len(hand) < count:
            fitting = [kind for kind in waiting if _together(hand, kind)]
            if not fitting:
                waiting += [str(kind) for kind in rng.permutation(sorted(KINDS))]
                continue
            hand.append(fitting[0])
            waiting.remove(fitting[0])
        hands.append(tuple(hand))
    return hands


def _together(hand: list[str], kind: str) -> bool:
    return kind not in hand and not any(kind in pair and pair & set(hand) for pair in APART)


def _with_effects(rng: np.random.Generator, kinds: tuple[str, ...]) -> Deal:
    strengths = np.exp(rng.uniform(np.log(WEAKEST), np.log(STRONGEST), len(kinds)))
    if len(kinds) > 1 and rng.random() < WEAK:
        strengths[-1] = 1.5  # nobody can name it: it must not be misnamed either
    out = str(rng.choice(kinds)) if rng.random() < OUT_OF_VOCABULARY else None
    real = set(kinds) <= PLANTABLE and rng.random() < REAL / PLANTABLE_SHARE
    decoy = str(rng.choice(["scene", "unknown light"])) if rng.random() < DECOYED else "none"
    return Deal(0, kinds, tuple(float(z) for z in strengths), out, decoy, real)


def _wrong(rng: np.random.Generator, dealt: Deal) -> dict[str, float]:
    if dealt.real or rng.random() >= WRONG:
        return {}
    name = str(rng.choice(["noise.slope", "noise.intercept", "black_level"]))
    return {name: float(rng.choice([-1, 1]) * rng.uniform(5, 30))}


def _with_own(rng: np.random.Generator, dealt: Deal) -> Deal:
    """Return a deal, at times with an effect that camera.toml has, of a size that may be wrong."""
    left = sorted(OWN.keys() - set(dealt.kinds))
    kind, share = str(rng.choice(left)), float(rng.choice([-1, 1]) * rng.uniform(0.15, 0.5))
    owned, off = rng.random() < OWNED, rng.random() < OFF
    if dealt.real or dealt.decoy == "coarse codes" or not owned:
        return dealt
    wrong = {f"effect.{kind}.{OWN[kind]}": share} if off else {}
    return replace(dealt, own=kind, wrong={**dealt.wrong, **wrong})


def camera_for(dealt: Deal, seed: int, layout: str = "small") -> Case:
    """Return a random camera and layout that the effects and the decoy fit."""
    poisson_decoy = dealt.decoy == "poisson camera"
    for draw in range(CAMERAS):
        rng = np.random.default_rng([seed, dealt.number, draw, 52])
        timed = bool({"dark_current", "hot_pixels", "amp_glow"} & set(dealt.kinds))
        choice = Choice(
            segments=_segments(dealt),
            cfa="GRBG" if "channel_imbalance" in dealt.kinds and draw > CAMERAS // 2 else None,
            read_noise_dn=0.45 if dealt.decoy == "coarse codes" else None,
            bit_depth=12 if dealt.decoy == "coarse codes" else None,
            electrons=2000.0 if poisson_decoy else None,
            # One in five cannot show what grows with time, or with light.
            times="darks" if timed and rng.random() < 0.8 else None,
            light=False if dealt.decoy == "unknown light" else None,
            scene=dealt.decoy == "scene",
        )
        case = draw_case(int(rng.integers(2**31)), layout, choice)
        case = replace(case, wrong=dealt.wrong, shot="poisson" if poisson_decoy else "gaussian")
        kinds = dealt.kinds if dealt.own is None else (*dealt.kinds, dealt.own)
        if all(RECIPES[kind].fits(case) for kind in kinds):
            return case
    message = f"no camera fits {dealt.kinds}"
    raise RuntimeError(message)


def _segments(dealt: Deal) -> int | None:
    if "dual_gain" in dealt.kinds:
        return 1
    return 2 if "dual_gain_mismatch" in dealt.kinds or dealt.decoy == "two segments" else None
