"""What a design comes to, in sentences for somebody who designs gears."""

from collections.abc import Iterator

from hdcal.design.sizes import named
from hdcal.report.words import estimate, number, percent


def generator_words(found: dict) -> Iterator[str]:
    """Yield what the wave generator has to be.

    Args:
        found: from `summarise_generator`.
    """
    asked, spring, aim = found["asked"], found["spring"], found["set_point"]
    low, high = asked["window_mm"]
    middle, span = estimate(aim["force_N"])
    yield (
        f"To hold the gear at {aim['deformation_mm']:.4g} mm each side has to press "
        f"with {middle} N ({percent(found['interval'])} {_kind(found)} {span} N) at "
        f"{aim['temperature_C']:g} °C."
    )
    softest = "any spring does, down to the softest considered: "
    if not spring["softest_considered"]:
        softest = "the softest spring that does it has "
    yield (
        f"With one set point for every gear, {softest}"
        f"{number(spring['rate_N_per_mm'])} N/mm, {number(spring['rate_over_gear'])} "
        f"times the gear's own stiffness. Its free end stands "
        f"{number(spring['interference_mm'])} mm beyond the undeformed gear."
    )
    yield (
        f"It keeps {low:g} … {high:g} mm at {_warmth(asked['temperature_C'])} with "
        f"probability {_chance(spring)} (required {asked['probability']:g}): no "
        f"backlash {_share(spring['zero_backlash'])}, no jam "
        f"{_share(spring['no_jam'])}."
    )
    yield _adjusting(found)
    yield _stress(found["stress"], f"At {high:g} mm")


def _adjusting(found: dict) -> str:
    own = found["adjusted"]
    (x, y), (force, more) = own["interference_mm"], own["preload_N"]
    share = percent(own["share_of_gears"])
    return (
        f"Adjusted gear by gear with that spring, the set point has to reach from "
        f"{number(x, y - x)} to {number(y, y - x)} mm, that is a preload of "
        f"{number(force, more - force)} to {number(more, more - force)} N, to serve "
        f"{share} of the gears; the window is then kept with probability "
        f"{_share(own['probability'])}."
    )


def inverse_words(found: dict) -> Iterator[str]:
    """Yield which sizes keep the limit.

    Args:
        found: from `summarise_inverse`.
    """
    asked, best, tested = found["asked"], found["design"], found["tested"]
    sizes = ", ".join(
        f"{name.replace('_', ' ')} {value:.4g} mm"
        for name, value in best["sizes_mm"].items()
    )
    what = " with ".join(filter(None, (best["material"], sizes)))
    yield (
        f"{what} keeps {asked['limit_force_N']:g} N at {asked['deformation_mm']:g} mm "
        f"and {_warmth(asked['temperature_C'])} with probability {_chance(best)} "
        f"(required {asked['probability']:g}). Of all that keep the limits its sizes "
        f"are the nearest to those of {_own(found)}."
    )
    middle, span = estimate(best["force_N"])
    yield (
        f"Its force is {middle} N ({percent(found['interval'])} {_kind(found)} {span} "
        f"N). {_own(found).capitalize()} takes {estimate(tested['force_N'])[0]} N and "
        f"keeps the limit with probability {_share(tested['probability'])}."
    )
    yield _stress(best, f"At {asked['deformation_mm']:g} mm")
    if asked["limit_stress_MPa"] is not None:
        yield f"The stress was kept below {asked['limit_stress_MPa']:g} MPa."
    elif best["yield_MPa"] is None:
        yield (
            "The material's file names no yield strength: the stress was not limited. "
            "Say --limit-stress."
        )
    slopes = found["elasticities"]
    parts = [
        f"{name.removesuffix('_mm').replace('_', ' ')} {value:+.2f} %"
        for name, value in slopes.items()
        if abs(value) > 1e-9
    ]
    yield f"One per cent more of each changes this force by: {', '.join(parts)}."


def _stress(entry: dict, where: str) -> str:
    middle, span = estimate(entry["stress_MPa"])
    text = (
        f"{where} the smooth wall bends with {middle} MPa under the load ({span} MPa)"
    )
    if entry["utilisation"] is not None:
        text += f", {percent(entry['utilisation']['median'])} of its yield strength"
    return (
        f"{text}. This is from the imposed shape; notches at the teeth are not in it."
    )


def study_words(found: dict) -> Iterator[str]:
    """Yield what the study spans.

    Args:
        found: from `summarise_study`.
    """
    force = found["columns"]["force_median_N"]
    varied = " and ".join(map(named, found["varied"])) or "nothing"
    yield (
        f"{len(force)} designs, varying {varied}: median force "
        f"{number(min(force))} … {number(max(force))} N."
    )
    yield f"Bands are {percent(found['interval'])} {found['interval_kind']}s."


def _own(found: dict) -> str:
    return (
        "the tested gear" if found["basis"] == "posterior" else "the gear of the file"
    )


def _kind(found: dict) -> str:
    return found["interval_kind"].removeprefix("equal-tailed ")


def _warmth(levels) -> str:
    low, high = min(levels), max(levels)
    return f"{low:g} °C" if low == high else f"{low:g} … {high:g} °C"


def _chance(entry: dict) -> str:
    error = entry["standard_error"]
    return _share(entry["probability"]) + (f" ± {error:.2g}" if error else "")


def _share(value: float) -> str:
    """Return a probability; what was always so among the draws is not certain."""
    if value > 0.9995:
        return "above 0.999"
    return "below 0.001" if value < 0.0005 else f"{value:.4g}"
