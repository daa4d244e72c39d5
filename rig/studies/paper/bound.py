"""A net trained with noise, and solver steps after it, beside the bound on both."""

from collections.abc import Iterator

import numpy as np

import models
from models import NetOptions, Recipe, predict, train_net
from models.nets import batches
from models.nets.refine import refine
from rig.report.figure import Bar, at_most
from rig.studies.paper.sets import Effort, Samples, pressed, several
from rig.studies.paper.table import Sample
from rig.system.arrays import F64

# σ over the root mean square strain of a unit touch: of the test, and between which it is drawn in
# training. An estimate moves with the noise in the same way at every level, best learnt from much.
LEVELS = (0.01, 0.05, 0.1)
TRAINED = (0.01, 0.2)


def bound(effort: Effort) -> Samples:
    """Compare a net trained with noise, and two solver steps after it, with the bound."""
    pool, first, test = several(1)
    answer = pressed("paper-one")[1]
    unit = float(np.sqrt(np.mean(first.strain**2)))
    recipe = Recipe(effort.epochs(20000), 2e-3, "cosine", "scaled", check=20000)
    options = NetOptions((128,) * 3, "silu")
    gain = batches.gain(answer.gradient(pool.targets)).astype(np.float32)
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        stream = batches.estimated(pool, gain, (TRAINED[0] * unit, TRAINED[1] * unit), 512, rng)
        net = train_net(first, test, options, recipe, rng, batches=stream).net
        for level in LEVELS:
            sigma = level * unit
            seen = next(batches.noisy_batches(iter([test]), sigma, rng))
            forward = models.gauge_forward(answer, sigma)
            for what, value, bar in _over_crb(forward, predict(net, seen.strain), seen):
                what = f"noise {level:.0%}: {what}"
                of = "trained with noise", what, "", ""
                yield Sample(*of, recipe.epochs, seed, value, bar)


def _over_crb(
    forward: models.Forward, found_by_net: F64, seen: models.Dataset
) -> Iterator[tuple[str, float, Bar | None]]:
    """Root mean squares of a net and of solver steps after it, ÷ CRB."""
    of_net, limit, known, stepped = np.empty((4, len(seen)))
    for n, (strain, true) in enumerate(zip(seen.strain, seen.targets, strict=True)):
        fisher = forward.read(np.array([[*true, 1.0]]))[1]
        limit[n] = np.trace(np.linalg.inv(fisher @ fisher.T)[:2, :2])
        known[n] = np.trace(np.linalg.inv(fisher[:2] @ fisher[:2].T))
        measured = forward.whiten(strain.reshape(-1, 3).astype(float))
        found = refine(measured, forward, np.array([[*found_by_net[n], 1.0]]))
        stepped[n] = np.sum((found[0, :2] - true) ** 2)
        of_net[n] = np.sum((found_by_net[n] - true) ** 2)
    for what, square, limits, bar in (
        ("net: RMS ÷ CRB, force unknown", of_net, limit, at_most(1.4)),
        ("net: RMS ÷ CRB, force known", of_net, known, None),
        ("net and 2 solver steps: RMS ÷ CRB, force unknown", stepped, limit, at_most(1.02)),
    ):
        yield what, float(np.sqrt(np.mean(square) / np.mean(limits))), bar
