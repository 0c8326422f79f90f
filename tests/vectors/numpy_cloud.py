"""numpy_cloud.npy: the points of `cloud` in src/map/tests/mod.rs as NumPy writes them. python3 numpy_cloud.py"""

from pathlib import Path

import numpy

points = [[-1.0, -2.0, 0.0], [1.5, 2.25, 0.0], [0.0, 0.0, 2.5]]
points += [[k * 0.25 % 2.0 - 0.75, k * 0.375 % 3.0 - 1.5, k / 64.0] for k in range(40)]
numpy.save(Path(__file__).with_suffix(".npy"), numpy.array(points))
