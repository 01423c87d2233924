"""A set of sealed cases on disk, and the file with the labels that opens it.

The set holds of each case its table and a commitment to its label, the SHA-256 of a
secret salt, the label and the hash of the table. The labels are in the key file, which
answering never reads. Salts follow from the seed in the key file, so that with the seed
anybody can make the same commitment again.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from benchmarks.blind.label import LABEL, Label
from hdcal.errors import Finding, InputError

SET, GEAR, CASES = "set.json", "gear.toml", "cases"
_STRICT = ConfigDict(extra="forbid")
# Names become files: none can lead out of a folder.
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,99}$")]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,99}\.toml$")]
Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
_ANOTHER_COPY = "Get the set again from whoever made it"


@dataclass(frozen=True, config=_STRICT)
class Entry:
    """The public part of one case.

    Attributes:
        case: its name.
        sha256: hash of its table.
        commitment: to its label.
        withheld: effects that it is answered without.
    """

    case: Name
    sha256: Hash
    commitment: Hash
    withheld: tuple[str, ...] = ()


@dataclass(frozen=True, config=_STRICT)
class Manifest:
    """The public part of a set.

    Attributes:
        cases: in the order of the set.
        files: hash of the gear file, and of a material file that it names.
        origin: commitment to mix and seed.
        version: of hdcal that made the set.
    """

    cases: tuple[Entry, ...]
    files: dict[FileName, Hash]
    origin: Hash
    version: str


@dataclass(frozen=True, config=_STRICT)
class Key:
    """The secret part of a set: origin and labels."""

    mix: str
    seed: int
    labels: tuple[Label, ...]


@dataclass(frozen=True)
class BlindSet:
    """A set whose files are those of its commitment."""

    folder: Path
    manifest: Manifest
    commitment: str

    def table(self, entry: Entry) -> Path:
        """Return the measurement file of a case."""
        return self.folder / CASES / f"{entry.case}.csv"

    @property
    def gear(self) -> Path:
        """The gear file."""
        return self.folder / GEAR


MANIFEST, KEY = TypeAdapter(Manifest), TypeAdapter(Key)


def refusal(file: Path | str, problem: str, remedy: str) -> InputError:
    """Return one finding about a file as an error."""
    return InputError([Finding(str(file), problem, remedy)])


def digest(data: bytes) -> str:
    """Return the SHA-256 of bytes in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def canonical(data: Any) -> bytes:
    """Return plain data as JSON in the one form that is hashed."""
    return json.dumps(
        data, sort_keys=True, separators=(",", ":"), allow_nan=False
    ).encode()


def write_hashed(path: Path, adapter: TypeAdapter, content: Any) -> str:
    """Write content with its hash, whole or not at all, and return the hash."""
    plain = adapter.dump_python(content, mode="json")
    sha256 = digest(canonical(plain))
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_text(json.dumps({"sha256": sha256, "content": plain}), "utf-8")
    os.replace(unfinished, path)
    return sha256


def read_hashed(path: Path, adapter: TypeAdapter) -> tuple[Any, str]:
    """Return content and its hash.

    Raises:
        InputError: the file is missing, malformed, or was changed.
    """
    plain = read_json(path, TypeAdapter(dict[str, Any]))
    content = plain.get("content")
    if plain.keys() != {"sha256", "content"} or plain["sha256"] != digest(
        canonical(content)
    ):
        raise refusal(path, "was changed: its hash does not fit", "Restore the file")
    return _validated(path, adapter.validate_python, content), plain["sha256"]


def read_json(path: Path, adapter: TypeAdapter) -> Any:
    """Return the content of a JSON file.

    Raises:
        InputError: the file is missing or malformed.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        words = f"cannot be read ({error.strerror})"
        raise refusal(path, words, "Give the file that the command wrote") from None
    return _validated(path, adapter.validate_json, data)


def _validated(path: Path, validate, data: Any) -> Any:
    try:
        return validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the file"
        words = f"is not what the blind check writes ({place}: {first['msg']})"
        raise refusal(path, words, "Restore the file") from None


def salt(seed: int, name: str) -> bytes:
    """Return the salt of a case, or with an empty name that of the origin."""
    return hashlib.sha256(canonical(["salt", seed, name])).digest()


def label_commitment(label: Label, seed: int, sha256: str) -> str:
    """Return the commitment to a label; `sha256` is the hash of the case's table."""
    plain = canonical(LABEL.dump_python(label, mode="json"))
    return digest(salt(seed, label.case) + plain + sha256.encode())


def origin_commitment(mix: str, seed: int) -> str:
    """Return the commitment to mix and seed."""
    return digest(salt(seed, "") + canonical({"mix": mix, "seed": seed}))


def write_set(
    folder: Path,
    key: Path,
    drawn: Iterable[tuple[bytes, Label]],
    files: dict[str, bytes],
    *,
    mix: str,
    seed: int,
    version: str,
) -> BlindSet:
    """Write a set, and its key to another place.

    Args:
        folder: to make.
        key: file to write, readable to its owner only.
        drawn: table and label of each case.
        files: the gear file, and a material file that it names.
        mix: name of the mix.
        seed: of the draws and the salts; secret.
        version: of hdcal.

    Raises:
        InputError: folder or key exist, or the key would lie in the folder.
    """
    for path in (folder, key):
        if path.exists():
            raise refusal(path, "exists already", "Name another place or move it away")
    if key.resolve().is_relative_to(folder.resolve()):
        raise refusal(key, "would lie in the set that it opens", "Name another place")
    building = folder.with_name(f".{folder.name}.unfinished")
    shutil.rmtree(building, ignore_errors=True)
    (building / CASES).mkdir(parents=True)
    entries, labels = [], []
    for table, label in drawn:
        (building / CASES / f"{label.case}.csv").write_bytes(table)
        promise = label_commitment(label, seed, digest(table))
        entries.append(Entry(label.case, digest(table), promise, label.withheld))
        labels.append(label)
    for name, content in files.items():
        (building / name).write_bytes(content)
    hashes = {name: digest(content) for name, content in files.items()}
    origin = origin_commitment(mix, seed)
    manifest = Manifest(tuple(entries), hashes, origin, version)
    commitment = write_hashed(building / SET, MANIFEST, manifest)
    # The key first: no set is complete without it.
    descriptor = os.open(key, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(KEY.dump_json(Key(mix, seed, tuple(labels))))
    os.replace(building, folder)
    return BlindSet(folder, manifest, commitment)


def read_set(folder: Path) -> BlindSet:
    """Read a set and verify all that is public.

    Raises:
        InputError: holds every file that is missing or was changed.
    """
    manifest, commitment = read_hashed(folder / SET, MANIFEST)
    found = BlindSet(folder, manifest, commitment)
    expected = {folder / name: sha256 for name, sha256 in manifest.files.items()}
    expected |= {found.table(entry): entry.sha256 for entry in manifest.cases}
    findings = [
        Finding(str(path), "is missing or was changed", _ANOTHER_COPY)
        for path, sha256 in expected.items()
        if not path.is_file() or digest(path.read_bytes()) != sha256
    ]
    if findings:
        raise InputError(findings)
    return found


def read_key(found: BlindSet, path: Path) -> Key:
    """Read the labels of a set and verify its commitments.

    Raises:
        InputError: the key is another set's, or a label is not the promised one.
    """
    key: Key = read_json(path, KEY)
    entries = found.manifest.cases
    if [label.case for label in key.labels] != [entry.case for entry in entries]:
        raise refusal(path, "labels other cases than the set", "Name the set's key")
    if origin_commitment(key.mix, key.seed) != found.manifest.origin:
        words = "holds another mix or seed than the set was committed to"
        raise refusal(path, words, "Name the set's key")
    for entry, label in zip(entries, key.labels, strict=True):
        promise = label_commitment(label, key.seed, entry.sha256)
        if promise != entry.commitment or label.withheld != entry.withheld:
            words = f"holds another label of '{entry.case}' than was committed to"
            raise refusal(path, words, "Nothing this set says can be trusted")
    return key
