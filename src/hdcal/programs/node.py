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
    numbers are, and the numbers of one that is looked up in a table are no arrays.
    """

    def __init_subclass__(cls, **given: Any) -> None:
        super().__init_subclass__(**given)
        dataclasses.dataclass(frozen=True, eq=False)(cls)
        jax.tree_util.register_dataclass(cls)

    def __eq__(self, other: object) -> bool:
        mine, structure = jax.tree.flatten(self)
        theirs, another = jax.tree.flatten(other)
        return structure == another and all(map(np.array_equal, mine, theirs))

    def __hash__(self) -> int:
        leaves, structure = jax.tree.flatten(self)
        return hash((structure, *leaves))
