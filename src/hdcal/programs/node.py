"""Classes whose instances are trees of arrays, as JAX and programs take them."""

import dataclasses
from typing import Any, dataclass_transform

import jax
import numpy as np


def static(**given: Any) -> Any:
    """Declare a field that is no array: it is part of what a program is made for.

    Args:
        given: as `dataclasses.field` takes it.
    """
    return dataclasses.field(metadata={"static": True}, **given)


@dataclass_transform(
    frozen_default=True, field_specifiers=(static, dataclasses.field), eq_default=False
)
class Node:
    """A frozen dataclass whose fields are the children of a tree for JAX.

    Each subclass is made one as it is defined. Two are equal whose structures and
    numbers are; one that is looked up in a table has numbers that are no arrays.
    """

    def __init_subclass__(cls, **given: Any) -> None:
        super().__init_subclass__(**given)
        dataclasses.dataclass(frozen=True, eq=False)(cls)
        if "__check_init__" in vars(cls):
            # Of a class that was written for equinox it would be passed over.
            raise TypeError(f"{cls.__name__}: what checks a new one is __post_init__")
        _register(cls)

    def __eq__(self, other: object) -> bool:
        mine, structure = jax.tree.flatten(self)
        theirs, another = jax.tree.flatten(other)
        return structure == another and all(map(np.array_equal, mine, theirs))

    def __hash__(self) -> int:
        leaves, structure = jax.tree.flatten(self)
        return hash((structure, *leaves))


def _register(cls: type) -> None:
    """Tell JAX what the children of a class are.

    Not by its `register_dataclass`: two structures with as many fields are equal there,
    whatever their classes are (JAX 0.10), and one program would serve both.
    """
    children, fixed = [], []
    for field in dataclasses.fields(cls):
        if "converter" in field.metadata:
            raise TypeError(f"{cls.__name__}.{field.name}: nothing is converted here")
        (fixed if field.metadata.get("static") else children).append(field.name)
    keys = [jax.tree_util.GetAttrKey(name) for name in children]

    def flatten(node):
        held = vars(node)
        return [held[name] for name in children], tuple(held[name] for name in fixed)

    def with_keys(node):
        values, told = flatten(node)
        return list(zip(keys, values, strict=True)), told

    def unflatten(told, values):
        # As it was: what is checked of a new one would be in the way of tracing.
        node = object.__new__(cls)
        vars(node).update(zip(children, values, strict=True))
        vars(node).update(zip(fixed, told, strict=True))
        return node

    jax.tree_util.register_pytree_with_keys(cls, with_keys, unflatten, flatten)
