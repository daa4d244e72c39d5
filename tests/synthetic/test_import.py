"""Who asks for the camera alone does not pay for the kernels."""

import subprocess
import sys


def test_the_camera_comes_without_a_compiler():
    code = "import sys, synthetic; synthetic.Camera; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
