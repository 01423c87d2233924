"""Plain data in the one form that is hashed, and hashes of it."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any


class Broken(ValueError):
    """Something is not what was sealed; one phrase says what."""


def canonical(data: Any) -> bytes:
    """Return plain data as JSON of which there is only one form.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(
        data,
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
        default=_known_to_json,
    ).encode()


def _known_to_json(value: Any) -> Any:
    # A dataclass, or else one of NumPy's numbers and arrays.
    return asdict(value) if is_dataclass(value) else value.tolist()  # type: ignore[arg-type]


def digest(data: bytes) -> str:
    """Return the SHA-256 of bytes in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def with_digest(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return plain data with the hash of it as `sha256`."""
    return {**data, "sha256": digest(canonical(data))}


def digest_agrees(data: Mapping[str, Any]) -> bool:
    """Tell whether `sha256` is the hash of everything else."""
    rest = {key: value for key, value in data.items() if key != "sha256"}
    return data.get("sha256") == digest(canonical(rest))
