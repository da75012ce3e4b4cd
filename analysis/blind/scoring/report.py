"""The marks as a table to read and a picture of what was taken for what."""

from pathlib import Path
from typing import Any

import numpy as np

from analysis.blind.scoring.intervals import Figure
from analysis.blind.scoring.marks import Row
from analysis.blind.scoring.score import LARGE


def markdown(
    figures: list[Figure],
    causes: list[dict[str, Any]],
    rows: list[Row],
    bands: list[dict[str, Any]],
    command: str,
) -> str:
    """The full report: figures against goals, probabilities against what was true, one row per cause, every case that
    was not answered rightly in every point."""
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
        "## Probabilities",
        "",
        "| given | claims | mean | true | interval | holds |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {b['from']:g} to {b['to']:g} | {b['claims']} | {b['mean_probability']:.3f} | {b['share_true']:.3f} "
        f"| {b['low']:.3f} to {b['high']:.3f} | {'yes' if b['holds'] else '**no**'} |"
        for b in bands
    ]
    lines += [
        "",
        "## By cause",
        "",
        "| cause | found | alone | alone taken for | shrinkage | intervals right | detectable (median) |",
        "|---|---|---|---|---|---|---|",
    ]
    for c in causes:
        found = ", ".join(f"{size} {right} of {n}" for size, (right, n) in c["found"].items())
        inside, stated = c["coverage"]
        coverage = f"{inside} of {stated}" if stated else ""
        shrinkage = "" if c["shrinkage"] is None else f"{c['shrinkage']:.3f}"
        limit = "" if c["detectable"] is None else f"{c['detectable']:.2g}"
        alone = f"{c['alone'][0]} of {c['alone'][1]}" if c["alone"][1] else ""
        row = (c["cause"], found, alone, ", ".join(c["answered"]), shrinkage, coverage, limit)
        lines.append(f"| {' | '.join(row)} |")
    lines += [
        "",
        "## Cases not answered rightly in every point",
        "",
        "| case | truth (severity) | rig | answer | left |",
        "|---|---|---|---|---|",
    ]
    for r in rows:
        if not r.right:
            truth, answer = r.truth, r.answer
            causes_here = " + ".join(f"{name} ({size:.2f})" for name, size in truth.sizes.items()) or "none"
            rig = f"{truth.noise}, {truth.wall}, {truth.drive}, {truth.runs} runs"
            left = "" if answer.verdict != "unknown" else f"in the {'right' if r.marks.left_found else 'wrong'} stage"
            lines.append(
                f"| {truth.case} | {causes_here} | {rig} | {', '.join(answer.named) or answer.verdict} | {left} |"
            )
    return "\n".join(lines) + "\n"


def _picture_key(row: Row) -> tuple[int, str]:
    """The line of the picture that a case belongs to: single causes by name and size, the others by what they are."""
    order = {"none": 0, "listed": 1, "unknown": 2, "pair": 3, "triple": 4, "beside": 5}
    groups = {"none": "none", "pair": "two listed", "triple": "three listed", "beside": "listed beside unlisted"}
    size = " large" if row.truth.size >= LARGE else " small"
    name = groups.get(row.truth.group) or row.truth.kind.removeprefix("unknown_") + size
    return order[row.truth.group], name


def confusion_picture(rows: list[Row], path: Path) -> None:
    """Truth (down) against the cause named first, none or unknown (across); counts, shaded by share of the
    row."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    keys = sorted({_picture_key(r) for r in rows})
    answers = sorted({r.answer.word for r in rows} | {r.truth.kind for r in rows if r.truth.group == "listed"})
    answers = [a for a in answers if a not in ("none", "unknown")] + ["none", "unknown"]
    counts = np.zeros((len(keys), len(answers)))
    for r in rows:
        counts[keys.index(_picture_key(r)), answers.index(r.answer.word)] += 1
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
    axes.set_yticks(range(len(keys)), [name.replace("_", " ") for _, name in keys], fontsize=7)
    axes.set_xlabel("answer (cause named first)")
    axes.set_ylabel("truth")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def reliability_picture(bands: list[dict[str, Any]], path: Path) -> None:
    """The share of claims that was true over the probability they were given, with 90 % intervals."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(4.2, 4.0), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.6", lw=1)
    for band in bands:
        given = band["mean_probability"]
        axes.plot([given, given], [band["low"], band["high"]], color="#1f77b4", lw=1.5)
        axes.plot(given, band["share_true"], "o", color="#1f77b4", ms=5)
        axes.annotate(
            f"{band['claims']}", (given, band["share_true"]), xytext=(6, -3), textcoords="offset points", fontsize=7
        )
    axes.set_xlabel("probability given")
    axes.set_ylabel("share that was true (number of claims beside it)")
    axes.set_xlim(-0.04, 1.1)
    axes.set_ylim(-0.04, 1.04)
    figure.savefig(path, dpi=150)
    plt.close(figure)
