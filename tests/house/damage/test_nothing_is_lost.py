"""Nothing of the user's is touched: foreign files, other recordings and results changed by hand are refused by name."""

import shutil

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ovines.__main__ import main
from ovines.errors import InputError
from ovines.io.atomic_write import TEMPORARY_SUFFIX
from ovines.pipeline.ownership import FIGURES, whose
from ovines.pipeline.pages import remove_figures
from ovines.tables import read_provenance, read_table
from tests.conftest import write_small_recording


@pytest.fixture
def recordings(tmp_path):
    """Two recordings with one calibration; the second holds a raw table of its own."""
    for number in (1, 2):
        write_small_recording(tmp_path / "day" / f"run-{number}", frames=30, seed=number)
    return tmp_path / "day" / "run-1", tmp_path / "day" / "run-2"


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused_untouched(arguments, folder, capsys, *words):
    """Exit status 2, the words, and every byte below ``folder`` as before."""
    before = contents(folder)
    assert main([str(one) for one in arguments]) == 2
    said = capsys.readouterr()
    for word in words:
        assert word in said.out + said.err, said
    assert "Traceback" not in said.err and contents(folder) == before


@pytest.mark.parametrize("command", ["run", "triangulate", "diagnose", "compare"])
def test_another_recording_is_no_results_folder(command, recordings, capsys):
    one, other = recordings
    (other / "points.parquet").write_bytes(b"raw")
    refused_untouched([command, one, "--out", other], other.parent, capsys, str(other), "recording.toml")


@pytest.mark.others_further
@pytest.mark.parametrize("keeps_its_mark", [True, False])
def test_results_written_again_by_another_program(keeps_its_mark, recordings, tmp_path, capsys):
    """Speeds of 1e300 were squared: a table that pandas wrote again was nobody's, with our mark or without."""
    path = tmp_path / "results" / "rotation.parquet"
    assert main(["analyse", str(recordings[0]), "--out", str(path.parent)]) == 0
    stored = pq.read_table(path)
    table = stored.to_pandas()
    column = next(name for name in table.columns if table[name].dtype == float and name != "time_s")
    table[column] = 1e300
    made = pa.Table.from_pandas(table, preserve_index=False)
    texts = [pa.field(one.name, pa.large_string() if pa.types.is_string(one.type) else one.type) for one in made.schema]
    made = made.cast(pa.schema(texts))
    pq.write_table(made.replace_schema_metadata(stored.schema.metadata if keeps_its_mark else None), path)
    assert whose(path) == ("changed" if keeps_its_mark else "foreign")
    if keeps_its_mark:
        refused_untouched(["compare", recordings[0], "--out", path.parent], path.parent, capsys, str(path))
    else:
        with pytest.raises(InputError, match=rf"{column} is 1e\+300"):
            read_table(path, "rotation")


def test_another_series_is_no_results_folder(recordings, tmp_path, capsys):
    shutil.copytree(recordings[0].parent, tmp_path / "other")
    refused_untouched(
        ["triangulate", recordings[0].parent, "--out", tmp_path / "other"], tmp_path, capsys, "recording.toml"
    )


@pytest.mark.others_further
@pytest.mark.parametrize(
    "name", ["points.parquet", "motion.parquet", "report.html", "identification.parquet", "source.json"]
)
def test_a_file_of_the_user_under_our_name(name, recordings, tmp_path, capsys):
    mine = tmp_path / "thesis" / name
    mine.parent.mkdir()
    if name.endswith(".parquet"):
        pq.write_table(pa.table({"x": [1.0]}), mine)
    else:
        mine.write_text("{}")
    refused_untouched(
        ["triangulate", recordings[0], "--out", mine.parent], mine.parent, capsys, str(mine), "name another --out"
    )
    refused_untouched(["check", recordings[0], "--out", mine.parent], mine.parent, capsys, str(mine))
    mine.rename(mine.with_name("else"))
    assert main(["triangulate", str(recordings[0]), "--out", str(mine.parent)]) == 0


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("diagnose", "gap.html"),
        ("diagnose", "diagnosis.json"),
        ("compare", "compare.html"),
        ("simulate", "contact.parquet"),
    ],
)
def test_a_file_of_the_user_under_another_command_s_name(command, name, recordings, tmp_path, capsys):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / name).write_text("{}")
    what = "table-3" if command == "simulate" else recordings[0]
    refused_untouched(
        [command, what, "--out", tmp_path / "thesis"], tmp_path / "thesis", capsys, name, "did not write it"
    )


def test_other_files_beside_the_results_stay(recordings, tmp_path):
    out = tmp_path / "thesis"
    (out / FIGURES).mkdir(parents=True)
    mine = [out / "notes.txt", out / f".x{TEMPORARY_SUFFIX}", out / FIGURES / "mine.svg", out / FIGURES / "mine.pdf"]
    for path in mine:
        path.write_text("<svg>mine</svg>")
    left = out / f".points.parquet.123{TEMPORARY_SUFFIX}"
    left.write_text("half")  # what a killed run of ours leaves
    assert main(["triangulate", str(recordings[0]), "--out", str(out)]) == 0
    remove_figures(out)
    assert all(path.read_text() == "<svg>mine</svg>" for path in mine) and not left.exists()


def test_figures_of_the_user_are_not_written_over(recordings, tmp_path, capsys):
    mine = tmp_path / "thesis" / FIGURES / "path.svg"
    mine.parent.mkdir(parents=True)
    mine.write_text("<svg>mine</svg>")
    refused_untouched(
        ["run", recordings[0], "--out", tmp_path / "thesis", "--figures"], tmp_path / "thesis", capsys, str(mine)
    )


def test_pages_and_figures_are_known_as_ours(tmp_path):
    from matplotlib.figure import Figure

    from analysis.figures.style import save_figure
    from analysis.report.page import Page

    Page("title", "kind").write(tmp_path / "compare.html")
    for ending in ("svg", "pdf"):
        save_figure(Figure(), tmp_path / f"a.{ending}")
    assert {path.name: whose(path) for path in tmp_path.iterdir()} == dict.fromkeys(
        ("compare.html", "a.svg", "a.pdf"), "ours"
    )


def test_results_of_another_recording_are_refused(recordings, tmp_path, capsys):
    """README and tutorial into one folder: the page would show one's motion and the other's cameras."""
    one, other = recordings
    out = tmp_path / "results"
    assert main(["triangulate", str(one), "--out", str(out)]) == 0
    refused_untouched(["triangulate", other, "--out", out], out, capsys, str(one), "name another folder")
    refused_untouched(["triangulate", other.parent, "--out", out], out, capsys, str(one))
    refused_untouched(["compare", other, "--out", out], out, capsys, str(one))
    refused_untouched(["animate", other, "--results", out], out, capsys, str(one))
    assert main(["triangulate", str(one), "--out", str(out)]) == 0


def test_a_moved_recording_keeps_its_results(recordings, tmp_path, capsys):
    one, other = recordings
    out = tmp_path / "results"
    assert main(["triangulate", str(one), "--out", str(out)]) == 0
    shutil.copytree(one.parent, tmp_path / "moved")
    shutil.rmtree(one)
    assert main(["triangulate", str(tmp_path / "moved" / one.name), "--out", str(out)]) == 0
    assert "up to date" in capsys.readouterr().out
    assert main(["triangulate", str(other), "--out", str(out)]) == 2


def edited(path):
    """One value changed in another program that keeps the file's metadata."""
    table = pq.read_table(path)
    name = next(field.name for field in table.schema if pa.types.is_floating(field.type))
    values = table.column(name).to_pylist()
    values[3] += 1e-3
    at = table.schema.get_field_index(name)
    pq.write_table(table.set_column(at, table.schema.field(at), pa.chunked_array([values], pa.float64())), path)


def test_results_changed_by_hand_are_noticed(recordings, tmp_path, capsys):
    out = tmp_path / "results"
    command = ["triangulate", recordings[0], "--out", out]
    assert main([str(one) for one in command]) == 0
    provenance = read_provenance(out / "points.parquet")
    edited(out / "points.parquet")
    assert read_provenance(out / "points.parquet") == provenance and whose(out / "points.parquet") == "changed"
    refused_untouched(command, out, capsys, "points.parquet was changed", "recording.toml of its own")
    refused_untouched(["analyse", recordings[0], "--out", out], out, capsys, "points.parquet was changed")
    refused_untouched(["check", recordings[0], "--out", out], out, capsys, "points.parquet was changed")
    (out / "points.parquet").unlink()
    assert main([str(one) for one in command]) == 0


def test_the_same_values_in_another_encoding_are_as_written(recordings, tmp_path):
    path = recordings[0] / "tracks.parquet"
    table = pq.read_table(path)
    before = pd.DataFrame(read_table(path, "tracks"))
    pq.write_table(table, path, compression="zstd", use_dictionary=False, row_group_size=7)
    assert whose(path) == "ours"
    pd.testing.assert_frame_equal(read_table(path, "tracks"), before)
    edited(path)
    assert whose(path) == "changed"


def test_a_changed_calibration_and_page_are_noticed(tmp_path):
    from ovines.pipeline.runner import write_output
    from tests.conftest import two_cameras

    write_output(two_cameras(), tmp_path / "calibration.json", {"key": "a"})
    write_output("<p>0.72</p>", tmp_path / "report.html", {"key": "a"})
    for path in tmp_path.iterdir():
        assert whose(path) == "ours"
        text = path.read_text()
        path.write_text(text.replace("0.72", "0.73").replace("4096", "4097"))
        assert path.read_text() != text and whose(path) == "changed"


# --- files that the command line names --------------------------------------------------------------------------------


@pytest.fixture
def analysed(recordings, tmp_path):
    """A recording with its motion in a results folder."""
    assert main(["analyse", str(recordings[0]), "--out", str(tmp_path / "results")]) == 0
    return recordings[0], tmp_path / "results"


@pytest.mark.further
@pytest.mark.parametrize("name", ["raw.gif", "raw.mp4"])
def test_a_film_replaces_only_a_film_of_ours(name, analysed, tmp_path, capsys):
    folder, results = analysed
    mine = tmp_path / "films" / name
    mine.parent.mkdir()
    mine.write_bytes(b"a measurement")
    command = ["animate", folder, "--results", results, "--measured", "--start", 0.01, "--end", 0.0125, "--out", mine]
    refused_untouched(command, mine.parent, capsys, str(mine), "name another in --out")
    mine.unlink()
    for _ in range(2):
        assert main([str(one) for one in command]) == 0
    assert whose(mine) == "ours"
    import cv2

    assert cv2.VideoCapture(str(mine)).read()[0]  # the mark does no harm


def test_a_viewer_s_file_replaces_only_one_of_ours(analysed, tmp_path, capsys):
    pytest.importorskip("rerun")
    folder, results = analysed
    mine = tmp_path / "shown" / "mine.rrd"
    mine.parent.mkdir()
    mine.write_bytes(b"mine")
    command = ["view", folder, "--results", results, "--save", mine]
    refused_untouched(command, mine.parent, capsys, str(mine), "name another in --save")
    mine.unlink()
    for _ in range(2):
        assert main([str(one) for one in command]) == 0


def test_a_model_is_not_written_over_a_recording(recordings, capsys):
    one, _ = recordings
    for name in ("recording.toml", "tracks.parquet"):
        refused_untouched(["diagnose", one, "--write-model", one / name], one, capsys, name, "--write-model")


def test_names_are_not_copied_over_others(recordings, tmp_path, capsys):
    """Names that somebody clicked are an hour's work."""
    one, other = recordings
    (tmp_path / "mine.csv").write_text("camera,marker,u_px,v_px\nVW1,N1,1,2\n")
    (other / "names.csv").write_text("camera,marker,u_px,v_px\nVW1,N1,3,4\n")
    command = ["track", one, "--names", tmp_path / "mine.csv", "--out"]
    refused_untouched([*command, other], other, capsys, "recording.toml")
    results = tmp_path / "results"
    results.mkdir()
    (results / "names.csv").write_text("clicked")
    refused_untouched([*command, results], results, capsys, "names.csv is there already")


def test_figures_of_the_simulator_stand_alone(tmp_path, capsys):
    (tmp_path / "drops.png").write_bytes(b"mine")
    refused_untouched(["simulate", "--figures", tmp_path], tmp_path, capsys, "drops.png")
    refused_untouched(["simulate", "--figures", "table-3"], tmp_path, capsys, "put the scenario first")


def test_figures_of_a_run_replace_only_ours(tmp_path, capsys):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "paths.png").write_bytes(b"mine")
    command = ["simulate", "table-3", "--out", tmp_path, "--figures"]
    refused_untouched(command, tmp_path, capsys, "paths.png", "did not write it")
