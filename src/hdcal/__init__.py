"""hdcal: calibrate the force model of a harmonic-drive flexspline.

Public names load on first use, so that importing hdcal costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdcal.calibration.calibrate import calibrate
    from hdcal.calibration.calibration import summarise
    from hdcal.classical.fit import fit
    from hdcal.comparison.compare import compare
    from hdcal.data.case import Case, Gear
    from hdcal.data.priors import Prior
    from hdcal.data.reading import read_case
    from hdcal.data.records import Geometry, Records
    from hdcal.design.inverse_design import inverse_design
    from hdcal.design.study import study
    from hdcal.design.wave_generator import wave_generator
    from hdcal.diagnosis.diagnose import diagnose
    from hdcal.diagnosis.result import Diagnosis
    from hdcal.errors import HdcalError, InputError, NotUsable
    from hdcal.fleets.fleet import fleet
    from hdcal.fleets.result import Fleet
    from hdcal.inference.force_model.residuals import residuals
    from hdcal.inference.model_average import ModelAverage
    from hdcal.inference.posterior import Posterior
    from hdcal.motion.dynamic_calibration import calibrate_dynamic
    from hdcal.motion.dynamic_problem import DynamicPosterior
    from hdcal.motion.respond import respond
    from hdcal.physics.chain import force
    from hdcal.physics.effect import Effect, Noise, Rows, parameter
    from hdcal.physics.registry import EFFECTS
    from hdcal.prediction.bands.predict import predict
    from hdcal.prediction.margin.margin import margin
    from hdcal.shared_causes.causes import causes
    from hdcal.tracking.tracker import Tracker

_HOMES = {
    "Case": "data.case",
    "Diagnosis": "diagnosis.result",
    "DynamicPosterior": "motion.dynamic_problem",
    "EFFECTS": "physics.registry",
    "Effect": "physics.effect",
    "Fleet": "fleets.result",
    "Gear": "data.case",
    "Geometry": "data.records",
    "HdcalError": "errors",
    "InputError": "errors",
    "ModelAverage": "inference.model_average",
    "Noise": "physics.effect",
    "NotUsable": "errors",
    "Posterior": "inference.posterior",
    "Prior": "data.priors",
    "Records": "data.records",
    "Rows": "physics.effect",
    "Tracker": "tracking.tracker",
    "calibrate": "calibration.calibrate",
    "calibrate_dynamic": "motion.dynamic_calibration",
    "causes": "shared_causes.causes",
    "compare": "comparison.compare",
    "diagnose": "diagnosis.diagnose",
    "fit": "classical.fit",
    "fleet": "fleets.fleet",
    "force": "physics.chain",
    "inverse_design": "design.inverse_design",
    "margin": "prediction.margin.margin",
    "parameter": "physics.effect",
    "predict": "prediction.bands.predict",
    "read_case": "data.reading",
    "residuals": "inference.force_model.residuals",
    "respond": "motion.respond",
    "study": "design.study",
    "summarise": "calibration.calibration",
    "wave_generator": "design.wave_generator",
}

__all__ = [*sorted(_HOMES)]


def __getattr__(name: str):
    if name not in _HOMES:
        raise AttributeError(f"module 'hdcal' has no attribute {name!r}")
    return getattr(import_module(f"hdcal.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
