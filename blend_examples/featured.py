"""Makes the pictures that the extensions platform asks for, from those of the examples:

    build/venv/bin/python blend_examples/featured.py

docs/pictures/featured.jpg, 1920 x 1080, and docs/pictures/icon.png, 256 x 256. Neither is in the zip.
"""

from pathlib import Path

from PIL import Image

HERE = Path(__file__).resolve().parent
TARGET = HERE.parent / "docs" / "pictures"

NAMES = (
    *("jade_bowl", "low_sun", "marble_head"),
    *("acrylic_letters", "soapstone", "shop_window"),
    *("round_soap", "plank_floor", "soap_bar"),
)
COLUMNS, CELL = 3, (640, 360)

# The left half of a comparison is Beamspread's; its title stands above it, and a gap is at its right.
TITLE, PANEL_WIDTH = 36, 540

# Square around the candle in the bowl, in its panel.
ICON = (95, 10, 445, 360)


def panel(name):
    """Beamspread's half of a comparison, without its title."""
    with Image.open(HERE / "pictures" / f"{name}.png") as picture:
        return picture.convert("RGB").crop((0, TITLE, PANEL_WIDTH, picture.height))


def filled(picture, size):
    """The middle of a picture, scaled until it fills a size."""
    scale = max(size[0] / picture.width, size[1] / picture.height)
    large = picture.resize((round(picture.width * scale), round(picture.height * scale)), Image.Resampling.LANCZOS)
    left, top = (large.width - size[0]) // 2, (large.height - size[1]) // 2
    return large.crop((left, top, left + size[0], top + size[1]))


def main():
    whole = Image.new("RGB", (COLUMNS * CELL[0], len(NAMES) // COLUMNS * CELL[1]))
    for number, name in enumerate(NAMES):
        whole.paste(filled(panel(name), CELL), (number % COLUMNS * CELL[0], number // COLUMNS * CELL[1]))
    whole.save(TARGET / "featured.jpg", quality=92)
    panel("jade_bowl").crop(ICON).resize((256, 256), Image.Resampling.LANCZOS).save(TARGET / "icon.png", optimize=True)


if __name__ == "__main__":
    main()
