"""The calibrated posterior: draws, what they rest on, and whether they may be used."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.data.theory_names import SPRING, Theory
from hdcal.data.typed_json import typed, typed_text
from hdcal.errors import Finding, InputError, NotUsable
from hdcal.inference import posterior_file
from hdcal.inference.array_tree import CHAIN, DRAW, ArrayTree, Group, joined
from hdcal.inference.checks import Check
from hdcal.inference.diagnostics import Diagnosis
from hdcal.inference.held import LOOP, PILOT_NOISE, HeldModel, HeldSettings
from hdcal.inference.hypotheses import HYPOTHESIS, check_hypotheses
from hdcal.inference.posterior_limits import check_draws
from hdcal.inference.problem import Problem, build_problem
from hdcal.inference.values import site_shapes
from hdcal.notebook import Shown
from hdcal.physics.effect import Effect

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, repr=False)
class Posterior(Shown):
    """A calibration: draws in code units, priors, checks and provenance.

    Attributes:
        case: data and gear.
        theory: which stiffness K multiplies.
        effects: effects in the model.
        priors: of every site, in code units, K under `theory`.
        arrays: the groups posterior, prior, sample_stats, observed_data,
            constant_data and log_likelihood.
        diagnoses: sampling quality and driver by parameter.
        checks: what was checked and what came out.
        settings: seed, chains, warmup, draws, seconds, with_gap, versions; and
            `PILOT_NOISE`, by which the form of the noise was decided [N].
    """

    kind: ClassVar[str] = "static"

    case: Case
    theory: Theory
    effects: tuple[type[Effect], ...]
    priors: Mapping[str, Prior]
    arrays: ArrayTree
    diagnoses: Mapping[str, Diagnosis]
    checks: tuple[Check, ...]
    settings: Mapping[str, object]

    def sites(
        self, case: Case, effects: Sequence[type[Effect]], with_gap: bool
    ) -> dict[str, tuple[int, ...]]:
        """Return the shape of each parameter that a draw of a model holds."""
        return site_shapes(case, effects, with_gap, self._noise_sd, loop=self._loop)

    @property
    def _noise_sd(self) -> float | None:
        """What decided the form of the noise [N]; None in older files."""
        kept = self.settings.get(PILOT_NOISE)
        return None if kept is None else float(str(kept))

    @property
    def _loop(self) -> bool:
        """Whether the leftover discrepancy may know loading from unloading."""
        return bool(self.settings.get(LOOP, False))

    def __repr__(self) -> str:
        names = ", ".join(effect.name for effect in self.effects) or "none"
        state = "usable" if self.usable else "FAILED, do not use"
        return (
            f"<Posterior of {self.case.name}: {len(self.draws['K'])} draws, "
            f"theory {self.theory}, effects {names}, {state}>"
        )

    @property
    def usable(self) -> bool:
        """Whether every check passed that a result must pass."""
        return not self.reasons

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the result must not be used; empty when it may be."""
        failed = (check for check in self.checks if check.outcome == "failed")
        return tuple(f"{check.name}: {check.words}" for check in failed)

    @property
    def draws(self) -> dict[str, np.ndarray]:
        """All draws in code units by site, chains joined: [draw, …]."""
        return joined(self.arrays.groups["posterior"])

    @property
    def size(self) -> tuple[int, int]:
        """Chains, and draws of each."""
        group = self.arrays.groups["posterior"]
        return len(group[CHAIN].values), len(group[DRAW].values)

    @property
    def tree(self) -> "xr.DataTree":
        """What ArviZ draws from: its groups as a DataTree, which is not saved again."""
        return self.arrays.datatree

    @cached_property
    def problem(self) -> Problem:
        """The inference problem that was sampled."""
        return build_problem(
            self.case,
            self.priors,
            self.effects,
            theory=self.theory,
            with_gap=bool(self.settings["with_gap"]),
            noise_sd=self._noise_sd,
            loop=self._loop,
        )

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors, that of the force zero given how the mountings differ."""
        centre = {name: np.median(v, axis=0) for name, v in self.draws.items()}
        return self.problem.priors_given(centre)

    def require_usable(self) -> None:
        """Raise when nothing may be derived from this posterior.

        Raises:
            NotUsable: with the reasons.
        """
        if not self.usable:
            raise NotUsable(
                "this calibration failed its checks and must not be used: "
                + "; ".join(self.reasons)
            )

    def save(self, path: Path | str) -> None:
        """Write the posterior as a NetCDF file that ArviZ opens."""
        Path(path).write_bytes(self.to_netcdf())

    def to_netcdf(self) -> bytes:
        """Return the content of a NetCDF file that ArviZ opens."""
        attributes = {
            "status": "ok" if self.usable else "failed",
            "case": posterior_file.describe_case(self.case),
            "model": json.dumps(
                {
                    "theory": self.theory,
                    "effects": [effect.name for effect in self.effects],
                    "priors": {
                        name: posterior_file.describe_prior(prior)
                        for name, prior in self.priors.items()
                    },
                    "settings": dict(self.settings),
                    "diagnoses": {n: vars(d) for n, d in self.diagnoses.items()},
                    "checks": [vars(check) for check in self.checks],
                }
            ),
        }
        kind = posterior_file.CALIBRATION
        return posterior_file.sealed(self.arrays, kind, attributes)

    @classmethod
    def load(
        cls, path: Path | str, effects: Mapping[str, type[Effect]] | None = None
    ) -> "Posterior":
        """Read a posterior back.

        Args:
            path: a result folder or its posterior.nc.
            effects: the library in which the effects' names are looked up; needed
                for effects from outside.

        Raises:
            InputError: the file is missing, damaged, changed or from another
                version, or names an effect that the library lacks.
        """
        file = posterior_file.file_of(path)
        tree = posterior_file.open_tree(file)
        posterior_file.check_unchanged(tree, file)
        try:
            model = typed_text(HeldModel, tree.attrs["model"])
            settings = typed(HeldSettings, model.settings)
            if settings.kind != cls.kind:
                raise InputError([_of_another_kind(file, cls.kind)])
            case = posterior_file.restore_case(
                tree.attrs["case"],
                tree.groups["constant_data"],
                tree.groups["observed_data"]["force"].values,
            )
            if (model.theory == SPRING) != (case.gear.theory == SPRING):
                raise ValueError("is of another theory than its gear")
            chosen = _look_up(model.effects, effects, file)
            found = cls(
                case=case,
                theory=model.theory,
                effects=chosen,
                priors=posterior_file.restore_priors(model.priors),
                arrays=tree,
                diagnoses=model.diagnoses,
                checks=tuple(model.checks),
                settings=model.settings,
            )
            sites = found.sites(case, chosen, settings.with_gap)
            draws = tree.groups["posterior"]
            check_draws(draws, sites)
            _check_mixture(draws, chosen, settings)
            model.check_diagnoses(sites)
            return found
        except (KeyError, ValueError, TypeError, AttributeError) as error:
            raise InputError([posterior_file.not_a_posterior(file)]) from error


def _check_mixture(draws: Group, effects, settings: HeldSettings) -> None:
    origin, labelled = settings.diagnosis, HYPOTHESIS in draws
    if origin is None or origin.hypothesis is not None:
        if labelled:
            raise ValueError("has hypotheses of which it says nothing")
    elif not labelled:
        raise ValueError("does not say which draws are of which hypothesis")
    else:
        check_hypotheses(draws, effects, origin.probabilities)


def _of_another_kind(file, wanted: str) -> Finding:
    needed, found = "of the gear at rest", "of the moving gear"
    if wanted == "dynamic":
        needed, found = found, needed
    remedy = f"Name the folder of a calibration {needed}"
    return Finding(str(file), f"is a calibration {found}", remedy)


def _look_up(names, library, file) -> tuple[type[Effect], ...]:
    if library is None:
        from hdcal.physics.registry import EFFECTS as library
    unknown = [name for name in names if name not in library]
    if unknown:
        raise InputError(
            Finding(
                str(file),
                f"the effect '{name}' is not in the library",
                "pass a library that holds it: Posterior.load(path, effects=…)",
            )
            for name in unknown
        )
    return tuple(library[name] for name in names)
