"""Write a gear file: what is known of a gear and of its readings, as TOML."""

import json
from collections.abc import Iterator, Mapping

_LONGEST = 200


def gear_text(
    gear: Mapping[str, str | float],
    measurement: Mapping[str, str | float],
    columns: Mapping[str, str],
) -> str:
    """Return the text of a gear file."""
    tables = {"gear": gear, "measurement": measurement, "columns": columns}
    return "\n".join(
        line for name, rows in tables.items() for line in _table(name, rows)
    )


def _table(name: str, rows: Mapping[str, str | float]) -> Iterator[str]:
    if not rows:
        return
    yield f"[{name}]"
    for key, value in rows.items():
        # A text in TOML's quotes is written as in JSON.
        if key == "name":
            # Of a file, whose name may hold anything; the schema takes so many letters.
            value = "".join(c for c in str(value) if c.isprintable())[:_LONGEST]
        yield f"{key} = {json.dumps(value, ensure_ascii=False)}"
    yield ""
