"""A fitted fleet has the numbers of a reference: population, gears and next gear."""

from reference import assert_reference

import hdcal
from hdcal.data.resources import datasets_folder


def test_the_bundled_fleet_is_that_of_the_reference():
    case = hdcal.read_case(datasets_folder() / "fleet-demo")
    asked = {"deformation": 0.5, "limit_force": 105.0, "force_tolerance": 8.0}
    found = hdcal.fleet(case, chains=2, draws=300, **asked)
    assert not found.reasons
    table = found.gear_table.select_dtypes("number")
    numbers = {name: table[name].dropna().tolist() for name in table}
    quantities = found.to_dict()
    for name in ("population", "next_gear", "next_force", "gauge_rr", "lots"):
        numbers |= _numbers(name, quantities[name])
    assert_reference(__file__, "fleet-demo", numbers, rel=2e-3, abs=2e-4)


def _numbers(name: str, value) -> dict[str, float]:
    if isinstance(value, dict):
        value = value.items()
    elif isinstance(value, list):
        value = enumerate(value)
    elif isinstance(value, float):
        return {name: value}
    else:
        return {}
    found: dict[str, float] = {}
    for key, part in value:
        found |= _numbers(f"{name}.{key}", part)
    return found
