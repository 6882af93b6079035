"""The scene marble_floor: a chess game by the window, on measured marble (Jensen et al. 2001).

Light spreads about 8.5 mm inside this marble (diffusion length of its red channel). SCALE makes the scene so small
that this is wider than the window's bars and the necks of the chessmen: their shadows glow. Lengths are metres,
before SCALE.
"""

import math

import bpy
import scene_parts as parts

MM = 0.001
SCALE = 0.55  # a travel set, its king 5 cm tall
FLOOR_X, FLOOR_Y = (-0.54, 0.42), (-0.36, 0.28)
WALL_HEIGHT, WALL_THICKNESS = 0.5, 0.018
SKY_STRENGTH = 2.0

# Turned shapes: radius,height in mm from the floor up; a point given twice is an edge.
KING = (
    "0,0 0,0 17,0 17,0 17.6,3 16,6 13.5,7.5 13.5,7.5 14.2,9.5 12.6,12.5 9,18 7,28 6.2,40 6.6,50 8,55 8,55 11.4,56 "
    "11.4,58 8.6,59 8.6,59 10,61 8.2,63 8.2,63 9,70 11.8,79 11.8,79 10.5,81.5 4,84.5 2.5,86 0,86.5"
)
QUEEN = (
    "0,0 0,0 16.5,0 16.5,0 17,3 15.5,6 13,7.5 13,7.5 13.8,9.5 12.2,12.5 8.6,18 6.6,28 5.8,38 6.2,46 7.6,51 7.6,51 "
    "10.8,52 10.8,54 8,55 8,55 9.4,57 7.6,59 7.6,59 8,65 11,74 11,74 9.5,74 6,73 4,75.5 2,77 2,77 3.4,79.5 2,82 "
    "0,83"
)
BISHOP = (
    "0,0 0,0 14.5,0 14.5,0 15,2.6 13.6,5 11.5,6.5 11.5,6.5 12,8 10.6,11 7.6,16 5.8,25 5.2,34 5.8,40 6.6,43 6.6,43 "
    "9.4,44 9.4,45.6 6.8,46.8 6.8,46.8 8.6,52 7.6,58 4,64 1.8,66 1.8,66 2.6,68 1.6,70 0,70.6"
)
ROOK = (
    "0,0 0,0 15.5,0 15.5,0 16,2.8 14.6,5.5 12.5,7 12.5,7 13,9 11.4,12 9,17 7.8,26 7.6,34 8.4,38 8.4,38 11.4,40 "
    "11.4,41.5 10.6,42.5 10.6,42.5 11.6,53 11.6,53 8.6,53 8.6,53 8.2,49.5 8.2,49.5 0,49"
)
PAWN = (
    "0,0 0,0 12.5,0 12.5,0 13,2.4 11.6,4.6 9.8,5.8 9.8,5.8 10.4,7.4 9,10 6.2,15 4.8,22 5,28 5,28 8.4,29 8.4,30.5 "
    "5.4,31.8 5.4,31.8 8.2,37 7.4,42 4.2,45.2 0,46.2"
)
CANDLESTICK = (
    "0,0 0,0 24,0 24,0 24.6,2 22,4 12,6 7,10 5,16 5,16 8,17.5 8,20 5,21.5 5,21.5 4.2,28 6,34 12,37 12,37 13,38 "
    "12.4,39.4 12.4,39.4 9,39 9,39 9,38"
)
CANDLE = "8,38 8,38 8,66 8,66 7,66.8 7,66.8 4,65.8 0,65.6"
FLAME = "0,69 2.2,71.5 2.7,74.5 2,79 0.9,84 0,88"


def build():
    scene = parts.empty_scene("Marble floor", 960, 640, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    width, depth = FLOOR_X[1] - FLOOR_X[0], FLOOR_Y[1] - FLOOR_Y[0]
    parts.plane("Floor", width, depth, marble(), center=(sum(FLOOR_X) / 2, sum(FLOOR_Y) / 2))
    window_wall(center=-0.10)
    chessmen()
    candle(x=0.115, y=-0.085)
    parts.sun("Low sun", parts.direction(64, -90 + 24), 8.0, (1.0, 0.78, 0.52))
    parts.sun("Light of the room", parts.direction(20, 70), 0.10, (0.55, 0.70, 1.0), shadow=False)
    evening_sky(scene.world)
    parts.camera((0.085, -0.62, 0.215), (-0.005, 0.0, 0.068), lens=41)
    parts.scale_scene(SCALE)
    # Reflections of lamps in the polish are noise, and the room needs few bounces.
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3


def evening_sky(world):
    """Sky over a dim landscape behind the window, a dark room on this side. For the eye and for reflections alone:
    the bake knows only lamps, so it lights nothing else either."""
    tree = world.node_tree
    new, link = tree.nodes.new, tree.links.new
    coordinates, split = new("ShaderNodeTexCoord"), new("ShaderNodeSeparateXYZ")
    height, ramp = new("ShaderNodeMapRange"), new("ShaderNodeValToRGB")
    outside, mix = new("ShaderNodeMapRange"), new("ShaderNodeMixRGB")
    rays, seen, background = new("ShaderNodeLightPath"), new("ShaderNodeMath"), tree.nodes["Background"]
    height.inputs["From Min"].default_value, height.inputs["From Max"].default_value = -0.13, 0.13
    outside.inputs["From Min"].default_value, outside.inputs["From Max"].default_value = 0.1, 0.4
    stops = ramp.color_ramp.elements
    stops[0].position, stops[0].color = 0.0, (0.10, 0.062, 0.04, 1)
    stops[1].position, stops[1].color = 1.0, (0.50, 0.58, 0.72, 1)
    for position, color in (
        (0.48, (0.50, 0.29, 0.15, 1)),
        (0.51, (1.0, 0.58, 0.26, 1)),
        (0.56, (1.0, 0.72, 0.42, 1)),
        (0.75, (0.92, 0.74, 0.54, 1)),
    ):
        stops.new(position).color = color
    mix.inputs["Color1"].default_value = (0.008, 0.009, 0.012, 1)
    seen.operation = "MULTIPLY_ADD"  # SKY_STRENGTH - SKY_STRENGTH * is_diffuse
    seen.inputs[1].default_value, seen.inputs[2].default_value = -SKY_STRENGTH, SKY_STRENGTH
    link(coordinates.outputs["Generated"], split.inputs[0])
    link(split.outputs["Z"], height.inputs["Value"])
    link(split.outputs["Y"], outside.inputs["Value"])
    link(height.outputs[0], ramp.inputs["Fac"])
    link(outside.outputs[0], mix.inputs["Fac"])
    link(ramp.outputs["Color"], mix.inputs["Color2"])
    link(rays.outputs["Is Diffuse Ray"], seen.inputs[0])
    link(mix.outputs["Color"], background.inputs["Color"])
    link(seen.outputs[0], background.inputs["Strength"])
    world.cycles.sampling_method = "NONE"


def marble():
    """Measured marble, polished: the baked light, tinted by faint veins, under a coat of glossy reflection."""
    material, node = parts.medium_material("Marble", preset="marble")
    tree = material.node_tree
    new, link = tree.nodes.new, tree.links.new
    coordinates, noise, ramp = new("ShaderNodeTexCoord"), new("ShaderNodeTexNoise"), new("ShaderNodeValToRGB")
    noise.inputs["Scale"].default_value = 9.0
    noise.inputs["Detail"].default_value = 12.0
    noise.inputs["Roughness"].default_value = 0.62
    noise.inputs["Distortion"].default_value = 1.4
    # A vein is where the noise crosses its middle.
    stops = ramp.color_ramp.elements
    stops[0].position, stops[0].color = 0.44, (1, 1, 1, 1)
    stops[1].position, stops[1].color = 0.56, (1, 1, 1, 1)
    pale, dark = (0.93, 0.93, 0.93, 1), (0.62, 0.63, 0.66, 1)
    for position, color in ((0.485, pale), (0.5, dark), (0.515, pale)):
        stops.new(position).color = color
    tint = new("ShaderNodeMixRGB")
    tint.blend_type = "MULTIPLY"
    tint.inputs["Fac"].default_value = 0.8
    emission, glossy, add = new("ShaderNodeEmission"), new("ShaderNodeBsdfGlossy"), new("ShaderNodeAddShader")
    fresnel = new("ShaderNodeFresnel")
    fresnel.inputs["IOR"].default_value = 1.5
    glossy.inputs["Roughness"].default_value = 0.15
    output = tree.get_output_node("ALL")
    link(coordinates.outputs["Object"], noise.inputs["Vector"])
    link(noise.outputs["Fac"], ramp.inputs["Fac"])
    link(node.outputs["Color"], tint.inputs["Color1"])
    link(ramp.outputs["Color"], tint.inputs["Color2"])
    link(tint.outputs["Color"], emission.inputs["Color"])
    link(fresnel.outputs["Fac"], glossy.inputs["Color"])
    link(emission.outputs["Emission"], add.inputs[0])
    link(glossy.outputs["BSDF"], add.inputs[1])
    link(add.outputs["Shader"], output.inputs["Surface"])
    columns = [(coordinates,), (noise,), (ramp, node), (tint, fresnel), (emission, glossy), (add,), (output,)]
    for column, nodes in enumerate(columns):
        for row, item in enumerate(nodes):
            item.location = (280 * column - 800, -260 * row)
    return material


def window_wall(center):
    """A wall with an arched window of small panes."""
    plaster = parts.plain_material("Plaster", (0.42, 0.36, 0.31), roughness=0.9, specular=0.1)
    wood = parts.plain_material("Window frame", (0.16, 0.09, 0.05), roughness=0.45)
    y0, y1 = FLOOR_Y[1] - WALL_THICKNESS, FLOOR_Y[1]
    half, sill, spring = 0.115, 0.03, 0.125
    left, right = center - half, center + half
    steps = 24
    angles = [math.pi * step / steps for step in range(steps + 1)]
    arch = [(center + half * math.cos(angle), spring + half * math.sin(angle)) for angle in angles]
    # Wide enough that the sun comes in through the window alone.
    outer_left, outer_right = FLOOR_X[0] - 0.6, FLOOR_X[1] + 0.2
    pieces = [
        [(outer_left, 0), (outer_right, 0), (outer_right, sill), (outer_left, sill)],
        [(outer_left, sill), (left, sill), (left, spring), (outer_left, spring)],
        [(right, sill), (outer_right, sill), (outer_right, spring), (right, spring)],
        [(outer_left, spring), (left, spring), (left, WALL_HEIGHT), (outer_left, WALL_HEIGHT)],
        [(right, spring), (outer_right, spring), (outer_right, WALL_HEIGHT), (right, WALL_HEIGHT)],
    ]
    for first, second in zip(arch, arch[1:]):
        pieces.append([second, first, (first[0], WALL_HEIGHT), (second[0], WALL_HEIGHT)])
    for index, outline in enumerate(pieces):
        parts.prism(f"Wall {index}", outline, y0, y1, plaster)
    # The frame: posts and rails in the middle of the wall's thickness, a ledge below.
    bar, reach_y = 4 * MM, 5 * MM
    middle = (y0 + y1) / 2
    for index in (-1, 0, 1):
        x = center + index * half / 2
        top = spring + math.sqrt(half**2 - (x - center) ** 2)
        reach = bar * (1.5 if index == 0 else 1.0)
        parts.box(f"Post {index + 2}", (x - reach, middle - reach_y, sill), (x + reach, middle + reach_y, top), wood)
    for index, z in enumerate((sill + 0.048, spring, spring + 0.055)):
        reach = half if z <= spring else math.sqrt(half**2 - (z - spring) ** 2)
        low, high = (center - reach, middle - reach_y, z - bar), (center + reach, middle + reach_y, z + bar)
        parts.box(f"Rail {index + 1}", low, high, wood)
    parts.box("Ledge", (left - 0.015, y0 - 0.012, sill - 0.01), (right + 0.015, y1, sill), wood)


def chessmen():
    ebony = parts.plain_material("Ebony", (0.022, 0.014, 0.011), roughness=0.22)
    boxwood = parts.plain_material("Boxwood", (0.58, 0.34, 0.14), roughness=0.32)
    for name, profile, material, x, y in (
        ("King", KING, ebony, -0.035, 0.045),
        ("Bishop", BISHOP, ebony, -0.125, -0.01),
        ("Rook", ROOK, boxwood, 0.045, -0.015),
        ("Queen", QUEEN, boxwood, 0.155, 0.06),
        ("Pawn 1", PAWN, ebony, -0.07, -0.115),
        ("Pawn 2", PAWN, boxwood, 0.035, -0.145),
    ):
        parts.lathe(name, parts.rounded(profile), material, (x, y, 0.0), MM)
    # The fallen pawn lies on the rim of its foot (radius 13, height 2.4) and on its head (8.2, 37).
    fallen = parts.lathe("Fallen pawn", parts.rounded(PAWN), boxwood, (-0.165, -0.105, 13 * MM), MM)
    fallen.rotation_euler = (math.radians(90) + math.atan2(13 - 8.2, 37 - 2.4), 0, math.radians(-58))
    king = bpy.data.objects["King"]
    for name, low, high in (
        ("Cross upright", (-1.4, -1.4, 85.5), (1.4, 1.4, 97)),
        ("Cross bar", (-4, -1.4, 90.5), (4, 1.4, 93.3)),
    ):
        part = parts.box(name, [MM * value for value in low], [MM * value for value in high], ebony)
        part.location = king.location


def candle(x, y):
    """The point lamp is the flame, which throws no shadow of its own and lights nothing by itself."""
    brass = parts.plain_material("Brass", (0.83, 0.56, 0.22), roughness=0.2, metallic=1.0)
    wax = parts.glowing_material("Wax", (0.85, 0.72, 0.5), (1.0, 0.42, 0.12), 0.25)
    glow = parts.glowing_material("Flame", (0, 0, 0), (1.0, 0.55, 0.16), 30.0)
    parts.lathe("Candlestick", parts.rounded(CANDLESTICK), brass, (x, y, 0), MM)
    parts.lathe("Candle", parts.rounded(CANDLE), wax, (x, y, 0), MM)
    flame = parts.lathe("Flame", parts.rounded(FLAME), glow, (x, y, 0), MM)
    flame.visible_shadow = flame.visible_diffuse = False
    parts.point_lamp("Candle light", (x, y, 78 * MM), 0.16, (1.0, 0.56, 0.22))
