"""From bytes to text, checked while the bytes stream in."""

import codecs
import hashlib
from pathlib import Path

from hdcal.data.array_files import HDF5, MATLAB, PARQUET, read_arrays
from hdcal.data.findings import FileFindings
from hdcal.data.regular_file import why_not_readable
from hdcal.data.workbook import MARK, read_sheet

CHUNK = 1 << 18
LONGEST_LINE = 1 << 20
LARGEST_FILE = 1 << 32

# Encodings that test machines write beside Unicode: Western Europe, China, Japan.
_ENCODINGS = ("cp1252", "gb18030", "cp932")
# Signs and letters of Western languages; Chinese read as cp1252 has others.
_WESTERN = {*"°µ²³äöüßÄÖÜéèêëàâçùûîïôÉÈÊÀÇ"}
# What is not ASCII tells, in so many lines of it.
_JUDGED = 50
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(
    path: Path,
    findings: FileFindings,
    encoding: str | None = None,
    sheet: str | None = None,
) -> tuple[bytes, str, str]:
    """Read a text file, refusing what is no text before it fills the memory.

    Of a workbook a sheet is read as text.

    Args:
        path: where it is.
        findings: of the file.
        encoding: of the text; by default UTF-8, UTF-16 with its mark, or what it looks
            like.
        sheet: of a workbook; by default the one with readings.

    Returns:
        The text as UTF-8, without byte-order mark, each line ended by one newline;
        the hash of the file's own bytes; and what was guessed, in words.

    Raises:
        InputError: missing, unreadable, a folder, binary, or a line over 1 MiB.
    """
    if (why := why_not_readable(path, LARGEST_FILE)) is not None:
        findings.refuse(*why)
    try:
        if (held := _of_program(path, findings, encoding, sheet)) is not None:
            return held
        raw = _stream(path, findings, wide=encoding is not None)
    except FileNotFoundError:
        findings.refuse("does not exist", "Check the name and the folder")
    except PermissionError:
        findings.refuse("may not be read", "Give yourself the permission to read it")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        findings.refuse(f"cannot be read ({reason})", "Check the name and the disk")
    utf8, guessed = _as_utf8(raw, findings, encoding)
    if b"\r" in utf8:
        utf8 = utf8.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    note = f"the text is {guessed}. If not, name it: --encoding NAME" if guessed else ""
    return utf8, hashlib.sha256(raw).hexdigest(), note


def text_of(path: Path, sheet: str | None = None) -> bytes:
    """Return the bytes of a text file as they are, of any other the text in it.

    Args:
        path: of a file that `read_text` reads.
        sheet: of a workbook, as in `read_text`.
    """
    found = _of_program(path, FileFindings(str(path)), None, sheet)
    return path.read_bytes() if found is None else found[0]


def _of_program(
    path: Path, findings: FileFindings, encoding: str | None, sheet: str | None
) -> tuple[bytes, str, str] | None:
    """Return a workbook's sheet, or a file of arrays, as text; None of other files."""
    if _begins_with(path, MARK):
        if encoding is not None:
            findings.refuse("is a workbook, which has no `encoding`", "Leave it out")
        return read_sheet(path, findings, sheet)
    for kind in (PARQUET, MATLAB, HDF5):
        if _begins_with(path, kind):
            if encoding is not None or sheet is not None:
                words = "holds arrays, without `encoding` or `sheet`"
                findings.refuse(words, "Leave it out")
            return read_arrays(path, findings, kind)
    if sheet is not None:
        findings.refuse("is no workbook, and has no `sheet`", "Leave it out")
    return None


def _begins_with(path: Path, mark: bytes) -> bool:
    with open(path, "rb") as stream:
        return stream.read(len(mark)) == mark


def _stream(path: Path, findings: FileFindings, *, wide: bool) -> bytes:
    """The bytes; gives up at the first sign that this is not a table.

    A text that is `wide` may hold zeros.
    """
    kept, line, row, size = [], 0, 1, 0
    with open(path, "rb") as stream:
        while chunk := stream.read(CHUNK):
            if not kept:
                wide = wide or chunk.startswith(_WIDE_MARKS)
            if not wide and b"\0" in chunk:
                findings.refuse("is a binary file", "Save it as UTF-8 text")
            last = max(chunk.rfind(b"\n"), chunk.rfind(b"\r"))
            line = line + len(chunk) if last < 0 else len(chunk) - last - 1
            if line > LONGEST_LINE:
                row += sum(part.count(b"\n") for part in kept)
                words = "has a line of more than 1 MiB, so it is no table of readings"
                findings.refuse(words, "Write one row of readings per line", row)
            size += len(chunk)
            if size > LARGEST_FILE:
                remedy = "Split or thin out the readings"
                findings.refuse("is larger than 4 GiB", remedy)
            kept.append(chunk)
    return b"".join(kept)


def _as_utf8(
    raw: bytes, findings: FileFindings, encoding: str | None
) -> tuple[bytes, str]:
    """Return the text as UTF-8, and the encoding that was guessed."""
    if encoding is not None:
        return _decoded(raw, findings, encoding), ""
    if raw.startswith(_WIDE_MARKS):
        return _decoded(raw, findings, "utf-16"), ""
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        guessed = _looks_like(raw)
        return _decoded(raw, findings, guessed), guessed
    return raw.removeprefix(codecs.BOM_UTF8), ""


def _decoded(raw: bytes, findings: FileFindings, encoding: str) -> bytes:
    try:
        utf8 = raw.decode(encoding).encode()
    except LookupError:
        remedy = "Name one that Python knows, such as cp1252 or gb18030"
        findings.refuse(f"the `encoding` '{encoding}' is unknown", remedy)
    except UnicodeError:
        remedy = "Save it as UTF-8 text, or say its `encoding`"
        findings.refuse(f"is broken {encoding.upper()} text", remedy)
    if b"\0" in utf8:
        findings.refuse("is a binary file", "Save it as UTF-8 text")
    return utf8.removeprefix(codecs.BOM_UTF8)


def _looks_like(raw: bytes) -> str:
    """Return the likeliest encoding of a text that is not UTF-8."""
    # Degrees and micrometres alone look like Chinese to whoever counts letters.
    signs = raw.decode("cp1252", errors="replace")
    if {sign for sign in signs if not sign.isascii()} <= _WESTERN:
        return "cp1252"
    import charset_normalizer

    lines = [line for line in raw.splitlines() if not line.isascii()]
    found = charset_normalizer.from_bytes(
        b"\n".join(lines[:_JUDGED]), cp_isolation=list(_ENCODINGS)
    ).best()
    return found.encoding if found is not None else _ENCODINGS[0]
