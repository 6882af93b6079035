"""Makes the figures and writes their measurements into docs/method.md, between its markers."""

import argparse
import time
from importlib import import_module
from pathlib import Path

from . import style

PAGE = Path(__file__).resolve().parent.parent / "method.md"
MODULES = ("fig1", "fig4", "fig6", "albedo", "fig7", "fig8")
HEAD = ("", "paper", "ours by its method", "ours exact")


def filled(text, name, block):
    """The page with the text between a block's markers replaced."""
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise ValueError(f"{PAGE.name} lacks {begin} or {end}")
    return f"{before}{begin}\n{block}\n{end}{after}"


def main(arguments):
    parser = argparse.ArgumentParser(prog="docs/figures.sh", description=__doc__)
    parser.add_argument("module", nargs="*", choices=[*MODULES, []], help="only these; the summary is left as it was")
    chosen = parser.parse_args(arguments).module or MODULES
    rows = []
    for name in chosen:
        begin = time.perf_counter()
        blocks, summary = import_module(f"{__package__}.{name}").make()
        text = PAGE.read_text(encoding="utf-8")
        for block, content in blocks.items():
            text = filled(text, block, content)
        PAGE.write_text(text, encoding="utf-8")
        rows += summary
        print(f"{name:8} {time.perf_counter() - begin:5.0f} s", flush=True)
    if tuple(chosen) == MODULES:
        PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), "summary", style.table(HEAD, rows)), encoding="utf-8")
    print(f"Pictures are in {style.PICTURES}, numbers in {PAGE}")
