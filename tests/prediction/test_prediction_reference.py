"""Answers about forces have the numbers of a reference."""

import pytest
from posteriors import batch, single, with_discrepancy
from reference import assert_reference

import hdcal

ASKED = {
    "single": (single, {"limit_force": 85.0, "population": "readings"}),
    "gears": (batch, {"limit_force": 90.0, "population": "specimens"}),
    "mountings": (batch, {"limit_force": 90.0, "population": "mountings"}),
    "discrepancy": (
        with_discrepancy,
        {"quantity": "load", "temperature": [20.0, 60.0]},
    ),
}


@pytest.mark.parametrize("name", ASKED)
def test_margins_are_those_of_the_reference(name: str):
    make, asked = ASKED[name]
    posterior = make()
    numbers: dict[str, list[float]] = {}
    for at in (0.3, 0.7):
        table = hdcal.margin(posterior, at, **asked).to_frame().select_dtypes("number")
        numbers |= {f"{at} {key}": table[key].dropna().tolist() for key in table}
    bands = hdcal.predict(posterior, [0.1, 0.3, 0.5, 0.7], temperature=[0.0, 20.0])
    table = bands.to_frame().select_dtypes("number")
    numbers |= {f"bands {key}": table[key].dropna().tolist() for key in table}
    assert_reference(__file__, name, numbers, rel=1e-5, abs=1e-9)
