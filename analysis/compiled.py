"""Compiled code of analysis.compiled's importers, kept on disk under a hash of all their sources (see :mod:`ovines.core.compiled`)."""

from __future__ import annotations

from pathlib import Path

from ovines.core.compiled import compiler, stamp_above

compiled = compiler(stamp_above(Path(__file__).parent))
