"""Words in the window: each property and operator of the add-on has a tooltip as Blender's own."""

import ast
import re
from pathlib import Path

import beamspread
import bpy
import pytest
from beamspread.blender.node.node import BeamspreadNode

PROPERTY_VERBS = {
    *(
        "Bake",
        "Change",
        "Choose",
        "Continue",
        "Copy",
        "Divide",
        "Draw",
        "Extend",
        "Fill",
        "Fit",
        "Give",
        "Hide",
        "Include",
    ),
    *("Keep", "Let", "Limit", "Make", "Multiply", "Name", "Open", "Preview", "Refuse", "Render", "Replace", "Scale"),
    *("Set", "Show", "Stop", "Use", "Write"),
}
"""First words of tooltips. A new one has to be a verb in the imperative."""

OPERATOR_VERBS = PROPERTY_VERBS | {"Add", "Clear", "Delete", "Have", "Move", "Remove", "Switch", "Take", "Update"}

BRITISH = re.compile(
    r"colour|grey\b|metres?\b|centre|neighbour|behaviour|favour|licence|labell|travell|modell|"
    r"\b(?:normal|optim|organ|recogn|initial|maxim|minim|visual|general|special|summar)is(?:e|es|ed|ing)\b",
    re.IGNORECASE,
)

PROPERTY_OWNERS = (bpy.types.PropertyGroup, bpy.types.AddonPreferences)


def of_add_on(base: type) -> list[type]:
    """Classes of the add-on below a type of Blender's, also those that inherit from it by others."""
    found = []
    for kind in base.__subclasses__():
        found += of_add_on(kind)
        if kind.__module__.startswith(f"{beamspread.__name__}.") and hasattr(kind, "bl_rna"):
            found.append(kind)
    return list(dict.fromkeys(found))


def own_names(kind: type) -> list[str]:
    """Names of the properties that the class itself and its mixins define."""
    return [name for part in kind.__mro__ for name in vars(part).get("__annotations__", {})]


def operators() -> dict:
    """Types of the add-on's operators by name."""
    return {name: getattr(bpy.ops.beamspread, name).get_rna_type() for name in dir(bpy.ops.beamspread)}


def properties() -> dict:
    """Properties that the add-on registers, by class and name."""
    kinds = [BeamspreadNode, *(kind for base in PROPERTY_OWNERS for kind in of_add_on(base))]
    owned = [
        (kind.__name__, kind.bl_rna.properties[name])
        for kind in kinds
        for name in own_names(kind)
        if name in kind.bl_rna.properties
    ]
    owned += [
        (f"beamspread.{name}", prop)
        for name, rna in operators().items()
        for prop in rna.properties
        if prop.identifier != "rna_type"
    ]
    return {f"{owner}.{prop.identifier}": prop for owner, prop in owned}


def faults_of(text: str, verbs=()) -> list[str]:
    """Faults of a tooltip; `verbs`: it has to begin with one of them."""
    return [
        fault
        for fault, is_found in {
            "is empty": not text.strip(),
            "ends with a period": text.endswith("."),
            "is British": BRITISH.search(text) is not None,
            "begins in lower case": text.partition(" ")[0].islower(),
            "does not begin with a verb": bool(verbs) and text.partition(" ")[0] not in verbs,
        }.items()
        if is_found
    ]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "is empty"),
        ("Bake it.", "ends with a period"),
        ("Set the colour", "is British"),
        ("Set the scale of normalised light", "is British"),
        ("bake", "begins in lower case"),
        ("Quality of shadows", "does not begin with a verb"),
    ],
)
def test_faults_are_found(text, fault):
    assert fault in faults_of(text, PROPERTY_VERBS)
    assert not faults_of("Set the color", PROPERTY_VERBS)


def test_the_walk_meets_all_kinds_of_properties():
    names = set(properties())
    assert {"BeamspreadSettings.samples", "BeamspreadNode.ior", "BeamspreadNode.path_length"} <= names
    assert {"BeamspreadPreferences.threads", "beamspread.bake.objects"} <= names
    assert {"bake", "from_principled", "show_frames"} <= set(operators())


def test_tooltips_of_properties():
    faults = {}
    for name, prop in properties().items():
        verbs = () if prop.is_hidden else PROPERTY_VERBS
        if found := faults_of(prop.description, verbs):
            faults[name] = prop.description, found
        if not prop.is_hidden and (found := faults_of(prop.name)):
            faults[f"{name} (label)"] = prop.name, found
    assert not faults


def test_tooltips_of_enum_items():
    items = {
        f"{name} = {item.identifier}": item
        for name, prop in properties().items()
        if prop.type == "ENUM"
        for item in prop.enum_items
    }
    faults = {name: found for name, item in items.items() if (found := faults_of(item.description))}
    faults |= {name: item.name for name, item in items.items() if faults_of(item.name)}
    assert items
    assert not faults


def test_tooltips_of_operators():
    faults = {
        name: (rna.description, found)
        for name, rna in operators().items()
        if (found := faults_of(rna.description, OPERATOR_VERBS))
    }
    faults |= {f"{name} (label)": rna.name for name, rna in operators().items() if faults_of(rna.name)}
    assert not faults


def test_tooltip_of_the_node():
    """Menus of nodes show it and end it with a period."""
    assert not faults_of(BeamspreadNode.bl_rna.description, PROPERTY_VERBS)


def test_labels_of_panels():
    panels = of_add_on(bpy.types.Panel)
    assert len(panels) > 5
    assert not {panel.__name__: panel.bl_label for panel in panels if faults_of(panel.bl_label)}


def test_labels_in_the_source_are_not_british():
    """Texts that code draws, reports and raises for artists; comments and docstrings are others' concern."""
    found, package = [], Path(beamspread.__file__).parent
    folders = ("blender", "core/bake", "core/scene", "core/batch", "core/live")
    for file in (file for folder in folders for file in (package / folder).rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs
            # Names of one word, as of attributes, are no text that anyone reads.
            if is_text and " " in node.value and BRITISH.search(node.value):
                found.append(f"{file.name}:{node.lineno}: {node.value}")
    assert not found


def test_presets_have_plain_names_and_say_who_measured_them():
    items = BeamspreadNode.bl_rna.properties["preset"].enum_items[1:]
    labels = [item.name for item in items]
    assert len(set(labels)) == len(labels) == len(beamspread.presets())
    assert not [label for label in labels if re.search(r"[a-z]\d|Clorox|Gatorade|Head", label)]
    assert {item.description for item in items} == {
        "Measured by Jensen et al. 2001",
        "Measured by Narasimhan et al. 2006",
    }


def test_no_tooltip_asks_artists_for_options_of_a_command_line():
    texts = {name: prop.description for name, prop in properties().items()}
    texts |= {name: rna.description for name, rna in operators().items()}
    assert not [name for name, text in texts.items() if "--" in text]
