"""Reports: one self-contained HTML page per recording, per series, and the pieces other reports are built
from.
"""
