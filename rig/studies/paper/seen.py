"""Nets on what a camera sees: trained without images, tested on those and on images.

The plate of the paper under a camera, in perspective and telecentric. What the camera adds to the
strain is linear in the force, so touches are simulated by thousands without an image; hundreds of
images, correlated at the 72 gauges, say whether it is true. Images stand for 16 frames
averaged, with the noise that is left of 2 grey levels. The plate is that of its first 200 modes, in
images and without.
"""

from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np

import dic
import fe
import rig
import synthetic
from models import Dataset, Net, NetOptions, Recipe, position_error, predict, train_net
from models.data import dataset, gauge_layout
from models.forward.simulator import through_camera
from models.nets import batches
from rig.studies.paper.sets import Effort, Samples
from rig.studies.paper.table import Sample
from rig.studies.study import part
from rig.system.arrays import F64, AnyArray

SYSTEM = "seen by a camera"
FORCE = 1.0  # N
NOISE = 0.5  # grey levels of 8 bits, before rounding
SUBSET = 51  # px
MODES = 200
FRAMES = 60  # images to learn from, and as many for the test
FRACTION = 0.02  # of a batch that comes from images, where some does
POOL, TESTED = 20000, 3000


class View(NamedTuple):
    """What a camera makes of touches, without images and from them."""

    pool: Dataset  # touches without noise
    test: Dataset  # touches with noise
    root: np.ndarray  # of the covariance of the noise
    images: Dataset
    images_test: Dataset
    limit: float  # Cramér-Rao bound of the test, root mean square, force unknown, mm


def seen(effort: Effort) -> Samples:
    """One touch under a camera: nets trained on one view and tested on others."""
    plate = part(rig.load("paper-one").plate).build()
    views = {
        "telecentric": _view(plate, synthetic.telecentric_above(plate.size)),
        "perspective": _view(plate, synthetic.pinhole_above(plate.size, 500.0)),
    }
    recipe = Recipe(effort.epochs(6000), 2e-3, "cosine", "scaled", check=6000)
    for seed in range(effort.seeds):
        for trained, view in views.items():
            for name, images in ((trained, None), (f"{trained} and images", view.images)):
                net = _train(view, images, recipe, np.random.default_rng(seed))
                for watched, other in views.items():
                    for source, test in (("", other.test), (" images", other.images_test)):
                        error = position_error(test.targets, predict(net, test.strain)).mean()
                        what = f"trained on {name}, tested on {watched}{source}: loss"
                        yield Sample(SYSTEM, what, "mm", "", recipe.epochs, seed, error)
                what = f"trained on {name}, tested on {trained}: RMS ÷ CRB"
                square = np.mean((predict(net, view.test.strain) - view.test.targets) ** 2)
                ratio = np.sqrt(2 * square) / view.limit
                yield Sample(SYSTEM, what, "", "", recipe.epochs, seed, ratio)


def _train(view: View, images: Dataset | None, recipe: Recipe, rng: np.random.Generator) -> Net:
    """Return a net that learns from a view, with a fraction of images among it if there are any."""
    stream = batches.noisy_batches(batches.shuffled_batches(view.pool, 512, rng), view.root, rng)
    if images is not None:
        stream = batches.mixed_batches(
            stream, batches.shuffled_batches(images, round(512 * FRACTION), rng)
        )
    first = next(batches.noisy_batches(iter([view.pool]), view.root, rng))
    return train_net(
        first, view.test, NetOptions((128, 128), "silu"), recipe, rng, batches=stream
    ).net


def _view(plate: fe.Plate, camera: synthetic.AnyCamera) -> View:
    rng, modes = np.random.default_rng(0), fe.modes(plate, MODES)
    top = camera.face_height(plate.thickness)
    places = gauge_layout.gauges_inside_edges(plate.size)
    px = np.rint(camera.project(np.column_stack([places, np.full(len(places), top)])))
    gauges = synthetic.strain_gauges(px, SUBSET, window=1)
    unit = through_camera(modes, camera, gauges)

    def read(places: F64) -> F64:
        return FORCE * unit(places).reshape(len(places), -1)

    def touched(number: int) -> Dataset:
        places = dataset.random_places(plate.size, 10.0, number, rng)
        return Dataset(read(places), places)

    spots = synthetic.Speckle(plate.size, diameter=0.5, seed=4)
    warper, sensor = synthetic.prepare_warp(spots.draw(), camera, top), synthetic.Sensor(NOISE)
    span = (sensor.white - sensor.black) * sensor.top / 255.0
    rest = span * warper.render(np.zeros((len(warper.points), 3)), None, None)
    noise = np.sqrt(NOISE**2 + 1 / 12)  # with the rounding to whole grey levels
    texture = synthetic.texture_at(rest, px, gauges.size)
    root = np.linalg.cholesky(gauges.covariance(texture, noise)).astype(np.float32)
    correlate = _correlator(warper, modes, sensor, px, top, rng)

    def of_images() -> Dataset:
        drawn = touched(FRAMES)
        return Dataset(correlate(drawn.targets), drawn.targets)

    test = touched(TESTED)
    return View(
        touched(POOL),
        next(batches.noisy_batches(iter([test]), root, rng)),
        root,
        of_images(),
        of_images(),
        _limit(lambda places: cast(F64, np.linalg.solve(root, read(places).T).T), test.targets),
    )


def _limit(white: Callable[[F64], F64], places: F64) -> float:
    """Bound on places, root mean square in mm, from the strains over their noise at places."""
    step = 1e-3 * np.eye(2)  # mm
    slopes = [(white(places + h) - white(places - h)) / 2e-3 for h in step]
    jacobian = np.stack([white(places) / FORCE, *slopes], axis=1)
    covariance = np.linalg.inv(jacobian @ jacobian.transpose(0, 2, 1))
    return float(np.sqrt(np.mean(covariance[:, 1, 1] + covariance[:, 2, 2])))


def _correlator(
    warper: synthetic.Warper,
    modes: fe.Modes,
    sensor: synthetic.Sensor,
    px: F64,
    top: float,
    rng: np.random.Generator,
) -> Callable[[F64], F64]:
    """Return a function from places (N, 2) to the strains (N, I) that DIC finds in images."""
    value, slope = modes.value(warper.points), modes.slope(warper.points)

    def image(q: F64) -> AnyArray:
        moved = np.column_stack([-top * (slope[..., 0] @ q), -top * (slope[..., 1] @ q), value @ q])
        return warper.render(moved, sensor, rng)

    def read(places: F64) -> F64:
        found: list[F64] = []
        for q in FORCE * modes.response(places):
            reference = dic.prepare(image(0.0 * q), SUBSET, points=px)
            field = dic.strain(dic.correlate(reference, image(q)))
            found.append(np.column_stack([field.exx, field.eyy, field.exy]).ravel())
        return np.array(found)

    return read
