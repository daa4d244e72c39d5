"""A recorded session of the small twin, made once."""

import pytest

from rig.bench import build_bench
from rig.loop import Loop
from rig.recording.recorder import Recorder
from rig.twin import build_twin


@pytest.fixture
def session(small, in_hand):
    """Record frames of the twin: `session(path, sequences)` gives scene, bench and snapshots."""

    def make(path, sequences, waiting=100, **options):
        scene = small({"touches.most": 2})
        bench = build_bench(scene, lambda done, total: None)
        source = in_hand(build_twin(scene), [*range(17), *sequences])
        with Recorder(
            path, {"scene": scene.model_dump_json()}, waiting=waiting, **options
        ) as recorder:
            stream = iter(Loop(bench, source, recorder=recorder))
            shots = [next(stream) for _ in sequences]
        return bench, shots, recorder

    return make
