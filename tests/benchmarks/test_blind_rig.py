"""The virtual rig is independent of the library, and its gaps have the stated size."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.blind.cases import GEAR_TOML, draw_cases
from benchmarks.blind.rig.loadings import LOADINGS, rich
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.noise import NOISES
from benchmarks.blind.rig.outside import OUTSIDE
from benchmarks.blind.rig.virtual_rig import (
    ActiveMechanism,
    RigState,
    VirtualRig,
    draw_noise,
)

import hdcal


def test_the_rig_imports_nothing_of_the_library():
    modules = ("loadings", "mechanisms", "noise", "outside")
    script = "import sys, " + ", ".join(f"benchmarks.blind.rig.{m}" for m in modules)
    script += "; print({'hdcal', 'jax', 'numpyro'} & {*sys.modules})"
    command = [sys.executable, "-c", script]
    root = Path(__file__).parents[2]
    done = subprocess.run(command, capture_output=True, text=True, cwd=root)
    assert done.stdout.strip() == "set()", done.stderr


def test_every_effect_of_the_library_has_a_mechanism():
    # Without a run on the bare rig no reading shows its compliance.
    assert {*MECHANISMS, *NOISES} == {*hdcal.EFFECTS} - {"rig_compliance"}
    assert len(OUTSIDE) == 65
    assert not {*OUTSIDE} & {*hdcal.EFFECTS}


def test_a_label_states_the_size_of_its_gap():
    for _, label in draw_cases("rigs", 60, seed=11):
        if label.kind in ("effect", "outside") and label.truth[0] not in NOISES:
            rms = np.sqrt(np.mean(np.square(label.curve)))
            assert rms / label.sigma == pytest.approx(label.r, rel=2e-3), label.truth


def test_a_calibration_absorbs_slope_zero_and_loss_of_modulus():
    rig = VirtualRig(rich().history)
    x, _, warm = rig.absorbed.T
    assert rig.gap_over_noise(3.0 * x - 2.0) < 1e-6
    # Ridge regression: the prior holds back a part of the loss of modulus.
    left = warm - np.polyval(np.polyfit(x, warm, 1), x)
    np.testing.assert_allclose(rig.gap(warm), left / (1.0 + left @ left), atol=1e-9)


def test_hdcal_reads_what_the_rig_writes(tmp_path):
    (tmp_path / "gear.toml").write_text(GEAR_TOML)
    for text, label in draw_cases("null", 3, seed=8):
        (tmp_path / "data.csv").write_text(text)
        records = hdcal.read_case(tmp_path).records
        assert len(records.force) == label.rows
        left = np.asarray(records.force) - label.clean
        assert np.std(left) < 1.5 * label.sigma


def test_correlated_noise_has_its_variance_and_correlation():
    rig = VirtualRig(rich(2000).history, sigma=0.5)
    noise = draw_noise(rig, np.random.default_rng(1), correlation=0.6)
    assert np.std(noise) == pytest.approx(0.5, rel=0.03)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.6, abs=0.02)


def test_closed_forms():
    history = LOADINGS["ramp"]().history
    rig = VirtualRig(history, alpha=0.0)
    # One arm: a force that arrives at once decays with the stated rate.
    leak = MECHANISMS["charge_leakage"]
    state, held = RigState(history, np.array([200.0]), history.deformation), np.ones(60)
    lost = leak.adds(50.0 * held, state, 0.01, {"slow": 0.0})
    expected = 50.0 * np.exp(-0.01 * (history.time - history.time[0])) - 50.0
    np.testing.assert_allclose(lost, expected, atol=1e-9)
    # Dahl's friction approaches its largest with the stated reach.
    slip = ActiveMechanism(MECHANISMS["coulomb_friction"], 2.0, {"reach": 0.05})
    expected = 2.0 * (1.0 - np.exp(-history.deformation / 0.05))
    np.testing.assert_allclose(rig.curve(slip), expected, atol=1e-9)
