"""The limit: from the noise of a pixel to a touch, and what each way of measuring keeps of it.

Parts: steps, over, ways. All on the shipped twin; bounds are Cramér and Rao's, with shift,
rotation and scale of the camera and the light unknown.
"""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

import dic
import models
import rig
import synthetic
from models import Forward, expected_errors, gauges_inside_edges, places_over_plate
from models.forward.linear import modal
from rig.live.baseline import average_reference
from rig.live.bench import Bench, build_bench
from rig.live.chain import Chain, prepare_chain
from rig.live.strain_chain import prepare_strain
from rig.report.figure import Figure
from rig.report.plate_map import at
from rig.sources.twin import Twin, build_twin
from rig.studies.study import line, rms as root_mean_square, run
from rig.system.arrays import F64, AnyArray

FORCE = 1.0  # N
INSET = 25.0  # mm from an edge
REFERENCE = 16  # frames
SUBSET, STEP, WINDOW = 21, 5, 5
STEPS = "From the noise of a pixel to a touch of 1 N (shipped twin)"
OVER = "Bound of a touch of 1 N over the plate, every pixel, one frame"
WAYS = "What each way of measuring keeps, a touch of 1 N, rms over the plate 25 mm from the edges"


class Case(NamedTuple):
    """The bench, its twin, an image at rest without noise (grey levels), and the noise."""

    bench: Bench
    twin: Twin
    still: AnyArray
    noise: float


@cache
def case() -> Case:
    """Build the shipped twin."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    rest = np.zeros((len(twin.warper.points), 3))
    span = (twin.sensor.white - twin.sensor.black) * twin.sensor.top / 255.0
    noise = float(np.hypot(twin.sensor.noise, 12**-0.5))  # with the rounding to grey levels
    return Case(bench, twin, span * twin.warper.render(rest, None, None), noise)


def touches() -> F64:
    """Touches of 1 N over the plate, away from its edges."""
    size = case().bench.plate.size
    places = places_over_plate(size, 16)
    inner = np.all((places >= INSET) & (places <= np.array(size) - INSET), axis=1)
    return np.column_stack([places[inner], np.full(inner.sum(), FORCE)])


def bounds(forward: Forward) -> tuple[float, float]:
    """Bounds of place, mm, and force, N: root mean square over the touches."""
    errors = expected_errors(forward, touches())
    return root_mean_square(errors.place), root_mean_square(errors.force)


def steps() -> Iterator[Figure]:
    """Follow one grey level of noise to millimetres and newtons."""
    bench, twin, still, noise = case()
    rng = np.random.default_rng(3)
    scale = bench.plate.size[0] / np.ptp(
        bench.camera.project([[0, 0, bench.height], [bench.plate.size[0], 0, bench.height]])[:, 0]
    )
    light = still / ((twin.sensor.white - twin.sensor.black) * twin.sensor.top)
    pair = [twin.sensor.capture(light, rng) for _ in range(2)]
    field = dic.correlate(dic.prepare(pair[0], SUBSET, STEP), pair[1])
    strain = dic.strain(field, WINDOW)
    sigma, of_strain = np.nanmedian(field.sigma_u), np.nanmedian(strain.sigma[:, 0])
    place, force = bounds(every_pixel())
    for name, value, unit in (
        ("noise of the camera, rounding included", noise, "grey levels"),
        ("contrast of the pattern, standard deviation", still.std(), "grey levels"),
        ("a pixel on the plate", 1e3 * scale, "µm"),
        (f"displacement, subset {SUBSET}: σ stated", 1e3 * sigma, "mpx"),
        ("the same on the plate", 1e3 * scale * sigma, "µm"),
        ("displacement: scatter over stated σ", np.nanstd(field.u / field.sigma_u), ""),
        (f"strain, VSG {strain.vsg} px: σ stated", 1e6 * of_strain, "µε"),
        ("strain: scatter over stated σ", np.nanstd(strain.exx / strain.sigma[:, 0]), ""),
        ("touch, bound of the place", place, "mm"),
        ("touch, bound of the force", 1e3 * force, "mN"),
    ):
        yield from line(STEPS, name, figure=(float(value), unit))


def over() -> Iterator[Figure]:
    """Bounds of place and force over the whole plate, from every pixel."""
    places = places_over_plate(case().bench.plate.size, 16)
    errors = expected_errors(every_pixel(), np.column_stack([places, np.full(len(places), FORCE)]))
    for (x, y), place, force in zip(places.tolist(), errors.place, errors.force, strict=True):
        yield from line(OVER, at(x, y), place=(place, "mm"), force=(force, "N"))


def ways() -> Iterator[Figure]:
    """Bounds of every way to measure, beside that of all pixels."""
    bench = case().bench
    least, _ = bounds(every_pixel())
    subsets = places_over(400)
    for name, forward in (
        ("every pixel", every_pixel()),
        *((f"sums over tiles of {n} px", by_tiles(n)) for n in (8, 16, 32)),
        ("strain map, exact covariance", by_strain()),
        (
            "displacement of 400 subsets of 31 px",
            by_gauges(synthetic.displacement_gauges(subsets, 31)),
        ),
        (
            "displacement of 72 subsets of 31 px",
            by_gauges(synthetic.displacement_gauges(ring(), 31)),
        ),
        (
            "strain at 400 places, VSG 51 px",
            by_gauges(synthetic.strain_gauges(subsets, 31, step=5, window=5)),
        ),
        (
            "strain at 72 places of a ring, VSG 51 px (the paper's way)",
            by_gauges(synthetic.strain_gauges(ring(), 31, step=5, window=5)),
        ),
    ):
        place, force = bounds(forward)
        shipped = f"tiles of {bench.dic.tile} px" in name
        yield from line(
            WAYS,
            name + " (default)" * shipped,
            place=(place, "mm"),
            **{"÷_CRB": place / least},
            force=(1e3 * force, "mN"),
        )


def every_pixel() -> Forward:
    """Use every pixel."""
    bench, _, still, noise = case()
    pattern = models.pixel_level(bench.motions.plate_modes, bench.camera, bench.height, still)
    return pattern.forward(noise)


def by_tiles(size: int) -> Forward:
    """Use sums over tiles, each with a light of its own, as in the live loop."""
    return chain(size).pattern.forward(case().noise)


def by_strain() -> Forward:
    """Use the strain map over blocks of tiles."""
    bench = case().bench
    found = prepare_strain(chain(8), bench.camera, 3, WINDOW)
    return found.map.forward(case().noise)


@cache
def chain(size: int) -> Chain:
    """Prepare the live chain on tiles of `size` px, with a reference of many frames."""
    bench, twin, *_ = case()
    zero = average_reference([twin.frame(n, ()) for n in range(REFERENCE)])
    tiles = dic.lay_tiles((bench.camera.size[1], bench.camera.size[0]), size)
    motions = models.prepare_motions(bench.motions.modes, bench.camera, bench.height, tiles)
    return prepare_chain(zero, motions, bench.max_touches)


def by_gauges(gauges: synthetic.Gauges) -> Forward:
    """Use displacement or strain at places, with its full covariance, rigid motion left free."""
    bench, _, still, noise = case()
    modes, camera = bench.motions.plate_modes, bench.camera
    points = camera.on_plate(gauges.px, bench.height)
    seen = synthetic.image_motion_basis(
        camera, gauges.px, modes.value(points), modes.slope(points), bench.height
    )
    response = np.asarray(gauges.read(seen)).reshape(-1, len(modes.stiffness))
    rigid = np.asarray(gauges.read(synthetic.rigid_motion_basis(camera, gauges.px))).reshape(
        len(response), -1
    )
    texture = synthetic.texture_at(still, gauges.xy, gauges.size)
    root = np.linalg.cholesky(gauges.covariance(texture, noise))
    whitened, free = (np.linalg.solve(root, part) for part in (response, rigid))
    free = free[:, np.linalg.norm(free, axis=0) > 1e-9 * np.abs(whitened).max()]
    basis = np.linalg.qr(free)[0]
    return modal(modes, (whitened - basis @ (basis.T @ whitened)).T)


def ring() -> F64:
    """72 places on a ring 25 mm inside the edges, px."""
    a, b = case().bench.plate.size
    inner = INSET + gauges_inside_edges((a - 2 * INSET, b - 2 * INSET), (a - 2 * INSET) / 18, 0.0)
    return on_image(inner)


def places_over(count: int) -> F64:
    """Lay a grid of places over the plate, px."""
    a, b = case().bench.plate.size
    side = round(count**0.5)
    x, y = np.meshgrid(np.linspace(10, a - 10, side), np.linspace(10, b - 10, side))
    return on_image(np.column_stack([x.ravel(), y.ravel()]))


def on_image(places: F64) -> F64:
    """Where places of the seen face, mm, stand in the image, whole px."""
    bench = case().bench
    seen = bench.camera.project(np.column_stack([places, np.full(len(places), bench.height)]))
    return np.rint(seen)


PARTS = {"steps": steps, "over": over, "ways": ways}

if __name__ == "__main__":
    run(PARTS, __doc__)
