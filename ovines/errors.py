"""The one error a user sees: what was found, what was expected, what to do.

Raised wherever input is wrong; only ``ovines.__main__`` catches it and turns it
into three lines and exit status 2.  "No impact" or "marker hidden" are values
in a table, never errors.
"""

from __future__ import annotations


class InputError(Exception):
    """Input that cannot be used as it is.

    Parameters
    ----------
    found, expected, do : str
        What stood in the input (with file and line or key), what belongs there,
        and what the user can do about it.
    """

    def __init__(self, found: str, expected: str, do: str) -> None:
        super().__init__(f"found:    {found}\nexpected: {expected}\ndo:       {do}")
        self.found = found
        self.expected = expected
        self.do = do

    def __reduce__(self):  # workers hand it through a pickle; the default would lose two fields
        return type(self), (self.found, self.expected, self.do)
