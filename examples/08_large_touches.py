"""Press a thin plate hard, then a bent one: which theory holds, and what each says."""

from pathlib import Path

import numpy as np

import fe

plate = fe.Plate(size=(150.0, 100.0), thickness=1.0, young=3000.0, poisson=0.38)
touch = fe.Touch(x=61.0, y=45.0, force=5.0)
place = [(touch.x, touch.y)]

# Which theory a force needs, and what the smaller one would cost.
print(fe.linear_range(plate, touch.force).sentence)

# Linear theory, and the shell on a mesh that bends and stretches.
linear = fe.deflect(plate, [touch])
shell = fe.solve(plate, [touch], mesh=fe.grid(plate, 24))
print(f"deflection by linear theory: {linear.deflection(place)[0]:.3f} mm")
print(f"deflection of the shell: {shell.deflection(place)[0]:.3f} mm")
print("stability:", shell.stability.verdict.value)

# What a camera sees: the touched face moves in its plane too.
u, v, w = shell.displacement([(100.0, 45.0)])[0]
print(f"the face at (100, 45): u {1e3 * u:+.2f} µm, v {1e3 * v:+.2f} µm, w {w:+.3f} mm")

# Bend the base, then touch: west and east clamps come nearer by 5 mm. They may turn too.
held = fe.Plate(plate.size, 1.0, 3000.0, 0.38, fe.Edges(*(fe.Clamped(),) * 2, *(fe.Free(),) * 2))
base = fe.Shell(held, fe.grid(held, 24)).at(fe.Base(bend=5.0, twist=0.0))
touched = base.touch([fe.Touch(61.0, 45.0, 0.5)])
print(f"the bent base bows to {base.deflection([(75.0, 50.0)])[0]:.2f} mm")
for name, state in {"base": base, "touched": touched}.items():
    stability = state.stability
    print(f"{name}: {stability.verdict.value}, smallest eigenvalue {stability.eigenvalue:.3g}")

# What gauges read for a small further touch there, from one adjoint solve each.
gauges = np.array([(30.0, 20.0), (75.0, 80.0)])
per_newton = fe.shell_influence(base, gauges).strain([(61.0, 45.0)])[0]
print("exx per newton on the base:", ", ".join(f"{1e6 * exx:+.0f} µε" for exx in per_newton[:, 0]))

results = Path("results")
results.mkdir(exist_ok=True)
fe.draw(shell, [touch], results / "large-touch.png")
fe.write_vtu(results / "bent-base.vtu", touched, [fe.Touch(61.0, 45.0, 0.5)])
print(f"wrote {results / 'large-touch.png'} and {results / 'bent-base.vtu'}, for ParaView")
