"""`ovines run --cluster`: a real scheduler and real workers, one of them killed while it works."""

import os
import signal
import threading
import time

import pytest

from ovines.pipeline.series.cluster import run_on_cluster
from ovines.pipeline.series.recordings import Workers, run_series
from tests.conftest import refused


@pytest.fixture
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as running:
        yield running


def killer(cluster, out, killed):
    """Kill the worker process that first writes into ``out``, as soon as it holds a stage's result."""
    while not list(out.glob("run-0*/points.parquet")):
        time.sleep(0.02)
    from distributed import Client

    with Client(cluster, set_as_default=False) as client:
        processes = client.run(os.getpid)
        busy = {address for address, keys in client.processing().items() if keys}
    address = next(iter(sorted(busy)))
    os.kill(processes[address], signal.SIGKILL)
    killed.append(address)


@pytest.mark.long
def test_a_killed_worker_loses_nothing_and_changes_nothing(small_series, tmp_path, cluster):
    killed: list[str] = []
    thread = threading.Thread(target=killer, args=(cluster, tmp_path / "far", killed), daemon=True)
    thread.start()
    far = run_series(
        small_series, tmp_path / "far", "identify", workers=Workers(cluster=cluster.scheduler_address, bars=False)
    )
    thread.join(60)
    near = run_series(small_series, tmp_path / "near", "identify", workers=Workers(bars=False))
    assert killed, "no worker was killed: the test shows nothing"
    assert [one.status for one in far] == [one.status for one in near] == ["done"] * 4, far
    tables = sorted(path.relative_to(tmp_path / "near") for path in (tmp_path / "near").rglob("*.parquet"))
    assert len(tables) == 3 * 8 + 1
    for table in tables:
        assert (tmp_path / "far" / table).read_bytes() == (tmp_path / "near" / table).read_bytes(), table


def test_nobody_at_the_address(small_series, tmp_path, monkeypatch, ovines):
    pytest.importorskip("distributed")
    monkeypatch.setattr("ovines.pipeline.series.cluster.PATIENCE_S", 0.5)
    from ovines.errors import InputError

    with pytest.raises(InputError, match="a running Dask scheduler"):
        run_on_cluster([], None, False, False, "tcp://127.0.0.1:9", False)
    refused(ovines("run", small_series, "--cluster", "nonsense://x", "--out", tmp_path / "out"), "--cluster")
