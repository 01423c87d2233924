"""A mirrored question about a mirrored gear has the mirrored design."""

import numpy as np
import pytest
from designs import known
from mirrored import check_same, mirrored
from posteriors import batch, single, with_leftover
from slices import slice_of

from hdcal.design.inverse_design import inverse_design as limit_module
from hdcal.design.inverse_design.inverse_design import inverse_design
from hdcal.design.study.study import study
from hdcal.design.wave_generator import wave_generator as window_module
from hdcal.design.wave_generator.wave_generator import wave_generator
from hdcal.errors import InputError

WINDOW, WALL = (0.38, 0.42), {"wall_thickness_mm": (0.4, 0.9)}
ASKED = {"temperatures": [-20.0, 80.0], "probability": 0.9}
SIZE = 400
GEARS = {
    "one": lambda: single(size=SIZE),
    "of a batch": lambda: batch(6, SIZE),
    "with a leftover": lambda: with_leftover(SIZE),
}


@pytest.fixture
def given(monkeypatch):
    """Let draws stand in for a calibration."""

    def use(draws):
        for module in (window_module, limit_module):
            monkeypatch.setattr(module, "design_draws", lambda source, seed: draws)
        return draws

    return use


def turned(span: dict) -> dict:
    """Return an interval of numbers with the other sign."""
    kept = {"kept": -span["kept"]} if "kept" in span else {}
    return {"median": -span["median"], "lo": -span["hi"], "hi": -span["lo"]} | kept


def swapped(ends: list) -> list:
    """Return two ends with the other sign."""
    return [-ends[1], -ends[0]]


def turned_generator(found: dict) -> dict:
    """Return a generator that pulls as this one presses."""
    asked, spring, aim, own, stress = (
        dict(found[name])
        for name in ("asked", "spring", "set_point", "adjusted", "stress")
    )
    asked["window_mm"] = swapped(asked["window_mm"])
    spring["interference_mm"] *= -1.0
    aim |= {"deformation_mm": -aim["deformation_mm"], "force_N": turned(aim["force_N"])}
    own |= {name: swapped(own[name]) for name in ("interference_mm", "preload_N")}
    stress["deformation_mm"] *= -1.0
    ends = {"at_lo": "at_hi", "at_middle": "at_middle", "at_hi": "at_lo"}
    return found | {
        "asked": asked,
        "spring": spring,
        "set_point": aim,
        "adjusted": own,
        "stress": stress,
        "force_N": [
            force | {name: turned(force[other]) for name, other in ends.items()}
            for force in found["force_N"]
        ],
    }


def turned_inverse(found: dict) -> dict:
    """Return a design that is pulled as this one is pressed."""

    def candidate(one: dict) -> dict:
        return one | {"force_N": turned(one["force_N"])}

    at = -found["asked"]["deformation_mm"]
    return found | {
        "asked": found["asked"] | {"deformation_mm": at},
        "design": candidate(found["design"]),
        "tested": candidate(found["tested"]),
        "candidates": [candidate(one) for one in found["candidates"]],
    }


@pytest.mark.parametrize("kind", GEARS)
def test_the_spring_for_a_window_is_mirrored(kind: str):
    gear = GEARS[kind]()
    asked = {**ASKED, "setting_sd": 0.003, "probability": 0.95}
    asked["tolerances"] = {"wall_thickness_mm": 0.03}
    found = wave_generator(gear, WINDOW, **asked)
    other = wave_generator(mirrored(gear), (-0.42, -0.38), **asked)
    assert not found.spring.softest_considered
    # Both ends of the window matter, and they are missed by different gears.
    assert any(p.zero_backlash != p.no_jam for p in found.at_temperature)
    check_same(other.to_dict(), turned_generator(found.to_dict()))
    assert other.stress.stress_MPa.lo > 0.0
    first, last = other.adjusted.preload_N
    assert first < last < 0.0
    assert " pull " in other.answer[0]


@pytest.mark.parametrize("kind", slice_of(GEARS, ["with a leftover"]))
@pytest.mark.parametrize("sign", slice_of([1, -1], [-1]))
def test_the_sizes_for_a_limit_are_mirrored(kind: str, sign: int):
    gear, asked = GEARS[kind](), {**ASKED, "limit_stress": 60.0}
    found = inverse_design(gear, WALL, 70.0, deformation=0.4, **asked)
    other = inverse_design(mirrored(gear), WALL, sign * 70.0, deformation=-0.4, **asked)
    assert found.design.change > 0.0 and found.design.utilisation_kept > 0.5
    check_same(other.to_dict(), turned_inverse(found.to_dict()))


@pytest.mark.parametrize("kind", GEARS)
def test_the_forces_of_a_study_are_mirrored(kind: str):
    gear, vary = GEARS[kind](), {"wall_thickness_mm": [0.6, 0.7]}
    at = np.array([0.1, 0.4])
    found = study(gear, vary | {"deformation_mm": at}).designs
    other = study(mirrored(gear), vary | {"deformation_mm": -at}).designs
    expected = dict(found) | {"deformation_mm": -found["deformation_mm"]}
    for name, source in (("median", "median"), ("lo", "hi"), ("hi", "lo")):
        expected[f"force_{name}_N"] = -found[f"force_{source}_N"]
    check_same(
        {name: column.tolist() for name, column in other.items()},
        {name: column.tolist() for name, column in expected.items()},
    )
    assert np.all(other["force_lo_N"] < other["force_hi_N"])
    assert np.all(other["stress_MPa"] > 0.0)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_larger_limit_is_kept_with_a_larger_probability(given, sense: int):
    draws = given(known(SIZE))
    at = {"deformation": sense * 0.4, "probability": 0.9}
    kept, changes = [], []
    for limit in (50.0, 65.0, 75.0, 80.0, 85.0, 90.0, 120.0):
        found = inverse_design(draws.gear, WALL, limit, **at)
        kept.append(found.tested.probability)
        changes.append(found.design.change)
        assert sense * found.design.force_N.kept <= limit * (1.0 + 1e-5)
    assert kept == sorted(kept) and (kept[0], kept[-1]) == (0.00125, 0.99875)
    assert changes == sorted(changes, reverse=True) and changes[-1] == 0.0


@pytest.mark.parametrize("sense", [1, -1])
def test_the_stress_of_either_sense_is_limited(given, sense: int):
    draws = given(known(SIZE))
    at = {"deformation": sense * 0.4, "probability": 0.9}
    free = inverse_design(draws.gear, WALL, 60.0, **at)
    limit = 0.9 * free.design.stress_MPa.median
    thick = {"wall_thickness_mm": (0.6, 0.9)}
    with pytest.raises(InputError, match="of the allowed stress"):
        inverse_design(draws.gear, thick, 200.0, limit_stress=limit, **at)


def test_a_limit_with_the_other_sign_is_refused(given):
    draws = given(known(SIZE))
    with pytest.raises(InputError, match="Give 60 N, or ask at a negative"):
        inverse_design(draws.gear, WALL, -60.0, deformation=0.4, probability=0.9)
