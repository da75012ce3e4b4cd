"""A worker process that ends when the process that started it has ended, however that was."""

from __future__ import annotations

import os
import threading
import time

LOOK_S = 0.5
ORPHANED = 3  # exit status; nobody is left to read it

_watched: set[int] = set()


def die_with(parent: int) -> None:
    """End this process soon after the process ``parent``, its own, is gone; nothing where that is not its parent.

    A thread asks who the parent is: the system gives an orphan another one.  What was being written is written whole or
    not at all, and locks go with the process.
    """
    if parent in _watched or os.getppid() != parent:
        return
    _watched.add(parent)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_S)
        os._exit(ORPHANED)

    threading.Thread(target=watch, daemon=True).start()
