"""Calibration certificates of the rig's gauges: what they state, and as priors.

A gain is an error in proportion to the reading, a zero one that all readings share:
no row shows them. The zero of the deformation is where the rig touches the gear: to the
error of finding that point a displacement gauge adds its own.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, model_validator

from hdcal.data.gear_file.validation import STRICT, fault, within
from hdcal.data.prior import Prior

_K = 2.0  # coverage factor where none is stated
# Sites of the model that are there where a certificate states them, with their unit.
GAINS = ("force_gain", "deformation_gain")
ZEROS = ("force_offset", "deformation_offset")
GAUGE_UNITS = {**dict.fromkeys(GAINS, "1"), "temperature_offset": "K"}
_UNITS = GAUGE_UNITS | {"force_offset": "N", "deformation_offset": "mm"}
_SOURCE = "certificate: "

_Percent = Annotated[float, within("expanded_percent")]


class GaugeCertificate(BaseModel):
    """What every certificate may state: k is the coverage factor."""

    model_config = STRICT
    SITES: ClassVar[dict[str, str]]  # site of the model of each key
    k: Annotated[float, within("k")] | None = None

    @property
    def stated(self) -> dict[str, Any]:
        """What is given, by key, without k."""
        return self.model_dump(exclude_none=True, exclude={"k"})

    @model_validator(mode="after")
    def _states_something(self) -> Self:
        if not self.stated:
            remedy = f"State one of {', '.join(self.SITES)}"
            raise fault("states no uncertainty", remedy)
        return self


class ForceCertificate(GaugeCertificate):
    """The certificate of the force gauge."""

    SITES: ClassVar = {"expanded_percent": "force_gain", "expanded_N": "force_offset"}
    expanded_percent: _Percent | None = None
    expanded_N: Annotated[float, within("expanded_N")] | None = None


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
    for certificate in given.values():
        for key, value in certificate.stated.items():
            site, k = certificate.SITES[key], certificate.k or _K
            sd = value / k * (0.01 if _UNITS[site] == "1" else 1.0)
            source = f"{_SOURCE}{key} = {value}, k = {k:g}"
            priors[site] = Prior("normal", (0.0, sd), _UNITS[site], source)
    return priors


def contact_as_read(contact: Prior, gauge: Prior) -> Prior:
    """Return the prior of the deformation that is read at first contact."""
    if contact.family not in ("normal", "fixed"):
        return contact
    middle, own = (*map(float, contact.numbers), 0.0)[:2]
    sd = math.hypot(own, float(gauge.numbers[1]))
    source = f"{gauge.source}; contact: {contact.source}"
    return Prior("normal", (middle, sd), gauge.unit, source)
