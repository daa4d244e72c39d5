"""Write docs/correlation-figures.md, .csv and a picture: error of correlation against run time.

Usage: ``python benchmarks/dic_figures.py``; about two minutes. Peers stand beside ours where they
are installed (extra ``peers``: pyvale, al-dic; OpenCV's PyrLK is always there). CPU times are of
one thread and the median of some runs.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import csv
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
from dic_peers import Peer, al_dic_field, pyramid, pyvale_field
from numpy.typing import NDArray

import dic
import synthetic
from synthetic import formulas

DOCS = Path(__file__).parent.parent / "docs"
SIDE, SCALE, NOISE = 512, 0.25, 2.0  # px, mm per px, grey levels
BORDER = 45  # px, kept by every window of subsets
SIZE = (SIDE * SCALE, SIDE * SCALE)
CAMERA = synthetic.telecentric_above(SIZE, (SIDE, SIDE), 0.0)
SHIFT, AMPLITUDE, PERIODS = (0.4, -0.3), (0.5, 0.4), (110.0, 140.0)  # px
MOTIONS = {
    "shift": formulas.Polynomial(((SHIFT[0] * SCALE,),), ((SHIFT[1] * SCALE,),)),
    "waves": formulas.Wave(
        (AMPLITUDE[0] * SCALE, AMPLITUDE[1] * SCALE),
        (1 / PERIODS[0] / SCALE, 1 / PERIODS[1] / SCALE),
    ),
}
LENGTH = 1 / np.hypot(1 / PERIODS[0], 1 / PERIODS[1])  # px, of the waves
SUBSETS, STEPS = (11, 15, 21, 31, 41), (2, 3, 10, 20)
SMOOTHED = ((11, 9), (15, 7), (15, 9), (15, 11), (21, 9))  # subset, window


@dataclass(frozen=True)
class Line:
    """One setting of one code: times in ms, errors in px (root mean square of both components)."""

    code: str
    subset: int
    step: int
    order: str
    window: str
    interpolation: str
    points: int
    from_nothing: float
    next_frame: float
    shift: float
    waves: float


def main() -> None:
    """Measure and write."""
    mpl.use("Agg")
    cv2.setNumThreads(1)
    began = time.process_time()
    lines = list(measure(pictures()))
    write_table(lines)
    draw(lines, DOCS / "images" / "dic-error-time.png")
    write_page(lines, time.process_time() - began)


def pictures() -> dict[str, NDArray]:
    """Take the reference and both motions, exactly rendered."""
    rng, sensor = np.random.default_rng(0), synthetic.Sensor(noise=NOISE)
    pattern = synthetic.speckle(SIZE)
    moved = {"rest": None} | MOTIONS
    return {k: synthetic.render(pattern, CAMERA, m, sensor, rng) for k, m in moved.items()}


def error(name: str, xy: NDArray, moved: NDArray) -> float:
    """Root mean square of what was measured less the truth, px, away from the border."""
    inside = np.all((xy >= BORDER) & (xy <= SIDE - 1 - BORDER), axis=1)
    inside &= np.isfinite(moved).all(axis=1)
    places = CAMERA.on_plate(xy[inside], 0.0)
    truth = synthetic.motion(CAMERA, places, MOTIONS[name](places), 0.0)
    return float(np.sqrt(np.mean((moved[inside] - truth) ** 2)))


def measure(seen: dict[str, NDArray]) -> Iterator[Line]:
    """Run every setting of ours and of the peers."""
    for order in (0, 1, 2):
        for subset in SUBSETS:
            yield ours(seen, subset, 5, order)
    for step in STEPS:
        yield ours(seen, 21, step, 1)
    for subset, window in SMOOTHED:
        yield ours(seen, subset, 5, 1, window)
    for window in (15, 21, 31):
        yield pyrlk(seen, window)
    yield from full_field_peers(seen)


def ours(seen, subset: int, step: int, order: int, window: int | None = None) -> Line:
    """Correlate, and smooth if a window is given."""

    def field(ref, frame, guess=None):
        disp = dic.correlate(ref, frame, guess)
        return disp, disp if window is None else dic.smooth(disp, window)

    ref = dic.prepare(seen["rest"], subset, step, order)
    last, _ = field(ref, seen["waves"])
    errors = []
    for name in MOTIONS:
        _, found = field(ref, seen[name])
        errors.append(error(name, found.xy, np.column_stack([found.u, found.v])))
    first = timed(lambda: field(dic.prepare(seen["rest"], subset, step, order), seen["waves"]))
    further = timed(lambda: field(ref, seen["waves"], last))
    smoothed = "-" if window is None else f"{window}, degree 4"
    setting = "ours", subset, step, str(order), smoothed, "quintic"
    return told(Line(*setting, len(ref.xy), first, further, *errors))


def pyrlk(seen, window: int) -> Line:
    """OpenCV's tracker at the points of a grid of step 5."""
    xy = dic.prepare(seen["rest"], 21).xy
    errors = [error(name, xy, pyramid(seen["rest"], seen[name], xy, window)) for name in MOTIONS]
    taken = timed(lambda: pyramid(seen["rest"], seen["waves"], xy, window))
    setting = "PyrLK", window, 5, "0", "-", "linear"
    return told(Line(*setting, len(xy), taken, taken, *errors))


def full_field_peers(seen) -> Iterator[Line]:
    """Run pyvale and al-dic where they are installed; each call does all of the work."""
    codes: tuple[tuple[str, int, int, str, str, Callable[..., Peer | None]], ...] = (
        ("pyvale", 21, 5, "1", "its own", lambda a, b: pyvale_field(a, b, 1)),
        ("pyvale", 21, 5, "2", "its own", lambda a, b: pyvale_field(a, b, 2)),
        ("al-dic, local", 20, 4, "1", "its own", al_dic_field),
    )
    for code, subset, step, order, interpolation, run in codes:
        found = [run(seen["rest"], seen[name]) for name in MOTIONS]
        if found[0] is None:
            continue
        errors = [error(n, f.xy, f.moved) for n, f in zip(MOTIONS, found, strict=True)]
        taken, points = 1e3 * found[-1].timing[0], len(found[0].xy)
        setting = code, subset, step, order, "-", interpolation
        yield told(Line(*setting, points, taken, taken, *errors))


def timed(run: Callable[[], object], times: int = 5) -> float:
    """Median CPU time of some runs, ms."""
    run()
    taken = []
    for _ in range(times):
        start = time.process_time()
        run()
        taken.append(1e3 * (time.process_time() - start))
    return float(np.median(taken))


def told(line: Line) -> Line:
    """Print a line as it comes."""
    print(" | ".join(cells(line)), flush=True)
    return line


def cells(line: Line) -> tuple[str, ...]:
    """Round for a table: ms, and errors in mpx."""
    *setting, points, first, further, shift, waves = astuple(line)
    text = f"{first:.0f}", f"{further:.0f}", f"{1e3 * shift:.1f}", f"{1e3 * waves:.1f}"
    return (*(str(part) for part in setting), str(points), *text)


def write_table(lines: list[Line]) -> None:
    """Write every digit as CSV."""
    with (DOCS / "correlation-figures.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([field.name for field in fields(Line)])
        table.writerows(
            [f"{v:.5g}" if isinstance(v, float) else v for v in astuple(line)] for line in lines
        )


def front(lines: list[Line], motion: str) -> list[Line]:
    """Lines that no other one beats both in time and in error, the fastest first."""
    kept: list[Line] = []
    for line in sorted(lines, key=lambda one: (one.from_nothing, getattr(one, motion))):
        if not kept or getattr(line, motion) < getattr(kept[-1], motion):
            kept.append(line)
    return kept


TICKS = (2, 3, 5, 10, 20, 30, 50, 100, 200, 500, 1000, 2000)
GROUPS = {  # which lines, colour and marker
    "order 0": (lambda n: n.code == "ours" and n.order == "0", "tab:gray", "v"),
    "order 1": (lambda n: n.code == "ours" and n.order == "1" and n.window == "-", "tab:blue", "o"),
    "order 2": (lambda n: n.code == "ours" and n.order == "2", "tab:green", "s"),
    "order 1, smoothed": (lambda n: n.window != "-", "tab:purple", "D"),
    "PyrLK": (lambda n: n.code == "PyrLK", "tab:orange", "^"),
    "pyvale": (lambda n: n.code == "pyvale", "tab:red", "X"),
    "al-dic": (lambda n: n.code.startswith("al-dic"), "tab:brown", "P"),
}


def draw(lines: list[Line], path: Path) -> None:
    """Draw error against time from nothing, one panel a motion, with the front of Pareto."""
    from matplotlib import pyplot as plt

    titles = {"shift": "rigid shift", "waves": f"waves of {LENGTH:.0f} px, 0.5 px high"}
    figure, panels = plt.subplots(1, 2, figsize=(12, 4.8), layout="constrained")
    for panel, (motion, title) in zip(panels, titles.items(), strict=True):
        best = front(lines, motion)
        place = [n.from_nothing for n in best], [1e3 * getattr(n, motion) for n in best]
        panel.step(
            *place, where="post", color="0.8", linewidth=4, zorder=0, label="front of Pareto"
        )
        for name, (belongs, colour, marker) in GROUPS.items():
            some = [n for n in lines if belongs(n)]
            xs, ys = [n.from_nothing for n in some], [1e3 * getattr(n, motion) for n in some]
            if some:
                panel.scatter(xs, ys, c=colour, marker=marker, s=36, label=name)
            for line, x, y in zip(some, xs, ys, strict=True):
                step = f"/{line.step}" if line.step != 5 else ""
                window = f"·{line.window.split(',')[0]}" if line.window != "-" else ""
                text = f"{line.subset}{step}{window}"
                panel.annotate(text, (x, y), (4, 3), textcoords="offset points", fontsize=7)
        panel.set(xscale="log", yscale="log", title=title, xlabel="CPU time of a pair, ms")
        panel.set_xticks(TICKS, TICKS, minor=False)
        panel.set_yticks(TICKS, TICKS, minor=False)
        panel.minorticks_off()
        panel.set(xlim=(20, 3000), ylim=(2, 150))
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("error, root mean square, mpx")
    figure.legend(*panels[1].get_legend_handles_labels(), loc="outside right upper", fontsize=8)
    figure.savefig(path, dpi=110)


HEAD = (
    "code|subset|step|order|smoothing|interpolation|points|"
    "pair, ms|next frame, ms|shift, mpx|waves, mpx"
)


def write_page(lines: list[Line], taken: float) -> None:
    """Write the page."""
    rows = [HEAD, "|".join("---" for _ in HEAD.split("|")), *("|".join(cells(n)) for n in lines)]
    parts = (
        "# Correlation: error against run time",
        f"Written by `python benchmarks/dic_figures.py` in {taken / 60:.1f} minutes of CPU "
        f"time on {machine()}, one thread. Every digit is in "
        "[correlation-figures.csv](correlation-figures.csv); the bars one by one are printed by "
        "`python benchmarks/dic_bars.py`.",
        f"Pictures of {SIDE} × {SIDE} px, rendered exactly, 8 bit, noise of {NOISE:g} grey levels "
        f"in both. Error: root mean square over the points {BORDER} px from the border. *Shift* "
        f"is ({SHIFT[0]:g}, {SHIFT[1]:g}) px everywhere, so it shows noise and bias; *waves* are "
        f"{LENGTH:.0f} px long and {AMPLITUDE[0]:g} and {AMPLITUDE[1]:g} px high in u and v, so "
        "they also show what a subset flattens. *Pair*: preparation, search and correlation; "
        "*next frame*: correlation alone, from the last field. Peers do all of it at every call.",
        "![Error against time](images/dic-error-time.png)",
        "Numbers at the marks: subset, step where it is not 5, points of the window where a field "
        "is smoothed. Smoothing is `dic.smooth`, "
        "[decision 34](decisions/0034-wide-windows-of-small-subsets.md).",
        "\n".join(f"| {row.replace('|', ' | ')} |" for row in rows),
    )
    (DOCS / "correlation-figures.md").write_text("\n\n".join(parts) + "\n")


def machine() -> str:
    """Name processor and versions."""
    known = Path("/proc/cpuinfo")
    lines = known.read_text().splitlines() if known.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    cpu = names[0] if names else platform.processor()
    return f"{cpu}, Python {platform.python_version()}, NumPy {np.__version__}"


if __name__ == "__main__":
    main()
