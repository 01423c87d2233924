"""Chart of a study: the force over the size that was varied first."""

from typing import TYPE_CHECKING

import numpy as np

from hdcal.design.sizes import named
from hdcal.report.chart_spec import CYCLE, Band, Chart, Line, Mark, Panel, Points

if TYPE_CHECKING:
    from hdcal.design.study.study import Study


def study_chart(found: "Study") -> Chart:
    """Return the median force with its interval.

    There is a curve for each combination of what else was varied; of more than six only
    some. Materials alone have a point each.
    """
    columns = found.designs
    along = next((name for name in found.varied if name != "material"), None)
    if along is None:
        return Chart(panels=[_materials(found)])
    others = [name for name in found.varied if name != along]
    keys = list(zip(*(columns[name].tolist() for name in others), strict=True))
    keys = keys or [()] * len(columns[along])
    each = list(dict.fromkeys(keys))
    kept = np.linspace(0, len(each) - 1, min(len(each), len(CYCLE))).round().astype(int)
    marks: list[Mark] = []
    for key, colour in zip((each[place] for place in kept), CYCLE, strict=False):
        rows = np.array([row for row, one in enumerate(keys) if one == key])
        rows = rows[np.argsort(columns[along][rows], kind="stable")]
        x = columns[along][rows]
        middle, low, high = (one[rows] for one in _forces(found))
        label = ", ".join(map(_value, others, key)) or _interval(found)
        look = {"label": label, "x": x, "colour": colour}
        marks += [Band(low=low, high=high, **look), Line(y=middle, **look)]
    x_label = f"{named(along)} [{'°C' if along.endswith('_C') else 'mm'}]"
    title = _interval(found) if others else ""
    return Chart(panels=[Panel(title=title, x=x_label, y="force [N]", marks=marks)])


def _materials(found: "Study") -> Panel:
    middle, low, high = _forces(found)
    x, names = np.arange(1.0, len(middle) + 1.0), found.designs["material"].tolist()
    points = Points(label=_interval(found), x=x, y=middle, low=low, high=high)
    return Panel(x="material", y="force [N]", marks=[points], names=names)


def _forces(found: "Study") -> list[np.ndarray]:
    return [found.designs[f"force_{end}_N"] for end in ("median", "lo", "hi")]


def _interval(found: "Study") -> str:
    kind = found.interval_kind.removeprefix("equal-tailed ")
    return f"Median and {100.0 * found.interval:g} % {kind}"


def _value(name: str, value: float | str) -> str:
    if isinstance(value, str):
        return value
    return f"{named(name)} {value:g} {'°C' if name.endswith('_C') else 'mm'}"
