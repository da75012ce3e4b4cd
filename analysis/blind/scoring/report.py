"""The marks as a table to read and a picture of what was taken for what."""

from pathlib import Path
from typing import Any

import numpy as np

from analysis.blind.scoring.intervals import Figure
from analysis.blind.scoring.score import Row


def markdown(figures: list[Figure], causes: list[dict[str, Any]], rows: list[Row], command: str) -> str:
    """The full report: figures against goals, one row per cause, every case answered wrongly."""
    lines = [
        "# Blind trial",
        "",
        f"Made by `{command}`. Intervals are 90 % (Wilson for shares, bootstrap over cases for means).",
        "",
        "| figure | value | interval | cases | goal | met |",
        "|---|---|---|---|---|---|",
    ]
    for f in figures:
        value = "-" if f.value is None else f"{f.value:.3g}"
        interval = "-" if f.low is None else f"{f.low:.3g} to {f.high:.3g}"
        met = "" if f.met is None else "yes" if f.met else "**no**"
        lines.append(f"| {f.name} | {value} | {interval} | {f.n} | {f.goal} | {met} |")
    lines += [
        "",
        "## By cause",
        "",
        "| cause | found (size: of) | taken for | shrinkage | intervals right | detectable (median stated) |",
        "|---|---|---|---|---|---|",
    ]
    for c in causes:
        found = ", ".join(f"{size}: {right} of {n}" for size, (right, n) in c["found"].items())
        inside, stated = c["coverage"]
        coverage = f"{inside} of {stated}" if stated else ""
        shrinkage = "" if c["shrinkage"] is None else f"{c['shrinkage']:.3f}"
        limit = "" if c["detectable"] is None else f"{c['detectable']:.2g}"
        lines.append(f"| {c['kind']} | {found} | {', '.join(c['answered'])} | {shrinkage} | {coverage} | {limit} |")
    wrong = [
        r
        for r in rows
        if (
            r.verdict != "none"
            if r.group == "none"
            else r.verdict != "unknown"
            if r.group == "unknown"
            else not r.all_named
        )
    ]
    lines += [
        "",
        "## Cases answered wrongly",
        "",
        "| case | truth | size | noise | answer | stage |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.case} | {r.kind} | {r.size:g} | {r.noise} | {', '.join(r.named) or r.verdict} | {r.stage or ''} |"
        for r in wrong
    ]
    return "\n".join(lines) + "\n"


def confusion_picture(rows: list[Row], path: Path) -> None:
    """Truth (down) against the cause named first, none or unknown (across); counts, shaded by share of the
    row."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    order = {"none": 0, "listed": 1, "pair": 2, "unknown": 3}
    keys = sorted({(order[r.group], r.kind, -r.size if r.group == "listed" else 0.0) for r in rows})
    label = {
        key: key[1].removeprefix("unknown_") + ("" if key[0] != 1 else " large" if key[2] <= -1 else " small")
        for key in keys
    }
    answers = sorted({r.answered for r in rows} | {k[1] for k in keys if k[0] == 1}) + []
    answers = [a for a in answers if a not in ("none", "unknown")] + ["none", "unknown"]
    counts = np.zeros((len(keys), len(answers)))
    for r in rows:
        key = (order[r.group], r.kind, -r.size if r.group == "listed" else 0.0)
        counts[keys.index(key), answers.index(r.answered)] += 1
    share = counts / counts.sum(axis=1, keepdims=True)
    figure, axes = plt.subplots(figsize=(3.6 + 0.36 * len(answers), 2.6 + 0.21 * len(keys)), layout="constrained")
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(
            j,
            i,
            f"{counts[i, j]:.0f}",
            ha="center",
            va="center",
            fontsize=7,
            color="white" if share[i, j] > 0.6 else "black",
        )
    for i in range(1, len(keys)):
        if keys[i][0] != keys[i - 1][0]:
            axes.axhline(i - 0.5, color="0.3", lw=0.8)
    axes.set_xticks(range(len(answers)), [a.replace("_", " ") for a in answers], rotation=60, ha="right", fontsize=7)
    axes.set_yticks(range(len(keys)), [label[k].replace("_", " ") for k in keys], fontsize=7)
    axes.set_xlabel("answer (cause named first)")
    axes.set_ylabel("truth")
    figure.savefig(path, dpi=150)
    plt.close(figure)
