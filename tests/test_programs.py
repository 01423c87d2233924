"""Programs that were compiled once start fast, and say the same, to the last bit."""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import hdcal
from hdcal.programs import compiling, files
from hdcal.programs.program import Program, program

_TWICE = """
import sys
from hdcal.cli.compilation_cache import keep_compilations
keep_compilations()
import hdcal
found = hdcal.calibrate(hdcal.read_case(sys.argv[1]), draws=400, chains=2)
print(found.tree["posterior"]["K"].to_numpy().sum().hex())
print("numpyro" in sys.modules)
"""


@pytest.fixture
def cached(tmp_path):
    """Give a cache of its own for one test."""
    before = files._kept_in
    files.keep_in(str(tmp_path))
    yield tmp_path
    files.keep_in(before)


def kept(folder: Path) -> list[Path]:
    """Return the programs that are kept in a cache."""
    return sorted(p for p in (folder / "programs").rglob("*") if p.is_file())


TRACED = []


def cosine_sum(numbers, *, times=1):
    """Return a number, and count how often it was traced."""
    TRACED.append(times)
    return {"sum": times * jnp.sum(jnp.cos(numbers["x"])) + numbers["y"]}


def called_back(x):
    """Return what this process itself has to say."""
    shape = jax.ShapeDtypeStruct(x.shape, x.dtype)
    return jax.pure_callback(lambda y: np.asarray(y) + 1.0, shape, x)


def applied(x, *, apply):
    """Return what a function makes of it."""
    return apply(x)


def doubled(x):
    """Return two arrays."""
    return [x, 2.0 * x]


def of_instance(effect, x):
    """Return what an effect makes of it."""
    return effect.apply(x, None)


def of_class(x, *, effect):
    """Return what an effect of that class makes of it."""
    return effect(3.0).apply(x, None)


def counted():
    """Return a program, and how often it was traced."""
    TRACED.clear()
    return program(cosine_sum, static=("times",)), TRACED


def another(one: Program) -> Program:
    """Return the program as a later process has it."""
    return Program(one._function, one._static, one._returns)


def test_what_was_traced_is_not_traced_again(cached):
    one, traced = counted()
    numbers = {"x": np.linspace(0.0, 1.0, 7), "y": 3}
    found = one(numbers, times=2)
    assert traced == [2]
    assert len(kept(cached)) == 1
    again = another(one)(numbers, times=2)
    assert traced == [2]
    assert float(again["sum"]).hex() == float(found["sum"]).hex()
    assert float(found["sum"]) == pytest.approx(2 * np.cos(numbers["x"]).sum() + 3)


def test_another_shape_setting_or_structure_is_another_program(cached):
    one, traced = counted()
    for size, times in ((7, 1), (8, 1), (7, 2)):
        one({"x": np.zeros(size), "y": 0.0}, times=times)
    assert len(traced) == len(kept(cached)) == 3
    assert float(one({"x": np.zeros(7), "y": 1.0}, times=2)["sum"]) == 15.0


def test_another_setting_of_jax_is_another_program(cached):
    one, traced = counted()
    numbers = {"x": np.zeros(3), "y": 0.0}
    one(numbers, times=1)
    with jax.default_matmul_precision("highest"):
        # In the same process and in a later one.
        one(numbers, times=1)
        another(one)(numbers, times=1)
    assert len(traced) == len(kept(cached)) == 2


def test_other_code_is_another_program(cached, tmp_path, monkeypatch):
    monkeypatch.undo()
    one, traced = counted()
    one({"x": np.zeros(3), "y": 0.0}, times=1)
    folder = kept(cached)[0].parent
    code = tmp_path / "code"
    code.mkdir()
    (code / "one.py").write_text("changed = True")
    monkeypatch.setattr(files, "_CODE", code)
    files._folder_in.cache_clear()
    another(one)({"x": np.zeros(3), "y": 0.0}, times=1)
    assert len(traced) == 2
    assert {file.parent for file in kept(cached)} != {folder}
    files._folder_in.cache_clear()


@pytest.mark.parametrize("damage", [b"", b"short", b"x" * 4000])
def test_a_damaged_file_is_thrown_away(cached, damage):
    one, traced = counted()
    numbers = {"x": np.linspace(0.0, 1.0, 5), "y": 0.0}
    found = one(numbers, times=1)
    (file,) = kept(cached)
    file.write_bytes(damage)
    assert float(another(one)(numbers, times=1)["sum"]) == float(found["sum"])
    assert len(traced) == 2
    # It was written anew, and is read again.
    another(one)(numbers, times=1)
    assert len(traced) == 2
    changed = bytearray(file.read_bytes())
    changed[-1] ^= 1
    file.write_bytes(bytes(changed))
    assert float(another(one)(numbers, times=1)["sum"]) == float(found["sum"])
    assert len(traced) == 3


def test_a_file_that_has_the_name_of_another_is_thrown_away(cached):
    one, traced = counted()
    for size in (3, 5):
        one({"x": np.zeros(size), "y": 0.0}, times=1)
    first, second = kept(cached)
    contents = first.read_bytes(), second.read_bytes()
    for file, content in zip((second, first), contents, strict=True):
        file.write_bytes(content)
    for size in (3, 5, 3, 5):
        assert float(another(one)({"x": np.zeros(size), "y": 0.0}, times=1)["sum"])
    assert len(traced) == 4


def test_a_folder_that_others_may_write_keeps_nothing(cached):
    one, traced = counted()
    (cached / "programs").mkdir()
    (cached / "programs").chmod(0o777)
    for made in (one, another(one)):
        made({"x": np.zeros(3), "y": 0.0}, times=1)
    assert len(traced) == 2
    assert not kept(cached)


def test_its_folder_is_nobody_elses(cached):
    one, _ = counted()
    one({"x": np.zeros(3), "y": 0.0}, times=1)
    assert (cached / "programs").stat().st_mode & 0o777 == 0o700


def test_a_full_or_missing_folder_is_no_error(cached, monkeypatch):
    monkeypatch.undo()

    real = Path.write_bytes

    def full(self, data):
        if "programs" in self.parts:
            real(self, data[:40])
            raise OSError(28, "No space left on device")
        return real(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    one, traced = counted()
    assert float(one({"x": np.zeros(3), "y": 0.0}, times=1)["sum"]) == 3.0
    assert traced == [1]
    assert not kept(cached)


def test_few_versions_of_the_code_stay(cached):
    whole = cached / "programs"
    whole.mkdir(0o700)
    for place in range(6):
        (whole / f"old{place}").mkdir()
        os.utime(whole / f"old{place}", (place, place))
    one, _ = counted()
    one({"x": np.zeros(3), "y": 0.0}, times=1)
    names = {folder.name for folder in whole.iterdir()}
    assert len(names) == 4
    assert {"old3", "old4", "old5"} < names


_FACTOR = """
import sys
import numpy as np
from hdcal.programs.files import keep_in
from test_programs import factor, program
keep_in(sys.argv[1])
print(float(program(factor)(np.eye(3) + 1.0).sum()).hex())
"""


def factor(x):
    """Return what LAPACK computes."""
    return jnp.linalg.cholesky(x)


def test_what_calls_lapack_finds_it_in_a_later_process(tmp_path):
    """It is there only once JAX has looked for it; to call it before is a crash."""
    command = [sys.executable, "-c", _FACTOR, str(tmp_path)]
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    env |= {"JAX_ENABLE_X64": "true"}
    said = {subprocess.check_output(command, text=True, env=env) for _ in range(2)}
    assert len(kept(tmp_path)) == len(said) == 1
    found = float.fromhex(said.pop())
    assert found == pytest.approx(np.linalg.cholesky(np.eye(3) + 1.0).sum())


def test_beside_a_cache_of_jax_nothing_is_kept(cached):
    """What JAX read from there, written once more, lacks functions that it calls."""
    jax.config.update("jax_compilation_cache_dir", str(cached / "own"))
    try:
        counted()[0]({"x": np.zeros(3), "y": 0.0}, times=1)
        assert not kept(cached)
        files.keep_in(str(cached))
        assert jax.config.jax_compilation_cache_dir is None
    finally:
        jax.config.update("jax_compilation_cache_dir", None)


def test_another_processor_has_other_programs(cached, monkeypatch):
    here = files._of_code_and_machine()
    assert here == files._of_code_and_machine()
    monkeypatch.setattr(files, "_processor", lambda: "flags: none")
    assert files._of_code_and_machine() != here


def test_what_calls_back_works_and_is_not_kept(cached):
    np.testing.assert_array_equal(program(called_back)(np.zeros(2)), np.ones(2))
    assert not kept(cached)


def test_an_argument_told_by_its_address_is_not_kept(cached):
    one = program(applied, static=("apply",))
    assert float(one(np.float64(2.0), apply=lambda x: x + 1.0)) == 3.0
    assert not kept(cached)


def own_effect(factor: float):
    """Return an effect of a user's own, as a script that was edited has it."""

    class Own(hdcal.Effect):
        name: ClassVar[str] = "own"
        stage: ClassVar[str] = "deformation"
        groups: ClassVar[tuple[str, ...]] = ("curve up",)
        symmetry: ClassVar[str] = "even"
        error: float = hdcal.parameter("1", "", typical=1.0, null=0.0)

        def apply(self, signal, rows):
            return factor * self.error * signal

    return Own


@pytest.mark.parametrize("as_class", [True, False])
def test_a_class_of_the_users_own_is_traced_anew(cached, as_class):
    """Its name and its fields may be the same, and its code another."""

    found = []
    for factor in (1.0, 2.0):
        effect, x = own_effect(factor), np.float64(5.0)
        if as_class:
            found.append(float(program(of_class, static=("effect",))(x, effect=effect)))
        else:
            found.append(float(program(of_instance)(effect(3.0), x)))
    assert found == [15.0, 30.0]
    assert not kept(cached)


def test_a_class_that_executed_text_makes_is_the_users_own(cached):
    for factor in (1.0, 2.0):
        made = {}
        exec(f"class Own:\n def apply(self, x, _):\n  return {factor} * x", made)
        jax.tree_util.register_pytree_node(
            made["Own"], lambda _: ((), None), lambda *_, own=made["Own"]: own()
        )
        assert made["Own"].__module__ == "builtins"
        found = program(of_instance)(made["Own"](), np.float64(5.0))
        assert float(found) == factor * 5.0
    assert not kept(cached)


def test_functions_that_others_made_have_no_name(cached):
    def adder(more):
        return program(lambda x: x + more)

    assert [float(adder(more)(np.float64(1.0))) for more in (2.0, 3.0)] == [3.0, 4.0]
    assert not kept(cached)


def test_settings_that_are_equal_and_of_another_type_are_told_apart(cached):
    times, traced = counted()
    for setting in (1, True, 1.0):
        times({"x": np.zeros(3), "y": 0.0}, times=setting)
    assert [type(one) for one in traced] == [int, bool, float]


def test_what_lies_on_another_device_is_jit(tmp_path):
    script = f"""
import jax, numpy as np
from hdcal.programs.program import program
from hdcal.programs.files import keep_in
keep_in({str(tmp_path)!r})
from pathlib import Path
from test_programs import kept, doubled
one = program(doubled)
first, second = jax.devices()
both = jax.sharding.Mesh(np.array([first, second]), "x")
split = jax.sharding.NamedSharding(both, jax.sharding.PartitionSpec("x"))
x = np.arange(4.0)
for place in (second, split):
    assert np.array_equal(one(jax.device_put(x, place))[1], 2.0 * x)
assert not kept(Path({str(tmp_path)!r}))
assert np.array_equal(one(x)[1], 2.0 * x)
assert len(kept(Path({str(tmp_path)!r}))) == 1
with jax.default_device(second):
    assert np.array_equal(one(x)[1], 2.0 * x)
"""
    env = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    env["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    assert done.returncode == 0, done.stderr


_BESIDE_ANOTHER = """
import sys
import jax, numpy as np
from hdcal import calibrate, read_case
from hdcal.programs import compiling, program
from hdcal.programs.files import keep_in
from test_programs import doubled
keep_in(sys.argv[1])
if sys.argv[3:]:
    program.lowered = None  # Nothing may be compiled.
places = jax.devices()
place = places[int(sys.argv[2])]
program.computing_device = compiling.computing_device = lambda: place
found = calibrate(read_case("datasets/xb1-100-80"), warmup=100, draws=100)
print(found.draws["K"].sum())
one = program.program(doubled)
# JAX' own arrays are on its first device, bound to nowhere.
for x in (np.arange(4.0), jax.numpy.arange(4.0), one(np.arange(4.0))[1]):
    assert one(x)[1].devices() == {place}
"""


def test_programs_run_on_their_device_and_not_where_jax_would(tmp_path):
    """As beside a graphics processor, for which a second device stands."""
    env = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    env["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    told = []
    for place, *only_loaded in (("0",), ("1",), ("1", "loaded")):
        given = [str(tmp_path / place), place, *only_loaded]
        command = [sys.executable, "-c", _BESIDE_ANOTHER, *given]
        done = subprocess.run(
            command, capture_output=True, text=True, env=env, check=False
        )
        assert done.returncode == 0, done.stderr
        told.append(done.stdout)
    assert told[0] == told[1] == told[2]
    assert kept(tmp_path / "1")


def test_a_processor_that_is_not_here_is_refused(monkeypatch):
    monkeypatch.setenv("JAX_PLATFORMS", "abacus")
    script = "from hdcal.__main__ import main; main(['fleet', 'datasets/fleet-demo'])"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("hdcal: JAX_PLATFORMS: names 'abacus', ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(("asked", "chosen"), [(None, "cpu"), ("cuda,cpu", "cuda,cpu")])
def test_a_command_looks_for_no_other_processor_unless_told(asked, chosen):
    script = "import os, atexit; from hdcal.__main__ import main; "
    script += (
        "atexit.register(lambda: print(os.environ['JAX_PLATFORMS'])); main(['-h'])"
    )
    env = {n: value for n, value in os.environ.items() if n != "JAX_PLATFORMS"}
    env |= {} if asked is None else {"JAX_PLATFORMS": asked}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=True)
    assert done.stdout.splitlines()[-1] == chosen


def test_a_setting_may_be_left_out(cached):
    one, _ = counted()
    assert float(one({"x": np.zeros(3), "y": 0.0})["sum"]) == 3.0
    assert len(kept(cached)) == 1


def test_under_a_transformation_it_is_jit(cached):
    one, _ = counted()
    slope = jax.grad(lambda x: one({"x": x, "y": 0.0}, times=1)["sum"])(jnp.ones(3))
    np.testing.assert_allclose(slope, -np.sin(np.ones(3)))
    assert not kept(cached)


_TRACED_AT_ONCE, _MOST_AT_ONCE = [], []


def _slowly_traced(x, *, place: int):
    """Note how many are being traced."""
    _TRACED_AT_ONCE.append(place)
    _MOST_AT_ONCE.append(len(_TRACED_AT_ONCE))
    time.sleep(0.05)
    _TRACED_AT_ONCE.remove(place)
    return x + place


@pytest.mark.parametrize("kept_on_disk", [True, False])
def test_threads_trace_one_after_the_other(cached, kept_on_disk: bool):
    """NumPyro's handlers are on one stack for all of them."""
    if not kept_on_disk:
        files.keep_in(None)
    _MOST_AT_ONCE.clear()
    made = Program(_slowly_traced, static=("place",))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda n: float(made(1.0, place=n)), range(4)))
    assert found == [1.0, 2.0, 3.0, 4.0]
    assert len(_MOST_AT_ONCE) == 4 and max(_MOST_AT_ONCE) == 1


def test_a_class_comes_back(cached):
    one = program(doubled, returns=lambda first, second: {"a": first, "b": second})
    assert float(one(np.float64(2.0))["b"]) == 4.0


def test_a_second_process_says_the_same_without_what_only_tracing_needs(tmp_path):
    def run(cache):
        env = os.environ | {"HDCAL_CACHE_DIR": str(cache)}
        command = [sys.executable, "-c", _TWICE, "datasets/xb1-100-80"]
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, env=env
        )
        return done.stdout.split()

    first, second = run(tmp_path), run(tmp_path)
    without = run(__file__)
    assert first[0] == second[0] == without[0]
    assert (first[1], second[1], without[1]) == ("True", "False", "True")


def test_of_known_numbers_it_is_part_of_another_trace(cached):
    inner, given = Program(doubled), np.arange(3.0)
    found = jax.jit(lambda x: x + inner(given)[1])(1.0)
    np.testing.assert_array_equal(found, [1.0, 3.0, 5.0])
    slope = jax.grad(lambda x: jnp.sum(x * inner(given)[1]))(1.0)
    assert float(slope) == 6.0


def test_an_xla_that_lacks_an_option_is_asked_without(cached, monkeypatch):
    own = jax.jit

    def older(function, *args, compiler_options=None, **named):
        if compiler_options:
            raise ValueError("No such compile option")
        return own(function, *args, **named)

    monkeypatch.setattr(jax, "jit", older)
    compiling._options.cache_clear()
    try:
        assert compiling._options() is None
        found = Program(doubled)(np.arange(3.0))
        np.testing.assert_array_equal(found[1], [0.0, 2.0, 4.0])
    finally:
        compiling._options.cache_clear()


def test_a_program_has_the_same_name_in_every_process():
    """Sets are in another order in each."""
    script = """
import jax
from rigs import make_records
from hdcal.programs.program import _outline, _text
known = frozenset({"run", "temperature", "time", "rates"})
records = make_records([0.0, 1.0], [0.0, 1.0], known=known)
print(_outline(jax.tree.structure(records)), _text(("known", known)))
"""
    said = set()
    for seed in range(4):
        env = {**os.environ, "PYTHONHASHSEED": str(seed)}
        env["PYTHONPATH"] = os.pathsep.join(sys.path)
        command = [sys.executable, "-c", script]
        said.add(subprocess.check_output(command, text=True, env=env))
    (told,) = said
    assert told.count("'rates','run','temperature','time'") == 2


@pytest.mark.parametrize("name", ["jax_disable_jit", "jax_debug_nans"])
def test_who_debugs_gets_jit_itself(cached, name):
    jax.config.update(name, True)
    try:
        assert float(counted()[0]({"x": np.zeros(3), "y": 0.0}, times=1)["sum"]) == 3.0
    finally:
        jax.config.update(name, False)
    assert not kept(cached)


def test_what_becomes_of_an_error_within_is_part_of_the_name(cached, monkeypatch):
    monkeypatch.undo()
    for said in ("raise", "nan"):
        monkeypatch.setenv("EQX_ON_ERROR", said)
        counted()[0]({"x": np.zeros(3), "y": 0.0}, times=1)
    assert len(kept(cached)) == 2
