"""Campaigns: progress, resuming, tables, recommendations."""

import os
import signal
import threading

import assay
import numpy as np
import pytest
from assay import _progress
from assay._program import call
from conftest import CAMPAIGN

MEASURES = {"raw_speed", "consistency", "truth_error_max", "energy_drift"}


def test_progress_is_told_event_by_event(measured):
    results, events = measured
    kinds = [each["event"] for each in events]
    assert {"plan", "begin", "phase", "finished", "end"} <= set(kinds)
    begin = next(each for each in events if each["event"] == "begin")
    finished = [each for each in events if each["event"] == "finished"]
    assert begin["done"] == 0 and len(finished) == begin["cells"] == finished[-1]["done"]
    assert {each["contender"] for each in finished} == {"mujoco-euler", "ode-quick", "bullet-si-f64"}
    assert all(each["left_s"] >= 0 for each in finished)
    assert f"{begin['cells']} cells" in results.summary
    assert results.status()["done"] == results.status()["planned"]


def test_the_same_call_resumes(measured, campaign):
    results, _ = measured
    again = []
    assay.run(campaign, results.folder, progress=again.append)
    begin = next(each for each in again if each["event"] == "begin")
    assert begin["cells"] == begin["done"] > 0
    assert not [each for each in again if each["event"] == "finished"]


def test_an_interrupt_loses_no_finished_cell(campaign, tmp_path):
    seen = []

    def progress(event):
        seen.append(event)
        if len([each for each in seen if each["event"] == "finished"]) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        assay.run(campaign, tmp_path / "results", progress=progress)
    status = assay.Results(tmp_path / "results").status()
    assert 2 <= status["done"] < status["planned"]
    rest = []
    results = assay.run(campaign, tmp_path / "results", progress=rest.append)
    begin = next(each for each in rest if each["event"] == "begin")
    assert begin["done"] >= 2 and results.status()["done"] == status["planned"]


def test_values_as_tables(measured):
    results, _ = measured
    pandas = pytest.importorskip("pandas")
    polars = pytest.importorskip("polars")
    rows = results.values("dicts")
    table = results.values()
    other = results.values(frame="polars")
    assert isinstance(table, pandas.DataFrame) and isinstance(other, polars.DataFrame)
    assert len(table) == len(rows) == other.height == len(call("export", results.folder, "--format", "csv").splitlines()) - 1
    assert list(table.columns) == other.columns == list(rows[0])
    assert MEASURES <= set(table["measure"])
    assert table["value"].dtype == float and table["timestep_ms"].dtype == float
    assert np.array_equal(table["value"].to_numpy(), other["value"].to_numpy(), equal_nan=True)
    errors = table[(table.measure == "consistency") & (table.contender == "mujoco-euler")].set_index("timestep_ms")["value"]
    assert errors[4] > errors[2] > 0  # a method of first order
    with pytest.raises(assay.InputError, match="frame is 'arrow': give pandas, polars or dicts"):
        results.values("arrow")


def test_states_as_arrays(measured):
    results, _ = measured
    states = results.trajectories()
    run = states["planar-chain", "mujoco-euler"]
    samples = len(run["time"])
    assert run["position"].shape == (samples, 5, 3) and run["angle"].shape == (samples, 5)
    own = assay.Simulation(assay.load("planar-chain"), "mujoco-euler", float(run["timestep_ms"]))
    every = round((run["time"][1] - run["time"][0]) * 1e3 / own.timestep_ms)
    mine = own.rollout((samples - 1) * every, every=every)
    assert np.array_equal(mine.bodies[:, :, :3], run["position"])


def test_a_recommendation(measured):
    results, _ = measured
    found = results.recommend("planar-chain", error="1m")
    assert found["recommended"]["contender"] in ("mujoco-euler", "ode-quick", "bullet-si-f64")
    none = results.recommend("planar-chain", error="0.001nm")
    assert none["recommended"] is None and none["nearest"]["contender"] in ("mujoco-euler", "ode-quick", "bullet-si-f64")
    with pytest.raises(assay.InputError, match="no limit was given"):
        results.recommend("planar-chain")
    with pytest.raises(assay.InputError, match="did you mean 'planar-chain'"):
        results.recommend("planar-chian", error="1mm")
    limited = results.recommend("planar-chain", limits={"energy_drift": "1000J"})
    assert limited["limits"][0]["value"] == "energy_drift"


def test_what_changed(measured, campaign, tmp_path):
    results, _ = measured
    again = assay.run(campaign, tmp_path / "again", progress=False)
    found = results.compare(again)
    rows = found.changes("dicts")
    # accuracy is the same, bit by bit
    errors = [row for row in rows if row["measure"] in ("consistency", "truth", "drift")]
    assert errors and all(row["a"] == row["b"] for row in errors)
    assert found.markdown().startswith("#")
    assert len(found.changes()) == len(rows)


def test_report_data_and_claims(measured):
    results, _ = measured
    page = results.report()
    assert page.is_file() and "</html>" in page.read_text(encoding="utf-8")[-200:]
    data = results.data()
    assert {each["name"] for each in data["systems"]} == {"planar-chain"}
    assert set(data["papers"]) == {"mujoco-euler", "ode-quick", "bullet-si-f64"}
    assert "replays" not in data and all("samples" not in cell for cell in data["cells"])
    assert len(results.claims()) > 0


def test_mistakes(tmp_path, measured):
    with pytest.raises(assay.InputError, match="holds no results"):
        assay.Results(tmp_path)
    with pytest.raises(assay.InputError, match="'assay run' has no option '--eror'"):
        assay.run("planar-chain", tmp_path / "r", eror="1mm")
    with pytest.raises(assay.InputError, match="did you mean 'quick'"):
        assay.run("quik", tmp_path / "r", full=True)
    bad = tmp_path / "bad.toml"
    bad.write_text("name = ")
    with pytest.raises(assay.InputError, match="bad.toml"):
        assay.run(bad, tmp_path / "r")
    results, _ = measured
    with pytest.raises(assay.InputError, match="progress is 'loud'"):
        call("run", "quick", "--out", tmp_path / "r", "--progress", "loud")


def test_a_bar_in_a_notebook():
    pages = []

    class Handle:
        def update(self, page):
            pages.append(page)

    def display(page, display_id):
        assert display_id
        pages.append(page)
        return Handle()

    bar = _progress.Notebook(display)
    bar.event({"event": "begin", "cells": 10, "done": 0, "left_s": 120.0})
    bar.event({"event": "message", "text": "note: <b>"})
    bar.last = 0
    bar.event({"event": "finished", "cells": 10, "done": 4, "left_s": 61.4})
    assert "4/10 cells, 1 min 01 s left" in repr(pages[-1])
    assert "value='0.4000'" in pages[-1]._repr_html_() and "note: &lt;b&gt;" in pages[-1]._repr_html_()
    bar.end("10 cells in 2 s\n")
    assert "10 cells in 2 s" in pages[-1]._repr_html_()


def test_the_command_of_the_package(tmp_path):
    import subprocess
    import sys

    command = os.path.join(os.path.dirname(sys.executable), "assay")
    done = subprocess.run([command, "systems"], capture_output=True, text=True, check=True)
    assert "humanoid" in done.stdout
    # signals reach the program: it takes the process's place
    file = tmp_path / "long.toml"
    file.write_text(CAMPAIGN.replace("rounds = 2", "rounds = 2000"))
    child = subprocess.Popen([command, "run", file, "--out", tmp_path / "r", "--progress", "json"], stderr=subprocess.PIPE,
                             stdout=subprocess.DEVNULL, text=True)
    timer = threading.Timer(600, child.kill)
    timer.start()
    for line in child.stderr:
        if '"begin"' in line:
            child.send_signal(signal.SIGTERM)
            break
    said = child.stderr.read()
    assert child.wait() == 1 and "resumes" in said
    timer.cancel()
