"""The seal of the blind check: what is promised in public, and what stays secret.

Nothing here touches the disk. A set is promised by one hash: that of its cases, each
with the hash of its data and a commitment to its label, and of its gear file.
"""

import hashlib
import json
import re
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any

from cryptography.fernet import Fernet, InvalidToken

from hdcal.blind.label import Label

SET_SCHEMA, LABELS_SCHEMA = "hdcal.blind/1", "hdcal.blind-labels/1"
_SALT_BYTES = 16
# One label's length tells of what it holds; of a single case it would be seen.
_PADDING = 1 << 16
# Names become files: nothing that could climb out of a folder or hide in one.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
_HASH = re.compile(r"[0-9a-f]{64}")


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


def stamped(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return plain data with the hash of it as `sha256`."""
    return {**data, "sha256": digest(canonical(data))}


def is_stamped(data: Mapping[str, Any]) -> bool:
    """Tell whether `sha256` is the hash of everything else."""
    rest = {key: value for key, value in data.items() if key != "sha256"}
    return data.get("sha256") == digest(canonical(rest))


def is_name(text: Any) -> bool:
    """Tell whether a text can name a case or a diagnoser."""
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def new_salt() -> str:
    """Return what keeps a commitment from being guessed, in hexadecimal digits."""
    return secrets.token_hex(_SALT_BYTES)


def drawn_salt(seed: int, case: str) -> str:
    """Return the salt of a drawn case: whoever learns the seed can commit anew.

    The seed is as secret as the labels, which it makes.
    """
    return digest(canonical(["salt", seed, case]))[: 2 * _SALT_BYTES]


def commit(label: Label, salt: str, csv_sha256: str) -> str:
    """Return the commitment to one label: it tells nothing and binds its maker.

    Args:
        label: what is sealed.
        salt: 16 random bytes in hexadecimal digits.
        csv_sha256: hash of the case's data.

    Raises:
        Broken: the salt is none.
    """
    try:
        random = bytes.fromhex(salt)
    except (TypeError, ValueError):
        random = b""
    # Salt and hash have one length, so that no two triples give the same bytes.
    if len(random) != _SALT_BYTES or not _HASH.fullmatch(csv_sha256):
        raise Broken("holds a salt or a hash of the wrong length")
    return digest(random + canonical(label) + csv_sha256.encode())


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
    """

    cases: tuple[Entry, ...]
    gear_sha256: str
    sealed_sha256: str
    versions: dict[str, str]

    @property
    def commitment(self) -> str:
        """Hash that promises data, gear and labels of the whole set."""
        promised = {"cases": self.cases, "gear_sha256": self.gear_sha256}
        return digest(canonical(promised))

    def plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "schema": SET_SCHEMA,
            "commitment": self.commitment,
            **asdict(self),
        }

    @classmethod
    def from_plain(cls, data: Mapping[str, Any]) -> "Manifest":
        """Return the manifest of plain data.

        Raises:
            Broken: it is none, or was changed since its hash was taken.
        """
        try:
            cases = tuple(Entry(**entry) for entry in data["cases"])
            rest = data["gear_sha256"], data["sealed_sha256"], dict(data["versions"])
            promised = data["commitment"]
        except (KeyError, TypeError, ValueError):
            raise Broken("lacks something that every set has") from None
        hashes = [*rest[:2], *(h for e in cases for h in (e.sha256, e.commitment))]
        if not all(isinstance(h, str) and _HASH.fullmatch(h) for h in hashes):
            raise Broken("holds something that is no SHA-256")
        if not all(isinstance(entry.library, str) for entry in cases):
            raise Broken("holds a library that is no text")
        check_names([entry.case for entry in cases])
        found = cls(cases, *rest)
        if promised != found.commitment:
            raise Broken("was changed: its commitment is not that of its cases")
        return found


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


@dataclass(frozen=True)
class Sealed:
    """What is secret about a set.

    Attributes:
        mix: name of the mix; empty for a measurement.
        seed: whoever knows it can draw the same cases again.
        labels: in the order of the set.
        salts: of the commitments, in the same order.
    """

    mix: str
    seed: int
    labels: tuple[Label, ...]
    salts: tuple[str, ...]

    def plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        pairs = zip(self.salts, self.labels, strict=True)
        return {
            "schema": LABELS_SCHEMA,
            "mix": self.mix,
            "seed": self.seed,
            "labels": [{"salt": salt, "label": one} for salt, one in pairs],
        }


def new_key() -> bytes:
    """Return a random key."""
    return Fernet.generate_key()


def seal(secret: Sealed, key: bytes) -> bytes:
    """Return the secret, encrypted and authenticated."""
    text = canonical(secret.plain())
    return Fernet(key).encrypt(text + b" " * (-len(text) % _PADDING))


def unseal(token: bytes, key: bytes) -> Sealed:
    """Return what was sealed.

    Raises:
        Broken: the key is no key, or not the one it was sealed with.
    """
    try:
        lock = Fernet(key)
    except ValueError:
        raise Broken("is no key") from None
    try:
        data = json.loads(lock.decrypt(token))
        pairs = [(p["salt"], Label.from_plain(p["label"])) for p in data["labels"]]
        salts, labels = zip(*pairs, strict=True)
        found = Sealed(data["mix"], data["seed"], labels, salts)
        schema = data["schema"]
    except InvalidToken:
        raise Broken("is not the key of this set") from None
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError):
        raise Broken("opens what no blind check has sealed") from None
    if schema != LABELS_SCHEMA:
        raise Broken("opens what another version has sealed")
    return found


def check_labels(manifest: Manifest, secret: Sealed) -> None:
    """Hold what was sealed against what was promised.

    Raises:
        Broken: a label is not the one that was committed to.
    """
    promised = [entry.case for entry in manifest.cases]
    if [label.case for label in secret.labels] != promised:
        raise Broken("holds labels of other cases than the set")
    parts = zip(manifest.cases, secret.labels, secret.salts, strict=True)
    for entry, label, salt in parts:
        if commit(label, salt, entry.sha256) != entry.commitment:
            raise Broken(f"holds another label of '{entry.case}' than was promised")
        if library_of(label) != entry.library:
            raise Broken(f"withholds other effects from '{entry.case}' than the set")


def library_of(label: Label) -> str:
    """Return which effects a case leaves out, as `--library` reads it."""
    return "minus:" + ",".join(label.withheld) if label.withheld else ""
