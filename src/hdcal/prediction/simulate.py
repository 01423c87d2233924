"""Forces of future members of a population, simulated from posterior draws.

Every answer about a future force comes from here: bands and margins use `simulate`,
designs and studies `gear_forces`, responses `gear_discrepancy`; streams that are
tracked have the same bends, scores and drifts.
"""

from functools import lru_cache

import numpy as np
from scipy.special import ndtri

from hdcal.data.records import Records
from hdcal.prediction.conditions import Conditions, Population, usual_sd
from hdcal.prediction.forces import forces_of_draws, grid_records
from hdcal.prediction.joint import DRIFTS, JointModel
from hdcal.prediction.members import Members
from hdcal.prediction.sizes import size_nodes

# What the draws leave open about all members: standard normal scores of each draw, and
# `law`, the level at which a law of the bend is selected.
SCORES = ("gear", "mounting", "law", "bend", "zero_drift", "frame_drift")
# Certified errors of gauges: inputs of their own, where a load is asked for.
CERTIFIED = ("force_gain", "deformation_gain", "temperature_offset")
# Parameters that are inputs of their own where the prior determines them; the zero of
# the gauge is one of every load. Readings show the sum of both zeros: what the prior
# of first contact leaves open of it is its part.
SEPARATE = ("alpha", "deformation_offset", "force_offset")


def simulate(
    model: JointModel,
    at: Conditions,
    population: Population = "readings",
    *,
    seed: int = 0,
) -> Members:
    """Return the forces of the members of a population in every draw.

    Members that differ from each other are readings of the tested gear and mounting,
    new mountings, or new gears (`specimens`) in new mountings. The seed is that of the
    scores of what the draws leave open.
    """
    problem, draws, count = model.problem, model.draws, model.size
    reading, score = at.quantity == "reading", draw_scores(model.size, seed)
    gears = problem.specimens if population == "specimens" else 0
    mountings = problem.runs if population != "readings" and reading else 0
    none = np.zeros(count)
    gear_sd = draws["specimen_sd"] if gears else none
    zero_sd = draws["run_offset_sd"] if mountings else none
    # The centre of a population lies sd/√n from the mean of the tested members.
    gear = gear_sd * score["gear"] / max(gears, 1) ** 0.5
    mounting = zero_sd * score["mounting"] / max(mountings, 1) ** 0.5
    drift = _drifts(model, at, score)
    bend, acting = _bend(model, at, score)
    theory, tested = model.posterior.theory, model.posterior.case.gear.geometry
    nodes, node_share = size_nodes(tested, at.tolerances, theory)
    factor = np.broadcast_to(at.factor, (count, at.size))[:, None]
    force, slope, log_share, noise, left = _forces(
        model,
        at,
        (1.0 + gear)[:, None, None] * nodes[:, None] * factor,
        drift["frame_drift"],
        acting,
    )
    along = at.loading * (force + (bend + drift["zero_drift"])[:, None])
    along = along + mounting[:, None, None]
    own = (slope * factor * nodes[:, None] * gear_sd[:, None, None]) ** 2
    noise = noise**2 if reading else np.zeros_like(noise[:, :, :1])
    share = node_share[:, None] * (np.exp(log_share) if reading else 1.0)
    share = np.broadcast_to(share, noise.shape[:3])
    variance = noise + (own + zero_sd[:, None, None] ** 2)[:, :, None]
    mean = np.broadcast_to(along[:, :, None], variance.shape)
    within = np.einsum("dnk,dnkr->dr", share, noise)
    scatter = {"noise": within, "gear": np.einsum("n,dnr->dr", node_share, own)}
    scatter["mounting"] = np.broadcast_to(zero_sd[:, None] ** 2, within.shape)
    scatter |= _of_sizes(model, at, along, node_share)
    # A load is what is left of a reading once the zero of the gauge is taken off.
    separate = "force_offset" if at.quantity == "load" else ""
    common = {"gear": gear, "mounting": mounting} | {
        name: draws[name]
        for name in (*CERTIFIED, *SEPARATE)
        if name in draws and (model.driver(name) == "prior" or name == separate)
    }
    common = {
        name: np.broadcast_to(values[:, None], within.shape)
        for name, values in common.items()
    }
    common |= {"bend": at.loading * bend, "discrepancy": at.loading * left, **drift}
    return Members(
        share.reshape(count, -1),
        np.moveaxis(mean, 3, 1).reshape(count, at.size, -1),
        np.sqrt(np.moveaxis(variance, 3, 1)).reshape(count, at.size, -1),
        scatter,
        common,
    )


def gear_forces(model: JointModel, at: Conditions, *, seed: int = 0) -> np.ndarray:
    """Return the force of every draw on gears by themselves [N], (draw, row).

    Each row is another gear, loaded from its free shape, without zeros, errors and
    drifts of a rig.
    """
    bend, acting = _bend(model, at, draw_scores(model.size, seed))
    factor = np.broadcast_to(at.factor, (model.size, at.size))[:, None]
    moved = np.zeros((model.size, at.size))
    return _forces(model, at, factor, moved, acting)[0][:, 0] + bend


def gear_discrepancy(
    model: JointModel, deformation: np.ndarray, *, seed: int = 0
) -> np.ndarray:
    """Return the force of a gear outside model and effects [N], (draw, row).

    The bend, and the fitted discrepancy as the mean of loading and unloading, by the
    deformation from the free shape, per mm as read, (row,).
    """
    score, case = draw_scores(model.size, seed), model.posterior.case
    warm, tested = case.gear.reference_temperature, case.records.deformation
    # One direction of loading, so that the curve has no step at the free shape.
    sign = -1.0 if np.min(tested) + np.max(tested) < 0.0 else 1.0
    ways = [
        Conditions.of(deformation, warm, sign, unloading, quantity="gear")
        for unloading in (False, True)
    ]
    bend, acting = _bend(model, ways[0], score)
    one = np.ones((model.size, 1, len(deformation)))
    moved = np.zeros((model.size, len(deformation)))
    return bend + np.mean([_forces(model, at, one, moved, acting)[4] for at in ways], 0)


def _forces(
    model: JointModel, at: Conditions, factor, moved, acting
) -> tuple[np.ndarray, ...]:
    """Return what `forces_of_draws` does."""
    path = _path(at, model.posterior.case.records)
    repeats = len(path.deformation) // at.size
    forces = forces_of_draws(
        model.problem,
        model.draws,
        path,
        np.tile(factor, repeats),
        np.tile(moved, repeats),
        acting,
        quantity=at.quantity,
        asked=at.size,
    )
    return tuple(map(np.asarray, forces))


def _path(at: Conditions, records: Records) -> Records:
    """Return the rows that lead to the conditions, each in a gear of its own."""
    sd = usual_sd(records)
    if not at.unloading.any():
        return grid_records(at.deformation, at.temperature, at.movement, sd)
    turn = np.where(at.unloading, at.turn(records), at.deformation)
    return grid_records(
        np.append(turn, at.deformation),
        np.tile(at.temperature, 2),
        np.append(at.loading, at.movement),
        sd,
        np.tile(np.arange(at.size), 2),
    )


@lru_cache(maxsize=8)
def draw_scores(count: int, seed: int) -> dict[str, np.ndarray]:
    """Return SCORES of each draw by Latin hypercube sampling."""
    rng, even = np.random.default_rng(seed), (np.arange(count) + 0.5) / count
    levels = {name: rng.permutation(even) for name in SCORES}
    return {n: level if n == "law" else ndtri(level) for n, level in levels.items()}


def _bend(model: JointModel, at: Conditions, score) -> tuple[np.ndarray, np.ndarray]:
    """Return the bend of each draw [N], and the share of the discrepancy that acts.

    Shapes (draw, row) and (row,). A bend that is drawn from its prior is drawn along
    the direction of loading, so that mirrored data have the mirrored answer.
    """
    place, main = at.deformation, model.models[0]
    if at.quantity == "gear":
        free = float(np.mean(model.draws["deformation_offset"]))
        place = place + free
        # The free shape is known, without force: no bend grows between it and the
        # nearer end of the tested range.
        _, above = main.bends
        low, high = above.far, above.end
        known = np.clip(place, min(low, free), max(high, free))
        place = np.clip(place, low, high) + (place - known)
    mean, sd = model.bend(place, score["law"])
    bend = mean + sd * score["bend"][:, None] * at.loading
    if at.quantity == "gear":
        bend = bend * at.factor
    return bend, 1.0 - main.beyond(place)


def _drifts(model: JointModel, at: Conditions, score) -> dict[str, np.ndarray]:
    """Return the drift of zero [N] and frame [mm] outside the tested temperatures."""
    warm = model.posterior.case.records.temperature
    kelvins = at.temperature - np.clip(at.temperature, np.min(warm), np.max(warm))
    if at.quantity != "reading" or not kelvins.any():
        return dict.fromkeys(DRIFTS, np.zeros((model.size, at.size)))
    return {
        name: (mean[:, None] + np.outer(sd * score[name], at.loading)) * kelvins
        for name, (mean, sd) in model.drifts.items()
    }


def _of_sizes(model: JointModel, at: Conditions, force, node_share) -> dict:
    """Return the variance by each tolerance [N²], (draw, row), together that of all."""
    if not at.tolerances:
        return {}
    posterior = model.posterior
    geometry, theory = posterior.case.gear.geometry, posterior.theory
    centred = force - np.einsum("n,dnr->dr", node_share, force)[:, None]
    together = np.einsum("n,dnr->dr", node_share, centred**2)
    alone = {}
    for name, width in at.tolerances.items():
        nodes, share = size_nodes(geometry, {name: width}, theory)
        alone[name] = share @ (nodes - share @ nodes) ** 2
    total = sum(alone.values())
    return {name: together * part / total for name, part in alone.items()}
