"""Bend a clamped plate by touches; then ask once what gauges read for a touch anywhere."""

import numpy as np

import fe

plate = fe.Plate(size=(150.0, 100.0), thickness=1.5, young=3000.0, poisson=0.38)
mesh = fe.Mesh(plate.size, (60, 40))
touches = [fe.Touch(x=61.0, y=45.0, force=2.0), fe.Touch(x=110.0, y=70.0, force=1.0)]

# Forces press into the plate, z points out of the touched face: it moves by a negative w.
bent = fe.deflect(plate, touches, mesh)
under = np.array([(t.x, t.y) for t in touches])
print("deflection under the touches:", ", ".join(f"{w:.4f} mm" for w in bent.deflection(under)))

# Strain on the touched face: tension along the clamped edge, compression under the finger.
gauges = {"middle of the lower edge": (75.0, 0.0), "beside the first touch": (71.0, 45.0)}
places = np.array(list(gauges.values()))
for name, (exx, eyy, exy) in zip(gauges, bent.strain(places), strict=True):
    print(f"{name}: exx {1e6 * exx:+.1f}, eyy {1e6 * eyy:+.1f}, exy {1e6 * exy:+.1f} µε")

# One solve a measurement gives what the gauge reads for 1 N at EVERY place, with its gradient.
influence = fe.influence(plate, places, mesh)
force = np.array([t.force for t in touches])
by_influence = np.einsum("k,kmc->mc", force, influence.strain(under))
difference = np.abs(by_influence - bent.strain(places)).max() / np.abs(by_influence).max()
print(f"influence against bending: relative difference {difference:.1e}")

step = np.array([[1e-3, 0.0]])
start = under[:1]
forward, backward = influence.strain(start + step), influence.strain(start - step)
quotient = (forward - backward)[0] / 2e-3
exact = influence.gradient(start)[0, :, :, 0]
print(f"gradient against differences: {np.abs(quotient - exact).max() / np.abs(exact).max():.1e}")
