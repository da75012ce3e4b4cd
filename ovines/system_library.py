"""A system library that OpenCV needs and the machine lacks, said in one line."""

from __future__ import annotations


def missing_library(error: ImportError) -> str | None:
    """The line for an ImportError of a shared library; None for any other ImportError."""
    text = str(error)
    if "cannot open shared object" not in text:
        return None
    library = text.split(":")[0]
    return (
        f"OpenCV needs the system library {library}: install it, e.g. `apt-get install libgl1 libglib2.0-0`"
    )
