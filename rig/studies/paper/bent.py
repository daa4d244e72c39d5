"""One touch on a bent and twisted plate: nets of one step and of two (figure 5)."""

from dataclasses import replace

import numpy as np

from models import NetOptions, Recipe, position_error, predict, train_net
from models.nets import batches, loss
from models.nets.two_step import predict_two_step, train_two_step
from rig.report.figure import at_most
from rig.studies.paper import base as paper_base
from rig.studies.paper.sets import Effort, Samples
from rig.studies.paper.table import Sample


def deformable(effort: Effort) -> Samples:
    """One touch on a bent and twisted plate: a net of one step and one of two (figure 5)."""
    training, validation, *tests = paper_base.surfaces()
    recipe = Recipe(effort.epochs(10000), 1e-3, "cosine", "scaled", check=10000)
    shallow, wide = NetOptions((64,) * 4), NetOptions((128,) * 4)
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        once = train_net(
            training.together,
            validation.together,
            shallow,
            recipe,
            rng,
            loss=loss.base_loss(1.0),
            batches=batches.shuffled_batches(training.together, 512, rng),
        ).net
        twice = train_two_step(training, validation, (shallow, wide), recipe, rng)
        for ratio, test in zip(paper_base.RATIOS, tests, strict=True):
            for name, paper, found in (
                ("1 step, 64×4", "1.58", predict(once, test.loaded)[:, :2]),
                ("2 steps", "0.48", predict_two_step(twice, test.before, test.loaded)),
            ):
                value = position_error(test.xy, found).mean()
                what, bar = f"{name}, load {ratio:g} Δ0: loss", at_most(float(paper))
                if ratio != 1.0:
                    paper, bar = "", None  # it learnt no other load
                of = "deformable (5D)", what, "mm", paper
                yield Sample(*of, recipe.epochs, seed, value, bar)


def change(effort: Effort) -> Samples:
    """Two smooth steps, the second on what the touch changed of the strain, at any load."""
    training, validation, *tests = (
        replace(each, loaded=each.loaded - each.before) for each in paper_base.surfaces(True)
    )
    recipe = Recipe(effort.epochs(20000), 2e-3, "cosine", "scaled", check=20000)
    options = NetOptions((64,) * 2, "silu"), NetOptions((128,) * 3, "silu")
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        nets = train_two_step(training, validation, options, recipe, rng)
        for ratio, test in zip(paper_base.RATIOS, tests, strict=True):
            found = predict_two_step(nets, test.before, test.loaded)
            what = f"2 steps on the change, load {ratio:g} Δ0: loss"
            of = "deformable, change of strain", what, "mm", "0.48" if ratio == 1.0 else ""
            value = position_error(test.xy, found).mean()
            yield Sample(*of, recipe.epochs, seed, value, at_most(0.48))
