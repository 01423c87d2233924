"""A fleet as an answer, and all that its result folder holds."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from itertools import compress

import numpy as np

from hdcal.data.theory_names import SPRING
from hdcal.errors import shortened
from hdcal.fleets.answer import (
    FleetAnswer,
    FutureGear,
    GearBounds,
    LotAnswer,
    OperatorAnswer,
    PopulationAnswer,
    RigAnswer,
)
from hdcal.fleets.document import fleet_document
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.gauge import gauge
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.headline import far_apart, headline
from hdcal.fleets.left_out import left_out_of, with_left_out
from hdcal.fleets.next_force import CONTENTS, NextForce
from hdcal.fleets.next_gear import CONFIDENCE, stiffness_bounds
from hdcal.fleets.notes import notes_of
from hdcal.fleets.off_in import FALSE_CALLS
from hdcal.fleets.over_time import time_answer, time_series
from hdcal.inference.distributions import moments
from hdcal.inference.posterior_file import FILE_NAME
from hdcal.report.document import mapped
from hdcal.report.intervals import INTERVAL, Interval, credible_interval
from hdcal.report.write import Report
from hdcal.versions import versions

# Ends and middle of an interval.
_ENDS = (0.5 - 0.5 * INTERVAL, 0.5, 0.5 + 0.5 * INTERVAL)
# Files of one table.
_TABLES = ("gears.csv", "gears.parquet")


def gear_table(found: Fleet) -> dict[str, np.ndarray]:
    """Return the columns of gears.csv under their names."""
    key = found.case.units.key
    return {key(name): column for name, column in gear_columns(found).items()}


def gear_columns(found: Fleet) -> dict[str, np.ndarray]:
    """Return what is known of each gear, named after force and deformation."""
    own = found.stiffness * found.size_ratio
    low, middle, high = np.quantile(own, _ENDS, axis=0)
    columns = {
        "gear": np.array(found.case.specimen_labels),
        **({"lot": np.array(found.case.lots)} if found.case.lots else {}),
        "rows": found.rows,
        "runs": found.mountings,
        "stiffness_N_per_mm": middle,
        "stiffness_lo": low,
        "stiffness_hi": high,
        **({"size_ratio": found.size_ratio} if found.at_one_size else {}),
    }
    if found.case.gear.theory != SPRING:
        K_low, K, K_high = np.quantile(_influence(found), _ENDS, axis=0)
        columns |= {"K": K, "K_lo": K_low, "K_hi": K_high}
    failed = bool(found.reasons)
    apart_low, apart, apart_high = np.quantile(100.0 * found.apart, _ENDS, axis=0)
    columns |= {"apart_percent": apart, "apart_lo": apart_low, "apart_hi": apart_high}
    return columns | {
        "zero_N": found.zero,
        "noise_sd_N": found.noise_sd,
        "own_noise_sd_N": found.own_noise_sd,
        "loop_N": found.loop,
        "bend_N": found.bend,
        "distance_sd": found.distance,
        "probability_off": found.off,
        "chance_ordinary": found.chances["stiffness"],
        "chance_noise": found.chances["noise"],
        "chance_zero": found.chances["zero"],
        "chance_shape": found.chances["shape"],
        "called_off": found.called,
        "off_in": _kinds(found.off_in),
        "status": np.full(len(middle), "failed" if failed else "ok"),
    }


def _kinds(off_in: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return what each gear is called off in, in words, shape (g,)."""
    each = zip(*off_in.values(), strict=True)
    told = (", ".join(compress(off_in, own)) for own in each)
    return np.array([*told], object)


def _influence(found: Fleet) -> np.ndarray:
    """Return draws of K of every gear: data tell its product with the modulus only."""
    mean, sd = moments(found.case.gear.priors["E0"], "E0")
    rng = np.random.default_rng(int(str(found.settings["seed"])))
    modulus = 1.0 + sd / mean * rng.standard_normal((len(found.stiffness), 1))
    return found.stiffness / (found.unit * modulus)


def fleet_answer(found: Fleet, force: NextForce | None = None) -> FleetAnswer:
    """Return a fleet as an answer, ready for JSON.

    Args:
        found: the fleet.
        force: of a gear to come, where it was asked for.
    """
    draws, columns = found.draws, gear_columns(found)
    order = np.argsort(-found.off, kind="stable")
    called = [found.case.specimen_labels[row] for row in order if found.called[row]]
    population = PopulationAnswer(
        stiffness_N_per_mm=credible_interval(draws["stiffness"]),
        gear_sd_percent=credible_interval(100.0 * draws["specimen_sd"]),
        lot_sd_percent=_spread(draws, "lot_sd", 100.0),
        operator_sd_N=_spread(draws, "operator_sd"),
        rig_sd_percent=_spread(draws, "rig_sd", 100.0),
        mounting_sd_N=credible_interval(draws["run_offset_sd"]),
        reading_sd_N=credible_interval(draws["sigma"]),
    )
    lots = tuple(_lots(found))
    failed = f"This result failed its checks: {'; '.join(found.reasons)}."
    said = failed if found.reasons else headline(population, called, columns)
    # Where a force is asked for its tolerance is meant; else the largest force.
    read_at = found.readings.largest if force is None else force.deformation_mm
    answer = FleetAnswer(
        units=found.case.units,
        status="failed" if found.reasons else "ok",
        reasons=found.reasons,
        headline=said,
        next_step=_next_step(found, called),
        gears=len(found.off),
        rows=int(found.rows.sum()),
        left_out=left_out_of(found.case),
        called_off=tuple(called),
        off_in={
            name: tuple(np.array(found.case.specimen_labels)[own].tolist())
            for name, own in found.off_in.items()
        },
        false_calls=FALSE_CALLS,
        interval=INTERVAL,
        at_one_size=found.at_one_size,
        population=population,
        lots=lots,
        operators=tuple(_operators(found)),
        rigs=tuple(_rigs(found)),
        gauge_rr=gauge(draws, read_at, found.force_tolerance),
        over_time=tuple(map(time_answer, time_series(found))),
        misfit=found.misfit,
        next_gear=FutureGear(
            credible_interval(found.next_stiffness),
            tuple(
                GearBounds(content, CONFIDENCE, *stiffness_bounds(found.draws, content))
                for content in CONTENTS
            ),
        ),
        next_force=force,
        notes=tuple(notes_of(found)),
        seed=int(str(found.settings["seed"])),
        versions=versions(),
        data_sha256=found.case.data_sha256,
    )
    return mapped(answer, answer.units.say)


def _spread(
    draws: Mapping[str, np.ndarray], name: str, factor: float = 1.0
) -> Interval | None:
    return credible_interval(factor * draws[name]) if name in draws else None


def _lots(found: Fleet) -> Iterator[LotAnswer]:
    if not found.lots:
        return
    centre = found.draws["stiffness"] * (1.0 + group_offsets(found.draws, "lot"))
    for name, one in zip(found.lots, np.asarray(centre), strict=True):
        yield LotAnswer(name, found.case.lots.count(name), credible_interval(one))


def _operators(found: Fleet) -> Iterator[OperatorAnswer]:
    if not found.operators:
        return
    zeros = np.asarray(group_offsets(found.draws, "operator"))
    for name, one in zip(found.operators, zeros, strict=True):
        many = found.case.operators.count(name)
        yield OperatorAnswer(name, many, credible_interval(one))


def _rigs(found: Fleet) -> Iterator[RigAnswer]:
    if not found.rigs:
        return
    gains = 100.0 * np.asarray(group_offsets(found.draws, "rig"))
    for name, one in zip(found.rigs, gains, strict=True):
        many = found.case.rigs.count(name)
        yield RigAnswer(name, many, credible_interval(one))


def _in_another_unit(found: Fleet) -> np.ndarray:
    """Return which gears are so far off in stiffness that a unit may be wrong."""
    return found.off_in["stiffness"] & far_apart(100.0 * np.median(found.apart, axis=0))


def _next_step(found: Fleet, called: Sequence[str]) -> str | None:
    parts = []
    # A softer gear by itself is as good a line as any: no diagnosis sees it.
    bent = found.off_in["noise"] | found.off_in["shape"]
    with_more = {*np.array(found.case.specimen_labels)[bent].tolist()}
    odd = [name for name in called if name in with_more]
    if odd:
        alone = f"`--specimen {shlex.quote(odd[0])}`"
        parts.append(
            f"See what {odd[0]} has by itself: `hdcal diagnose` with the same data and "
            f"{alone}"
        )
    far = np.array(found.case.specimen_labels)[_in_another_unit(found)].tolist()
    if far:
        parts.append(
            f"See in which units {shortened(far, 1)} was read: not in the others'"
        )
    if again := [name for name in called if name not in {*with_more, *far}]:
        words = "anew and measure again before you act on this"
        parts.append(f"Mount {shortened(again, 1)} {words}")
    misfit = found.misfit
    beside = misfit.loop_N or misfit.bend_N or misfit.correlation
    if beside or bent.any():
        parts.append(
            "Ask which effects these gears have, and what they have in common: "
            "`hdcal causes` with the same data"
        )
    return ". ".join(parts) + "." if parts else None


def fleet_report(
    found: Fleet, command: str = "", force: NextForce | None = None
) -> Report[FleetAnswer]:
    """Return all that `hdcal fleet` leaves behind.

    Args:
        found: the fleet.
        command: that made it.
        force: of a gear to come, where it was asked for.
    """

    def figures():
        from hdcal.fleets.figure import curves_figure, fleet_figure, time_figure

        series = time_series(found)
        units = found.case.units
        drawn = {"time": time_figure(series, units)} if series else {}
        drawn["curves"] = curves_figure(found)
        return {"gears": fleet_figure(found)} | drawn

    def charts():
        from hdcal.fleets.chart import fleet_chart
        from hdcal.fleets.time_chart import time_charts

        series = time_series(found)
        units = found.case.units
        drawn = {"time": time_charts(series, units)} if series else {}
        return {} if found.reasons else {"gears": [fleet_chart(found)]} | drawn

    answer, columns = fleet_answer(found, force), gear_columns(found)
    document = fleet_document(found, answer, columns, command)
    return Report(
        document,
        answer,
        "summary.json",
        figures,
        tables=lambda: dict.fromkeys(
            _TABLES, with_left_out(gear_table(found), found.case)
        ),
        others=lambda: [(FILE_NAME, found.posterior.to_netcdf())],
        charts=charts,
        theory=found.case.gear.theory,
    )
