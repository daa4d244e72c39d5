"""What `touchplate design` promises of benches drawn at random, beside what their twins then show.

Parts: few (6 benches, for which there is no bar), fifty. Each twin shows 300 frames of one touch at
a random place with a random force; nothing is known of a touch from the frame before. Benches are
clamped plates of PVC that the largest force bends by 0 to 3 times their thickness; those that
`design` refuses, since the material would not come back, are drawn again. Predicted: the median of
errors drawn from the covariance and the bias that are promised for each of these touches, of those
that are not found as well. The twin bends as the reduced plate does, the prediction rests on the
plate in modes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import fe
import models
import rig
from rig.design.limits import refusal
from rig.design.outlook import bent, in_modes
from rig.design.prediction import Prediction, equal_pattern, image_motions, predict
from rig.design.setup import setup_of
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.report.figure import Bar, Figure
from rig.scene import Scene
from rig.scene.theory import choose, largest_force
from rig.sources.twin import build_twin
from rig.studies.study import line, run
from rig.system.arrays import F64
from rig.system.timing import Stopwatch

TABLE = "What a design promises, and what its twin shows"
FRAMES = 300
HONEST = Bar(0.85, 1.15)
DEEPEST = 3.0
_SEED = 11
_DRAWS = 200  # of the errors of each touch
_YOUNG, _POISSON, _STRAIN_LIMIT = 3000.0, 0.38, 0.02  # MPa; PVC


def designed(benches: int, bar: Bar | None = None) -> Iterator[Figure]:
    """Compare predictions with twins; the bar is that of them all."""
    places, forces = list[float](), list[float]()
    for number in range(benches):
        scene = drawn(np.random.default_rng((_SEED, number)))
        predicted, found, missed = compared(scene)
        ratio = np.median(predicted, axis=0) / np.median(found, axis=0)
        regime = choose(scene, setup_of(scene).plate, largest_force(scene)).regime
        places.append(float(ratio[0]))
        forces.append(float(ratio[1]))
        yield from line(
            TABLE,
            f"bench {number + 1}",
            **{
                "largest w/h": (0.0 if regime is None else regime.ratio, ""),
                "predicted place, median": (float(np.median(predicted[:, 0])), "mm"),
                "over found, place": (places[-1], "", bar, len(found)),
                "over found, force": (forces[-1], "", bar, len(found)),
                "not found": (100.0 * missed / FRAMES, "%", None, FRAMES),
            },
        )
    within = [HONEST.met_by(one) for one in (*places, *forces)]
    yield from line(
        TABLE,
        f"{benches} benches",
        smallest=(min(*places, *forces), "", bar, benches),
        largest=(max(*places, *forces), "", bar, benches),
        within=(100.0 * float(np.mean(within)), "%", None, len(within)),
    )


def drawn(rng: np.random.Generator) -> Scene:
    """Draw a bench that can work."""
    while True:
        long = rng.uniform(150.0, 400.0)
        size = (long, long * rng.uniform(0.6, 1.0))
        force, ratio = rng.uniform(2.0, 6.0), rng.uniform(0.0, DEEPEST)
        width = int(rng.uniform(600, 1400))
        given = {
            "plate.size": list(size),
            "plate.thickness": _thickness(size, force, ratio),
            "plate.young": _YOUNG,
            "plate.poisson": _POISSON,
            "plate.strain_limit": _STRAIN_LIMIT,
            "touches.max_touches": 1,
            "touches.force": [0.25 * force, force],
            "camera.pixels": [width, int(width * size[1] / size[0])],
            "camera.stand_off": long * rng.uniform(1.2, 3.0),
            "pattern.diameter": long / width * rng.uniform(2.5, 5.0),
            "pattern.seed": int(rng.integers(1000)),
            "sensor.noise": rng.uniform(1.0, 4.0),
            "source.script": "random",
        }
        scene = rig.load("twin", given | {"plate.theory": "large" if ratio > 0.2 else "linear"})
        if not refusal(scene):
            return scene


def _thickness(size: tuple[float, float], force: float, ratio: float) -> float:
    """Find the thickness at which a force bends a plate by `ratio` times that, mm."""
    thin, thick = 0.1, 0.05 * min(size)
    for _ in range(16):
        tried = (thin * thick) ** 0.5
        plate = fe.Plate(size, tried, _YOUNG, _POISSON)
        if fe.linear_range(plate, force).ratio > ratio:
            thin = tried
        else:
            thick = tried
    return thick


def compared(scene: Scene) -> tuple[F64, F64, int]:
    """Errors drawn from what is predicted, and those found, of place and force; and the missed."""
    given = setup_of(scene)
    theory = choose(scene, given.plate, largest_force(scene))
    modal = bent(theory, in_modes(scene, theory, given))
    promised = predict(given, None, 1.0, modal)
    pattern = _pattern(promised, modal)
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    frames = range(bench.reference_frames)
    chain, _ = bench.prepare(average_reference([twin.frame(k, ()) for k in frames]))
    rng, predicted, found, missed = np.random.default_rng(_SEED), list[F64](), list[F64](), 0
    for number in range(100, 100 + FRAMES):
        (touch,) = twin.touches(number)
        image = twin.frame(number, (touch,))
        seen = estimate_frame(chain, image, at_rest(chain), Stopwatch(lambda: 0.0)).estimate
        true = np.array([touch.x, touch.y, touch.force])
        noise = promised.noise(np.array([models.aliased_part(pattern, true)]))
        spread = models.cramer_rao(pattern, true[None], float(noise[0]))
        bias = promised.gain * models.bias_of_interpolation(pattern, true)
        off = rng.multivariate_normal(bias, spread, _DRAWS)
        predicted.append(_sizes(off))
        if not seen.count:
            missed += 1
            continue
        nearest = int(np.argmin(np.linalg.norm(seen.xy - true[:2], axis=1)))
        found.append(_sizes(np.array([[*seen.xy[nearest], seen.force[nearest]]]) - true))
    return np.concatenate(predicted), np.concatenate(found), missed


def _pattern(prediction: Prediction, modal: fe.ModalPlate | None) -> models.TilePattern:
    given = prediction.setup
    motions = image_motions(given.plate, given.camera, given.tile, modal)
    return equal_pattern(given, motions, prediction.energy)


def _sizes(off: F64) -> F64:
    """Distances and absolute errors of the force, of (n, 3): (n, 2)."""
    return np.column_stack([np.linalg.norm(off[:, :2], axis=1), np.abs(off[:, 2])])


PARTS = {"few": partial(designed, 6), "fifty": partial(designed, 50, HONEST)}

if __name__ == "__main__":
    run(PARTS, __doc__)
