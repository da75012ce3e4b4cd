"""docs/reference/gallery.md: every figure of the pages that the sample recordings give, with its command and caption.

``python -m ovines.documentation.gallery`` takes the figures from the pages, after the commands of `SOURCES` were run
in the folder of the repository.
"""

from __future__ import annotations

import base64
import html
import re
from pathlib import Path
from typing import NamedTuple

import ovines
from ovines.documentation.drawn import DRAWN
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole, written_whole

DOCS = Path(ovines.__file__).resolve().parent.parent / "docs"
PAGE, PICTURES = DOCS / "reference" / "gallery.md", DOCS / "figures" / "gallery"
SERIES, RENDERED = "sample_data/series_tilted", "sample_data/rendered"
SHOWN = "series_shown"
MAKE_SHOWN = (
    f"ovines blind make {SHOWN} --cases 6 --seed 4 --runs 4 --sizes 1 --kinds unknown_bowed_board,"
    "unknown_stretched_picture,unknown_slipped_marker,unknown_shaken_camera,host_ringing,unknown_smoothed_tracks"
)


class Source(NamedTuple):
    """Heading, the command, and the page that it writes; of its figures those whose names begin with one of ``only``
    (empty: all), and with none of ``without``.  A figure that an earlier page has is not shown again."""

    heading: str
    command: str
    page: str
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()


def _shown_case(heading: str, case: str, figure: str) -> Source:
    """A figure that only a page with such a finding has."""
    command = f"{MAKE_SHOWN}\novines diagnose {SHOWN}/cases/{case} --out results_shown/{case}"
    return Source(heading, command, f"results_shown/{case}/gap.html", (figure,))


SOURCES = (
    Source(
        "One recording",
        f"ovines run {SERIES} --out results_series",
        "results_series/run-01/report.html",
        without=("Marker paths", "Contact radius"),  # they need images
    ),
    Source("A recording with images", f"ovines run {RENDERED} --out results_rendered", "results_rendered/report.html"),
    Source("A calibration", f"ovines calibrate {RENDERED} --out results_rendered", "results_rendered/calibration.html"),
    Source("A series", f"ovines run {SERIES} --out results_series", "results_series/report.html"),
    Source(
        "Before the test day",
        f"ovines plan {SERIES}/run-01 --out plan_run-01 --marker-px 9 --yes",
        "plan_run-01/plan.html",
    ),
    Source(
        "Measured against simulated",
        f"ovines compare {SERIES}/run-01 --out results_series/run-01",
        "results_series/run-01/compare.html",
    ),
    Source(
        "The sim-to-real gap",
        f"ovines diagnose {SERIES} --out results_tilted",
        "results_tilted/gap.html",
        without=("The Host beside its drive",),  # nothing but the drive moves it there
    ),
    Source(
        "A law that nobody wrote before",
        "ovines diagnose sample_data/series_unknown --out results_unknown",
        "results_unknown/gap.html",
        ("acceleration +=", "Missing quantity", "Residual of one flight"),
    ),
    _shown_case("Boards that are not true", "case-003", "Arrows over the world"),
    _shown_case("A marker that moves on its body", "case-002", "Markers against their bodies"),
    _shown_case("A camera that moves", "case-006", "Motion of the ground markers"),
    _shown_case("A Host that rings", "case-005", "The Host beside its drive"),
    Source(
        "A picture that changed since the calibration",
        "ovines blind make series_beside --cases 2 --seed 3 --runs 3 --sizes 1 "
        "--kinds unknown_smoothed_tracks,unknown_knocked_lens\n"
        "ovines diagnose series_beside/cases/case-001 --out results_beside/case-001",
        "results_beside/case-001/gap.html",
        ("Arrows over the picture",),
    ),
    Source(
        "Tracks that were smoothed",
        "ovines blind make series_mean --cases 4 --seed 5 --runs 3 --sizes 0.6 --kinds unknown_smoothed_tracks\n"
        "ovines diagnose series_mean/cases/case-001 --out results_mean/case-001",
        "results_mean/case-001/gap.html",
        ("Places at blows",),
    ),
)
RUN_FIGURES = (  # scenario, figure of `ovines simulate NAME --figures`, what it shows
    ("rig", "paths", "Paths of NES and Host in the room, and of the NES from the Host, with its impacts."),
    ("rig", "coordinates", "Places and angle over time; grey: the wall holds the disk."),
    ("rig", "velocities", "Velocity of the NES from the Host, and that of its rim by its spin."),
    ("rig", "impacts", "Speeds before and after each impact, where it was, and the energy that it took."),
    ("rig", "energies", "Energy stored and lost, and the work of the driver."),
    ("rig", "floor_friction", "Floor friction near rest, and Farkas' functions of sliding over spinning."),
    ("table-3", "rebound_heights", "Heights of a dropped disk: each is the square of the restitution of the last."),
)
FIGURE = re.compile(
    r'<figure>.*?<img src="data:image/(svg\+xml|png);base64,([^"]+)" alt="([^"]*)">.*?<figcaption>(.*?)</figcaption>',
    re.DOTALL,
)
INTRO = """# Gallery

Every figure, with the command that draws it. `--figures` with `ovines run`, `ovines report` and `ovines compare` also
writes each as SVG and PDF, for a paper. [Which function draws which](#which-function-draws-which) stands at the end;
those of `analysis.figures` take tables: [an example](../notebook.md#impacts-and-parameters). Films: [look at a
recording](../how-to/look.md).

Made by `python -m ovines.documentation.gallery` from the sample recordings and a few made series.
"""
# The samples' lenses leave nothing over, and no accelerometer stood beside them: a figure of three runs of a blind
# series, and of the records that tests/analysis/test_accelerometers.py and
# tests/house/files/test_trigger_signal.py make.
BESIDE = """
## Orbits

```sh
ovines orbits bifurcation impact-oscillator --states host_x_m,host_vx_m_per_s --over \
drive_frequency_factor=1.0:1.5:101 --periods 60 --out results
ovines orbits lyapunov bouncing-ball --states nes_y_m,nes_vy_m_per_s --transient 50 --out results
ovines orbits section bouncing-ball --states nes_y_m,nes_vy_m_per_s --periods 5000 --yes --out results
ovines orbits follow impact-oscillator --states host_x_m,host_vx_m_per_s --over drive_frequency_factor=0.7:1.3:61 \
--out results
ovines orbits basins impact-oscillator --states host_x_m,host_vx_m_per_s --over host_x_m=-3:0:60 --over \
host_vx_m_per_s=-3:3:60 --transient 100 --out results
```

What each says: [orbits and sensitivities](../how-to/orbits.md).

![Bifurcation diagram of the impact oscillator](../figures/orbits_bifurcation.png)
![Lyapunov exponents of the bouncing ball](../figures/orbits_lyapunov.png)
![Poincaré section of the bouncing ball](../figures/orbits_section.png)
![A branch of orbits](../figures/orbits_follow.png)
![Basins of attraction](../figures/orbits_basins.png)

## A design

```sh
ovines shaker --frequency-hz 11 --acceleration-g 9 --travel-m 0.0254 --velocity-m-per-s 1.5 --most-acceleration-g \
20 --host-radius-m 0.045 --nes-radius-m 0.01 --out design
ovines design sprung-host --band 0.9:1.1:5 --over clearance_m=0.03:0.08 --over mass_ratio=0.02:0.08 --candidates 4 \
--keep 2 --runs 4 --transient 30 --periods 15 --out results
ovines sweep rig --over drive_amplitude_factor=0.3:1.5:13 --over restitution=0.4:0.9:11 --runs 8
```

What each says: [design a NES](../how-to/design.md), [a sweep](../simulator.md#a-run-many-runs-a-range).

![Limits of a shaker over frequency, and the design point](../figures/shaker.png)
![Response of the Host](../figures/design_response.png)
![Energy taken from the Host](../figures/design_energy.png)
![Candidates of the search](../figures/design_search.png)
![Map of a sweep](../figures/sweep_map.png)

## The simulator's tests

```sh
ovines simulate --figures figures
```

What each shows: [validation of the simulator](../validation/simulator.md).

![drops](../figures/drops.png)
![spinning drops](../figures/spinning_drops.png)
![extreme speeds](../figures/extreme_speeds.png)
![near the wall](../figures/near_wall.png)
![stops](../figures/stops.png)
![Farkas](../figures/farkas_functions.png)
![sprung Host](../figures/sprung_host.png)
![shaken Host](../figures/shaken_host.png)
![perspectives](../figures/perspectives.png)

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
    """Write the pictures of the pages and runs below ``folder`` and give the gallery's Markdown."""
    lines, shown = [INTRO.rstrip()], set()
    for source in SOURCES:
        lines += ["", f"## {source.heading}", "", "```sh", source.command, "```"]
        text = _there(folder / source.page, source.command).read_text(encoding="utf-8")
        for kind, content, alt, caption in FIGURE.findall(text):
            title = html.unescape(alt)
            name = _file_name(title)
            wanted = title.startswith(source.only or "") and not title.startswith(source.without)
            if name in shown or not wanted:
                continue
            shown.add(name)
            picture = PICTURES / f"{name}.{kind.partition('+')[0]}"
            with written_whole(picture) as temporary:
                temporary.write_bytes(base64.b64decode(content))
            words = " ".join(html.unescape(re.sub(r"<(?!/?su[bp]>)[^>]+>", "", caption)).split())
            lines += ["", f"![{title}](../figures/gallery/{picture.name})", "", words]
    lines += ["", "## A simulated run", "", "```sh"]
    commands = {name: f"ovines simulate {name} --out sim_{name} --figures" for name, _, _ in RUN_FIGURES}
    lines += [*commands.values(), "```"]
    for name, figure, words in RUN_FIGURES:
        picture = PICTURES / f"run_{figure}.png"
        with written_whole(picture) as temporary:
            temporary.write_bytes(
                _there(folder / f"sim_{name}" / "figures" / f"{figure}.png", commands[name]).read_bytes()
            )
        lines += ["", f"![{words}](../figures/gallery/{picture.name})", "", f"`{name}`: {words}"]
    return "\n".join(lines) + "\n" + BESIDE + "\n" + _functions()


def _there(path: Path, command: str) -> Path:
    if not path.is_file():
        raise InputError(f"{path} is not there", "what a command of the gallery writes", f"run `{command}`")
    return path


def _file_name(title: str) -> str:
    return re.sub(r"\W+", "_", title.lower()).strip("_")[:60]


def _functions() -> str:
    """Each function that draws a figure, with the picture of it above."""
    rows = [f"| `{function}` | [{picture}](../figures/{picture}) |" for function, picture in sorted(DRAWN.items())]
    return "\n".join(["## Which function draws which", "", "| function | picture |", "|---|---|", *rows]) + "\n"


if __name__ == "__main__":
    PICTURES.mkdir(parents=True, exist_ok=True)
    write_text_whole(gallery(Path.cwd()), PAGE)
