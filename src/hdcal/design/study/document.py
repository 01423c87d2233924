"""The report of a study."""

from collections.abc import Sequence

from hdcal.design.document import HEADINGS, band, design_document, picture
from hdcal.design.sentences import as_known
from hdcal.design.sizes import named
from hdcal.design.study.answer import StudyAnswer
from hdcal.report.document import Document, Section, Table, Text
from hdcal.report.parameters import Interval
from hdcal.report.words import estimate, number, percent

# Rows of a study's table in a terminal and on the page; all are in study.csv.
_FIRST_ROWS, _MOST_ROWS = 40, 200
_STUDY = (
    "Median force with its band, or as a map over the first two sizes. Where more were "
    "varied, the others are at their middle value."
)


def study_headline(found: StudyAnswer) -> str:
    """Return what the study spans, in one sentence."""
    return as_known(found, _span(found))


def study_words(found: StudyAnswer) -> list[str]:
    """Return what the study spans."""
    return [_span(found), _bands(found)]


def _span(found: StudyAnswer) -> str:
    force = list(map(float, found.columns["force_median_N"]))
    least, most = min(force), max(force)
    varied = " and ".join(map(named, found.varied)) or "nothing"
    return (
        f"{len(force)} designs, varying {varied}: median force "
        f"{number(least, most - least)} … {number(most, most - least)} N."
    )


def _bands(found: StudyAnswer) -> str:
    return f"Bands are {percent(found.interval)} {found.interval_kind}s."


def study_document(found: StudyAnswer, command: str = "") -> Document:
    """Return the report of a study; its picture is called study."""
    sections = [picture("study", "Force", _STUDY), *_designs(found)]
    return design_document(found, "study", [_bands(found)], sections, command)


def _designs(found: StudyAnswer) -> list[Section]:
    """Return the designs in a table; of many, only the first are brief."""
    shown, same = _columns(found)
    numbers = [HEADINGS[name] for name in shown if name != "material"]
    numbers += ["force [N]", "band [N]", "stress [MPa]"]
    titles = ["material"] * ("material" in shown) + numbers
    count = len(found.columns["material"])
    rows = [_row(found, shown, row) for row in range(min(count, _MOST_ROWS))]

    def table(first: int, last: int) -> Table:
        return Table(titles, rows[first:last], frozenset(numbers))

    def cut(at: int) -> list[Text]:
        words = f"The first {at} of {count}; all are in study.csv."
        return [Text(words, soft=True)] if count > at else []

    words = f"Band: {band(found)}. Stress: hoop bending under the load, median."
    note = Text(words, soft=True)
    first = [*same, table(0, _FIRST_ROWS), note, *cut(_FIRST_ROWS)]
    sections = [Section("Designs", first, brief=True)]
    if count > _FIRST_ROWS:
        further = [table(_FIRST_ROWS, _MOST_ROWS), *cut(_MOST_ROWS)]
        sections.append(Section("Further designs", further))
    return sections


def _columns(found: StudyAnswer) -> tuple[list[str], list[Text]]:
    """Return the columns of the table, and above it what is the same in all rows."""
    given = [name for name in HEADINGS if name in found.columns]
    varied = found.varied or ("deformation_mm",)
    shown = [n for n in given if n in varied or len({*found.columns[n]}) > 1]
    told = []
    for name in given:
        if name not in shown:
            words, _, unit = HEADINGS[name].removesuffix("]").partition(" [")
            told.append(f"{words} {_cell(found.columns[name][0])} {unit}".rstrip())
    return shown, [Text(f"The same in all: {', '.join(told)}.")] if told else []


def _cell(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def _row(found: StudyAnswer, shown: Sequence[str], row: int) -> list[str]:
    columns = found.columns
    ends = (float(columns[f"force_{e}_N"][row]) for e in ("median", "lo", "hi"))
    stress = float(columns["stress_MPa"][row])
    texts = [_cell(columns[name][row]) for name in shown]
    most = max(map(float, columns["stress_MPa"]))
    return [*texts, *estimate(Interval(*ends)), number(stress, 0.1 * most)]
