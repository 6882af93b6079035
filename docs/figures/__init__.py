"""The figures of Manabe et al. 2012, made again: `docs/figures.sh`, or `python -m figures [NAME ...]`.

Each figure is a module with `make()`, which writes `docs/pictures/<name>.png` and returns blocks of Markdown that
`page` puts between the markers of `docs/method.md`.
"""
