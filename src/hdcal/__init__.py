"""hdcal: calibrate the force model of a harmonic-drive flexspline.

Public names load on first use, so that importing hdcal costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdcal.answers.audit.article import Claim
    from hdcal.answers.audit.audit import audit
    from hdcal.answers.bands import Bands, predict
    from hdcal.answers.calibration import calibrate
    from hdcal.answers.classical import PolynomialFit, fit
    from hdcal.answers.diagnosis.diagnose import diagnose
    from hdcal.answers.diagnosis.verdict import Verdict
    from hdcal.answers.dynamics.calibration import calibrate_dynamic
    from hdcal.answers.dynamics.respond import Response, respond
    from hdcal.answers.inverse_design import InverseDesign, inverse_design
    from hdcal.answers.margins.answer import Margin
    from hdcal.answers.margins.margin import margin
    from hdcal.answers.residuals import Residuals, residuals
    from hdcal.answers.study import Study, study
    from hdcal.answers.summary import summarise
    from hdcal.answers.tolerance import k_factor, wilks_size
    from hdcal.answers.tracking import Tracker
    from hdcal.answers.wave_generator import WaveGenerator, wave_generator
    from hdcal.errors import Finding, HdcalError, InputError, NotUsable
    from hdcal.inference.dynamic.posterior import DynamicPosterior
    from hdcal.inference.posterior import Posterior
    from hdcal.physics.chain import force
    from hdcal.physics.effect import Effect, Noise, Rows, parameter
    from hdcal.physics.profile import Profile, ring_profile
    from hdcal.physics.registry import EFFECTS
    from hdcal.physics.theory import THEORIES
    from hdcal.rig.case import Case, Gear
    from hdcal.rig.priors import Prior
    from hdcal.rig.reading import read_case
    from hdcal.rig.records import Geometry, Records

_HOMES = {
    "Bands": "answers.bands",
    "Case": "rig.case",
    "Claim": "answers.audit.article",
    "DynamicPosterior": "inference.dynamic.posterior",
    "EFFECTS": "physics.registry",
    "Effect": "physics.effect",
    "Finding": "errors",
    "Gear": "rig.case",
    "Geometry": "rig.records",
    "HdcalError": "errors",
    "InputError": "errors",
    "InverseDesign": "answers.inverse_design",
    "Margin": "answers.margins.answer",
    "Noise": "physics.effect",
    "NotUsable": "errors",
    "PolynomialFit": "answers.classical",
    "Posterior": "inference.posterior",
    "Prior": "rig.priors",
    "Profile": "physics.profile",
    "Records": "rig.records",
    "Residuals": "answers.residuals",
    "Response": "answers.dynamics.respond",
    "Rows": "physics.effect",
    "Study": "answers.study",
    "THEORIES": "physics.theory",
    "Tracker": "answers.tracking",
    "Verdict": "answers.diagnosis.verdict",
    "WaveGenerator": "answers.wave_generator",
    "audit": "answers.audit.audit",
    "calibrate": "answers.calibration",
    "calibrate_dynamic": "answers.dynamics.calibration",
    "diagnose": "answers.diagnosis.diagnose",
    "fit": "answers.classical",
    "force": "physics.chain",
    "inverse_design": "answers.inverse_design",
    "k_factor": "answers.tolerance",
    "margin": "answers.margins.margin",
    "parameter": "physics.effect",
    "predict": "answers.bands",
    "read_case": "rig.reading",
    "residuals": "answers.residuals",
    "respond": "answers.dynamics.respond",
    "ring_profile": "physics.profile",
    "study": "answers.study",
    "summarise": "answers.summary",
    "wave_generator": "answers.wave_generator",
    "wilks_size": "answers.tolerance",
}

__all__ = [*sorted(_HOMES)]


def __getattr__(name: str):
    if name not in _HOMES:
        raise AttributeError(f"module 'hdcal' has no attribute {name!r}")
    return getattr(import_module(f"hdcal.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
