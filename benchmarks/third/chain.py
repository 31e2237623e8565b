"""The chain from light to codes."""

from collections.abc import Iterator

import numpy as np

from third.camera import Array, Camera, Exposure
from third.effect import Effect


def simulate(
    camera: Camera, effects: list[Effect], chance: np.random.Generator
) -> Iterator[tuple[Exposure, Array]]:
    """Yield each exposure with its 16-bit codes; the effects have been made ready."""
    response = np.tile(camera.response, (camera.rows // 2, camera.columns // 2))
    response = response.astype(np.float32)
    for exposure in camera.exposures:
        base = exposure.signal_dn * response
        if exposure.kind == "scene" and camera.scene_light is not None:
            base = base * camera.scene_light.astype(np.float32)
        yield exposure, _exposed(camera, effects, exposure, base.astype(np.float32), chance)


def _exposed(
    camera: Camera,
    effects: list[Effect],
    exposure: Exposure,
    base: Array,
    chance: np.random.Generator,
) -> Array:
    light = _light(camera, effects, exposure, base)
    slope, noise = _paths(camera, base)
    charge = _charge(camera, effects, light, slope, chance)[-exposure.frames :]
    expected = light[-exposure.frames :].mean(0)
    for effect in effects:
        charge = effect.amplified(charge)
    own = [effect for effect in effects if type(effect).read_noise is not Effect.read_noise]
    drawn = own[0].read_noise(charge.shape) if own else None
    if drawn is None:
        drawn = chance.standard_normal(charge.shape, dtype=np.float32)
    volts = charge + noise * drawn
    for effect in effects:
        volts = effect.switched(volts, base)
    for effect in effects:
        volts = effect.read_out(volts, exposure)
    for effect in effects:
        volts = effect.remembered(volts, expected)
    for effect in effects:
        volts = effect.filtered(volts)
    codes = _codes(camera, effects, volts.astype(np.float64) + camera.black)
    for effect in effects:
        codes = effect.delivered(codes, exposure)
    return codes


def _light(camera: Camera, effects: list[Effect], exposure: Exposure, base: Array) -> Array:
    frames = exposure.frames + max((effect.warm_up for effect in effects), default=0)
    light = np.broadcast_to(base, (frames, camera.rows, camera.columns)).copy()
    for effect in effects:
        light = effect.lit(light, exposure)
    for effect in effects:
        light = effect.warmed(light, exposure)
    return np.asarray(np.maximum(light, 0), np.float32)


def _paths(camera: Camera, base: Array) -> tuple[Array, Array]:
    """Return slope and read noise of each pixel's read-out path."""
    low, high = camera.low, camera.high or camera.low
    above = base >= (np.inf if camera.switch_dn is None else camera.switch_dn)
    slope = np.where(above, high.slope, low.slope).astype(np.float32)
    return slope, np.sqrt(np.where(above, high.intercept, low.intercept)).astype(np.float32)


def _charge(
    camera: Camera, effects: list[Effect], light: Array, slope: Array, chance: np.random.Generator
) -> Array:
    counts = camera.shot == "poisson" or any(effect.counts_photons for effect in effects)
    gathering = next((effect for effect in effects if effect.instalments > 1), None)
    if gathering is None:
        charge = _collected(light, slope, chance, counts=counts)
    else:
        share, parts = light / gathering.instalments, range(gathering.instalments)
        charge = gathering.gathered(
            [_collected(share, slope, chance, counts=counts) for _ in parts]
        )
    for effect in sorted(effects, key=lambda effect: effect.charge_rank):
        charge = effect.charged(charge)
    return charge


def _collected(light: Array, slope: Array, chance: np.random.Generator, *, counts: bool) -> Array:
    """Return charge with its shot noise."""
    if counts:
        return (chance.poisson(light / slope) * slope).astype(np.float32)
    noise = chance.standard_normal(light.shape, dtype=np.float32)
    return np.asarray(light + np.sqrt(slope * light) * noise)


def _codes(camera: Camera, effects: list[Effect], volts: Array) -> Array:
    own = (effect.codes(volts) for effect in effects)
    codes = next((found for found in own if found is not None), None)
    rounded = np.floor(volts + 0.5) if codes is None else codes
    return np.clip(rounded, 0, camera.white).astype(np.uint16)
