"""What is public about a set, and the one hash that promises it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hdcal.blind.canonical import Broken, canonical, digest

SET_SCHEMA, FIRST_SCHEMA = "hdcal.blind/2", "hdcal.blind/1"
# Names become files: nothing that could climb out of a folder or hide in one.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
HASH = re.compile(r"[0-9a-f]{64}")


def is_name(text: Any) -> bool:
    """Tell whether a text can name a case or a diagnoser."""
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


@dataclass(frozen=True)
class Entry:
    """What is public about one case.

    Attributes:
        case: its name.
        sha256: hash of its data.
        commitment: to its label.
        library: effects to leave out, `minus:NAME[,NAME]`; empty for none.
    """

    case: str
    sha256: str
    commitment: str
    library: str = ""


@dataclass(frozen=True)
class Manifest:
    """What is public about a set.

    Attributes:
        cases: in the order of the set.
        gear_sha256: hash of the gear file.
        sealed_sha256: hash of the encrypted labels.
        versions: of the packages that made it.
        origin: commitment to mix and seed; None in a set of the first schema.
        material_sha256: hash of the material file; None where the gear names none.
    """

    cases: tuple[Entry, ...]
    gear_sha256: str
    sealed_sha256: str
    versions: dict[str, str]
    origin: str | None = None
    material_sha256: str | None = None

    @property
    def not_bound(self) -> tuple[str, ...]:
        """What the commitment of an older set does not promise."""
        return () if self.origin else ("mix", "seed", "version")

    @property
    def commitment(self) -> str:
        """Hash that promises data, gear and labels of the whole set, and their origin.

        Of the packages only hdcal itself is promised: others may draw the same cases.
        """
        promised = {"cases": self.cases, "gear_sha256": self.gear_sha256}
        if self.origin is not None:
            promised |= {
                "schema": SET_SCHEMA,
                "case_count": len(self.cases),
                "material_sha256": self.material_sha256,
                "origin": self.origin,
                "version": self.versions["hdcal"],
            }
        return digest(canonical(promised))

    def plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        first = self.origin is None
        found = {"schema": FIRST_SCHEMA if first else SET_SCHEMA, **asdict(self)}
        if first:
            del found["origin"], found["material_sha256"]
        return {**found, "commitment": self.commitment}

    @classmethod
    def from_plain(cls, data: Mapping[str, Any]) -> "Manifest":
        """Return the manifest of plain data.

        Raises:
            Broken: it is none, or was changed since its hash was taken.
        """
        rest = {k: v for k, v in data.items() if k not in ("schema", "commitment")}
        try:
            cases = tuple(Entry(**entry) for entry in rest.pop("cases"))
            found = cls(cases, **rest)
            check_names([entry.case for entry in cases])
            _check_types(found)
            plain = found.plain()
            if plain.keys() != data.keys():
                raise KeyError
        except (AttributeError, KeyError, TypeError):
            raise Broken("lacks something that every set has, or holds more") from None
        if any(plain[key] != data[key] for key in ("schema", "commitment")):
            raise Broken("was changed: its commitment is not that of its content")
        return found


def _check_types(found: Manifest) -> None:
    """Refuse what no maker writes.

    Raises:
        Broken: a hash, a library or a version is none.
        AttributeError, KeyError: there is no version of hdcal.
    """
    hashes = [found.gear_sha256, found.sealed_sha256]
    hashes += [h for h in (found.origin, found.material_sha256) if h is not None]
    hashes += [h for e in found.cases for h in (e.sha256, e.commitment)]
    if not all(isinstance(h, str) and HASH.fullmatch(h) for h in hashes):
        raise Broken("holds something that is no SHA-256")
    if not all(isinstance(entry.library, str) for entry in found.cases):
        raise Broken("holds a library that is no text")
    versions = [found.versions["hdcal"], *found.versions.values()]
    if not all(isinstance(version, str) for version in versions):
        raise Broken("holds a version that is no text")


def check_names(names: Sequence[Any]) -> None:
    """Refuse names of cases that could not be files of their own.

    Raises:
        Broken: there is none, one is no name, or one comes twice.
    """
    if not names:
        raise Broken("holds no case")
    for name in names:
        if not is_name(name):
            raise Broken(f"holds {str(name)[:60]!r}, which cannot name a case")
    # Some file systems know no capitals.
    if len({name.casefold() for name in names}) < len(names):
        raise Broken("holds two cases of one name")
