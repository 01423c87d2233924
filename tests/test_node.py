"""What programs are given: dataclasses that JAX takes apart and puts together."""

import copy
import dataclasses
import pickle
from abc import ABC, abstractmethod

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal.programs.node import Node, static


class Line(Node):
    slope: jax.Array | float
    name: str = static(default="")
    zeros: dict[str, float] = dataclasses.field(default_factory=dict)

    def at(self, x):
        return self.slope * x + sum(self.zeros.values())


class Other(Node):
    slope: jax.Array | float
    name: str = static(default="")
    zeros: dict[str, float] = dataclasses.field(default_factory=dict)


class Steeper(Line):
    factor: float = 2.0


class Checked(Node):
    number: float

    def __post_init__(self):
        if not self.number > 0.0:
            raise ValueError("is not positive")


class Shape(Node, ABC):
    @abstractmethod
    def area(self): ...


LINE = Line(2.0, "first", {"zero": 1.0})


def test_its_fields_are_leaves_but_those_that_are_no_arrays():
    leaves, structure = jax.tree.flatten(LINE)
    assert leaves == [2.0, 1.0]
    assert jax.tree.unflatten(structure, leaves) == LINE
    assert jax.tree.structure(dataclasses.replace(LINE, name="second")) != structure
    paths = [jax.tree_util.keystr(path) for path, _ in jax.tree.leaves_with_path(LINE)]
    assert paths == [".slope", ".zeros['zero']"]


def test_a_subclass_has_all_fields():
    steeper = Steeper(1.0, factor=3.0)
    assert jax.tree.leaves(steeper) == [1.0, 3.0]
    assert steeper.at(2.0) == 2.0


def test_classes_with_the_same_fields_are_not_mistaken_for_each_other():
    """As one program for both would: JAX' own dataclasses are equal then."""
    one, other = (jax.tree.structure(made(2.0)) for made in (Line, Other))
    assert one != other
    assert Line(2.0) != Other(2.0)


def test_equal_are_those_with_the_same_numbers():
    assert Line(np.arange(3.0)) == Line(jnp.arange(3.0))
    assert Line(np.arange(3.0)) != Line(np.arange(4.0))
    assert Line(2.0) != Line(2.0, "named") and Line(2.0) != 2.0
    assert len({Line(2.0), Line(2.0), Line(3.0)}) == 2


def test_nothing_is_changed_in_place():
    with pytest.raises(dataclasses.FrozenInstanceError):
        LINE.slope = 3.0  # pyright: ignore[reportAttributeAccessIssue]


def test_it_is_copied_and_sent_to_other_processes():
    for back in (copy.deepcopy(LINE), pickle.loads(pickle.dumps(LINE))):
        assert back == LINE


def test_jax_compiles_differentiates_and_maps_it():
    slopes = jax.jit(jax.grad(lambda line: line.at(3.0)))(LINE)
    assert slopes == Line(3.0, "first", {"zero": 1.0})
    many = jax.vmap(lambda slope: Line(slope))(jnp.arange(3.0))
    np.testing.assert_array_equal(many.slope, [0.0, 1.0, 2.0])


def test_a_new_one_is_checked_and_one_put_together_is_not():
    with pytest.raises(ValueError, match="not positive"):
        Checked(0.0)
    assert jax.tree.map(lambda x: -x, Checked(1.0)).number == -1.0


def test_what_equinox_did_and_this_does_not_is_told():
    with pytest.raises(TypeError, match="__post_init__"):

        class Late(Node):
            number: float

            def __check_init__(self):
                raise ValueError

    with pytest.raises(TypeError, match="nothing is converted"):

        class Converted(Node):
            number: int = dataclasses.field(metadata={"converter": int})


def test_one_that_lacks_a_method_cannot_be_made():
    with pytest.raises(TypeError, match="abstract"):
        Shape()  # pyright: ignore[reportAbstractUsage]
