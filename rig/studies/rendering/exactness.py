"""How exact and how fast images are rendered, and whether correlation without images is true.

Parts: truth, warped, rates, gauges. One thread; lines of a GPU are left out where there is none.
Errors in pixels are what least squares reads out of an image's error on tiles of 21 px.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import dic
import fe
import synthetic
from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import cpu_seconds, line, rms, run
from rig.system.arrays import AnyArray
from synthetic.inverse import invert
from synthetic.points import at_height

if TYPE_CHECKING:
    import torch

PLATE = fe.Plate((254.0, 203.2), thickness=1.0, young=3000.0, poisson=0.38, edges=fe.Clamped())
SIZE, TOP = PLATE.size, PLATE.thickness / 2
MIDDLE = np.array(SIZE) / 2
CAMERA = synthetic.pinhole_above(SIZE, 500.0, (1024, 1024))
PATTERN = synthetic.speckle(SIZE)
REPEATS = 3
SENSOR = synthetic.Sensor(noise=2.0)
TOUCHES = 2000  # rendered and correlated
TRUE, HONEST = at_most(1e-4), Bar(0.9, 1.1)  # px; scatter over what is predicted
Array = NDArray[np.float64]
Displacement = Callable[[Array], Array]
"""From points of the plate (N, 2) to how far they move, (N, 3), mm."""
# The plate is linear on both sides: what is checked is the way from its motion to the strain.
FORCES = (0.1, 1.5)  # N


def moved(F: Array, points: Array) -> Array:
    """Affine displacement about the middle of the plate."""
    flat = (points - MIDDLE) @ (F - np.eye(2)).T
    return np.column_stack([flat, np.zeros(len(points))])


def pressed(points: Array) -> Array:
    """Dent of 3 mm."""
    x, y = (np.pi * points / SIZE).T
    w = -3.0 * np.sin(x) ** 2 * np.sin(y) ** 2
    return np.column_stack([0.02 * w, -0.03 * w, w])


def waved(points: Array) -> Array:
    """Waves of 60 px with 2 % of strain."""
    x, y = (2 * np.pi * points / 15.0).T
    return np.column_stack([0.05 * np.sin(x + y), 0.04 * np.cos(y), 0 * x])


def turn(degrees: float) -> Array:
    """Rotation as a matrix."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


STRETCH = np.array([[1.5, 0.1], [-0.1, 0.7]])
DISPLACEMENTS: dict[str, Displacement] = {
    "dent of 3 mm": pressed,
    "waves of 60 px, 2 % strain": waved,
    "rotation 170°": partial(moved, turn(170)),
    "strain 50 % and -30 %": partial(moved, STRETCH),
    "rotation -80° and strain": partial(moved, turn(-80) @ STRETCH),
}


def truth() -> Iterator[Figure]:
    """Where the material points of pixels are seen, and how far the mean over a pixel is off."""
    table = "Exact images, 1024²"
    for name, displacement in DISPLACEMENTS.items():
        yield from line(table, name, material_points=(point_error(displacement), "px", TRUE))
    for name, samples in (("dent of 3 mm", 4), ("strain 50 % and -30 %", 5)):
        fine, image = (exact(DISPLACEMENTS[name], count) for count in (8, samples))
        levels, worst, mean = sizes(fine, image - fine)
        yield from line(
            table,
            f"{name}, {samples} × {samples} samples a pixel",
            worst_tile=(worst, "px", TRUE),
            mean_error=(mean, "px"),
            scatter=(levels, "of 255 levels"),
        )


def point_error(displacement: Displacement) -> float:
    """Largest distance, px, of a corner of a pixel from where its material point is seen."""
    inverse = invert(CAMERA, displacement, SIZE, TOP)
    pixels = np.stack(np.meshgrid(*(np.arange(float(n)) for n in CAMERA.size)), -1).reshape(-1, 2)
    pixels, offset = pixels[inverse.covers(pixels)], np.array([-0.5, 0.5])
    (points,) = inverse.follow(pixels, offset[None])
    on = ((points >= 0) & (points <= SIZE)).all(axis=1)
    seen = CAMERA.project(at_height(points[on], TOP) + displacement(points[on]))
    return float(np.abs(seen - pixels[on] - offset).max())


def exact(displacement: Displacement, samples: int = 4) -> Array:
    """Light of an exact image, 255 at most."""
    return synthetic.render(PATTERN, CAMERA, displacement, None, None, TOP, samples)


def sizes(image: Array, error: Array) -> tuple[float, float, float]:
    """Scatter in grey levels; by least squares on tiles of 21 px the worst and the mean in px."""
    down, along = np.gradient(image)
    slopes = np.stack([along, down], axis=-1)
    found: list[AnyArray] = []
    for top, left in np.ndindex(*(np.array(image.shape) // 21)):
        tile = np.s_[21 * top : 21 * top + 21, 21 * left : 21 * left + 21]
        if image[tile].std() > 40:
            A, b = slopes[tile].reshape(-1, 2), -error[tile].ravel()
            found.append(np.linalg.lstsq(A, b, rcond=None)[0])
    worst, mean = np.abs(found).max(), np.abs(np.mean(found, axis=0)).max()
    return float(error.std()), float(worst), float(mean)


def warped() -> Iterator[Figure]:
    """Errors of both warpers against the exact renderer."""
    warper = synthetic.prepare_warp(PATTERN, CAMERA, TOP)
    batch = synthetic.prepare_batch(warper)
    for name in list(DISPLACEMENTS)[:2]:
        image, motion = exact(DISPLACEMENTS[name]), DISPLACEMENTS[name](warper.points)
        for way, made in (
            ("one warped image", warper.render(motion, None, None)),
            ("batch on torch", batch.render(warper.forward(motion)[None])[0, 0].numpy()),
        ):
            levels, worst, mean = sizes(image, made - image)
            yield from line(
                "Warped images against exact ones, 1024²",
                f"{way}, {name}",
                worst_tile=(1e3 * worst, "mpx"),
                mean_error=(1e3 * mean, "mpx"),
                scatter=(levels, "of 255 levels"),
            )


def rates() -> Iterator[Figure]:
    """Images a CPU second; the process waits for a GPU at full load, so that it counts too."""
    import torch

    torch.set_num_threads(1)
    warper = synthetic.prepare_warp(PATTERN, CAMERA, TOP)
    rng, motion = np.random.default_rng(0), pressed(warper.points)
    blur = synthetic.Exposure(synthetic.Optics(gaussian=0.5, disc=2.0))
    take = partial(synthetic.render, PATTERN, CAMERA)
    ways: dict[str, tuple[Callable[[], object], int]] = {
        "exact, at rest": (lambda: take(None, SENSOR, rng, TOP), 1),
        "exact, dented": (lambda: take(pressed, SENSOR, rng, TOP), 1),
        "exact, dented, out of focus": (
            lambda: take(pressed, SENSOR, rng, TOP, exposure=blur),
            1,
        ),
        "warped, one by one": (lambda: warper.render(motion, SENSOR, rng), 1),
    }
    for device in ["cpu"] + ["cuda"] * torch.cuda.is_available():
        batch, many = synthetic.prepare_batch(warper, device), 4 if device == "cpu" else 32
        fields = torch.as_tensor(np.stack([warper.forward(motion)] * many), device=device).float()
        ways[f"batch of {many} on {device}"] = partial(_rendered, batch, fields), many
    for name, (call, many) in ways.items():
        call()
        rate = many / cpu_seconds(call, REPEATS)
        yield from line("How fast images of 1024² are made", name, rate=(rate, "a CPU second"))


def _rendered(batch: synthetic.BatchWarper, fields: "torch.Tensor") -> None:
    """Render a batch to its end."""
    import torch

    with torch.no_grad():
        batch.render(fields)[0, 0, 0, 0].item()


def gauges() -> Iterator[Figure]:
    """Gauges without images against touches that are rendered and correlated."""
    camera = synthetic.pinhole_above(SIZE, 500.0, (400, 320))
    pattern = synthetic.speckle(SIZE, diameter=3.2, softness=0.6, seed=4)
    warper = synthetic.prepare_warp(pattern, camera, TOP)
    places = np.stack(np.meshgrid([60, 130, 200, 270, 340], [60, 160, 260]), -1).reshape(-1, 2)
    kinds = {
        "displacement": (synthetic.displacement_gauges(places, 31), "mpx", 1e3),
        "strain": (synthetic.strain_gauges(places, 31, step=8, window=5), "µε", 1e6),
    }
    modes, rng = fe.modes(PLATE, 120), np.random.default_rng(1)
    touches = rng.uniform((25, 25), np.array(SIZE) - 25, (TOUCHES, 2))
    weights = modes.response(touches) * rng.uniform(*FORCES, (TOUCHES, 1))
    found = [correlated(warper, shape, places, rng) for shape in moving(warper, modes, weights)]
    image = warper.render(np.zeros((len(warper.points), 3)), SENSOR, None)
    for name, (gauge, unit, scale) in kinds.items():
        points = camera.on_plate(gauge.px, TOP)
        seen = synthetic.image_motion_basis(
            camera, gauge.px, modes.value(points), modes.slope(points), TOP
        )
        said = (gauge.read(seen) @ weights.T).reshape(-1, TOUCHES).T
        # Rounding to a grey level adds its own noise.
        texture = synthetic.texture_at(image, places, gauge.size)
        covariance = gauge.covariance(texture, float(np.hypot(SENSOR.noise, 12**-0.5)))
        off = np.array([each[name] for each in found]) - said
        sigma, bias = np.sqrt(np.diag(covariance)), np.abs(off.mean(axis=0))
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), off.T)
        yield from line(
            "Gauges without images against rendered and correlated touches",
            name,
            signal=(scale * float(said.std()), f"{unit}, rms"),
            predicted_σ=(scale * float(sigma.mean()), unit),
            scatter_over_predicted=(rms(whitened), "", HONEST, TOUCHES),
            largest_bias=(scale * float(bias.max()), unit),
            bias_over_σ=float((bias / sigma).max()),
        )


def moving(warper: synthetic.Warper, modes: fe.Modes, weights: Array) -> Iterator[Array]:
    """Displacement of the face, mm, at the points of a warper, touch by touch."""
    value, slope = modes.value(warper.points), modes.slope(warper.points)
    for q in weights:
        yield np.column_stack([-TOP * (slope[..., 0] @ q), -TOP * (slope[..., 1] @ q), value @ q])


def correlated(
    warper: synthetic.Warper,
    motion: Array,
    places: Array,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """Displacement and small strain at places, from an image at rest and one of the touch."""
    window = 8 * np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), -1).reshape(-1, 2)
    points = (places[:, None] + window).reshape(-1, 2)
    ref = dic.prepare(warper.render(np.zeros_like(motion), SENSOR, rng), 31, points=points)
    field = dic.correlate(ref, warper.render(motion, SENSOR, rng))
    if not field.valid.all():
        raise ValueError(f"all points must be measured, got {np.sum(~field.valid)} that are not")
    at = np.stack([field.u, field.v], axis=-1).reshape(len(places), len(window), 2)
    slopes = np.einsum("qb,nqa->nab", window / np.square(window[:, 0]).sum(), at)
    shear = (slopes[:, 0, 1] + slopes[:, 1, 0]) / 2
    strain = np.column_stack([slopes[:, 0, 0], slopes[:, 1, 1], shear])
    return {"displacement": at[:, len(window) // 2].ravel(), "strain": strain.ravel()}


PARTS = {"truth": truth, "warped": warped, "rates": rates, "gauges": gauges}

if __name__ == "__main__":
    run(PARTS, __doc__)
