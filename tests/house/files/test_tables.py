"""Every table of the contract, checked on reading and on writing."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ovines.errors import InputError
from ovines.tables import TABLES, checked, read_provenance, read_table, write_table
from tests.conftest import drawn


def tracks(frames=(0, 1, 2), times_s=(0.0, 0.1, 0.2), **changes):
    count = len(frames)
    columns = {
        "camera": ["VW1"] * count, "frame": list(frames), "time_s": list(times_s), "marker": ["N1"] * count,
        "u_px": np.arange(count) + 0.5, "v_px": np.arange(count) - 0.25, "sd_px": [0.1, None, 0.2][:count],
    }  # fmt: skip
    return pd.DataFrame(columns | changes)


def test_contract_columns_are_declared():
    """The columns that FORMATS.md promises, with the units their names end in."""
    contract = {
        "tracks": "camera frame time_s marker u_px v_px sd_px",
        "points": "frame time_s marker x_m y_m z_m x_sd_m y_sd_m z_sd_m reprojection_px",
        "motion": "frame time_s nes_x_m nes_y_m nes_z_m nes_angle_rad host_x_m host_y_m host_z_m host_angle_rad "
        "nes_vx_m_per_s",
        "impacts": "impact time_s time_sd_s azimuth_rad normal_speed_before_m_per_s normal_speed_after_m_per_s "
        "tangential_speed_before_m_per_s tangential_speed_after_m_per_s spin_before_rad_per_s spin_after_rad_per_s "
        "restitution restitution_sd tangential_restitution wall_friction regime",
        "identification": "parameter value sd low high n_impacts",
        "predictions": "run frame time_s quantity measured as_given recalibrated with_effect",
        "contact": "start_s end_s",
    }
    for name, columns in contract.items():
        assert set(columns.split()) <= set(TABLES[name].names), name
    units = {"u_px": "px", "time_s": "s"}
    assert {name: TABLES["tracks"].column(name).unit for name in units} == units
    assert TABLES["motion"].column("nes_vx_m_per_s").unit == "m/s"
    assert TABLES["motion"].column("host_spin_rad_per_s").unit == "rad/s"
    assert TABLES["impacts"].column("restitution_sd").unit == "1"


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "tracks.parquet"
    provenance = {"version": "1", "command": "track", "parameters": {"a": 1}, "inputs": {"x": "ab"}}
    write_table(tracks(), "tracks", path, provenance)
    back = read_table(path, "tracks")
    pd.testing.assert_frame_equal(back, checked(tracks(), "tracks"))
    assert read_provenance(path) == provenance
    schema = pq.read_schema(path)
    assert schema.field("u_px").metadata[b"unit"] == b"px"
    assert pq.read_table(path).column("sd_px").null_count == 1, "missing is null in the file, not NaN"
    assert [entry.name for entry in tmp_path.iterdir()] == ["tracks.parquet"]


def test_narrow_types_of_others_are_taken(tmp_path):
    path = tmp_path / "tracks.parquet"
    table = pa.table(
        {
            "camera": pa.array(["VW1", "VW2"]).dictionary_encode(),
            "frame": pa.array([3, 3], pa.int16()),
            "time_s": pa.array([0.5, 0.5], pa.float32()),
            "marker": pa.array(["N1", "N1"], pa.large_string()),
            "u_px": pa.array([1, 2], pa.int32()),
            "v_px": pa.array([1.0, 2.0], pa.float32()),
            "sd_px": pa.nulls(2),
            "note": pa.array(["mine", "too"]),
        }
    )
    pq.write_table(table, path)
    back = read_table(path, "tracks")
    assert list(back.columns) == list(TABLES["tracks"].names)
    assert back["frame"].dtype == np.int64 and back["u_px"].dtype == np.float64
    assert back["sd_px"].isna().all()


def test_an_entry_at_motion_may_lack_angle_and_sd(tmp_path):
    path = tmp_path / "motion.parquet"
    bodies = {f"{body}_{axis}_m": [0.0, 0.1] for body in ("nes", "host") for axis in "xyz"}
    frame = pd.DataFrame({"frame": [0, 1], "time_s": [0.0, 0.1], "nes_angle_rad": [None, None], **bodies})
    pq.write_table(pa.Table.from_pandas(frame), path)
    back = read_table(path, "motion")
    assert set(back.columns) == set(TABLES["motion"].names)
    assert back["nes_angle_rad"].isna().all() and back["nes_x_sd_m"].isna().all()


WRONG = {
    "missing column": (tracks().drop(columns="u_px"), "no column u_px"),
    "NaN where a value must be": (tracks(u_px=[1.0, np.nan, 2.0]), "u_px is missing (null or NaN) in row 1"),
    "infinite": (tracks(v_px=[1.0, np.inf, 2.0]), "v_px is infinite in row 1"),
    "text for a number": (tracks(u_px=["a", "b", "c"]), "u_px is of type"),
    "number for text": (tracks(marker=[1, 2, 3]), "marker is of type"),
    "flags for numbers": (tracks(u_px=[True, False, True]), "u_px is of type bool"),
    "half a frame": (tracks(frames=(0.5, 1, 2)), "frame holds"),
    "negative frame": (tracks(frames=(-1, 0, 1)), "frame is -1 in row 0"),
    "frame twice": (tracks(frames=(0, 1, 1)), "frame 1, marker N1 stands more than once"),
    "time stands still": (
        tracks(times_s=(0.0, 0.1, 0.1)),
        "frame 1 of VW1 at 0.1 s is followed by frame 2, at 0.1 s",
    ),
    "time runs back": (tracks(times_s=(0.0, 0.2, 0.1)), "is followed by"),
    "NaN time": (tracks(times_s=(0.0, np.nan, 0.1)), "time_s is missing"),
    "two times of a frame": (tracks(frames=(0, 1, 1), marker=["N1", "N1", "N2"]), "has two times"),
    "instants": (tracks(time_s=pd.to_datetime(["2020", "2021", "2022"])), "time_s is of type datetime"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_tables_are_refused(case, tmp_path):
    frame, reason = WRONG[case]
    path = tmp_path / "tracks.parquet"
    pq.write_table(pa.Table.from_pandas(frame), path)
    with pytest.raises(InputError) as refusal:
        read_table(path, "tracks")
    assert reason in refusal.value.found
    assert str(path) in refusal.value.found
    with pytest.raises(ValueError, match="table 'tracks'"):
        write_table(frame, "tracks", tmp_path / "new.parquet", {})
    assert not (tmp_path / "new.parquet").exists()


def two_cameras_tracks(frames=(0, 1, 2), times_s=(0.0, 0.1, 0.2)):
    """Two markers in every frame of two cameras, in the order of the key; frames and times are the second camera's."""
    parts = [
        pd.concat([tracks(*clock, camera=camera), tracks(*clock, camera=camera, marker="N2")])
        for camera, clock in (("VW1", ((0, 1, 2), (0.0, 0.1, 0.2))), ("VW2", (frames, times_s)))
    ]
    return pd.concat(parts).sort_values(["camera", "frame", "marker"], ignore_index=True)


@pytest.mark.parametrize("order", [slice(None, None, -1), [7, 2, 9, 4, 0, 11, 1, 6, 3, 10, 8, 5]], ids=str)
def test_rows_in_order_are_the_table_that_they_are_in_any_other(order):
    """What stands in order is neither sorted nor looked through for repetitions."""
    table = two_cameras_tracks()
    pd.testing.assert_frame_equal(checked(table, "tracks"), table)
    pd.testing.assert_frame_equal(checked(table.iloc[order], "tracks"), table)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (two_cameras_tracks(times_s=(0.0, 0.1, 0.1)), "frame 1 of VW2 at 0.1 s is followed by frame 2, at 0.1 s"),
        (two_cameras_tracks(times_s=(0.3, 0.2, 0.4)), "frame 0 of VW2 at 0.3 s is followed by frame 1, at 0.2 s"),
        # The second camera begins with the frame and the time with which the first one ends.
        (two_cameras_tracks((2, 3, 4), (0.2, 0.1, 0.3)), "frame 2 of VW2 at 0.2 s is followed by frame 3, at 0.1 s"),
        (
            two_cameras_tracks().assign(time_s=lambda rows: rows["time_s"] + 0.01 * (rows.index == 9)),
            "frame 1 of VW2 at 0.1 s has two times, at 0.11 s",
        ),
    ],
)
@pytest.mark.parametrize("order", [slice(None), slice(None, None, -1)], ids=["in order", "turned round"])
def test_a_clock_that_does_not_go_forward_is_refused_in_any_order(table, words, order):
    if "two times" in words and order.step:
        words = "frame 1 of VW2 at 0.11 s has two times, at 0.1 s"  # which of them stands first
    with pytest.raises(InputError) as refused:
        checked(table.iloc[order], "tracks")
    assert words in str(refused.value)


def test_an_undeclared_column_is_not_written(tmp_path):
    with pytest.raises(ValueError, match="undeclared columns colour"):
        write_table(tracks().assign(colour="red"), "tracks", tmp_path / "t.parquet", {})


def test_a_truncated_file_is_refused(tmp_path):
    path = tmp_path / "tracks.parquet"
    write_table(tracks(), "tracks", path, {})
    whole = path.read_bytes()
    for length in (0, 3, 10, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match="cannot be read as Parquet"):
            read_table(path, "tracks")
        assert read_provenance(path) is None


@drawn(60)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(tmp_path, data):
    """Bytes changed anywhere: a DataFrame that keeps the declaration, or InputError; nothing else."""
    path = tmp_path / "damaged.parquet"
    write_table(tracks(), "tracks", path, {})
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    try:
        frame = read_table(path, "tracks")
    except InputError:
        return
    assert list(frame.columns) == list(TABLES["tracks"].names)


@drawn(40)
@given(
    st.lists(
        st.tuples(st.integers(0, 10**6), st.floats(allow_nan=True, allow_infinity=False)),
        unique_by=lambda r: r[0],
    )
)
def test_any_declared_content_survives(tmp_path, rows):
    frame = pd.DataFrame(
        {
            "parameter": [f"p{number}" for number, _ in rows],
            **{
                name: pd.Series([abs(value) if name == "sd" else value for _, value in rows], dtype=float)
                for name in ("value", "sd", "low", "high")
            },
            "n_impacts": pd.Series([number for number, _ in rows], dtype="Int64"),
        }
    )
    write_table(frame, "identification", tmp_path / "i.parquet", {})
    pd.testing.assert_frame_equal(
        read_table(tmp_path / "i.parquet", "identification"), checked(frame, "identification")
    )
