"""Runs until test_kept_files.py kills it: writes its image to the file again and again.

blender -b --python THIS -- FILE
"""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent.parent / "build" / "stage")]

import beamspread  # noqa: E402
import bpy  # noqa: E402
import numpy as np  # noqa: E402

beamspread.register()
image = bpy.data.images.load(sys.argv[-1])
width, height = image.size
noise = np.random.default_rng(1).random((height, width, 3), np.float32)
while True:
    beamspread.blender.images.files.fill_image(image, noise)
