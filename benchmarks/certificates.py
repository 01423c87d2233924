"""Does the load keep its 95 % where gauges are wrong as their certificates allow?

Rigs are made up: gear, gains, zeros, thermometer and mountings are each drawn from what
the gear file states or the shipped priors believe. The truth and its readings are
computed here, from the law of each gauge, and not by hdcal.
"""

import tempfile
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr

from benchmarks.children import table
from hdcal.data.case import Case, Gear
from hdcal.data.gear import read_gear
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors, rig_priors
from hdcal.data.records import Records
from hdcal.inference import laplace
from hdcal.inference.force_model.priors import problem_priors
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.structure import decide_structure
from hdcal.inference.posterior import STRUCTURE, Posterior
from hdcal.inference.posterior_tree import dataset
from hdcal.inference.sample import sample
from hdcal.prediction.conditions import Conditions
from hdcal.prediction.joint import joint
from hdcal.prediction.members import one_member
from hdcal.prediction.simulate import simulate

RIGS, AT = 300, 0.4
MOUNTINGS, ROWS = 3, 10
SIZES = """
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"
"""
# Expanded uncertainties, k = 2.
STATED = """
[measurement]
force_calibration = { expanded_percent = 1.0, expanded_N = 0.2 }
deformation_calibration = { expanded_percent = 0.6, expanded_mm = 0.002 }
temperature_calibration = { expanded_K = 4.0 }
"""
# Standard uncertainty of the displacement gauge's zero [mm].
STATED_MM = 0.001
TOLD = "as stated"
WRONG = "gains ignored"
TOUCHED = "contact as sure as its gauge"
SILENT = "no certificate"
QUANTITIES = ("load", "stiffness", "next reading")
TAILS = np.array([0.025, 0.975])


@cache
def gear_of(text: str) -> Gear:
    """Return the gear of a file with this text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "gear.toml"
        path.write_text(text)
        return read_gear(path)


@cache
def gears() -> dict[str, Gear]:
    """Return what each contender is told of the rig."""
    told, gauge = gear_of(SIZES + STATED), Prior("normal", (0.0, STATED_MM))
    return {
        TOLD: told,
        WRONG: replace(told, gauge_priors={}),
        TOUCHED: replace(told, priors={**told.priors, "deformation_offset": gauge}),
        SILENT: gear_of(SIZES),
    }


@dataclass(frozen=True)
class Rig:
    """One made-up rig with its readings, and what is true of it."""

    case: Case
    load: float
    stiffness: float
    next_reading: float


def made(seed: int) -> Rig:
    """Return a rig whose gear, gauges and mountings are drawn."""
    rng, told = np.random.default_rng(seed), gears()[TOLD]

    def normal(prior) -> float:
        return float(rng.normal(*prior.numbers))

    gain, stretch, offset = map(normal, told.gauge_priors.values())
    zero = normal(told.priors["force_offset"])
    # Where the rig was found to touch the gear, by a gauge that is wrong too.
    contact = normal(rig_priors()["deformation_offset"]) + rng.normal(0.0, STATED_MM)
    median, log_sd = told.priors["K"].numbers
    influence = median * np.exp(log_sd * rng.normal())
    modulus, loss = normal(told.priors["E0"]), normal(told.priors["alpha"])
    ring = float(np.pi * 70.0 * 0.68**3 / (24.0 * 40.0**3 * (np.pi**2 - 8.0) / 16.0))
    stiffness = influence * modulus * ring
    sigma = 0.3 * np.exp(0.3 * rng.normal())
    spread = abs(rng.normal(0.0, *told.scale_priors["run_offset_sd"].numbers))
    mounted = zero + spread * rng.normal(size=MOUNTINGS)

    def force(deformation, temperature):
        warmer = temperature - told.reference_temperature
        return stiffness * (1.0 - loss * warmer) * deformation

    # What is true of each row, and then what its gauges make of it.
    run = np.repeat(np.arange(MOUNTINGS), ROWS)
    true = np.tile(np.linspace(0.02, 0.5, ROWS), MOUNTINGS)
    warm = rng.uniform(15.0, 25.0, len(run))
    noise = rng.normal(0.0, sigma, len(run) + 1)
    read = (1.0 + gain) * force(true, warm) + mounted[run] + noise[1:]
    shown = (1.0 + stretch) * true + contact
    # The gauge, its gain taken off, at AT: its zero is what it is.
    here = AT - contact / (1.0 + stretch)
    again = (AT - contact) / (1.0 + stretch), told.reference_temperature - offset
    zeros = np.zeros(len(run))
    records = Records(
        deformation=shown,
        temperature=warm + offset,
        time=zeros,
        angle=zeros,
        direction=zeros + 1.0,
        sense=zeros + 1.0,
        rate=zeros,
        run=run,
        specimen=np.zeros(len(run), int),
        force=read,
        force_sd=zeros,
        known=frozenset({"temperature", "run", "runs"}),
    )
    labels = tuple(map(str, range(MOUNTINGS)))
    return Rig(
        case=Case("made", told, records, labels, ("0",), "0" * 64),
        load=force(here, told.reference_temperature),
        stiffness=stiffness,
        next_reading=(1.0 + gain) * force(*again) + mounted.mean() + noise[0],
    )


def sampled(case: Case, seed: int) -> Posterior:
    """Return short chains of a case: what `calibrate` draws, its checks left out."""
    shipped, theory = effect_priors(), case.gear.theory
    form = decide_structure(case, with_gap=False)
    problem = build_problem(case, shipped, structure=form)
    size = {"chains": 2, "warmup": 300, "draws": 500}
    draws = sample(problem, laplace.fit(problem), seed, **size)
    priors = problem_priors(case, (), shipped, theory)
    tree = xr.DataTree.from_dict({"posterior": dataset(draws.values)})
    settings = {"with_gap": False, STRUCTURE: asdict(form)}
    return Posterior(case, theory, (), priors, tree, {}, (), settings)


def intervals(posterior: Posterior) -> dict[str, np.ndarray]:
    """Return 95 % intervals of load, stiffness and the next reading."""
    model = joint(posterior)

    def at(quantity):
        warm = posterior.case.gear.reference_temperature
        return simulate(model, Conditions.of(AT, warm, quantity=quantity))

    new = one_member(at("reading"))
    return {
        "load": np.quantile(at("load").centre[:, 0], TAILS),
        "stiffness": np.quantile(model.draws["stiffness"], TAILS),
        "next reading": np.array([new.quantile(tail)[0, 0] for tail in TAILS]),
    }


def answered(seed: int, contender: str) -> np.ndarray:
    """Return whether each interval holds the truth, and its width over the truth."""
    rig = made(seed)
    case = replace(rig.case, gear=gears()[contender])
    found = intervals(sampled(case, seed))
    truth = dict(
        zip(QUANTITIES, (rig.load, rig.stiffness, rig.next_reading), strict=True)
    )
    held = [found[q][0] <= truth[q] <= found[q][1] for q in QUANTITIES]
    wide = [float(np.ptp(found[q]) / abs(truth[q])) for q in QUANTITIES]
    return np.array([*held, *wide])


def coverage(contender: str, seeds: range) -> np.ndarray:
    """Return the rows of `answered`, one for each seed."""
    return np.stack([answered(seed, contender) for seed in seeds])


def main(repeats: int = 5, rigs: int = RIGS) -> None:
    """Print how often each interval holds the truth; `repeats` is not used."""
    rows = []
    for name in gears():
        found = coverage(name, range(10_000, 10_000 + rigs))
        held, wide = found[:, :3].mean(axis=0), np.median(found[:, 3:6], axis=0)
        cells = [f"{h:.1%} (± {w / 2:.2%})" for h, w in zip(held, wide, strict=True)]
        rows.append((name, rigs, *cells))
    table(("gear file", "rigs", *QUANTITIES), rows)
