"""What the machine lacks, said in words: a system library that OpenCV needs, or memory."""

from __future__ import annotations

from ovines.errors import InputError

NO_MEMORY = str(
    InputError(
        "not enough memory",
        "room for the tables and pictures of one recording",
        "close other programs, or split the recording",
    )
)
UNMAPPED = ("failed to map segment", "cannot allocate memory", "libllvmlite")  # how loaders say that no memory is left


def missing_library(error: Exception) -> str | None:
    """What to say of an error that comes from the machine; None for any other."""
    text = str(error)
    if isinstance(error, MemoryError) or any(one in text.lower() for one in UNMAPPED):
        return NO_MEMORY
    if not isinstance(error, ImportError):
        return None
    if "cannot open shared object" not in text:
        return None
    library = text.split(":", maxsplit=1)[0]
    return f"OpenCV needs the system library {library}: install it, e.g. `apt-get install libgl1 libglib2.0-0`"
