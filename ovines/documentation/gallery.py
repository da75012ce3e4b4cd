"""docs/reference/gallery.md: every figure of the pages that the sample recordings give, with its command and caption.

``python -m ovines.documentation.gallery`` takes the figures from the pages, after the commands of `SOURCES` were run
in the folder of the repository.
"""

from __future__ import annotations

import base64
import html
import re
from pathlib import Path

import ovines
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole, written_whole

DOCS = Path(ovines.__file__).resolve().parent.parent / "docs"
PAGE, PICTURES = DOCS / "reference" / "gallery.md", DOCS / "figures" / "gallery"
SERIES, RENDERED = "sample_data/series_tilted", "sample_data/rendered"
SOURCES = (  # heading, command, the page it writes; a figure that an earlier page has is not shown again
    ("One recording", f"ovines run {SERIES} --out results_series", "results_series/run-01/report.html"),
    ("A recording with images", f"ovines run {RENDERED} --out results_rendered", "results_rendered/report.html"),
    ("A calibration", f"ovines calibrate {RENDERED} --out results_rendered", "results_rendered/calibration.html"),
    ("A series", f"ovines run {SERIES} --out results_series", "results_series/report.html"),
    (
        "Measured against simulated",
        f"ovines compare {SERIES}/run-01 --out results_series/run-01",
        "results_series/run-01/compare.html",
    ),
    ("The sim-to-real gap", f"ovines diagnose {SERIES} --out results_tilted", "results_tilted/gap.html"),
)
NEED_IMAGES = ("Marker paths", "Contact radius")  # how their names begin; the first recording has none
FIGURE = re.compile(
    r'<figure>.*?<img src="data:image/(svg\+xml|png);base64,([^"]+)" alt="([^"]*)">.*?<figcaption>(.*?)</figcaption>',
    re.DOTALL,
)
INTRO = """# Gallery

Every figure of the reports, with the command that draws it. `--figures` with `ovines run`, `ovines report` and
`ovines compare` also writes each as SVG and PDF, for a paper. The functions behind them are in `analysis.figures` and
take tables: [an example](../notebook.md#impacts-and-parameters). The nine figures of the simulator's tests stand in
[its validation](../validation/simulator.md); `ovines simulate --figures DIR` draws them. Films: [look at a
recording](../how-to/look.md).

Made by `python -m ovines.documentation.gallery` from the sample recordings.
"""
# The samples' lenses leave nothing over, and no accelerometer stood beside them: a figure of three runs of a blind
# series, and of the records that tests/analysis/test_accelerometers.py and
# tests/house/files/test_trigger_signal.py make.
BESIDE = """
## Accelerometers

![Acceleration of the Host by cameras and accelerometers over some periods, and its difference over the run.]\
(../figures/accelerations.png)

The Host's acceleration along each sensor by the cameras' path and by [the record beside them](../how-to/record.md), a
shaker's start. The difference is the noise of the cameras' path, differentiated twice. Made, not measured.

## A lens field

![Arrows of the lens field of each camera over its standard deviation.](../figures/lens_field.png)

What the lens models leave over (arrows), [learnt from rigid bodies](../markers.md#the-lens-learnt-from-recordings) in
both views. Three runs of a blind series with a residual of 0.2 to 0.3 px; colour: sd (px); dots: markers.

## A calibration's spline

![Arrows of the spline of each camera over its standard deviation.](../figures/calibration_spline.png)

Where a lens needs one ([how it is chosen](../how-to/calibrate.md)): what the distortion terms leave over (arrows). Of a
camera rendered with a residual of 0.25 px; colour: sd (px).

## A trigger

![The sampled trigger over the pulses of a perfect clock, and how far each interval is off.]\
(../figures/trigger_signal.png)

`ovines import RECORDING --trigger-signal FILE` (thesis, Fig. 43): a signal with pulses of 800 μs at 50 kHz whose
instants scatter by 2 μs (`tests/house/files/test_trigger_signal.py`).
"""


def gallery(folder: Path) -> str:
    """Write the pictures of the pages below ``folder`` and give the gallery's Markdown."""
    lines, shown = [INTRO.rstrip()], set()
    for heading, command, page in SOURCES:
        if not (folder / page).is_file():
            raise InputError(f"{folder / page} is not there", "the page of a sample", f"run `{command}`")
        lines += ["", f"## {heading}", "", "```sh", command, "```"]
        for kind, content, alt, caption in FIGURE.findall((folder / page).read_text(encoding="utf-8")):
            name = re.sub(r"\W+", "_", html.unescape(alt).lower()).strip("_")[:60]
            if name in shown or (heading == SOURCES[0][0] and html.unescape(alt).startswith(NEED_IMAGES)):
                continue
            shown.add(name)
            picture = PICTURES / f"{name}.{kind.partition('+')[0]}"
            with written_whole(picture) as temporary:
                temporary.write_bytes(base64.b64decode(content))
            words = " ".join(html.unescape(re.sub(r"<(?!/?su[bp]>)[^>]+>", "", caption)).split())
            lines += ["", f"![{html.unescape(alt)}](../figures/gallery/{picture.name})", "", words]
    return "\n".join(lines) + "\n" + BESIDE


if __name__ == "__main__":
    PICTURES.mkdir(parents=True, exist_ok=True)
    write_text_whole(gallery(Path.cwd()), PAGE)
