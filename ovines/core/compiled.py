"""How the engine is compiled: once per machine, kept on disk, without Python's lock.

numba notices a change of the file it caches, not of files that it calls: after editing one module of the engine
delete ``ovines/core/__pycache__`` (an installation brings new files, so its users never meet this).
Division by zero gives inf or nan as in numpy: checks for an exception would cost a fifth of the speed.
"""

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy")

# For small functions on the hot path: a call hands eight arrays over and counts references on each, which costs more
# than the work itself (measured: 0.4 us of 0.65 us per right-hand side).
inlined = njit(nogil=True, error_model="numpy", inline="always")
