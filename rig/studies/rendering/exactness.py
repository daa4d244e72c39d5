"""Print how exact and how fast pictures are rendered, and whether DIC without images is true.

Usage: ``python benchmarks/rendering.py [TOUCHES]``, touches that are rendered and correlated to
check the gauges, 2000 if left out. One thread; rows of a GPU are left out where there is none.
Errors in pixels are what least squares reads out of a picture's error on tiles of 21 px.
"""

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import torch

import dic
import fe
import synthetic
from synthetic.inverse import invert
from synthetic.points import at_height

PLATE = fe.Plate((254.0, 203.2), thickness=1.0, young=3000.0, poisson=0.38, edges=fe.Clamped())
SIZE, TOP = PLATE.size, PLATE.thickness / 2
MIDDLE = np.array(SIZE) / 2
CAMERA = synthetic.pinhole_above(SIZE, 500.0, (1024, 1024))
PATTERN = synthetic.speckle(SIZE)
REPEATS = 3
SENSOR = synthetic.Sensor(noise=2.0)
TOUCHES = 2000
# The plate is linear on both sides: what is checked is the way from its motion to the strain.
FORCES = (0.1, 1.5)  # N


def moved(F, points):
    """Affine displacement about the middle of the plate."""
    flat = (points - MIDDLE) @ (np.asarray(F) - np.eye(2)).T
    return np.column_stack([flat, np.zeros(len(points))])


def pressed(points):
    """Dent of 3 mm."""
    x, y = (np.pi * points / SIZE).T
    w = -3.0 * np.sin(x) ** 2 * np.sin(y) ** 2
    return np.column_stack([0.02 * w, -0.03 * w, w])


def waved(points):
    """Waves of 60 px with 2 % of strain."""
    x, y = (2 * np.pi * points / 15.0).T
    return np.column_stack([0.05 * np.sin(x + y), 0.04 * np.cos(y), 0 * x])


def turn(degrees):
    """Rotation as a matrix."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


STRETCH = np.array([[1.5, 0.1], [-0.1, 0.7]])
DISPLACEMENTS = {
    "dent of 3 mm": pressed,
    "waves of 60 px, 2 % strain": waved,
    "rotation 170°": partial(moved, turn(170)),
    "strain 50 % and -30 %": partial(moved, STRETCH),
    "rotation -80° and strain": partial(moved, turn(-80) @ STRETCH),
}


def show(what: str, measured: str, bar: str = "") -> None:
    """Print one row."""
    print(f"{what:52s} {measured}{'   bar ' + bar if bar else ''}", flush=True)


def main(touches: int) -> None:
    """Print every row."""
    torch.set_num_threads(1)
    truth_rows()
    warper = synthetic.prepare_warp(PATTERN, CAMERA, TOP)
    batch_rows(warper)
    rate_rows(warper)
    gauge_rows(touches)


def truth_rows() -> None:
    """Where the material points of pixels are seen, and how far the mean over a pixel is off."""
    for name, displacement in DISPLACEMENTS.items():
        show(f"material points, {name}", f"{point_error(displacement):.0e} px", "≤ 1e-4 px")
    for name, samples in (("dent of 3 mm", 4), ("strain 50 % and -30 %", 5)):
        fine, image = (exact(DISPLACEMENTS[name], count) for count in (8, samples))
        off = errors(fine, image - fine)
        show(f"pixels of {samples} x {samples} points, {name}", off, "≤ 1e-4 px a tile")


def point_error(displacement: Callable) -> float:
    """Largest distance, px, of a corner of a pixel from where its material point is seen."""
    inverse = invert(CAMERA, displacement, SIZE, TOP)
    pixels = np.stack(np.meshgrid(*(np.arange(float(n)) for n in CAMERA.size)), -1).reshape(-1, 2)
    pixels, offset = pixels[inverse.covers(pixels)], np.array([-0.5, 0.5])
    (points,) = inverse.follow(pixels, offset[None])
    on = ((points >= 0) & (points <= SIZE)).all(axis=1)
    seen = CAMERA.project(at_height(points[on], TOP) + displacement(points[on]))
    return np.abs(seen - pixels[on] - offset).max()


def exact(displacement: Callable, samples: int = 4) -> np.ndarray:
    """Light of an exact picture, 255 at most."""
    return synthetic.render(PATTERN, CAMERA, displacement, None, None, TOP, samples)


def errors(image: np.ndarray, error: np.ndarray) -> str:
    """Errors in grey levels and in pixels, in words."""
    levels, worst, mean = sizes(image, error)
    return f"{levels:.3f} of 255 levels, {worst:.1e} px a tile at most, {mean:.1e} px on average"


def sizes(image: np.ndarray, error: np.ndarray) -> tuple[float, float, float]:
    """Scatter in grey levels; by least squares on tiles of 21 px the worst and the mean in px."""
    slopes, found = np.stack(np.gradient(image)[::-1], axis=-1), []
    for top, left in np.ndindex(*(np.array(image.shape) // 21)):
        tile = np.s_[21 * top : 21 * top + 21, 21 * left : 21 * left + 21]
        if image[tile].std() > 40:
            A, b = slopes[tile].reshape(-1, 2), -error[tile].ravel()
            found.append(np.linalg.lstsq(A, b, rcond=None)[0])
    return float(error.std()), np.abs(found).max(), np.abs(np.mean(found, axis=0)).max()


def batch_rows(warper: synthetic.Warper) -> None:
    """Errors of both warpers against the exact renderer."""
    batch = synthetic.prepare_batch(warper)
    for name in list(DISPLACEMENTS)[:2]:
        displacement = DISPLACEMENTS[name]
        image, motion = exact(displacement), displacement(warper.points)
        show(
            f"one warped picture, {name}", errors(image, warper.render(motion, None, None) - image)
        )
        fast = batch.render(warper.forward(motion)[None])[0, 0].numpy()
        show(f"batch on torch, {name}", errors(image, fast - image))


def rate_rows(warper: synthetic.Warper) -> None:
    """Pictures a CPU second; the process waits for a GPU at full load, so that it counts too."""
    rng, motion = np.random.default_rng(0), pressed(warper.points)
    blur = synthetic.Exposure(synthetic.Optics(gaussian=0.5, disc=2.0))
    take = partial(synthetic.render, PATTERN, CAMERA)
    show("1024² exact, at rest", rate(lambda: take(None, SENSOR, rng, TOP)))
    show("1024² exact, dented", rate(lambda: take(pressed, SENSOR, rng, TOP)))
    show(
        "1024² exact, dented, out of focus",
        rate(lambda: take(pressed, SENSOR, rng, TOP, exposure=blur)),
    )
    show("1024² warped, one by one", rate(lambda: warper.render(motion, SENSOR, rng)))
    for device in ["cpu"] + ["cuda"] * torch.cuda.is_available():
        batch, many = synthetic.prepare_batch(warper, device), 4 if device == "cpu" else 32
        fields = torch.as_tensor(np.stack([warper.forward(motion)] * many), device=device).float()
        show(f"1024² batch of {many} on {device}", rate(partial(rendered, batch, fields), many))


def rendered(batch: synthetic.BatchWarper, fields: torch.Tensor) -> None:
    """Render a batch to its end."""
    with torch.no_grad():
        batch.render(fields)[0, 0, 0, 0].item()


def rate(call: Callable[[], object], pictures: int = 1) -> str:
    """Median and range of the rate of a call, warmed up."""
    call()
    taken = []
    for _ in range(REPEATS):
        began = time.process_time()
        call()
        taken.append(time.process_time() - began)
    slow, middle, fast = (pictures / t for t in np.quantile(taken, [1, 0.5, 0]))
    return f"{middle:.3g} a CPU second ({slow:.3g} to {fast:.3g})"


def gauge_rows(count: int) -> None:
    """Gauges without images against touches that are rendered and correlated."""
    camera = synthetic.pinhole_above(SIZE, 500.0, (400, 320))
    pattern = synthetic.speckle(SIZE, diameter=3.2, softness=0.6, seed=4)
    warper = synthetic.prepare_warp(pattern, camera, TOP)
    places = np.stack(np.meshgrid([60, 130, 200, 270, 340], [60, 160, 260]), -1).reshape(-1, 2)
    gauges = {
        "displacement": (synthetic.displacement_gauges(places, 31), "mpx", 1e3),
        "strain": (synthetic.strain_gauges(places, 31, step=8, window=5), "µε", 1e6),
    }
    modes, rng = fe.modes(PLATE, 120), np.random.default_rng(1)
    touches = rng.uniform((25, 25), np.array(SIZE) - 25, (count, 2))
    weights = modes.response(touches) * rng.uniform(*FORCES, (count, 1))
    found = [correlated(warper, shape, places, rng) for shape in moving(warper, modes, weights)]
    image = warper.render(np.zeros((len(warper.points), 3)), SENSOR, None)
    for name, (gauge, unit, scale) in gauges.items():
        points = camera.on_plate(gauge.px, TOP)
        seen = synthetic.seen(camera, gauge.px, modes.value(points), modes.slope(points), TOP)
        said = (gauge.read(seen) @ weights.T).reshape(-1, count).T
        # Rounding to a grey level adds its own noise.
        texture = synthetic.texture_at(image, places, gauge.size)
        covariance = gauge.covariance(texture, np.hypot(SENSOR.noise, 12**-0.5))
        off = np.array([each[name] for each in found]) - said
        sigma = np.sqrt(np.diag(covariance))
        show(
            f"{name} of {count} touches, rms and predicted σ",
            f"{scale * said.std():.1f}, {scale * sigma.mean():.1f} {unit}",
        )
        show("  σ of the difference over predicted", deviations(off, covariance), "1")
        bias = np.abs(off.mean(axis=0))
        share, chance = (bias / sigma).max(), (bias / off.std(axis=0)).max() * np.sqrt(count)
        largest = f"{scale * bias.max():.2f} {unit}, {share:.3f} σ, {chance:.1f} of its own σ"
        show("  largest bias", largest)


def moving(warper: synthetic.Warper, modes: fe.Modes, weights: np.ndarray) -> Iterator[np.ndarray]:
    """Displacement of the face, mm, at the points of a warper, touch by touch."""
    value, slope = modes.value(warper.points), modes.slope(warper.points)
    for q in weights:
        yield np.column_stack([-TOP * (slope[..., 0] @ q), -TOP * (slope[..., 1] @ q), value @ q])


def correlated(
    warper: synthetic.Warper, motion: np.ndarray, places: np.ndarray, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Displacement and small strain at places, from a picture at rest and one of the touch."""
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


def deviations(off: np.ndarray, covariance: np.ndarray) -> str:
    """Scatter of the differences in units of what is predicted, together and one by one."""
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), off.T)
    each = off.std(axis=0) / np.sqrt(np.diag(covariance))
    return f"{np.sqrt(np.square(whitened).mean()):.3f} ({each.min():.2f} to {each.max():.2f})"


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else TOUCHES)
