"""What scored trials say by severity: ``python benchmarks/gap/trial_severity.py TRIAL [TRIAL ...]``.

Of each trial's score.json how many causes were detected in bands of severity (an unlisted one: something is said to be
left in its stage; a listed one: it is named), with Wilson's 90 % interval; log scores; and what came of probabilities
of 0.99 and more.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.intervals import wilson

BANDS = (0.3, 0.5, 0.7, 0.9, 1.4)


def detected(cases, low, high, listed):
    """Whether each cause of a band was detected; of several listed ones in a case, whether all are named."""
    return [
        case["all_named" if listed else "left_found"]
        for case in cases
        for name, size in case["sizes"].items()
        if low <= size < high and CAUSES[name].listed == listed
    ]


def share(hits):
    if not hits:
        return "-"
    low, high = wilson(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} ({low:.2f} to {high:.2f})"


def main():
    for folder in sys.argv[1:]:
        score = json.loads((Path(folder) / "score.json").read_text())
        print(f"{Path(folder).name}: {len(score['cases'])} cases")
        for low, high in pairwise(BANDS):
            unlisted, listed = (share(detected(score["cases"], low, high, one)) for one in (False, True))
            print(f"| {low} to {high} | {unlisted} | {listed} |")
        for one in score["figures"]:
            if one["name"].startswith("log score"):
                print(f"{one['name']}: {one['value']:.3f} ({one['low']:.3f} to {one['high']:.3f})")
        for band in score["reliability"]:
            if band["from"] == 0.99:
                print(f"0.99 and more: {band['claims']} given, {band['share_true']:.2f} true")


if __name__ == "__main__":
    main()
