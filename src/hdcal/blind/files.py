"""Files of a set: read by their declared size, and never believed unread."""

from pathlib import Path
from typing import Any

from hdcal.blind.canonical import digest
from hdcal.data.regular_file import why_not_readable
from hdcal.data.typed_json import parse_json
from hdcal.errors import Finding, InputError
from hdcal.report.plain import printable

# Sizes that are still read [bytes]: of any file, and of some kinds.
LARGEST, LARGEST_KEY = 1 << 30, 1 << 10
LARGEST_MANIFEST, LARGEST_ANSWER = 1 << 25, 1 << 20
GET_AGAIN = "Get the set again from whoever made it; this copy proves nothing"


def refusal(file: Path | str, problem: str, remedy: str) -> InputError:
    """Return what is wrong with one file as an error."""
    return InputError([Finding(printable(str(file)), printable(problem), remedy)])


def read_bytes(path: Path, remedy: str, largest: int = LARGEST) -> bytes:
    """Read a file.

    Args:
        path: the file.
        remedy: what to do where it cannot be.
        largest: size that is still read [bytes].

    Raises:
        InputError: it is missing, too large, or no file.
    """
    if (why := why_not_readable(path, largest)) is not None:
        raise refusal(path, why[0], remedy)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise refusal(path, "is missing", remedy) from None
    except (OSError, ValueError) as error:
        words = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise refusal(path, words, remedy) from None


def read_checked(path: Path, sha256: str) -> bytes:
    """Read a file of a set whose hash was promised.

    Raises:
        InputError: it is missing, or another one.
    """
    data = read_bytes(path, GET_AGAIN)
    if digest(data) != sha256:
        raise refusal(path, "was changed or is incomplete", GET_AGAIN)
    return data


def read_json(
    path: Path, schemas: str | tuple[str, ...], remedy: str, largest: int
) -> dict[str, Any]:
    """Read an object of one schema.

    Args:
        path: the file.
        schemas: what its `schema` has to be, or may be.
        remedy: what to do where it is not.
        largest: size that is still read [bytes].

    Raises:
        InputError: it is missing, too large, no JSON, or of another schema.
    """
    known = (schemas,) if isinstance(schemas, str) else schemas
    try:
        data = parse_json(read_bytes(path, remedy, largest))
    except ValueError:
        raise refusal(path, "is no JSON, or only half of it", remedy) from None
    if not isinstance(data, dict) or data.get("schema") not in known:
        words = f"is not of the schema {' or '.join(known)}"
        raise refusal(path, words, remedy)
    return data
