"""The paper's figures from results."""

import assay
import pytest

pytest.importorskip("matplotlib")


def curves(axes):
    return {line.get_label(): line for line in axes.get_lines() if not line.get_label().startswith("_")}


def test_speed_against_error(measured, tmp_path):
    results, _ = measured
    figure = assay.plots.speed_accuracy(results, "planar-chain", "consistency")
    (axes,) = figure.axes
    drawn = curves(axes)
    assert set(drawn) == {"mujoco-euler", "ode-quick", "bullet-si-f64"}
    assert axes.get_xscale() == axes.get_yscale() == "log"
    values = {row["timestep_ms"]: row["value"] for row in results.values("dicts")
              if row["measure"] == "consistency" and row["contender"] == "mujoco-euler"}
    # the reference's own timestep is no point of it
    assert sorted(drawn["mujoco-euler"].get_ydata()) == pytest.approx([values[2], values[4]])
    # larger timesteps are faster and less accurate
    xs, ys = drawn["mujoco-euler"].get_data()
    assert (xs[0] < xs[1]) == (ys[0] < ys[1])
    figure.savefig(tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 10_000
    with pytest.raises(assay.InputError, match="no system 'humanoid': they have planar-chain"):
        assay.plots.speed_accuracy(results, "humanoid")
    with pytest.raises(assay.InputError, match="no value 'beauty'"):
        assay.plots.speed_accuracy(results, "planar-chain", "beauty")


def test_the_papers_figures(measured):
    results, _ = measured
    data = results.data()
    three = assay.plots.figure3(data)
    assert len(three.axes) == 8
    bars, plot = three.axes[4], three.axes[5]
    assert {text.get_text() for text in bars.get_yticklabels()} == {"mujoco-euler", "ode-quick", "bullet-si-f64"}
    assert len(curves(plot)) == 3
    assert [text.get_text() for text in three.axes[0].texts] == ["not timed"]
    four = assay.plots.figure4(data)
    assert [bool(curves(axes)) for axes in four.axes] == [False, False, False, True, True]
    assert [text.get_text() for axes in assay.plots.figure5(data).axes for text in axes.texts] == ["not measured"] * 2
    assert assay.plots.grasp_table(data).axes[0].texts[0].get_text() == "not measured"


def row(contender, step, outcome, **values):
    return {"system": "grasp", "contender": contender, "timestep_ms": step, "measure": "grasp", "outcome": outcome,
            "values": [{"name": name, "value": value} for name, value in values.items()]}


def test_the_table_of_grasps():
    data = {"systems": [], "catalogue": [], "views": [], "looks": {}, "papers": ["a", "b"],
            "cells": [row("a", 1, "ok", grasp_held=1), row("a", 4, "ok", grasp_held=1, largest_stable_timestep=4),
                      row("a", 16, "ok", grasp_held=0), row("b", 1, "unstable"), row("b", 4, "unsupported")]}
    (axes,) = assay.plots.grasp_table(data).axes
    marks = {line.get_label(): list(zip(*line.get_data())) for line in axes.get_lines()}
    assert marks == {"held": [(0, 0), (1, 0)], "dropped": [(2, 0)], "unstable or failed": [(0, 1)]}
    assert [text.get_text() for text in axes.get_yticklabels()] == ["a  (holds to 4 ms)", "b"]


def capsules(bodies, contacts, seconds):
    name = f"capsules-{bodies}{'' if contacts else '-free'}"
    return ({"name": name, "facts": {"family": "capsules", "bodies": bodies, "contacts": contacts}},
            {"system": name, "contender": "mujoco-euler-cg", "timestep_ms": 1, "measure": "scaling", "outcome": "ok",
             "values": [{"name": "run_time", "value": seconds, "low": seconds * 0.9, "high": seconds * 1.1},
                        {"name": "scaling_exponent", "value": 1.25}]})


def test_growing_heaps():
    made = [capsules(10, True, 1.0), capsules(20, True, 2.5), capsules(10, False, 0.5)]
    data = {"systems": [each[0] for each in made], "cells": [each[1] for each in made], "catalogue": [], "views": [], "looks": {},
            "papers": []}
    sparse, dense = assay.plots.figure5(data).axes
    assert [text.get_text() for text in dense.texts] == ["not measured"]
    labels = [text.get_text() for text in sparse.get_legend().get_texts()]
    assert labels == ["contacts, grows as N^1.25", "no contacts, grows as N^1.25"]
    assert list(sparse.containers[0].lines[0].get_xdata()) == [10, 20]
    assert list(sparse.containers[0].lines[0].get_ydata()) == [1.0, 2.5]
