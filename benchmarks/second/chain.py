"""The chain from light to codes."""

from second.charge import collected, moved
from second.converter import codes, transitions
from second.geometry import Array, Case, Effect, segment_of
from second.light import Effects, expected_charge, fixed_gain, light, thermal_rate
from second.readout import Sensor, read
from second.wander import series


def true_segments(case: Case, effects: Effects) -> list[dict[str, float]]:
    """Return the read-out segments of the sensor, which camera.toml need not know."""
    e = effects.get("dual_gain")
    if not e:
        return case["segments"]
    base = case["segments"][0]
    return [
        {
            "upper_dn": e["switch_dn"],
            "slope": base["slope"],
            "intercept": base["intercept"],
        },
        {"slope": e["slope2"], "intercept": e["intercept2"]},
    ]


def simulate(case: Case, hidden: list[Effect]) -> list[Array]:
    """Return codes by frame, row and column, one array an exposure."""
    effects = {e["kind"]: e for e in hidden}
    segments = true_segments(case, effects)
    gain, rate = fixed_gain(case, effects), thermal_rate(case, effects)
    sensor = Sensor.of(case, effects)
    lamp = None
    if e := effects.get("flicker"):
        lamp = e["sigma_percent"] / 100 * series(case, e)
    edges = transitions(case, effects["adc_dnl"]) if "adc_dnl" in effects else None
    out, first = [], 0
    for i, exposure in enumerate(case["exposures"]):
        own = None if lamp is None else lamp[first : first + exposure["n"]]
        lit = light(case, effects, i, own) * gain
        expected = expected_charge(case, effects, i, lit, rate)
        slope, intercept = segment_of(segments, expected)
        charge = collected(case, effects, i, expected, slope)
        charge = moved(case, effects, i, charge, (expected[0], slope[0]))
        v = read(case, effects, sensor, i, charge, expected, intercept)
        out.append(codes(case, effects, v, edges))
        first += exposure["n"]
    return out
