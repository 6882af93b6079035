"""Errors that bakes would end with, as far as they are known without baking."""

from __future__ import annotations

import bpy

from ...core.errors import BakeError, message_of
from ...core.messages import Messages
from ..images.facts import is_sequence
from ..images.files import check_image
from ..images.results import check_editable
from ..node.find import find_misplaced, targets_of
from ..read.visibility import ObjectInstance, check_instance
from .state import state


def problems_of(obj, counts: dict[str, int]) -> Messages:
    """Errors that a bake of the object would end with.

    `counts` is the result of `rendered_counts`. An error of the object as a whole comes once for each of its targets.
    """
    misplaced = find_misplaced([obj] if obj.instance_type == "NONE" else [], with_images=True)
    messages = Messages(message for bake in misplaced for message in bake.messages)
    targets, view_layer = targets_of(obj), bpy.context.view_layer
    if targets and obj.name not in view_layer.objects:  # an instance alone
        targets = [target for target in targets if not target.was_baked_elsewhere()]
    times = counts.get(obj.name, 0)
    for target in targets:
        checks = [
            lambda: check_instance(obj.name, ObjectInstance(obj, None, times) if times else None, view_layer),
            lambda target=target: target.node.surface().check(),
        ]
        if bpy.context.scene.beamspread.output == "LUMINANCE":
            checks.append(lambda target=target: check_editable(target.material))
        if target.image is not None and not is_sequence(target.image):  # its row says what it shows
            checks.append(lambda target=target: check_image(target.image))
        if target.name in state.refused:
            messages.add(message_of(state.refused[target.name], str(target.name)))
        for check in checks:
            try:
                check()
            except BakeError as error:
                messages.add(message_of(error, str(target.name)))
    return messages
