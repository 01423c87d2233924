"""Whatever the bytes: a case or an InputError, nothing else."""

import math

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdcal.data.reading import read_case
from hdcal.errors import InputError

FUZZ = settings(
    max_examples=100,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

HEADERS = st.sampled_from(
    ["deformation_mm", "force_N", "force_kgf", "time_s", "run", "specimen", "angle_deg",
     "temperature_K", "force_sd_N", "force", "x", "", '"', "deformation_"]
)  # fmt: skip
CELLS = st.one_of(
    st.floats().map(str),
    st.integers(-5, 5).map(str),
    st.sampled_from(["", " ", "1,5", "1.5", '"', '"1"', "1e400", "\t", "\r", "é", "²"]),
    st.text(max_size=4),
)


def attempt(folder, raw=None, **options):
    if raw is not None:
        (folder / "data.csv").write_bytes(raw)
    try:
        case = read_case(folder, **options)
    except InputError as error:
        assert error.findings
        assert str(error)
        return
    records = case.records
    assert records.force.size >= 5
    for name in ("deformation", "force", "time", "rate", "temperature", "direction"):
        assert all(math.isfinite(number) for number in getattr(records, name))
    assert set(records.direction) <= {-1.0, 0.0, 1.0}
    assert set(records.sense) <= {-1.0, 1.0}


@FUZZ
@given(st.binary(max_size=300))
def test_random_bytes(folder, raw):
    attempt(folder, raw)
    attempt(folder, b"deformation_mm,force_N\n" + raw)


@FUZZ
@given(st.data(), st.sampled_from(",;\t"), st.sampled_from(["\n", "\r\n", "\r"]))
def test_random_tables(folder, data, separator, end):
    headers = data.draw(st.lists(HEADERS, min_size=1, max_size=5))
    width = len(headers)
    row = st.lists(CELLS, min_size=max(1, width - 1), max_size=width + 1)
    rows = data.draw(st.lists(row, max_size=9))
    text = end.join(separator.join(cells) for cells in [headers, *rows])
    attempt(folder, text.encode("utf-8", "surrogatepass"))


@FUZZ
@given(
    st.lists(
        st.tuples(*[st.floats(-1, 1) | st.floats(allow_nan=False)] * 3), max_size=12
    )
)
def test_random_numbers(folder, rows):
    lines = ["deformation_mm,force_N,time_s"]
    lines += [",".join(map(str, row)) for row in rows]
    attempt(folder, "\n".join(lines).encode())


VALUES = st.sampled_from(
    ["1", "-1", "0", "nan", "inf", "true", '"x"', '"steel"', '"cup"', "[]", "{}",
     "1e308", "9" * 400, "1979-05-27",
     "{ family = 'normal', mean = 1, sd = 1, unit = 'GPa' }",
     "{ family = 'beta', a = 1, b = 2, unit = 'mm' }", "{ family = [] }", "[[1], [2]]",
     "{ family = 'lognormal', median = 1e300, log_sd = 1e300, unit = 'GPa' }",
     "{ a = { family = 'fixed', value = 1 } }", "{ a.b.c.d = 1 }", '"../x.toml"',
     "{ family = 'fixed', value = 1e300, unit = '1e99*1e99' }", '"\\u0000.toml"']
)  # fmt: skip
KEYS = st.sampled_from(
    ["gear", "measurement", "priors", "gear.name", "gear.wall_thickness_mm",
     "gear.radius_mm", "gear.length_mm", "gear.material", "gear.theory",
     "gear.load_height_mm", "measurement.deformation", "measurement.x",
     "measurement.force_resolution_N", "priors.K", "priors.E0", "priors.alpha",
     "priors.sigma", "priors.gap_sd", "priors.x", "priors.x.y", 'priors."x.y"', "''"]
)  # fmt: skip


@FUZZ
@given(st.lists(st.tuples(KEYS, VALUES), max_size=5), st.booleans())
def test_random_gear_values(folder, pairs, complete):
    text = "".join(f"{key} = {value}\n" for key, value in pairs)
    if complete:
        text += "gear.wall_thickness_mm = 1\ngear.radius_mm = 9\ngear.length_mm = 1\n"
    (folder / "gear.toml").write_text(text)
    attempt(folder)
