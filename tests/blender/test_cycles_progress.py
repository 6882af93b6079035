"""Stages of Cycles' process."""

import bpy
from beamspread.blender.cycles import process
from beamspread.blender.cycles.scene_copy import SceneCopy
from beamspread.core.progress import Progress

CHILD = """
import json, sys, time
import numpy as np
request = json.load(open(sys.argv[-1]))
time.sleep(0.6)
print(request["mark"], 0.0, flush=True)
time.sleep(0.6)
np.savez(request["output"], done=np.ones(1))
"""


def test_it_says_that_cycles_starts_until_it_answers(monkeypatch, tmp_path):
    child, stages = tmp_path / "child.py", []
    child.write_text(CHILD)
    monkeypatch.setattr(process, "CHILD", child)
    progress = Progress(lambda _fraction: stages.append(progress.stage))
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy:
        assert process.run(copy, "any", {}, progress, "Searching")["done"] == 1
    assert [*dict.fromkeys(stages)] == ["Searching (Cycles starts)", "Searching"]
