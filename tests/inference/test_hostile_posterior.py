"""A posterior file from a stranger is refused by what it declares, unread."""

import json
import os
import shutil
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from posteriors import batch
from trees import arrays_of

from hdcal.data.typed_json import typed, typed_text
from hdcal.errors import InputError
from hdcal.inference import posterior_file
from hdcal.inference.held import HeldCase, HeldModel, HeldSettings
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import open_tree


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("honest") / "posterior.nc"
    batch(3, 20).save(path)
    return path


def bomb(file: h5py.File) -> None:
    """Nine gigabytes of zeros in some kilobytes."""
    size, chunk = 9 << 27, 1 << 20
    held = file.create_dataset(
        "posterior/many", (size,), "f8", chunks=(chunk,), compression="gzip"
    )
    held[:chunk] = 0.0


def unwritten(file: h5py.File) -> None:
    file.create_dataset("posterior/many", (1 << 40,), "f8")


def loop(file: h5py.File) -> None:
    file["posterior/again"] = file["/"]


def twice(file: h5py.File) -> None:
    file["posterior/again"] = file["posterior/K"]


def soft_link(file: h5py.File) -> None:
    file["posterior/again"] = h5py.SoftLink("/posterior")


def external_link(file: h5py.File) -> None:
    file["posterior/again"] = h5py.ExternalLink("other.nc", "/")


def external_data(file: h5py.File) -> None:
    file.create_dataset("posterior/x", (4,), "f8", external=[("/etc/passwd", 0, 32)])


def virtual_data(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource("other.nc", "x", (4,))
    file.create_virtual_dataset("posterior/x", layout)


def lists(file: h5py.File) -> None:
    file.create_dataset("posterior/x", (4,), h5py.vlen_dtype("f8"))


def records(file: h5py.File) -> None:
    file.create_dataset("posterior/x", (4,), [("a", "f8"), ("b", "i4")])


def references(file: h5py.File) -> None:
    file["posterior"].attrs["x"] = file["posterior/K"].ref


def named_type(file: h5py.File) -> None:
    file["posterior/x"] = np.dtype("f8")


def absurd_chunk(file: h5py.File) -> None:
    file.create_dataset("posterior/x", (4,), "f8", maxshape=(None,), chunks=(1 << 28,))


def one_long_text(file: h5py.File) -> None:
    """The same megabyte, named ten thousand times."""
    text = file.create_dataset("posterior/x", (10_000,), h5py.string_dtype())
    text[:] = ["x" * 20_000] * 10_000


def many_texts_in_an_attribute(file: h5py.File) -> None:
    """Each may be the same long one: what HDF5 reads it reads whole."""
    texts = np.full(1000, "x", object)
    file["posterior"].attrs.create("x", texts, dtype=h5py.string_dtype())


def long_attributes(file: h5py.File) -> None:
    for index in range(68):
        file["posterior"].attrs[f"x{index}"] = f"{index}" + "x" * (1 << 20)


def texts_in_a_large_chunk(file: h5py.File) -> None:
    """Unpacked anew for every text that is read, as it fits no cache."""
    text = file.create_dataset(
        "posterior/x",
        (200,),
        h5py.string_dtype(),
        chunks=(1 << 20,),
        maxshape=(None,),
        compression="gzip",
    )
    text[0] = "a"


def one_chunk_of_much_more(file: h5py.File) -> None:
    """Eight numbers are declared; HDF5 unpacks all that is there."""
    packed = zlib.compressobj(9)
    zeros = b"".join(packed.compress(bytes(1 << 24)) for _ in range(8))
    chunk = {"chunks": (8,), "compression": "gzip"}
    held = file.create_dataset("posterior/x", (8,), "f8", **chunk)
    held.id.write_direct_chunk((0,), zeros + packed.flush())


def axes_of_many_scales(file: h5py.File) -> None:
    scale = file["posterior/chain"].ref
    many = np.empty(2, object)
    many[:] = [np.array([scale] * 1000, h5py.ref_dtype)] * 2
    kind = h5py.vlen_dtype(h5py.ref_dtype)
    del file["posterior/K"].attrs["DIMENSION_LIST"]
    file["posterior/K"].attrs.create("DIMENSION_LIST", many, dtype=kind)


def texts_in_place_of_axes(file: h5py.File) -> None:
    texts, kind = np.full(2, "x", object), h5py.string_dtype()
    for name in ("DIMENSION_LIST", "REFERENCE_LIST"):
        file["posterior"].attrs.create(name, texts, dtype=kind)


def many_objects(file: h5py.File) -> None:
    for index in range(2_500):
        file.create_group(f"posterior/g{index}")


HOSTILE = [
    bomb,
    unwritten,
    loop,
    twice,
    soft_link,
    external_link,
    external_data,
    virtual_data,
    lists,
    records,
    references,
    named_type,
    absurd_chunk,
    one_long_text,
    many_texts_in_an_attribute,
    long_attributes,
    texts_in_a_large_chunk,
    one_chunk_of_much_more,
    axes_of_many_scales,
    texts_in_place_of_axes,
    many_objects,
]


@pytest.mark.parametrize("spoil", HOSTILE)
def test_what_no_posterior_declares_is_refused_unread(file, tmp_path, spoil):
    copy = Path(shutil.copy(file, tmp_path / "posterior.nc"))
    with h5py.File(copy, "a") as opened:
        spoil(opened)
    begun = time.process_time()
    with pytest.raises(InputError, match="Take a file that hdcal wrote"):
        open_tree(copy)
    # To read what they declare would take minutes, or for ever.
    assert time.process_time() - begun < 5.0


def test_a_pipe_and_a_device_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    for name in ("pipe", "link"):
        with pytest.raises(InputError, match="may never end"):
            open_tree(tmp_path / name)


def scaled(file: h5py.File) -> None:
    file["posterior/K"].attrs["scale_factor"] = 2.0


def shifted(file: h5py.File) -> None:
    file["observed_data/force"].attrs["add_offset"] = 10.0


def with_gaps(file: h5py.File) -> None:
    file["posterior/K"].attrs["_FillValue"] = file["posterior/K"][0, 0]


def dated(file: h5py.File) -> None:
    file["constant_data/time"].attrs["units"] = "seconds since 2000-01-01"


@pytest.mark.parametrize("change", [scaled, shifted, with_gaps, dated])
def test_what_others_would_read_as_other_numbers_is_refused(file, tmp_path, change):
    copy = Path(shutil.copy(file, tmp_path / "posterior.nc"))
    with h5py.File(copy, "a") as opened:
        change(opened)
    with pytest.raises(InputError, match="is not a posterior that hdcal wrote"):
        Posterior.load(copy)


def test_numbers_of_another_machine_are_read(file, tmp_path):
    copy = Path(shutil.copy(file, tmp_path / "posterior.nc"))
    with h5py.File(copy, "a") as opened:
        values, scales = opened["posterior/K"][...], opened["posterior/K"].dims
        axes = [scale[0] for scale in scales]
        del opened["posterior/K"]
        held = opened.create_dataset("posterior/K", data=values.astype(">f8"))
        for place, axis in enumerate(axes):
            held.dims[place].attach_scale(axis)
    found = Posterior.load(copy).draws["K"]
    assert found.dtype == np.dtype("=f8")
    np.testing.assert_array_equal(found, Posterior.load(file).draws["K"])


def nothing_drawn(tree) -> None:
    tree["posterior"] = tree["posterior"].isel(draw=slice(0, 0))


def not_finite(tree) -> None:
    tree["posterior/K"].values[0, 3] = np.nan


def without_a_parameter(tree) -> None:
    del tree["posterior"]["K"]


def texts_for_numbers(tree) -> None:
    draws = tree["posterior"].to_dataset()
    draws["K"] = draws["K"].astype(str)
    tree["posterior"] = draws


def other_axes(tree) -> None:
    draws = tree["posterior"].to_dataset()
    draws["K"] = draws["K"].transpose()
    tree["posterior"] = draws


def rows_not_finite(tree) -> None:
    tree["constant_data/deformation"].values[0] = np.inf


def other_shape(tree) -> None:
    draws = tree["posterior"].to_dataset()
    draws["sigma"] = draws["run_offset"]
    tree["posterior"] = draws


def a_label_too_few(tree) -> None:
    tree["constant_data/run"].values[0] = 99


def nothing_deformed(tree) -> None:
    tree["constant_data/deformation"].values[:] = 0.0


def beyond_every_rig(tree) -> None:
    tree["constant_data/deformation"].values[0] = 1e200


def draws_beyond_every_rig(tree) -> None:
    tree["posterior/deformation_offset"].values[0, 3] = 1e308


def a_diagnosis_of_nothing(tree) -> None:
    model = json.loads(tree.attrs["model"])
    model["diagnoses"]["nothing"] = model["diagnoses"]["K"]
    tree.attrs["model"] = json.dumps(model)


def described(name: str, *path: str, value: object) -> Callable[[Any], None]:
    """Return what puts another value into an attribute's JSON."""

    def spoil(tree) -> None:
        whole = part = json.loads(tree.attrs[name])
        for key in path[:-1]:
            part = part[key]
        assert path[-1] in part
        part[path[-1]] = value
        tree.attrs[name] = json.dumps(whole)

    spoil.__name__ = ".".join((name, *path))
    return spoil


TYPES = [
    described("model", "priors", "K", "numbers", value=[]),
    described("model", "priors", "K", "family", value="x"),
    described("model", "theory", value="x"),
    described("model", "settings", "seed", value="1"),
    described("model", "checks", value=[{"name": "x"}]),
    described("case", "gear", "reference_temperature", value="warm"),
    described("case", "gear", "geometry", "radius", value=[1.0]),
    described("case", "gear", "priors", value={}),
    described("case", "run_labels", value=7),
]
NAN, HUGE = float("nan"), 1e300
GEAR, GEOMETRY, MODEL = ("case", "gear"), ("case", "gear", "geometry"), ("model",)
NUMBERS = [
    *(described(*GEOMETRY, "radius", value=v) for v in (0.0, -1.0, NAN, HUGE)),
    described(*GEOMETRY, "poisson", value=0.5),
    # Each by itself can be, but not beside the others.
    described(*GEOMETRY, "wall_thickness", value=41.0),
    described(*GEOMETRY, "load_height", value=71.0),
    *(described(*GEAR, "nominal_deformation", value=v) for v in (-1.0, 40.0, NAN)),
    *(described(*GEAR, "reference_temperature", value=v) for v in (-300.0, NAN, HUGE)),
    *(described(*GEAR, "force_resolution", value=v) for v in (-1.0, NAN, HUGE)),
    *(described(*GEAR, "density", value=v) for v in (0.0, NAN)),
    described(*GEAR, "priors", "K", "numbers", value=[-2.0, 0.4]),
    described(*GEAR, "priors", "sigma", "numbers", value=[HUGE, 0.4]),
    described(*GEAR, "priors", "E0", "numbers", value=[-2e5, 1.0]),
    described(*GEAR, "scale_priors", "gap_sd", "numbers", value=[0.0]),
    described(*MODEL, "priors", "K", "numbers", value=[NAN, 0.4]),
    described(*MODEL, "priors", "K", "numbers", value=[2.0, -1.0]),
    described(*MODEL, "priors", "E0", "numbers", value=[2e5, HUGE]),
    *(described(*MODEL, "settings", "seed", value=v) for v in (-5, 10**40)),
    *(described(*MODEL, "settings", "draws", value=v) for v in (0, 10**40)),
    described(*MODEL, "settings", "chains", value=1),
    described(*MODEL, "settings", "warmup", value=-1),
    described(*MODEL, "settings", "seconds", value=-1.0),
    described(*MODEL, "diagnoses", "K", "driven_by", value="nobody"),
]


@dataclass
class Attributes:
    """What `described` spoils of a tree."""

    attrs: dict[str, str]


@pytest.fixture(scope="module")
def attributes(file) -> dict[str, str]:
    return {name: str(text) for name, text in open_tree(file).attrs.items()}


def typed_attributes(attributes: dict[str, str]) -> None:
    typed_text(HeldCase, attributes["case"])
    typed(HeldSettings, typed_text(HeldModel, attributes["model"]).settings)


@pytest.mark.parametrize("spoil", NUMBERS)
def test_a_number_that_a_gear_file_may_not_hold_is_none_of_a_posterior(
    attributes, spoil
):
    typed_attributes(attributes)
    spoiled = Attributes(dict(attributes))
    spoil(spoiled)
    with pytest.raises(ValueError):
        typed_attributes(spoiled.attrs)


def test_what_hdcal_wrote_is_read(file):
    assert Posterior.load(file).usable


@pytest.mark.parametrize(
    "spoil",
    [
        *TYPES,
        described(*GEOMETRY, "radius", value=NAN),
        described(*MODEL, "priors", "K", "numbers", value=[NAN, 0.4]),
        described(*MODEL, "settings", "seed", value=-5),
        a_diagnosis_of_nothing,
        draws_beyond_every_rig,
        other_shape,
        a_label_too_few,
        nothing_deformed,
        beyond_every_rig,
        nothing_drawn,
        not_finite,
        without_a_parameter,
        texts_for_numbers,
        other_axes,
        rows_not_finite,
    ],
)
def test_a_broken_content_is_refused_though_its_digest_is_right(file, tmp_path, spoil):
    tree = open_tree(file).datatree
    spoil(tree)
    del tree.attrs[posterior_file.DIGEST]
    tree.attrs[posterior_file.DIGEST] = posterior_file.digest(arrays_of(tree))
    tree.to_netcdf(tmp_path / "posterior.nc", engine="h5netcdf")
    with pytest.raises(InputError, match="is not a posterior that hdcal wrote"):
        Posterior.load(tmp_path)


@pytest.mark.parametrize("name", ["none", "many", "number", "folder", "garbage"])
def test_what_a_file_is_of_is_told_without_reading_it(file, tmp_path, name):
    """Nothing but that of a file that says it; no error of any other."""
    assert posterior_file.kind_of(file) is posterior_file.CALIBRATION
    assert '"theory"' in posterior_file.told(file, "model")
    other = tmp_path / "other.nc"
    if name == "folder":
        other.mkdir()
    elif name == "garbage":
        other.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(99))
    elif name != "none":
        shutil.copy(file, other)
        with h5py.File(other, "r+") as opened:
            said = opened.attrs["hdcal_format"]
            many = np.array([said] * 3, dtype=object)
            del opened.attrs["hdcal_format"]
            opened.attrs["hdcal_format"] = many if name == "many" else 7
    assert posterior_file.kind_of(other) is None
    assert posterior_file.told(other, "no such") == ""
