"""Types of arrays that state a shape, for readers, type checkers and the documentation.

They are jaxtyping's. To import it takes longer than to predict a force, so it is only
imported by those who look at types, or where somebody else has done so.
"""

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or "jaxtyping" in sys.modules:
    from jaxtyping import Bool, Float, Int, Key
else:

    class Float:
        """Stands for the array that it is given beside a shape."""

        def __class_getitem__(cls, item: tuple[Any, str]) -> Any:
            """Return the type of the array."""
            return item[0]

    Bool = Int = Key = Float

__all__ = ["Bool", "Float", "Int", "Key"]
