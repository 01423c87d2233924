"""Calibration certificates of the rig's gauges: what they state, and as priors.

A gain is an error in proportion to the reading, a zero one that all readings share.
Neither averages out over rows, and no row shows it. The zero of a force gauge is the
zero of the force. The zero of the deformation is where the rig touches the gear: to
the error of finding that point a displacement gauge adds its own.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

from hdcal.data.prior import Prior
from hdcal.data.priors import MODEL_UNITS
from hdcal.data.typed_json import within

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

_Percent = Annotated[float, within("expanded_percent")]
# A class is a name, but 0.5 without quotation marks is meant as one.
_Named = BeforeValidator(lambda x: str(x) if type(x) in (int, float) else x)


class GaugeCertificate(BaseModel):
    """What every certificate may state."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False
    )
    k: Annotated[float, within("k")] | None = None

    def stated(self) -> dict[str, Any]:
        """Return what is given, by key, k left out."""
        given = self.model_dump(exclude_none=True)
        return {key: value for key, value in given.items() if key != "k"}


class ForceCertificate(GaugeCertificate):
    """Of the force gauge."""

    expanded_percent: _Percent | None = None
    expanded_N: Annotated[float, within("expanded_N")] | None = None
    iso376_class: Annotated[Literal["00", "0.5", "1", "2"], _Named] | None = None
    astm_e74_class: Literal["A", "AA"] | None = None


class DeformationCertificate(GaugeCertificate):
    """Of the displacement gauge."""

    expanded_percent: _Percent | None = None
    expanded_mm: Annotated[float, within("expanded_mm")] | None = None


class TemperatureCertificate(GaugeCertificate):
    """Of the thermometer."""

    expanded_K: Annotated[float, within("expanded_K")] | None = None


# Site that each key speaks of: gains and the temperature's zero are sites of their own,
# zeros of force and deformation are what the model has anyway.
_SITES = {
    "force_calibration": {
        "expanded_percent": "force_gain",
        "iso376_class": "force_gain",
        "astm_e74_class": "force_gain",
        "expanded_N": "force_offset",
    },
    "deformation_calibration": {
        "expanded_percent": "deformation_gain",
        "expanded_mm": "deformation_offset",
    },
    "temperature_calibration": {"expanded_K": "temperature_offset"},
}


_SOURCE = "certificate: "


def is_stated(prior: Prior) -> bool:
    """Tell whether a prior is one that a certificate states."""
    return prior.family == "normal" and prior.source.startswith(_SOURCE)


def certificate_faults(
    given: Mapping[str, GaugeCertificate],
) -> Iterator[tuple[str, str, str]]:
    """Yield what certificates cannot state: key, problem and remedy.

    Args:
        given: by their keys in [measurement].
    """
    for name, one in given.items():
        stated = one.stated()
        sites = [_SITES[name][key] for key in stated]
        if not stated:
            keys = list(_SITES[name])
            yield name, "states no uncertainty", f"Write one of {', '.join(keys)}"
        elif len(set(sites)) < len(sites):
            yield name, f"states one gain as {' and as '.join(stated)}", "Keep one"
        elif one.k is not None and stated.keys() <= CLASSES.keys():
            yield (
                f"{name}.k",
                "a class has a coverage factor of its own",
                "Leave it out",
            )


def certificate_priors(given: Mapping[str, GaugeCertificate]) -> dict[str, Prior]:
    """Return the priors that certificates state, by site, in code units.

    Args:
        given: by their keys in [measurement].
    """
    found = {}
    for name, one in given.items():
        for key, value in one.stated().items():
            of_class = key in CLASSES
            expanded = CLASSES[key][value] if of_class else value
            k = CLASS_K if of_class else one.k or CLASS_K
            gain = of_class or key == "expanded_percent"
            sd = expanded / k * (0.01 if gain else 1.0)
            source = f"{_SOURCE}{key} = {value}, k = {k:g}"
            site = _SITES[name][key]
            unit = GAUGE_UNITS.get(site) or MODEL_UNITS[site]
            found[site] = Prior("normal", (0.0, sd), unit, source)
    return found


def contact_as_read(contact: Prior, gauge: Prior) -> Prior:
    """Return the prior of the deformation that is read at first contact.

    Args:
        contact: prior of what is read there on a gauge without error [mm]. One that
            is neither normal nor fixed stays as it is.
        gauge: what the certificate of the gauge states [mm].
    """
    if contact.family not in ("normal", "fixed"):
        return contact
    middle, own = (*map(float, contact.numbers), 0.0)[:2]
    sd = math.hypot(own, float(gauge.numbers[1]))
    source = f"{gauge.source}; and of the contact: {contact.source}"
    return Prior("normal", (middle, sd), gauge.unit, source)
