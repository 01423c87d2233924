"""From bytes to lines of text, checked while the bytes stream in."""

import codecs
import re
from pathlib import Path

from hdcal.data.findings import FileFindings

LONGEST_LINE = 1 << 20
LARGEST_FILE = 1 << 32
_CHUNK = 1 << 18
# Encodings that test machines write beside Unicode: Western Europe, China, Japan.
_ENCODINGS = ("cp1252", "gb18030", "cp932")
# Signs and letters of Western languages; Chinese read as cp1252 has others.
_WESTERN = {*"°µ²³·–äöüßÄÖÜéèêëàâçùûîïôÉÈÊÀÇñóíá"}
# Lines beyond ASCII by which the encoding is judged.
_JUDGED = 50
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_HTML = re.compile(
    r"\s*<(!doctype html|html|table|head|body|\?xml[^>]*>\s*<html)", re.I
)


def read_bytes(path: Path, findings: FileFindings, *, wide: bool) -> bytes:
    """Return the bytes of a text; give up at the first sign that it is no table.

    Args:
        path: of the file.
        findings: of the file.
        wide: the text may hold zeros.

    Raises:
        InputError: the file is binary, too large, or has a line over 1 MiB.
    """
    kept, line, row, size = [], 0, 1, 0
    with open(path, "rb") as stream:
        while chunk := stream.read(_CHUNK):
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


def decode(
    raw: bytes, findings: FileFindings, encoding: str | None
) -> tuple[str, list[str]]:
    """Return a text with plain newlines, and what was assumed of its encoding.

    Args:
        raw: the bytes.
        findings: of the file.
        encoding: by default UTF-8, UTF-16 with its mark, or what the bytes look like.

    Raises:
        InputError: they are no text in it, or a web page.
    """
    likely = encoding or _likely(raw)
    try:
        text = raw.decode(likely)
    except LookupError:
        remedy = "Name one that Python knows, such as cp1252 or gb18030"
        findings.refuse(f"the `encoding` '{encoding}' is unknown", remedy)
    except UnicodeError:
        remedy = "Save it as UTF-8 text, or say its `encoding`"
        findings.refuse(f"is broken {likely.upper()} text", remedy)
    if "\0" in text:
        findings.refuse("is a binary file", "Save it as UTF-8 text")
    if _HTML.match(text[:1000]):
        words = "is a web page (HTML), whatever its name says"
        findings.refuse(words, "Open it in a spreadsheet, save it as .xlsx or CSV")
    text = text.removeprefix("\ufeff")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if encoding or likely in ("utf-8", "utf-16"):
        return text, []
    return text, [f"the text is {likely}. If not, name it: --encoding NAME"]


def _likely(raw: bytes) -> str:
    """Return the likeliest encoding of a text."""
    if raw.startswith(_WIDE_MARKS):
        return "utf-16"
    try:
        raw.decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
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
