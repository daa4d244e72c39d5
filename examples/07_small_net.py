"""Train a small net on the paper's simulated touches, and see the solver beside it."""

import numpy as np

import fe
import models
from models import Recipe, train_net

SIZE = (100.0, 100.0)
plate = fe.Plate(size=SIZE, thickness=1.0, young=3000.0, poisson=0.3)
influence = fe.influence(plate, models.gauges_on_edges(SIZE), fe.Mesh(SIZE, (40, 40)))

# 17 x 17 touches to learn from, 14 x 14 between them to watch, others at random for the test.
rng = np.random.default_rng(7)
training = models.simulate_dataset(influence, models.grid_places(SIZE, spacing=5.0, margin=10.0))
validation = models.simulate_dataset(influence, models.midpoint_places(SIZE, 5.0, 10.0, count=14))
test = models.simulate_dataset(influence, models.random_places(SIZE, 10.0, 100, rng))

# The paper takes 30000 epochs; these are enough to see it learn.
options = models.NetOptions(layers=(32, 32), activation="tanh")
trained = train_net(training, validation, options, Recipe(epochs=1000, learning_rate=0.01), rng)
for epoch in (0, 100, 999):
    learnt, watched = trained.history[epoch]
    print(f"epoch {epoch}: loss {learnt:.2f} mm, between the touches {watched:.2f} mm")

error = models.position_error(test.targets, models.predict(trained.net, test.strain))
print(f"net: mean error {error.mean():.2f} mm, largest {error.max():.2f} mm, {len(error)} touches")

# The same strains, by least squares on the influence: no training, and the force is free.
solved = [
    models.solve(strain.reshape(-1, 3), influence, sigma=1e-7, count=1).xy[0]
    for strain in test.strain
]
error = models.position_error(test.targets, np.array(solved))
print(f"solver: mean error {error.mean():.1e} mm")
