"""The paper's validation on a bench, in the twin: strain by DIC in the middle of a PVC plate.

Two edges are clamped. The net learns from finite elements, seen by the gauges through the camera;
what it is tested on are rendered pictures of presses held still, 16 averaged, correlated at the
gauges. The solver on the strain map of the same pictures, and on their whole pattern, stand beside.
"""

from dataclasses import replace

import numpy as np

import fe
import rig
from models.data.dataset import random_places
from rig.commands.train import descend
from rig.live import chain as live
from rig.live.baseline import Zero
from rig.live.bench import build_bench
from rig.live.net_chain import NetPlan, prepare_net
from rig.sources.twin import build_twin
from rig.studies.paper.sets import Effort, Figures, errors
from rig.studies.paper.table import Figure
from rig.system.timing import Stopwatch
from rig.training.data import simulate
from rig.training.plan import lesson

SYSTEM = "bench, strain by DIC (2.2)"
PRESSES = 60
FRAMES = 16  # averaged, of every press and of the reference


def bench(effort: Effort) -> Figures:
    """One touch on the bench of the paper's validation."""
    scene = rig.load("paper-bench")
    taught = lesson(scene)
    taught = replace(
        taught, net=taught.net.model_copy(update={"epochs": effort.epochs(taught.net.epochs)})
    )
    sets, pictures = simulate(taught, lambda done, total: None), _Pictures(scene)
    epochs = taught.net.epochs
    for seed in range(effort.seeds):
        again = replace(taught, net=taught.net.model_copy(update={"seed": seed}))
        net = descend(again, sets, again.net.layers).net
        for what, data in (("without noise", sets.noise.pool), ("with noise", sets.test)):
            loss = errors(net, data).mean()
            yield Figure(SYSTEM, f"finite elements {what}: loss, mm", "", epochs, seed, loss)
        paper = "works, slightly less accurate"
        for steps, name in ((0, "net"), (2, "net and 2 solver steps")):
            off = pictures.by_net(net, steps)
            yield Figure(SYSTEM, f"pictures, {name}: loss, mm", "", epochs, seed, off.mean())
            what = f"pictures, {name}: median, mm"
            yield Figure(SYSTEM, what, "", epochs, seed, np.median(off))
            what, unit = (
                f"pictures, {name}: loss, hundredths of the side",
                scene.plate.size[0] / 100,
            )
            yield Figure(SYSTEM, what, paper, epochs, seed, off.mean() / unit)
            paper = ""
    for name, off in pictures.by_solver().items():
        yield Figure(SYSTEM, f"pictures, {name}: loss, mm", "", 0, 0, off.mean())
        yield Figure(SYSTEM, f"pictures, {name}: median, mm", "", 0, 0, np.median(off))


class _Pictures:
    """Presses on the twin, their pictures, and the live chain that reads them."""

    def __init__(self, scene):
        self.scene = scene
        twin = build_twin(scene)
        margin, force = scene.training.margin, scene.training.force[1]
        rng = np.random.default_rng(2)
        self.places = random_places(scene.plate.size, margin, PRESSES, rng)
        touches = [fe.Touch(*place, force) for place in self.places]
        numbers = iter(range(FRAMES * (PRESSES + 1)))

        def mean(*pressed):
            frames = [twin.frame(next(numbers), pressed) for _ in range(FRAMES)]
            return np.mean(frames, axis=0, dtype=np.float32)

        noise = scene.sensor.noise * np.sqrt(2 / FRAMES)
        self.zero = Zero(mean(), noise)
        self.images = [mean(touch) for touch in touches]
        whole = rig.load("paper-bench", {"estimator": {"kind": "pattern"}})
        self.bench = build_bench(whole, lambda done, total: None)
        self.chain, self.strain = self.bench.prepare(self.zero)
        watch, rest = Stopwatch(lambda: 0.0), live.at_rest(self.chain)
        self.sensed = [live.sense(self.chain, image, rest, watch) for image in self.images]

    def by_net(self, net, steps):
        """Errors of a net, (N,) mm."""
        gauges, margin = self.scene.gauges, self.scene.training.margin
        plan = NetPlan(net, gauges.build(self.scene.plate), gauges.subset, steps, margin)
        chain = prepare_net(plan, self.chain, self.zero, self.bench.camera)
        watch = Stopwatch(lambda: 0.0)
        told = [
            chain.tell(self.chain, image, sensed, watch).estimate
            for image, sensed in zip(self.images, self.sensed, strict=True)
        ]
        return self._errors(told)

    def by_solver(self):
        """Errors of the solver on the strain map and on the whole pattern, by name."""
        watch = Stopwatch(lambda: 0.0)
        strained = [live.with_strain(self.strain, sensed, watch) for sensed in self.sensed]
        return {
            "solver on the strain map": self._errors([each.from_strain for each in strained]),
            "solver on the whole pattern": self._errors([each.estimate for each in self.sensed]),
        }

    def _errors(self, told):
        return np.array(
            [
                np.hypot(*(one.xy[0] - place)) if one.count else np.nan
                for one, place in zip(told, self.places, strict=True)
            ]
        )
