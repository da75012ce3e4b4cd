"""Files with anything in them: read, or refused as `InputError`; never another exception, never a hang."""

import json
import string

from hypothesis import given
from hypothesis import strategies as st

from ovines.camera import read_calibration, write_calibration
from ovines.errors import InputError
from ovines.plausibility.names import read_names
from ovines.recording import read_recording, read_trigger
from tests.conftest import drawn, recording_toml, two_cameras

MANY = drawn(200)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.integers(10**300, 10**310) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)
CELLS = st.text(string.digits + ".,;-+eEnainfx \n\"'", max_size=12)


def read_or_refuse(read, *arguments):
    try:
        return read(*arguments)
    except InputError as error:
        assert error.found and error.expected and error.do
        return None


@MANY
@given(data=st.data())
def test_calibration(tmp_path, data):
    """One value of a good file replaced by anything, at any depth."""
    path = tmp_path / "calibration.json"
    write_calibration(two_cameras(), path)
    content = json.loads(path.read_text())
    here = content
    while True:
        keys = list(here) if isinstance(here, dict) else list(range(len(here)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(here[key], (dict, list)) or not here[key] or data.draw(st.booleans()):
            here[key] = data.draw(JSON)
            break
        here = here[key]
    path.write_text(json.dumps(content))
    cameras = read_or_refuse(read_calibration, path)
    assert cameras is None or all(camera.matrix.shape == (3, 3) for camera in cameras)


@MANY
@given(st.binary(max_size=200))
def test_any_bytes(tmp_path, content):
    path = tmp_path / "any"
    path.write_bytes(content)
    read_or_refuse(read_calibration, path)
    read_or_refuse(read_trigger, path)
    (tmp_path / "recording.toml").write_bytes(content)
    read_or_refuse(read_recording, tmp_path)


@MANY
@given(st.lists(st.tuples(CELLS, CELLS), max_size=5))
def test_trigger(tmp_path, rows):
    path = tmp_path / "trigger.csv"
    path.write_text("frame,time_s\n" + "\n".join(",".join(row) for row in rows))
    found = read_or_refuse(read_trigger, path)
    if found is not None:
        frames, times_s = found
        assert (frames[1:] > frames[:-1]).all() and (times_s[1:] > times_s[:-1]).all()


@MANY
@given(
    st.lists(
        st.tuples(st.sampled_from(["VW1", "VW9", ""]), st.sampled_from(["N1", "N2", "X"]), CELLS, CELLS),
        max_size=4,
    )
)
def test_names(tmp_path, rows):
    (tmp_path / "recording.toml").write_text(recording_toml())
    path = tmp_path / "names.csv"
    path.write_text("camera,marker,u_px,v_px\n" + "\n".join(",".join(row) for row in rows))
    found = read_or_refuse(read_names, path, read_recording(tmp_path))
    assert found is None or not found.duplicated(["camera", "marker"]).any()
