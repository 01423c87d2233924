"""Who may answer a blind check, and by which code, priors and thresholds."""

from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

import numpy as np

from hdcal.blind.canonical import canonical, digest
from hdcal.blind.label import CaseAnswer, Quantiles
from hdcal.blind.rival_methods import fit_each
from hdcal.data.case import Case
from hdcal.data.resources import priors_folder
from hdcal.data.versions import versions
from hdcal.diagnosis import model_posterior
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.groups import JOINED
from hdcal.diagnosis.library import choose_library
from hdcal.diagnosis.naming import naming_file
from hdcal.diagnosis.verdict import Verdict
from hdcal.diagnosis.where import FALSE_ALARM
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.registry import EFFECTS
from hdcal.report.parameters import Interval

Library = Mapping[str, type[Effect]]
Diagnoser = Callable[[Case, Library], CaseAnswer]


def by_hdcal(case: Case, library: Library) -> CaseAnswer:
    """Answer as `hdcal diagnose --quick` does."""
    return answer_of(diagnose(case, library=library, quick=True))


def always_none(case: Case, library: Library) -> CaseAnswer:
    """Answer that nothing is missing, whatever the data say."""
    impossible = dict.fromkeys(library, 0.0)
    chances = {NONE: 1.0, UNKNOWN: 0.0, **impossible}
    return CaseAnswer(
        case.name, "none", None, None, (NONE,), chances, impossible, False
    )


def by_r2(case: Case, library: Library) -> CaseAnswer:
    """Answer with the effect that fits best in sample, as R² ranks them."""
    found = fit_each(case, library)
    best = min((n for n in found if n != NONE), key=lambda n: found[n].square)
    return _certain(case, library, {best: 1.0})


def by_bic(case: Case, library: Library) -> CaseAnswer:
    """Answer with the weights of the Bayesian information criterion."""
    found = fit_each(case, library)
    least = min(each.bic for each in found.values())
    weight = {n: float(np.exp(-0.5 * (f.bic - least))) for n, f in found.items()}
    total = sum(weight.values())
    return _certain(case, library, {n: w / total for n, w in weight.items()})


def _certain(case: Case, library: Library, chances: dict[str, float]) -> CaseAnswer:
    """Return the answer of who knows neither pairs nor the unknown."""
    best = max(chances, key=lambda name: chances[name])
    nothing = dict.fromkeys((NONE, UNKNOWN, *library), 0.0)
    return CaseAnswer(
        case.name,
        "none" if best == NONE else "named",
        None if best == NONE else best,
        None,
        (best,),
        {**nothing, **chances},
        {name: chances.get(name, 0.0) for name in library},
        best != NONE,
    )


DIAGNOSERS: dict[str, Diagnoser] = {
    "hdcal": by_hdcal,
    "bic": by_bic,
    "r2": by_r2,
    "none": always_none,
}


def answer_of(verdict: Verdict) -> CaseAnswer:
    """Return what a verdict says, in the words that are scored."""
    which, gap, size = verdict.which, verdict.gap, verdict.which.amplitude
    return CaseAnswer(
        case=verdict.case.name,
        verdict=which.verdict,
        effect=which.effect,
        second_effect=which.second_effect,
        set=which.set,
        probabilities=which.probabilities,
        inclusion=which.inclusion,
        detected=gap.detected,
        p_value=verdict.where.p_value,
        # Where no gap is detected its size is not estimated.
        gap=_span(gap.rms_N) if gap.detected else None,
        amplitude={f"{size.effect}.{size.parameter}": _span(size)} if size else {},
        closed=_span(verdict.shrink.closed) if verdict.shrink.closed else None,
        noise_sd=gap.noise_sd_N,
        group=tuple(which.group.split(JOINED)) if which.group else (),
        group_members=which.group_members,
        describes_best=which.describes_best,
    )


def _span(interval: Interval) -> Quantiles:
    return interval.median, interval.lo, interval.hi


def families() -> dict[str, str]:
    """Return the family of every effect of the library."""
    return {name: effect.groups[0] for name, effect in EFFECTS.items()}


def withheld_from(*libraries: str | None) -> str | None:
    """Return one `minus:NAME[,NAME]` for several; None where all are empty."""
    names: list[str] = []
    for library in filter(None, libraries):
        names += library.removeprefix("minus:").split(",")
    return "minus:" + ",".join(dict.fromkeys(names)) if names else None


@cache
def fingerprint(library: str | None = None) -> dict[str, Any]:
    """Return what decides an answer beside the data; asked for once per process.

    Args:
        library: `minus:NAME[,NAME]`, left out of every case.
    """
    thresholds = {
        name: getattr(model_posterior, name)
        for name in dir(model_posterior)
        if name.startswith("PRIOR_") or name in ("NAMED", "SURE", "CARRIES")
    }
    considered = choose_library(library).items()
    return {
        "library_sha256": _of({name: _declared(effect) for name, effect in considered}),
        "priors_sha256": _of(_hashes(priors_folder(), ".toml")),
        "thresholds_sha256": _of({**thresholds, "FALSE_ALARM": FALSE_ALARM}),
        "naming_sha256": _of(naming_file()),
        "versions": versions(),
        "code_sha256": _of(_hashes(_package(), ".py")),
    }


def _of(data: Any) -> str:
    return digest(canonical(data))


def _declared(effect: type[Effect]) -> dict[str, Any]:
    return {
        "stage": effect.stage,
        "family": effect.groups[0],
        "symmetry": effect.symmetry,
        "needs": sorted(effect.needs),
        "parameters": sorted(parameters(effect)),
    }


def _package() -> Traversable:
    # pathlib.Path and zipfile.Path both know their parent; Traversable does not.
    package: Any = files("hdcal")
    return package


def _hashes(folder: Traversable, ending: str) -> dict[str, Any]:
    """Return the hash of every file with an ending, by name and folder."""
    found: dict[str, Any] = {}
    for item in folder.iterdir():
        if item.is_dir():
            inside = _hashes(item, ending)
            # A folder that only caches leave behind is no part of the code.
            if inside:
                found[item.name] = inside
        elif item.name.endswith(ending):
            found[item.name] = digest(item.read_bytes())
    return found
