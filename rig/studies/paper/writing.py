"""A finger writes on the plate of the paper's bench, and predicted dots follow it.

The twin renders a word, written at 0.2 N; each frame is read by itself, as live: by the paper's net
on DIC at 121 gauges, and by the solver on the whole pattern. `touchplate run paper-bench --set
source.script=letters --record FILE` does the same at the pace of the camera, and `touchplate
export FILE FOLDER --to film` makes the film of it.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import rig
from rig.live.baseline import ReferenceFrame
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.net_chain import NetPlan, prepare_net
from rig.report.figure import Figure
from rig.scene import Scene
from rig.sources.twin import WRITES, build_twin
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.trainings import train_kept
from rig.studies.study import line, part, run_drawn
from rig.system.arrays import F64
from rig.system.timing import Stopwatch

TITLE = "A finger that writes, one frame at a time"
WORDS = "TOUCH"
EVERY = 3  # frames of 30 a second, of which one is rendered
PRESSED = 0.99  # of the force, below which the finger lands or leaves


def writing(folder: Path) -> Iterator[Figure]:
    """Write a word; draw what was written and what was found."""
    scene = rig.load("paper-bench", {"source.script": "letters", "source.text": WORDS})
    true, found = _followed(scene)
    drawn, axes = plots.canvas(len(found), width=5.0, height=4.6)
    for panel, (name, places) in zip(axes[0], found.items(), strict=True):
        panel.plot(*true[:, :2].T, ".", color="tab:red", ms=2, label="written")
        panel.plot(*places.T, "o", color="tab:blue", ms=3, alpha=0.5, label="found")
        side = part(scene.plate).size[0]
        panel.set(title=name, xlabel="x, mm", ylabel="y, mm", aspect="equal")
        panel.set(xlim=(0, side), ylim=(0, side))
        panel.legend(fontsize="small")
    text = f"{WORDS}, frames of one image, 0.2 N"
    yield plots.keep(drawn, folder, "paper-letters.png", TITLE, text)
    pressed = true[:, 2] >= PRESSED * part(scene.touches).force[1]
    for name, places in found.items():
        off = np.hypot(*(places - true[:, :2]).T)[pressed]
        seen = np.isfinite(off)
        yield from line(
            TITLE,
            name,
            mean=(float(off[seen].mean()), "mm", None, int(pressed.sum())),
            median=(float(np.median(off[seen])), "mm"),
            largest=(float(off[seen].max()), "mm"),
            missed=(int((~seen).sum()), "frames"),
        )


def _followed(scene: Scene) -> tuple[F64, dict[str, F64]]:
    """Touches (N, 3) of the frames in which the finger presses, and places found, (N, 2)."""
    twin, kept = build_twin(scene), train_kept("paper-bench")
    rate, frames = part(scene.camera).rate, part(scene.dic).reference_frames
    rest = [twin.frame(number, ()) for number in range(frames)]
    noise = part(scene.sensor).noise * float(np.sqrt(1.0 + 1.0 / frames))
    zero = ReferenceFrame(np.array(rest).mean(axis=0, dtype=np.float32), noise)
    whole = rig.load("paper-bench", {"estimator": {"kind": "pattern"}})
    bench = build_bench(whole, lambda done, total: None)
    chain, _ = bench.prepare(zero)
    gauges, training = part(scene.gauges), part(scene.training)
    places = gauges.build(part(scene.plate))
    plan = NetPlan(kept.net, places, part(gauges.subset), 0, training.margin)
    net = prepare_net(plan, chain, zero, bench.camera)
    state, watch = at_rest(chain), Stopwatch(lambda: 0.0)
    true: list[F64] = []
    found: dict[str, list[F64]] = {"the paper's net": [], "solver on the whole pattern": []}
    number, ended = int(WRITES * rate), 0
    while ended < rate:
        touches = twin.touches(number)
        if touches:
            image = twin.frame(number, touches)
            sensed = estimate_frame(chain, image, state, watch)
            state = sensed.state
            true.append(np.array([touches[0].x, touches[0].y, touches[0].force]))
            by_net = net.estimate(chain, image, sensed, watch).estimate
            for name, estimate in zip(found, (by_net, sensed.estimate), strict=True):
                found[name].append(estimate.xy[0] if estimate.count else np.full(2, np.nan))
        ended = 0 if touches else ended + EVERY
        number += EVERY
    return np.array(true), {name: np.array(each) for name, each in found.items()}


if __name__ == "__main__":
    run_drawn({"writing": writing}, __doc__)
