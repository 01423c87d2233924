"""The calibrated posterior: draws, what they rest on, and whether they may be used."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.data.theory_names import Theory
from hdcal.errors import Finding, InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Convergence
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.structure import ModelStructure
from hdcal.inference.posterior_file import (
    CALIBRATION,
    content,
    file_of,
    not_a_posterior,
    read_tree,
)
from hdcal.inference.posterior_tree import (
    describe_case,
    joined_draws,
    restore_case,
    restore_priors,
    to_json,
)
from hdcal.notebook import Shown
from hdcal.physics.effect import Effect

# The setting with the structure of the model, and the one with the hypothesis of a
# diagnosis that the model is of.
STRUCTURE, HYPOTHESIS = "structure", "hypothesis"
_WORDS = {"static": "of the gear at rest", "dynamic": "of the moving gear"}
Library = Mapping[str, type[Effect]]


@dataclass(frozen=True, repr=False)
class Posterior(Shown):
    """A calibration: draws and priors in code units, checks and provenance.

    The tree has ArviZ' groups posterior, prior, sample_stats, observed_data,
    constant_data and log_likelihood.
    """

    kind: ClassVar[str] = "static"

    case: Case
    theory: Theory
    effects: tuple[type[Effect], ...]
    priors: Mapping[str, Prior]
    tree: xr.DataTree
    diagnoses: Mapping[str, Convergence]
    checks: tuple[Check, ...]
    settings: Mapping[str, Any]

    def __repr__(self) -> str:
        names = ", ".join(effect.name for effect in self.effects) or "none"
        state = "usable" if self.usable else "FAILED, do not use"
        return (
            f"<Posterior of {self.case.name}: {len(self.draws['K'])} draws, "
            f"theory {self.theory}, effects {names}, {state}>"
        )

    @property
    def structure(self) -> ModelStructure:
        """What the model contains besides line and effects."""
        return ModelStructure(**self.settings[STRUCTURE])

    @property
    def usable(self) -> bool:
        """Whether every check passed that a result must pass."""
        return not self.reasons

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the result must not be used; empty when it may be."""
        failed = (check for check in self.checks if check.outcome == "failed")
        return tuple(f"{check.name}: {check.words}" for check in failed)

    @cached_property
    def draws(self) -> dict[str, np.ndarray]:
        """All draws in code units by site, chains joined: [draw, …]."""
        return joined_draws(self.tree)

    @cached_property
    def problem(self) -> Problem:
        """The inference problem that was sampled."""
        form = {"theory": self.theory, "structure": self.structure}
        return build_problem(self.case, self.priors, self.effects, **form)

    @cached_property
    def median(self) -> dict[str, np.ndarray]:
        """Median of each site over all draws, in code units."""
        return {name: np.median(v, axis=0) for name, v in self.draws.items()}

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors, that of the force zero given how the mountings differ."""
        return self.problem.priors_given(self.median)

    def require_usable(self) -> None:
        """Raise `NotUsable`, with the reasons, when a check failed."""
        if not self.usable:
            words = "this calibration failed its checks and must not be used"
            raise NotUsable(f"{words}: {'; '.join(self.reasons)}")

    def save(self, path: Path | str) -> None:
        """Write the posterior as a NetCDF file that ArviZ opens."""
        Path(path).write_bytes(self.to_netcdf())

    def to_netcdf(self) -> bytes:
        """Return the content of a NetCDF file that ArviZ opens."""
        return content(self.tree, CALIBRATION, self.attributes())

    def attributes(self) -> dict[str, str]:
        """Return everything but the groups, as attributes of a file."""
        model = {
            "kind": self.kind,
            "theory": self.theory,
            "effects": [effect.name for effect in self.effects],
            "priors": {n: asdict(prior) for n, prior in self.priors.items()},
            "settings": dict(self.settings),
            "diagnoses": {n: asdict(found) for n, found in self.diagnoses.items()},
            "checks": [asdict(check) for check in self.checks],
        }
        return {
            "status": "ok" if self.usable else "failed",
            "case": describe_case(self.case),
            "model": to_json(model),
        }

    @classmethod
    def load(cls, path: Path | str, effects: Library | None = None) -> Self:
        """Read the posterior of one model from a result folder or its posterior.nc.

        `InputError` if the file is missing, damaged, changed, of several models or from
        another version, or names an effect that the library of effects lacks.
        """
        file = file_of(path)
        return cls.from_tree(read_tree(file), file, effects)

    @classmethod
    def from_tree(
        cls, tree: xr.DataTree, file: Path, effects: Library | None = None
    ) -> Self:
        """Return the posterior of a tree that was read from a file, as `load`."""
        if "model" not in tree.attrs:
            problem = "is of a diagnosis, which averages over several models"
            remedy = "Load it with hdcal.ModelAverage.load"
            raise InputError([Finding(str(file), problem, remedy)])
        try:
            model = json.loads(tree.attrs["model"])
            if model["kind"] != cls.kind:
                problem = f"is a calibration {_WORDS[model['kind']]}"
                remedy = f"Name the folder of a calibration {_WORDS[cls.kind]}"
                raise InputError([Finding(str(file), problem, remedy)])
            return cls(
                case=restore_case(tree.attrs["case"], tree),
                theory=model["theory"],
                effects=_look_up(model["effects"], effects, file),
                priors=restore_priors(model["priors"]),
                tree=tree,
                diagnoses={n: Convergence(**d) for n, d in model["diagnoses"].items()},
                checks=tuple(Check(**check) for check in model["checks"]),
                settings=model["settings"],
            )
        except (KeyError, ValueError, TypeError) as error:
            raise not_a_posterior(file) from error


def _look_up(
    names: list[str], library: Library | None, file: Path
) -> tuple[type[Effect], ...]:
    if library is None:
        from hdcal.physics.registry import EFFECTS as library
    if unknown := [name for name in names if name not in library]:
        remedy = "pass a library that holds it: Posterior.load(path, effects=…)"
        raise InputError(
            Finding(str(file), f"the effect '{name}' is not in the library", remedy)
            for name in unknown
        )
    return tuple(library[name] for name in names)
