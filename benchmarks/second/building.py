"""One case: its camera, what is hidden in it at which z, the model that goes with it, its key."""

from typing import Any, NamedTuple

import numpy as np

from second.cameras import draw_case
from second.chain import simulate
from second.dealing import Hand
from second.geometry import Array, Case, Effect, log_uniform, pick
from second.oracles import z_of
from second.prepared import Prepared, photon_transfer
from second.room import Room, solve
from second.strengths import draw_effect, target
from second.vocabulary import KNOWN, NEEDED, PARAMETERS, clash

TOLD = (
    "cfa",
    "h",
    "w",
    "bits",
    "black",
    "white",
    "shot",
    "segments",
    "response",
    "electrons_per_dn",
    "read_noise_e",
    "level_by",
    "light_given",
    "spacing",
    "codes_used",
)


class Built(NamedTuple):
    """A case, its frames by exposure, what camera.toml is to say, its key and its chance."""

    case: Case
    frames: list[Array]
    model: dict[str, Any]
    key: dict[str, Any]
    chance: np.random.Generator


class Planted(NamedTuple):
    """An effect of its final size, the z it was to stand at and the z it stands at."""

    effect: Effect
    wanted: float | None
    z: float


def build(seed: int, hand: Hand) -> Built:
    """Draw and record one case."""
    hidden = [*hand.listed, *([hand.unlisted] if hand.unlisted else [])]
    g = np.random.default_rng([seed, 3, hand.number])
    case = draw_case(seed, hand.number, hidden)
    kinds = _known_kinds(g, hand, hidden)
    case["codes_used"] = _codes_used(case)
    base = Prepared(case, simulate(case, []))
    known: list[Effect] = []
    for kind in kinds:
        effect = _planted(g, case, kind, [], base).effect
        if kind == "hot_pixels":
            case["known_hot"] = effect
        known.append(effect)
    if known:
        base = Prepared(case, simulate(case, known))
    planted = [_planted(g, case, kind, known, base) for kind in hidden]
    frames = simulate(case, known + [p.effect for p in planted])
    rows = _rows(case, known, planted, frames)
    model, off, said = _model(g, case, hand, base, frames)
    model["effects"] = known
    rounded = g.random() < 0.8
    black = case["black"]
    nominal = float(round(black)) if rounded else float(round(black * g.uniform(0.97, 1.03)))
    case["nominal_black"] = nominal
    verdict = "parameters" if off else "match"
    if hidden:
        verdict = "omitted_physics" if hand.listed else "unexplained"
    key = {
        "case": f"case-{hand.number:03d}",
        "verdict": verdict,
        "effects": list(hand.listed),
        "unlisted": [hand.unlisted] if hand.unlisted else [],
        "off": off,
        "known": [_described(effect) for effect in known],
        "hidden": rows,
        "model_is": said,
        "camera": {k: case[k] for k in (*TOLD, "nominal_black")},
        "exposures": [dict(e) for e in case["exposures"]],
        "scene": case["scene"],
        "case_seed": case["seed"],
    }
    return Built(case, frames, model, key, g)


def _known_kinds(g: np.random.Generator, hand: Hand, hidden: list[str]) -> list[str]:
    kinds: list[str] = []
    if hand.known:
        fits = [k for k in KNOWN if k not in hidden and not clash([*hidden, k])]
        kinds = [fits[j] for j in g.permutation(len(fits))[: int(g.integers(1, 3))]]
        wander = {"flicker", "black_level_drift"}
        if any(k in kinds and (wander - {k}) & set(hidden) for k in wander):
            kinds = [k for k in kinds if k not in wander] or ["dsnu"]
    need = NEEDED.get(hand.unlisted or "")
    if need and need not in kinds:
        kinds = [k for k in kinds if k != "dark_current"] + [need]
    return kinds


def _codes_used(case: Case) -> list[int]:
    top = max(e["level"] for e in case["exposures"] if e["kind"] != "dark")
    first, last = case["segments"][0], case["segments"][-1]
    spread = np.sqrt(last["slope"] * top + last["intercept"])
    low = max(0, case["black"] - 4 * np.sqrt(first["intercept"]))
    return [int(low), int(min(case["white"], case["black"] + top + 4 * spread))]


def _planted(
    g: np.random.Generator, case: Case, kind: str, known: list[Effect], base: Prepared
) -> Planted:
    """Draw an effect and size it to a drawn z, beside known ones but without other hidden ones."""
    drawn = draw_effect(kind, Room.of(case), g)
    effect, wanted = drawn.effect, target(kind, g)

    def z_now() -> float:
        there = Prepared(case, simulate(case, [*known, effect]))
        return z_of(effect, there, base)

    setter = drawn.setter
    if setter is None:
        return Planted(effect, None, z_now())

    def z_of_size(size: float) -> float:
        setter(effect, size)
        return z_now()

    size, z = solve(z_of_size, drawn.first, wanted, drawn.largest, drawn.exponent)
    setter(effect, size)
    return Planted(effect, wanted, z)


def _rows(
    case: Case, known: list[Effect], planted: list[Planted], frames: list[Array]
) -> list[dict[str, Any]]:
    """Return the key's rows: z with all others there, and alone."""
    spikes = any(p.effect["kind"] == "impulse" for p in planted)
    several = len(planted) > 1
    full = Prepared(case, frames) if several else None
    clean = Prepared(case, frames, clean=True) if spikes and several else full
    rows = []
    for effect, wanted, alone in planted:
        z = alone
        if full and clean:
            rest = [*known, *(p.effect for p in planted if p.effect is not effect)]
            aside = spikes and effect["kind"] != "impulse"
            without = Prepared(case, simulate(case, rest), clean=aside)
            z = z_of(effect, clean if aside else full, without)
        listed = effect["kind"] in PARAMETERS
        numbers = {"z": z, "z_alone": alone, "z_target": wanted}
        rows.append({**_described(effect), "listed": listed, **numbers})
    return rows


def _described(effect: Effect) -> dict[str, Any]:
    kind = effect["kind"]
    return {
        "effect": kind,
        "parameters": {name: effect[name] for name in PARAMETERS.get(kind, ())},
        "realisation": {k: v for k, v in effect.items() if k != "kind"},
    }


def _model(
    g: np.random.Generator, case: Case, hand: Hand, base: Prepared, frames: list[Array]
) -> tuple[dict[str, Any], list[dict[str, Any]], str]:
    """Return the base numbers of camera.toml, which of them are wrong, and what they are."""
    errors, _ = photon_transfer(base)
    segments, said = [dict(s) for s in case["segments"]], "true"
    if "dual_gain" in hand.listed:
        _, line = photon_transfer(Prepared(case, frames))
        if g.random() < 0.4:
            segments = [{"slope": float(line[0]), "intercept": float(max(line[1], 0.05))}]
            said = "one line fitted to the recording"
    model: dict[str, Any] = {"black_level": case["black"], "segments": segments}
    off = []
    if hand.wrong_number:
        name = pick(g, ["slope", "intercept", "black_level"])
        k = pick(g, [-1, 1]) * log_uniform(g, 6, 40)
        holder = model if name == "black_level" else segments[0]
        old = holder[name]
        new = old + k * errors[name]
        if holder is not model and new < 0.35 * old:
            new = old + abs(k) * errors[name]
        holder[name] = float(new)
        plain = name if holder is model else f"noise.{name}"
        apart = (new - old) / errors[name]
        off.append({"parameter": plain, "true": old, "model": new, "standard_errors": apart})
    if g.random() < 0.5:
        own = {**segments[0], "slope_se": errors["slope"], "intercept_se": errors["intercept"]}
        order = ("upper_dn", "slope", "intercept", "slope_se", "intercept_se")
        segments[0] = {name: own[name] for name in order if name in own}
    return model, off, said
