"""Reports: one self-contained HTML page per recording, per series, and the pieces other reports are built
from.
"""

from analysis.report.page import Card, Page, Section
from analysis.report.recording_report import recording_page, write_report

__all__ = ["Card", "Page", "Section", "recording_page", "write_report"]
