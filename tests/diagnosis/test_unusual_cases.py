"""Few rows, long logs, coarse readings, and cases that cannot be diagnosed."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated
from rigs import make_case, make_gear, make_records, ramp
from schema_checks import obeys

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.reading import read_case
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.many_cases import Diagnoses
from hdcal.diagnosis.result import Diagnosis
from hdcal.errors import InputError
from hdcal.physics.effect import Effect, parameter
from hdcal.physics.registry import EFFECTS

HYSTERESIS = {"hysteresis": {"force": 4.0, "reach": 0.1}}


class Step(Effect, stage="force", family="curve up"):
    """A step of the force at half the range, an effect of a user."""

    force: float = parameter("N", "height of the step", typical=2.0, null=0.0)

    def apply(self, signal, rows):
        return signal + self.force * (rows.deformation > 0.27)


def quick(case: Case, **settings) -> Diagnosis:
    return diagnose(case, quick=True, **settings)


def with_force(records, force, **columns) -> Case:
    return make_case(replace(records, force=np.asarray(force, float), **columns))


@pytest.mark.parametrize("rows", [3, 4, 6, 14])
def test_a_few_rows_of_noise_have_no_gap(rows: int):
    """Fewer rows than the remainder has columns, and than there are parameters."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = quick(simulated(ramp(rows), seed=1))
    assert found.which.verdict == "none"
    assert 0.02 * NOISE < found.gap.noise_sd_N < 3.0 * NOISE
    obeys(found.to_dict(), Diagnosis)


def test_one_run_at_one_temperature_is_no_obstacle():
    records = make_records(
        np.linspace(0.02, 0.54, 12), known={"temperature", "time"}, time=np.arange(12.0)
    )
    assert quick(simulated(records, seed=1)).which.verdict == "none"
    curved = {"progressive_stiffening": {"slope": 0.6}}
    found = quick(simulated(records, curved, seed=1))
    assert found.gap.probability > 0.9
    assert "progressive_stiffening" in found.which.causes[0].members


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_noise_has_no_cause(correlation: float):
    found = quick(simulated(rich(), seed=20, correlation=correlation))
    assert found.which.verdict == "none" and not found.which.acting
    assert found.how_far.closed is None and found.gap.probability < 0.2


def test_heavy_tails_are_no_effect_on_the_mean():
    found = quick(simulated(rich(), seed=1, freedom=4.0)).which
    assert all(EFFECTS[n].stage == "noise" for c in found.acting for n in c.members)


def test_coarse_readings_are_a_fact_and_no_cause():
    records = simulated(rich(), seed=2).records
    found = quick(with_force(records, 2.0 * np.round(records.force / 2.0)))
    assert found.coarse_step_N == pytest.approx(2.0)
    assert found.which.verdict == "none"
    assert quick(simulated(rich(), seed=2)).coarse_step_N == 0.0


def test_forces_that_were_set_are_not_coarse_readings():
    """A rig that is driven by force sets round numbers and reads the deformation."""
    records = simulated(rich(), seed=2).records
    force = 10.0 * np.round(records.force / 10.0)
    moved = records.deformation + (force - records.force) / 195.0
    found = quick(with_force(records, force, deformation=moved))
    assert found.coarse_step_N == 0.0 and found.which.verdict == "none"


@pytest.mark.parametrize("sd", [3.0, 0.0])
def test_zeros_of_many_short_runs(sd: float):
    """No run shows its own zero; together they do."""
    rng = np.random.default_rng(5)
    run, path = np.repeat(np.arange(20), 5), np.tile(np.linspace(0.05, 0.5, 5), 20)
    force = 400.0 * path + rng.normal(0.0, 1.0, 100) + rng.normal(0.0, sd, 20)[run]
    found = quick(make_case(make_records(path, force, known={"run", "runs"}, run=run)))
    if not sd:
        assert found.which.verdict == "none"
        return
    assert found.which.inclusion["run_offset"] > 0.9
    assert found.how_far.closed is not None and found.how_far.closed.median > 0.5


def test_an_effect_that_is_left_out_is_not_named_and_one_of_a_user_is():
    case = simulated(rich(), HYSTERESIS, seed=1)
    library = {n: e for n, e in EFFECTS.items() if n != "hysteresis"}
    found = quick(case, library=library)
    assert "hysteresis" not in found.which.inclusion
    assert found.library == tuple(library)
    library |= {"step": Step}
    with pytest.raises(InputError, match=r"step\.force"):
        quick(case, library=library)
    prior = {"step.force": Prior("half_normal", (2.0,))}
    gear = replace(make_gear(), effect_priors=prior)
    case = simulated(rich(), {"step": {"force": 2.0}}, library=library)
    found = quick(replace(case, gear=gear), library=library)
    assert found.which.inclusion["step"] > 0.9


@pytest.mark.parametrize("names", [[], ["outliers"]])
def test_without_an_effect_on_the_mean_a_loop_is_outside_the_library(names):
    case = simulated(rich(), HYSTERESIS, seed=1)
    found = quick(case, library={name: EFFECTS[name] for name in names})
    assert found.which.verdict == "unknown" and found.which.outside.probability > 0.9
    obeys(found.to_dict(), Diagnosis)
    assert quick(simulated(rich(), seed=1), library={}).which.verdict == "none"


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (lambda x: 0.0 * x, "exactly on a straight line"),
        (lambda x: 7.0 + 0.0 * x, "exactly on a straight line"),
        (lambda x: 200.0 * x, "exactly on a straight line"),
        (lambda x: -400.0 * x + 0.3 * np.cos(99.0 * x), "does not increase"),
    ],
)
def test_forces_without_scatter_and_falling_forces_are_refused(force, words: str):
    records = ramp(20)
    with pytest.raises(InputError, match=words):
        quick(with_force(records, force(records.deformation)))


def test_the_overview_names_what_acts_in_each_case():
    loop = simulated(rich(), HYSTERESIS, seed=1)
    plain = simulated(rich(), seed=1)
    force = np.array(plain.records.force)
    force[np.random.default_rng(3).choice(180, 9, replace=False)] += 6.0
    wild = replace(plain, records=replace(plain.records, force=force))
    found = quick(loop), quick(loop, library={}), quick(wild)
    causes = {"loop": "hysteresis", "odd": "outside the library", "wild": "outliers"}
    cases = {name: one.to_dict() for name, one in zip(causes, found, strict=True)}
    text = Diagnoses(cases=cases, refused={}).text()
    rows = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    assert all(cause in rows[name] for name, cause in causes.items())


def test_a_part_that_yields_and_is_unloaded_may_fall_as_a_whole():
    """A line through all readings falls; from row to row the force rises."""
    up, down = np.linspace(0.0, 1.0, 40), np.linspace(1.0, 0.9, 20)[1:]
    x = np.append(up, down)
    force = np.append(np.minimum(200.0 * up, 20.0), 20.0 - 200.0 * (1.0 - down))
    assert np.polyfit(x, force, 1)[0] < 0.0
    force += np.random.default_rng(1).normal(0.0, 0.1, 59)
    cause = quick(read_case({"deformation_mm": x, "force_N": force})).which.on_mean[0]
    assert cause.probability > 0.9 and "plastic_yield" in cause.members


def test_what_is_no_case_no_library_and_no_seed_is_refused():
    case = simulated(ramp(14))
    with pytest.raises(InputError, match="case"):
        quick("a folder")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="library"):
        quick(case, library=["hysteresis"])  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="seed"):
        quick(case, seed=-1)
