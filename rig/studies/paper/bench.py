"""The paper's validation on a bench, in the twin: strain by DIC in the middle of a PVC plate.

Two edges are clamped. The net learns from finite elements, seen by the gauges through the camera;
what it is tested on are rendered images of presses held still, 16 averaged, correlated at the
gauges. The solver on the strain map of the same images, and on their whole pattern, stand beside.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import fe
import rig
from models import Estimate, Net, random_places
from rig.live.baseline import ReferenceFrame
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.net_chain import NetPlan, prepare_net
from rig.live.strain_chain import with_strain
from rig.scene import Scene
from rig.sources.twin import build_twin
from rig.studies.paper.sets import Effort, Samples, errors
from rig.studies.paper.table import Sample
from rig.studies.study import part
from rig.system.timing import Stopwatch
from rig.training.data import simulate_sets
from rig.training.descend import descend
from rig.training.plan import training_plan

SYSTEM = "bench, strain by DIC (2.2)"
PRESSES = 60
FRAMES = 16  # averaged, of every press and of the reference


def bench(effort: Effort) -> Samples:
    """One touch on the bench of the paper's validation."""
    scene = rig.load("paper-bench")
    plan = training_plan(scene)
    plan = replace(
        plan, net=plan.descent.model_copy(update={"epochs": effort.epochs(plan.descent.epochs)})
    )
    sets, images = simulate_sets(plan, lambda done, total: None), BenchImages(scene)
    epochs = plan.descent.epochs
    for seed in range(effort.seeds):
        again = replace(plan, net=plan.descent.model_copy(update={"seed": seed}))
        net = descend(again, sets, again.descent.layers).net
        for what, data in (("without noise", part(sets.noise).pool), ("with noise", sets.test)):
            loss = errors(net, data).mean()
            yield Sample(SYSTEM, f"finite elements {what}: loss", "mm", "", epochs, seed, loss)
        paper = "works, slightly less accurate"
        for steps, name in ((0, "net"), (2, "net and 2 solver steps")):
            off = images.errors(images.by_net(net, steps))
            middle, relative = float(np.median(off)), 100 * off.mean() / part(scene.plate).size[0]
            yield Sample(SYSTEM, f"images, {name}: loss", "mm", "", epochs, seed, off.mean())
            yield Sample(SYSTEM, f"images, {name}: median", "mm", "", epochs, seed, middle)
            what = f"images, {name}: loss over the side"
            yield Sample(SYSTEM, what, "%", paper, epochs, seed, relative)
            paper = ""
    for name, found in images.by_solver().items():
        off = images.errors(found)
        middle = float(np.median(off))
        yield Sample(SYSTEM, f"images, {name}: loss", "mm", "", 0, 0, off.mean())
        yield Sample(SYSTEM, f"images, {name}: median", "mm", "", 0, 0, middle)


class BenchImages:
    """Presses on the twin, their images, and the live chain that reads them."""

    def __init__(self, scene: Scene):
        self.scene = scene
        twin = build_twin(scene)
        training, plate = part(scene.training), part(scene.plate)
        margin, force = training.margin, training.force[1]
        rng = np.random.default_rng(2)
        self.places = random_places(plate.size, margin, PRESSES, rng)
        touches = [fe.Touch(float(x), float(y), force) for x, y in self.places]
        numbers = iter(range(FRAMES * (PRESSES + 1)))

        def mean(*pressed: fe.Touch) -> NDArray[np.float32]:
            frames = [twin.frame(next(numbers), pressed) for _ in range(FRAMES)]
            return np.array(frames).mean(axis=0, dtype=np.float32)

        noise = part(scene.sensor).noise * float(np.sqrt(2 / FRAMES))
        self.zero = ReferenceFrame(mean(), noise)
        self.images = [mean(touch) for touch in touches]
        whole = rig.load("paper-bench", {"estimator": {"kind": "pattern"}})
        self.bench = build_bench(whole, lambda done, total: None)
        self.chain, self.strain = self.bench.prepare(self.zero)
        watch, rest = Stopwatch(lambda: 0.0), at_rest(self.chain)
        self.sensed = [estimate_frame(self.chain, image, rest, watch) for image in self.images]

    def by_net(self, net: Net, steps: int) -> list[Estimate | None]:
        """Estimates of a net."""
        gauges, margin = part(self.scene.gauges), part(self.scene.training).margin
        places = gauges.build(part(self.scene.plate))
        plan = NetPlan(net, places, part(gauges.subset), steps, margin)
        chain = prepare_net(plan, self.chain, self.zero, self.bench.camera)
        watch = Stopwatch(lambda: 0.0)
        return [
            chain.estimate(self.chain, image, sensed, watch).estimate
            for image, sensed in zip(self.images, self.sensed, strict=True)
        ]

    def by_solver(self) -> dict[str, list[Estimate | None]]:
        """Estimates of the solver on the strain map and on the whole pattern, by name."""
        watch = Stopwatch(lambda: 0.0)
        strained = [with_strain(part(self.strain), sensed, watch) for sensed in self.sensed]
        return {
            "solver on the strain map": [each.from_strain for each in strained],
            "solver on the whole pattern": [each.estimate for each in self.sensed],
        }

    def found(self, estimates: Sequence[Estimate | None]) -> NDArray[np.float64]:
        """Places (N, 2) mm; NaN where nothing was found."""
        none = np.full(2, np.nan)
        return np.array([one.xy[0] if one and one.count else none for one in estimates])

    def errors(self, estimates: Sequence[Estimate | None]) -> NDArray[np.float64]:
        """Distance of each from where was pressed, (N,) mm; NaN where nothing was found."""
        return np.hypot(*(self.found(estimates) - self.places).T)
