"""Checks of tables by pydantic, and the translation of its errors into findings."""

from collections.abc import Iterator
from typing import Any, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from hdcal.data.findings import did_you_mean
from hdcal.data.gear_file.toml_file import TomlFile
from hdcal.data.plausible import out_of_range, range_of
from hdcal.errors import Finding, InputError

M = TypeVar("M", bound=BaseModel)
STRICT = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)
_FAULT = "fault"
_EXAMPLES = {
    "gear": "[gear]",
    "measurement": "[measurement]",
    "priors": "[priors]",
    "name": 'name = "XB1-100-80"',
    "material": 'material = "steel"',
    "force_calibration": "force_calibration = { expanded_percent = 0.5, k = 2 }",
    "deformation_calibration": "deformation_calibration = { expanded_mm = 0.002 }",
    "temperature_calibration": "temperature_calibration = { expanded_K = 1.0 }",
    "range": 'range = "10%:40%"',
}


def fault(problem: str, remedy: str) -> PydanticCustomError:
    """Return the error that a validator raises, with its remedy."""
    context = {"problem": problem, "remedy": remedy}
    return PydanticCustomError(_FAULT, "{problem}", context)


def within(quantity: str) -> AfterValidator:
    """Return the constraint of a number to a range: a key of `RANGES` or `NAMES`."""

    def check(number: float) -> float:
        for finding in out_of_range("", number, range_of(quantity)):
            raise fault(finding.problem, finding.remedy)
        return number

    return AfterValidator(check)


def checked(
    kind: type[M], data: Any, toml: TomlFile, key: str = "", context: Any = None
) -> M:
    """Return the table at a dotted key of a file as a model, or raise InputError."""
    try:
        return kind.model_validate(data, context=context)
    except ValidationError as error:
        raise InputError(
            toml.finding(problem, remedy, ".".join(filter(None, [key, *place])))
            for place, problem, remedy in _faults(error, kind)
        ) from None


def requested(kind: type[M], context: Any, **given: Any) -> M:
    """Return the request that parameters make, or raise InputError."""
    try:
        return kind.model_validate(given, context=context)
    except ValidationError as error:
        every = _faults(error, kind)
        findings = [Finding(place[0], problem, how) for place, problem, how in every]
        raise InputError(dict.fromkeys(findings)) from None


def _faults(
    error: ValidationError, kind: type[BaseModel]
) -> Iterator[tuple[list[str], str, str]]:
    for details in error.errors():
        place = [str(part) for part in details["loc"]]
        yield place, *_words(dict(details), place, kind)


def _words(error: dict, place: list[str], model: Any) -> tuple[str, str]:
    """Return problem and remedy of an error of pydantic at a key of a model."""
    name = place[-1] if place else ""
    example = _EXAMPLES.get(name, f"{name} = … (a number)")
    match error["type"]:
        case "fault":
            return error["ctx"]["problem"], error["ctx"]["remedy"]
        case "extra_forbidden":
            for key in place[:-1]:
                annotation = model.model_fields[key].annotation
                # A table that may be missing is "this one, or nothing".
                model = next(iter(get_args(annotation)), annotation)
            return "unknown key", did_you_mean(name, [*model.model_fields])
        case "missing":
            return "is missing", f"Add it: {example}"
        case "literal_error":
            known = error["ctx"]["expected"].replace(" or ", ", ").split(", ")
            names = [name.strip("'") for name in known]
            remedy = did_you_mean(str(error["input"]), names)
            return f"unknown choice '{error['input']}'", remedy
    return error["msg"][:1].lower() + error["msg"][1:], f"Write it like {example}"
