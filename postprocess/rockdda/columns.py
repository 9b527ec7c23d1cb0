# SPDX-License-Identifier: MIT
"""Tables as columns of NumPy, for the package itself; users get them as tables of pandas, an extra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .arrays import AnyArray, FloatArray
from .errors import need

if TYPE_CHECKING:
    import pandas


class Columns(dict[str, AnyArray]):
    """The columns of a table by name, all of one length."""

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.values()), ()))

    def stack(self, *names: str) -> FloatArray:
        """(n, number of names) some columns as one array."""
        return np.column_stack([np.asarray(self[name], dtype=float) for name in names])

    def rows(self, chosen: AnyArray) -> Columns:
        """The rows of some indices, or where a mask is true."""
        return Columns({name: values[chosen] for name, values in self.items()})

    def without(self, *names: str) -> Columns:
        """All columns but some."""
        return Columns({name: values for name, values in self.items() if name not in names})

    def to_pandas(self, purpose: str, index: str | None = None) -> pandas.DataFrame:
        """A table of pandas, with a column as its index; ImportError that says how to get pandas for this purpose."""
        frame: pandas.DataFrame = need("pandas", "tables", purpose).DataFrame(dict(self))
        return frame if index is None else frame.set_index(index)
