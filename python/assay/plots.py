"""The paper's figures, and speed against error, with matplotlib.

Each function takes Results (or what Results.data() gave, which saves reading it again) and returns a matplotlib Figure. Colours,
dashes and marks are those of the report. Shown are today's versions of the paper's contenders, unless others are named; a part
that was not measured says so. `assay report` draws the same figures as SVG and PDF, without matplotlib."""

from __future__ import annotations

import math
import statistics
from typing import Any, Iterable, Optional, Union

from .errors import InputError

_MARKS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "triangle-down": "v", "cross": "x", "star": "*", "wye": "1"}


class _Data:
    """What `assay report --json` tells, by what plots ask for."""

    def __init__(self, results: Any):
        self.all = results if isinstance(results, dict) else results.data()
        self.facts = {each["name"]: each["facts"] for each in self.all["systems"]}
        self.units = {each["name"]: each["unit"] for each in self.all["catalogue"]}
        self.cells: dict[tuple[str, str, str], dict[float, dict]] = {}
        for cell in self.all["cells"]:
            of = self.cells.setdefault((cell["system"], cell["contender"], cell["measure"]), {})
            of[cell["timestep_ms"]] = cell
        self.speeds = {(view["system"], point["contender"], point["timestep_ms"]): point["speed"]["value"]
                       for view in self.all["views"] for point in view["points"] if point["speed"]}
        self.timed = {system for system, _, _ in self.speeds}

    def of(self, system: str, contender: str, measure: str) -> dict[float, dict]:
        return dict(sorted(self.cells.get((system, contender, measure), {}).items()))

    def measure_of(self, value: str) -> str:
        """The measure whose cells hold a value."""
        for each in self.all["catalogue"]:
            if each["name"] == value:
                return each["measure"]
        raise InputError(f"there is no value '{value}' in these results")

    @property
    def papers(self) -> list[str]:
        return self.all["papers"]

    def paper_figure(self, number: int) -> list[dict]:
        """What the paper's figure shows."""
        return self.all["paper_figures"][f"figure{number}"]


def _value(cell: dict, name: str) -> Optional[dict]:
    found = next((each for each in cell["values"] if each["name"] == name), None)
    return None if found is None or found["value"] is None else found


def _style(data: _Data, contender: str) -> dict:
    look = data.all["looks"].get(contender, {"light": "#1d2126", "dash": "", "mark": "circle"})
    dash = [float(part) for part in look["dash"].split()] if look["dash"] else []
    return {"color": look["light"], "marker": _MARKS.get(look["mark"], "o"), "markersize": 4, "linewidth": 1.2,
            "linestyle": (0, [part / 2 for part in dash]) if dash else "-"}


def _figure(width: float, height: float):
    # no window and no global state: the figure is the caller's
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _empty(axes: Any, text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color="0.5")
    axes.set_xticks([])
    axes.set_yticks([])


def _curves(data: _Data, axes: Any, system: str, value: str, title: str, contenders: Iterable[str]) -> dict[str, Any]:
    """A curve for each contender in logarithms, with a cross at the first timestep that gave nothing. On a system that was not
    timed the timesteps stand for the realtime factors. Returns handles for a legend."""
    handles: dict[str, Any] = {}
    measure = data.measure_of(value)
    for contender in contenders:
        points, bounds, fails_at = [], [], None
        for step, cell in data.of(system, contender, measure).items():
            speed = data.speeds.get((system, contender, step)) if system in data.timed else step
            if cell["outcome"] == "unsupported" or _value(cell, "restart_floor") is not None:
                continue
            error = _value(cell, value)
            if cell["outcome"] == "ok" and speed is not None and error is not None and abs(error["value"]) > 0:
                points.append((speed, abs(error["value"])))
                bounds.append(bool(error.get("bound")))
                fails_at = None
            elif cell["outcome"] != "ok" and fails_at is None:
                fails_at = speed if speed is not None else (points[-1][0] if points else None)
        style = _style(data, contender)
        if points:
            handles[contender] = axes.plot(*zip(*points), label=contender, **style)[0]
            for (x, y), bound in zip(points, bounds):
                if bound:
                    axes.annotate("", (x, y / 1.8), (x, y), arrowprops={"arrowstyle": "->", "color": style["color"]})
        if fails_at is not None:
            axes.plot([fails_at], [0.97], marker="X", color=style["color"], transform=axes.get_xaxis_transform(),
                      linestyle="none", markersize=6)
    if not handles:
        _empty(axes, "not measured")
        return handles
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, color="0.9", linewidth=0.5)
    axes.set_xlabel("realtime factor" if system in data.timed else "timestep (ms)")
    axes.set_ylabel(title)
    return handles


def _legend(figure: Any, handles: dict[str, Any]) -> None:
    if handles:
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize="small", frameon=False)


def speed_accuracy(results: Any, system: str, value: Optional[str] = None,
                   contenders: Optional[Iterable[str]] = None) -> Any:
    """Speed against an error of one system, a curve over timesteps for each contender; a cross where runs become unstable or
    fail. `value`: the error (default: the one that the report judges by). `contenders`: default, those that the report shows
    first."""
    data = _Data(results)
    view = next((each for each in data.all["views"] if each["system"] == system), None)
    if view is None:
        raise InputError(f"these results have no system '{system}': they have {', '.join(sorted(data.facts)) or 'none'}")
    value = value or view["main"]
    if value is None:
        raise InputError(f"no error was measured on '{system}'")
    if contenders is None:
        contenders = [name for name, look in data.all["looks"].items() if look["first"]]
    figure = _figure(7, 5)
    label = next((each["label"] for each in data.all["catalogue"] if each["name"] == value), value)
    unit = data.units.get(value, "")
    axes = figure.add_subplot()
    handles = _curves(data, axes, system, value, f"{label} ({unit})" if unit not in ("", "1") else label, contenders)
    axes.set_title(system)
    _legend(figure, handles)
    return figure


def _bars(data: _Data, axes: Any, system: str) -> None:
    by_step: dict[float, list[tuple[str, dict]]] = {}
    for contender in data.papers:
        for step, cell in data.of(system, contender, "raw_speed").items():
            speed = _value(cell, "raw_speed")
            if speed is not None:
                by_step.setdefault(step, []).append((contender, speed))
    if not by_step:
        _empty(axes, "not timed")
        return
    # the timestep nearest to 1 ms at which the most contenders were timed
    step = max(by_step, key=lambda each: (len(by_step[each]), -abs(math.log(each))))
    bars = sorted(by_step[step], key=lambda bar: bar[1]["value"])
    names, values = [bar[0] for bar in bars], [bar[1]["value"] for bar in bars]
    below = [value - bar[1].get("low", value) for value, bar in zip(values, bars)]
    above = [bar[1].get("high", value) - value for value, bar in zip(values, bars)]
    axes.barh(names, values, xerr=[below, above], color=[_style(data, name)["color"] for name in names], height=0.64,
              error_kw={"linewidth": 0.6, "capsize": 1.5})
    axes.set_xlabel(f"raw speed at {step:g} ms (kHz)")
    axes.tick_params(axis="y", labelsize="small")


def figure3(results: Any) -> Any:
    """The paper's figure 3: of each system raw speed (steps in a millisecond), and self-consistency error against speed."""
    data = _Data(results)
    figure = _figure(9, 12)
    handles: dict[str, Any] = {}
    for row, shown in enumerate(data.paper_figure(3)):
        system, title = shown["system"], shown["title"]
        bars, curves = figure.add_subplot(4, 2, 2 * row + 1), figure.add_subplot(4, 2, 2 * row + 2)
        dof = data.facts.get(system, {}).get("dof")
        bars.set_title(f"{title}, {dof:g} DOF" if dof else title, loc="left", fontweight="bold")
        _bars(data, bars, system)
        handles.update(_curves(data, curves, system, "consistency", "consistency error (m)", data.papers)
                       if any(data.of(system, name, "consistency") for name in data.papers)
                       else _empty(curves, "not measured") or {})
    _legend(figure, handles)
    return figure


def figure4(results: Any) -> Any:
    """The paper's figure 4: drift of energy and momenta against speed."""
    data = _Data(results)
    figure = _figure(11, 7)
    handles: dict[str, Any] = {}
    grid = figure.add_gridspec(2, 6)
    for i, plot in enumerate(data.paper_figure(4)):
        value = plot["value"]
        column = 2 * i if i < 3 else 2 * (i - 3) + 1
        axes = figure.add_subplot(grid[0 if i < 3 else 1, column:column + 2])
        axes.set_title(plot["title"], loc="left", fontweight="bold")
        system = next((each for each in plot["systems"] if any(_value(cell, value) is not None for name in data.papers
                                                       for cell in data.of(each, name, "drift").values())), None)
        if system is None:
            _empty(axes, "not measured")
        else:
            handles.update(_curves(data, axes, system, value, plot["axis"], data.papers))
    _legend(figure, handles)
    return figure


def _scaling(data: _Data, contender: str, contacts: bool) -> tuple[dict[float, tuple[float, float, float]], Optional[dict]]:
    """Processor seconds by number of bodies, of several seeds the median with the least and the most; the exponent."""
    seeds: dict[float, list[dict]] = {}
    exponent = None
    for system, facts in data.facts.items():
        if not facts.get("family") or bool(facts.get("contacts")) != contacts:
            continue
        for cell in data.of(system, contender, "scaling").values():
            time = _value(cell, "run_time")
            if time is not None and cell["outcome"] == "ok":
                seeds.setdefault(facts["bodies"], []).append(time)
            exponent = _value(cell, "scaling_exponent") or exponent
    return {bodies: (statistics.median(each["value"] for each in times), min(each.get("low", each["value"]) for each in times),
                     max(each.get("high", each["value"]) for each in times)) for bodies, times in sorted(seeds.items())}, exponent


def figure5(results: Any) -> Any:
    """The paper's figure 5: processor time of growing heaps of capsules, with contacts and without."""
    data = _Data(results)
    figure = _figure(9, 4)
    for i, solver in enumerate(data.paper_figure(5)):
        axes = figure.add_subplot(1, 2, i + 1)
        axes.set_title(solver["title"], loc="left", fontweight="bold")
        contender = next((each for each in solver["contenders"] if any(_scaling(data, each, on)[0] for on in (True, False))), None)
        if contender is None:
            _empty(axes, "not measured")
            continue
        style = _style(data, contender)
        for contacts in (True, False):
            seconds, exponent = _scaling(data, contender, contacts)
            if not seconds:
                continue
            label = "contacts" if contacts else "no contacts"
            if exponent is not None:
                label += f", grows as N^{exponent['value']:.2f}"
            middle = [each[0] for each in seconds.values()]
            axes.errorbar(list(seconds), middle,
                          yerr=[[each[0] - each[1] for each in seconds.values()], [each[2] - each[0] for each in seconds.values()]],
                          label=label, color=style["color"], marker=style["marker"], markersize=4, linewidth=1.2,
                          linestyle="-" if contacts else "--", fillstyle="full" if contacts else "none")
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("number of capsules N")
        axes.set_ylabel("processor time (s)")
        axes.legend(fontsize="small", frameon=False)
    return figure


def grasp_table(results: Any) -> Any:
    """The paper's table of grasps: at which timesteps the object stays in the hand."""
    data = _Data(results)
    rows = {name: data.of("grasp", name, "grasp") for name in data.papers if data.of("grasp", name, "grasp")}
    steps = sorted({step for cells in rows.values() for step in cells})
    figure = _figure(8, 1.2 + 0.3 * max(1, len(rows)))
    axes = figure.add_subplot()
    if not rows:
        _empty(axes, "not measured")
        return figure
    marks: dict[str, Union[list, Any]] = {"held": [], "dropped": [], "unstable or failed": []}
    largest = {}
    for y, (contender, cells) in enumerate(rows.items()):
        for step, cell in cells.items():
            held = _value(cell, "grasp_held")
            if cell["outcome"] == "unsupported" or (cell["outcome"] == "ok" and held is None):
                continue
            kind = "unstable or failed" if cell["outcome"] != "ok" else "held" if held["value"] == 1 else "dropped"
            marks[kind].append((steps.index(step), y))
            if _value(cell, "largest_stable_timestep") is not None:
                largest[contender] = step
    for (kind, places), (marker, color, fill) in zip(marks.items(), (("o", "#1463c4", "full"), ("v", "#d4590c", "none"),
                                                                     ("x", "0.1", "full"))):
        axes.plot([x for x, _ in places], [y for _, y in places], linestyle="none", marker=marker, color=color, fillstyle=fill,
                  label=kind)
    axes.set_xticks(range(len(steps)), [f"{step:g}" for step in steps])
    axes.set_yticks(range(len(rows)), [f"{name}  (holds to {largest[name]:g} ms)" if name in largest else name for name in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("timestep (ms)")
    figure.legend(loc="outside lower center", ncols=3, fontsize="small", frameon=False)
    return figure
