"""Which hypotheses the proposed runs have to tell apart."""

from types import SimpleNamespace
from typing import Any

import pytest

from hdcal.diagnosis.next_run import _candidates, _differing

EVIDENCE: Any = SimpleNamespace(
    single=SimpleNamespace(names=("coulomb_friction", "hysteresis")),
    subspace_effects=("relaxation",),
    on_noise=("outliers",),
)


def candidates(**probabilities: float) -> dict[str, float]:
    named = {name.replace("_and_", "+"): p for name, p in probabilities.items()}
    return _candidates(EVIDENCE, SimpleNamespace(probabilities=named))  # pyright: ignore


def test_what_stands_beside_noise_or_a_remainder_takes_part():
    found = candidates(
        coulomb_friction_and_outliers=0.6,
        hysteresis_and_unknown=0.2,
        unknown=0.1,
        coulomb_friction_and_hysteresis=0.1,
    )
    both = "coulomb_friction+hysteresis"
    single = {"coulomb_friction": 0.6, "hysteresis": 0.2}
    whole = {name: share / 0.9 for name, share in {**single, both: 0.1}.items()}
    assert found == pytest.approx(whole)


def test_what_all_have_in_common_is_not_what_a_run_tells():
    assert _differing("hysteresis+relaxation", "coulomb_friction+relaxation") == (
        "hysteresis",
        "coulomb_friction",
    )
    within = ("hysteresis+relaxation", "relaxation")
    assert _differing(*within) == within
    assert _differing("none", "relaxation") == ("none", "relaxation")


def test_noise_alone_is_no_gap():
    found = candidates(none=0.1, outliers=0.3, relaxation=0.4, unknown_and_outliers=0.2)
    assert found == pytest.approx({"none": 0.5, "relaxation": 0.5})
