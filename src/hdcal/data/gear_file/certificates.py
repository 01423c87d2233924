"""Calibration certificates of the rig's gauges: what they state, and as priors.

A gain is an error in proportion to the reading, a zero one that all readings share.
Neither averages out over rows, and no row shows it. The zero of a force gauge is the
zero of the force. The zero of the deformation is where the rig touches the gear: to
the error of finding that point a displacement gauge adds its own.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, BeforeValidator, model_validator

from hdcal.data.gear_file.validation import STRICT, fault, within
from hdcal.data.prior import Prior

# Relative expanded uncertainty [%], k = 2, of a force gauge of a class. ISO 376:2011:
# every component at the limit of its class, combined as its annex C does and rounded
# up. ASTM E74: a class A range begins at 400, AA at 2000 lower limit factors.
CLASSES = {
    "iso376_class": {"00": 0.09, "0.5": 0.18, "1": 0.35, "2": 0.65},
    "astm_e74_class": {"A": 0.25, "AA": 0.05},
}
CLASS_K = 2.0
# Sites of the model that are there where a certificate states them, with their unit.
GAINS = ("force_gain", "deformation_gain")
ZEROS = ("force_offset", "deformation_offset")
GAUGE_UNITS = {**dict.fromkeys(GAINS, "1"), "temperature_offset": "K"}
_UNITS = GAUGE_UNITS | {"force_offset": "N", "deformation_offset": "mm"}
_SOURCE = "certificate: "

_Percent = Annotated[float, within("expanded_percent")]
# A class is a name, but 0.5 without quotation marks is meant as one.
_Named = BeforeValidator(lambda x: str(x) if type(x) in (int, float) else x)


class GaugeCertificate(BaseModel):
    """What every certificate may state.

    Attributes:
        SITES: the site of the model of each key.
        k: coverage factor.
    """

    model_config = STRICT
    SITES: ClassVar[dict[str, str]]
    k: Annotated[float, within("k")] | None = None

    @property
    def stated(self) -> dict[str, Any]:
        """What is given, by key, without k."""
        return self.model_dump(exclude_none=True, exclude={"k"})

    @model_validator(mode="after")
    def _states_each_site_once(self) -> Self:
        stated = self.stated
        if not stated:
            keys = ", ".join(self.SITES)
            raise fault("states no uncertainty", f"Write one of {keys}")
        if len({self.SITES[key] for key in stated}) < len(stated):
            raise fault(f"states one gain as {' and as '.join(stated)}", "Keep one")
        if self.k is not None and stated.keys() <= CLASSES.keys():
            raise fault("a class has a coverage factor of its own", "Leave k out")
        return self


class ForceCertificate(GaugeCertificate):
    """The certificate of the force gauge."""

    SITES: ClassVar = {
        "expanded_percent": "force_gain",
        "iso376_class": "force_gain",
        "astm_e74_class": "force_gain",
        "expanded_N": "force_offset",
    }
    expanded_percent: _Percent | None = None
    expanded_N: Annotated[float, within("expanded_N")] | None = None
    iso376_class: Annotated[Literal["00", "0.5", "1", "2"], _Named] | None = None
    astm_e74_class: Literal["A", "AA"] | None = None


class DeformationCertificate(GaugeCertificate):
    """The certificate of the displacement gauge."""

    SITES: ClassVar = {
        "expanded_percent": "deformation_gain",
        "expanded_mm": "deformation_offset",
    }
    expanded_percent: _Percent | None = None
    expanded_mm: Annotated[float, within("expanded_mm")] | None = None


class TemperatureCertificate(GaugeCertificate):
    """The certificate of the thermometer."""

    SITES: ClassVar = {"expanded_K": "temperature_offset"}
    expanded_K: Annotated[float, within("expanded_K")] | None = None


def is_stated(prior: Prior) -> bool:
    """Tell whether a prior is one that a certificate states."""
    return prior.family == "normal" and prior.source.startswith(_SOURCE)


def certificate_priors(given: Mapping[str, GaugeCertificate]) -> dict[str, Prior]:
    """Return the priors that certificates state, by site, in code units."""
    priors = {}
    for one in given.values():
        for key, value in one.stated.items():
            expanded, k, unit = value, one.k or CLASS_K, _UNITS[one.SITES[key]]
            if key in CLASSES:
                expanded, k = CLASSES[key][value], CLASS_K
            sd = expanded / k * (0.01 if unit == "1" else 1.0)
            source = f"{_SOURCE}{key} = {value}, k = {k:g}"
            priors[one.SITES[key]] = Prior("normal", (0.0, sd), unit, source)
    return priors


def contact_as_read(contact: Prior, gauge: Prior) -> Prior:
    """Return the prior of the deformation that is read at first contact."""
    if contact.family not in ("normal", "fixed"):
        return contact
    middle, own = (*map(float, contact.numbers), 0.0)[:2]
    sd = math.hypot(own, float(gauge.numbers[1]))
    source = f"{gauge.source}; and of the contact: {contact.source}"
    return Prior("normal", (middle, sd), gauge.unit, source)
