"""A strip of two stiffnesses that bends as a stepped beam."""

import numpy as np

import fe

# West clamped, ν = 0, loads spread over the whole width: bends as a beam.
SIZE = (120.0, 40.0)
EDGES = fe.Edges(fe.Clamped(), fe.Free(), fe.Free(), fe.Free())
STEP = 50.0


def stepped(thickness: float, young: float = 3000.0) -> fe.Plate:
    """Make a strip whose outer part has another thickness and stiffness."""
    patch = fe.Patch((STEP, 120.0), (0.0, 40.0), thickness, young)
    return fe.Plate(SIZE, 1.0, 3000.0, 0.0, EDGES, (patch,))


def line_load(x: float, count: int = 41) -> list[fe.Touch]:
    """1 N over the whole width at x, as the trapezoid rule over elements of 1 mm."""
    weights = np.ones(count)
    weights[[0, -1]] = 0.5
    places = np.linspace(0.0, 40.0, count)
    return [fe.Touch(x, float(y), float(w) / 40.0) for y, w in zip(places, weights, strict=True)]


def cantilever(plate: fe.Plate, x: float) -> float:
    """Deflection of the stepped cantilever under 1 N at its tip, by integrating M / EI."""
    rigid = [3000.0 * 40.0 / 12, plate.patches[0].young * plate.patches[0].thickness ** 3 * 40 / 12]
    (length, _), s = plate.size, STEP

    def one(
        lo: float, hi: float, ei: float
    ) -> tuple[
        float, float
    ]:  # slope and deflection gained over a piece, from curvature (L - x) / EI
        slope = (length * (hi - lo) - (hi**2 - lo**2) / 2) / ei
        sag = (length * (hi - lo) ** 2 / 2 - (hi**3 / 6 - lo**2 * hi / 2 + lo**3 / 3)) / ei
        return slope, sag

    if x <= s:
        return one(0, x, rigid[0])[1]
    slope, sag = one(0, s, rigid[0])
    return sag + slope * (x - s) + one(s, x, rigid[1])[1]
