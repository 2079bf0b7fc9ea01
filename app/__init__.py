"""Apprentice: learn in which order an expert works on the regions of a part, and show a robot doing it."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when NumPy is loaded; on matrices as small as ours threads only wait
