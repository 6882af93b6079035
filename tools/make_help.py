"""Makes the help that the add-on's "?" buttons and F1 open: pages of docs/ as HTML, with their pictures.

    tools/make_help.py OUTPUT_FOLDER

writes them for a look; tools/make_package.py calls `help_files`. Pages that only developers read stay out, and links to
them become plain text. The same sources give the same bytes.
"""

import html
import io
import re
import sys
from pathlib import Path

from markdown_it import MarkdownIt
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"

PAGES = ("guide", "engines", "install", "python-and-batch", "performance", "method", "accuracy")
"""Pages in the order of the navigation."""

# Pictures are read in a browser beside text: more pixels and less loss make the zip larger.
MAX_WIDTH, QUALITY = 760, 55

STYLE = """
body { margin: 0 auto; max-width: 52em; padding: 1em 1.5em 4em; font: 16px/1.5 system-ui, sans-serif; }
body { color: #222; background: #fff; }
nav { border-bottom: 1px solid #bbb; padding-bottom: .5em; } nav a { margin-right: 1em; }
h1, h2, h3 { line-height: 1.2; margin-top: 1.6em; } a { color: #0b57a4; }
img { max-width: 100%; height: auto; } table { border-collapse: collapse; display: block; overflow-x: auto; }
th, td { border: 1px solid #bbb; padding: .3em .6em; text-align: left; vertical-align: top; }
code, pre { font-family: ui-monospace, monospace; font-size: .9em; background: #f0f0ee; } code { padding: 0 .2em; }
pre { padding: .7em 1em; overflow-x: auto; } pre code { padding: 0; }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #1e1e1e; } a { color: #7db8f0; }
code, pre { background: #2b2b2b; } nav, th, td { border-color: #555; } }
"""

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title} - Beamspread</title><style>{style}</style></head>
<body><nav>{nav}</nav>
{body}</body></html>
"""


def help_files() -> dict[str, bytes]:
    """Name in the folder of the help -> content, of all pages and the pictures in them."""
    pictures: dict[str, bytes] = {}
    pages = {f"{name}.html": _page(name, pictures) for name in PAGES}
    return {**pages, **pictures}


def _page(name: str, pictures: dict[str, bytes]) -> bytes:
    parser = MarkdownIt("commonmark").enable("table")
    tokens = parser.parse((DOCS / f"{name}.md").read_text(encoding="utf-8"))
    for heading, content in zip(tokens, tokens[1:]):
        if heading.type == "heading_open":
            heading.attrSet("id", anchor(content.content))
    for token in tokens:
        if token.children:
            token.children = list(_with_local_links(token.children, pictures))
    nav = " ".join(f'<a href="{other}.html">{html.escape(_title(other))}</a>' for other in PAGES)
    body = parser.renderer.render(tokens, parser.options, {})
    return PAGE.format(title=html.escape(_title(name)), style=STYLE, nav=nav, body=body).encode()


def _with_local_links(tokens: list, pictures: dict[str, bytes]):
    """Tokens of a paragraph: links lead to pages of the help, and pictures to copies; other local links go."""
    is_dropped = False
    for token in tokens:
        if token.type == "image":
            token.attrSet("src", _picture((DOCS / token.attrGet("src")).resolve(), pictures))
        elif token.type == "link_open":
            target = _target(str(token.attrGet("href")))
            is_dropped = target is None
            if is_dropped:
                continue
            token.attrSet("href", target)
        elif token.type == "link_close" and is_dropped:
            is_dropped = False
            continue
        yield token


def _target(link: str) -> str | None:
    """Where a link leads in the help; None if the help lacks that page."""
    path, _, part = link.partition("#")
    if "://" in path or not path:
        return link
    page = Path(path)
    if page.suffix != ".md" or page.parent != Path() or page.stem not in PAGES:
        return None
    return f"{page.stem}.html#{part}" if part else f"{page.stem}.html"


def _picture(path: Path, pictures: dict[str, bytes]) -> str:
    """Add a smaller copy of a picture; its name in the help."""
    name = f"pictures/{path.stem}.webp"
    if name not in pictures:
        with Image.open(path) as picture:
            shown = picture.convert("RGB")
        if shown.width > MAX_WIDTH:
            shown = shown.resize((MAX_WIDTH, round(shown.height * MAX_WIDTH / shown.width)), Image.Resampling.LANCZOS)
        content = io.BytesIO()
        shown.save(content, "WEBP", quality=QUALITY, method=6)
        pictures[name] = content.getvalue()
    return name


def anchor(heading: str) -> str:
    """Anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", heading).lower()).replace(" ", "-")


def _title(name: str) -> str:
    return (DOCS / f"{name}.md").read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ").strip()


def main(folder: Path) -> None:
    for name, content in help_files().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        print(f"{path}: {len(content) / 1e3:.0f} kB")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
