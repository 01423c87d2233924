"""Padding changes no evidence, and sizes of one bucket share every executable."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from compiling import compilations
from diagnosis_cases import judged, simulated
from rigs import cycles

from hdcal.data.priors import effect_priors
from hdcal.evidence import closed_form, noise_evidence
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.inference import padding
from hdcal.inference.padding import bucket_size
from hdcal.physics.registry import EFFECTS

# One of each kind: linear or not in its amplitude, with memory, with shapes, with
# several amplitudes, of members, on the noise.
NAMES = (
    "coulomb_friction",
    "contact_bedding",
    "hysteresis",
    "screw_error",
    "run_offset",
    "heteroscedastic_noise",
    "outliers",
)
LIBRARY = {name: EFFECTS[name] for name in NAMES}


def rows_of(rows: int):
    """Return cycles in three runs that take turns, with friction and some outliers."""
    records = cycles(rows)
    known = records.known | {"run", "runs"}
    records = replace(records, run=np.arange(rows) * 7 % 3, known=known)
    case = simulated(records, {"coulomb_friction": {"force": 0.8}}, seed=rows)
    force = np.array(case.records.force)
    force[[5, 20, 33]] += [3.0, -2.5, 4.0]
    return replace(case, records=replace(case.records, force=force))


def table_of(case) -> dict[str, np.ndarray]:
    return compute_evidence(case, LIBRARY, effect_priors()).table


@pytest.fixture
def unpadded(monkeypatch):
    """Give every array the length of its own."""
    for module in (padding, closed_form, noise_evidence):
        monkeypatch.setattr(module, "bucket_size", lambda size: size)


@pytest.fixture(scope="module")
def padded() -> dict[str, np.ndarray]:
    return table_of(rows_of(42))


@pytest.mark.thorough
def test_every_hypothesis_is_as_likely_as_without_padding(padded, unpadded):
    slow = table_of(rows_of(42))
    assert bucket_size(42) > 42
    assert list(padded) == list(slow)
    assert {"none", "unknown", "outliers", "hysteresis+screw_error"} <= set(padded)
    for name, evidence in slow.items():
        np.testing.assert_allclose(padded[name], evidence, rtol=0, atol=1e-9)


@pytest.mark.thorough
def test_rows_that_were_not_measured_would_be_noticed(padded, monkeypatch):
    """The comparison can fail: padding that counts as readings."""
    monkeypatch.setattr(
        noise_evidence, "measured", lambda size, count: np.ones(size, bool)
    )
    jax.clear_caches()
    wrong = table_of(rows_of(42))
    jax.clear_caches()
    assert np.max(np.abs(wrong["outliers"] - padded["outliers"])) > 0.1


@pytest.mark.thorough
def test_sizes_of_one_bucket_share_every_executable():
    assert bucket_size(42) == bucket_size(48) != bucket_size(54)
    # Made beforehand: to simulate readings compiles for their own number of rows.
    first, same, larger = map(rows_of, (42, 48, 54))
    judged(first, library=LIBRARY)
    with compilations() as found:
        judged(same, library=LIBRARY)
        assert found == []
        judged(larger, library=LIBRARY)
        assert found
