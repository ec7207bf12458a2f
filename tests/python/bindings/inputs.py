"""Models of bending plates and of the demo (baked with views), the demo's sensor and frames of a run that is not in its model."""
import os

import numpy

PLATES, DEMO, SENSOR, FRAMES = (os.environ[name] for name in ("LBEA_PLATES", "LBEA_DEMO", "LBEA_SENSOR", "LBEA_FRAMES"))


def cloud_of(file):
    """The points of a binary PLY file whose vertices are x, y, z as float."""
    return numpy.frombuffer(file.read_bytes().split(b"end_header\n", 1)[1], "<f4").reshape(-1, 3)
