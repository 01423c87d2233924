"""Draws of the population of a fleet in the groups of ArviZ: posterior.nc."""

from typing import TYPE_CHECKING

import xarray as xr

from hdcal.fleets.next_gear import stiffness_of_gears
from hdcal.inference.posterior_tree import dataset

if TYPE_CHECKING:
    from hdcal.fleets.result import Fleet

_IN_NEWTONS = ("zero", "run_offset_sd", "sigma", "loop", "bend", "operator")


def population_tree(fleet: "Fleet") -> xr.DataTree:
    """Return the draws of the population, and the stiffness of gears to come."""
    fit, chains = fleet.fit, int(fleet.fit.settings["chains"])
    draws = {name: values.reshape(chains, -1) for name, values in fit.draws.items()}
    units = {name: fleet.units.unit(_unit(name)) for name in draws}
    population = dataset(draws, units=units)
    for kind in ("lot", "operator", "rig"):
        for place, label in enumerate(getattr(fit.groups, f"{kind}s"), 1):
            population[f"{kind}_{place}"].attrs["long_name"] = label
    gears = stiffness_of_gears(fit.draws).sample(fleet.seed).reshape(chains, -1)
    predictions = dataset({"stiffness": gears}, units=units)
    return xr.DataTree.from_dict({"posterior": population, "predictions": predictions})


def _unit(site: str) -> str:
    """Return the unit of a site, in N and mm."""
    if site == "stiffness":
        return "N/mm"
    share = site.endswith(("_share", "_ratio")) or site == "noise_spread"
    return "N" if site.startswith(_IN_NEWTONS) and not share else "1"
