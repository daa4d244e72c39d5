"""Another bench from the next frame on, and a chain that stands on it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

import models
from models import BenchForward
from rig.live.chain import Chain
from rig.live.visibility import MaskedModels


class NextBench(NamedTuple):
    """What is known of a bench from the next frame on, and how its camera sees the plate's fields.

    None where that is so near by that first order tells it.
    """

    bench: models.BenchEstimate
    seen: models.Seen | None = None


def on_next_bench(chain: Chain, known: NextBench) -> Chain:
    """Stand a chain on another bench; its candidates stay where they are.

    Raises
    ------
    ValueError
        If the chain stands on an exact bench.
    """
    before, pattern, bench = chain.estimator, chain.pattern, known.bench
    if not isinstance(before.forward, BenchForward):
        raise ValueError("the chain stands on an exact bench, which nothing is learned of")
    if np.array_equal(before.forward.fields.values, bench.values):  # it is less sure, no more
        estimator = replace(before, bench=bench, grid=before.candidates)
        return replace(chain, masked_models=MaskedModels(pattern, estimator, chain.noise))
    forward, uneven = before.forward.moved(bench.values), pattern.uneven
    if known.seen is not None:
        forward, uneven = before.forward.on(bench.values, known.seen), known.seen.uneven
    motions = replace(pattern.motions, modes=forward.fields, large=forward.fields)
    grid = replace(before.candidates, forward=forward)
    estimator = replace(before, forward=forward, bench=bench, grid=grid)
    on_bench = replace(pattern, motions=motions, uneven=uneven)
    masked = MaskedModels(on_bench, estimator, chain.noise)
    return replace(chain, masked_models=masked)
