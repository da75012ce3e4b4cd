"""A sampled trigger becomes frame times."""

import numpy as np
import pandas as pd
import pytest

from analysis.accelerometers.trigger_figure import trigger_figure
from ovines.__main__ import main
from ovines.errors import InputError
from ovines.importers.formats.trigger_signal import frame_times_s
from ovines.recording import read_trigger

RATE_HZ, PERIOD_S, OPEN_S, FIRST_S = 50_000.0, 1.25e-3, 0.8e-3, 3.1e-3


def pulses(rng, count=40):
    """Exposure gates of the thesis (period 1250 us, open 800 us), 5 V with edges of 40 us and noise, sampled at 50 kHz;
    true middles.
    """
    time_s = np.arange(0.0, FIRST_S + (count + 1) * PERIOD_S, 1 / RATE_HZ)
    rise = FIRST_S + PERIOD_S * np.arange(count) + 2e-6 * rng.standard_normal(count)
    edge = 20e-6
    signal = sum(
        np.interp(time_s, [a - edge, a + edge, a + OPEN_S - edge, a + OPEN_S + edge], [0, 5, 5, 0]) for a in rise
    )
    return time_s, signal + 0.02 * rng.standard_normal(len(time_s)), rise


def test_middles_and_rises_within_a_microsecond():
    time_s, signal, rise = pulses(np.random.default_rng(1))
    assert np.abs(frame_times_s(time_s, signal, "rise") - rise).max() < 1e-6
    assert np.abs(frame_times_s(time_s, signal, "middle") - rise - OPEN_S / 2).max() < 1e-6
    late = time_s > FIRST_S + 0.5 * OPEN_S  # begins within a pulse
    assert len(frame_times_s(time_s[late], signal[late], "middle")) == len(rise) - 1


def test_what_is_no_pulse_train_is_refused():
    rng = np.random.default_rng(2)
    time_s, signal, _ = pulses(rng)
    for wrong in (np.zeros_like(signal), rng.standard_normal(len(signal))):
        with pytest.raises(InputError):
            frame_times_s(time_s, wrong, "rise")


def test_the_picture_has_the_signal_over_a_perfect_clock():
    """Both pulse trains rise together at the first frame shown, and an interval that is 20 us too long stands out."""
    time_s, signal, rise = pulses(np.random.default_rng(4))
    late = rise[:-1] + 20e-6 * (np.arange(len(rise) - 1) >= 30)
    close, whole = trigger_figure(time_s, signal, late, 1 / PERIOD_S, "rise").axes
    clock, measured = close.lines[0], close.lines[1]
    x, y = clock.get_xdata(), clock.get_ydata()
    ups = x[1:][np.diff(y) > 0]
    assert np.abs(ups[1] - 0.0) < 1e-9 and np.allclose(np.diff(ups), 1e3 * PERIOD_S, rtol=1e-9)
    downs = x[1:][np.diff(y) < 0]
    assert np.abs(downs[1] - 1e3 * OPEN_S) < 1e3 * 3 / RATE_HZ
    assert np.ptp(measured.get_ydata()) > 4.9
    off = whole.lines[0].get_ydata()
    assert np.argmax(off) == 29 and abs(off.max() - 20.0) < 10.0  # intervals scatter by 2.8 us


def test_the_command(tmp_path, capsys):
    time_s, signal, rise = pulses(np.random.default_rng(3))
    assert main(["new", str(tmp_path / "run"), "--usual"]) == 0
    pd.DataFrame({"time_s": time_s, "gate_v": signal}).to_csv(tmp_path / "gate.csv", index=False)
    command = ["import", str(tmp_path / "run"), "--trigger-signal", str(tmp_path / "gate.csv")]
    assert main(command) == 0 and "800" in capsys.readouterr().out
    frames, times_s = read_trigger(tmp_path / "run" / "trigger.csv")
    assert len(frames) == len(rise) and np.abs(times_s - rise - OPEN_S / 2).max() < 1e-6
    picture = (tmp_path / "run" / "trigger_signal.svg").read_text(encoding="utf-8")
    assert "perfect clock, 800 per second" in picture and (tmp_path / "run" / "trigger_signal.png").is_file()
    assert main(command) == 2 and "--force" in capsys.readouterr().err
    (tmp_path / "gate.csv").write_text("a,b\n1,2\n")
    assert main([*command, "--force"]) == 2
