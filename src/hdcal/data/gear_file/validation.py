"""Checks of tables by pydantic, and the translation of its errors into findings."""

import re
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from hdcal.data.gear_file.toml_file import TomlFile, did_you_mean
from hdcal.data.plausible import out_of_range, range_of
from hdcal.errors import Findings

M = TypeVar("M", bound=BaseModel)
STRICT = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)
_FAULT = "fault"
_EXAMPLES = {
    "gear": "[gear]",
    "measurement": "[measurement]",
    "priors": "[priors]",
    "name": 'name = "XB1-100-80"',
    "material": 'material = "steel"',
    "theory": 'theory = "ring"',
    "deformation": 'deformation = "radial"',
    "force_calibration": "force_calibration = { expanded_percent = 0.5, k = 2 }",
    "deformation_calibration": "deformation_calibration = { expanded_mm = 0.002 }",
    "temperature_calibration": "temperature_calibration = { expanded_K = 1.0 }",
    "range": 'range = "10%:40%"',
    "family": 'family = "normal"',
}


def fault(problem: str, remedy: str) -> PydanticCustomError:
    """Return the error that a validator raises: its problem and its remedy."""
    context = {"problem": problem, "remedy": remedy}
    return PydanticCustomError(_FAULT, "{problem}", context)


def within(quantity: str) -> AfterValidator:
    """Return the constraint of a number to the range of a quantity.

    Args:
        quantity: a key of `RANGES` or `NAMES`.
    """
    known = range_of(quantity)

    def check(number: float) -> float:
        for found in out_of_range("", number, known):
            raise fault(found.problem, found.remedy)
        return number

    return AfterValidator(check)


def checked(
    kind: type[M] | TypeAdapter[M],
    data: Any,
    toml: TomlFile,
    key: str = "",
    context: Any = None,
    tagged: Mapping[str, type[M]] | None = None,
) -> M:
    """Return data as a model of pydantic.

    Args:
        kind: the model, or an adapter of a union of models.
        data: as parsed.
        toml: the file in which they stand.
        key: dotted key there; empty at the top.
        context: of the validators.
        tagged: the models of the union by their tags.

    Raises:
        InputError: holds everything that is wrong with the data.
    """
    adapted = isinstance(kind, TypeAdapter)
    validate = kind.validate_python if adapted else kind.model_validate
    try:
        return validate(data, context=context)
    except ValidationError as error:
        wrong = error.errors()
    with Findings() as findings:
        for one in wrong:
            place, model = [str(part) for part in one["loc"]], kind
            if tagged is not None:
                model = tagged[place.pop(0)] if place else kind
                place = place or ["family"]
            problem, remedy = _words(
                dict(one), place[-1] if place else key, model, place
            )
            at = ".".join(filter(None, [key, *place]))
            findings.append(toml.finding(problem, remedy, at))
    raise AssertionError


def _words(error: dict, name: str, model: Any, place: list[str]) -> tuple[str, str]:
    """Return problem and remedy of one of pydantic's errors."""
    kind, example = error["type"], _EXAMPLES.get(name, f"{name} = … (a number)")
    if kind == _FAULT:
        return error["ctx"]["problem"], error["ctx"]["remedy"]
    if kind == "extra_forbidden":
        return "unknown key", did_you_mean(name, _keys(model, place[:-1]))
    if kind in ("missing", "union_tag_not_found"):
        return "is missing", f"Add it: {example}"
    if kind in ("literal_error", "union_tag_invalid"):
        known = error["ctx"].get("expected") or error["ctx"]["expected_tags"]
        value = str(error["ctx"].get("tag", error["input"]))
        known = re.findall(r"'([^']+)'", known)
        return f"unknown choice '{value}'", did_you_mean(value, known)
    words = error["msg"][:1].lower() + error["msg"][1:]
    return words, f"Write it like {example}"


def _keys(model: Any, place: list[str]) -> list[str]:
    """Return the keys of the table at a place in a model."""
    for name in place:
        kind = model.model_fields[name].annotation
        # A table that may be missing is "this one, or nothing".
        model = next(iter(get_args(kind)), kind)
    return [*model.model_fields]
