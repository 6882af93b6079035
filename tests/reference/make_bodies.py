"""Makes bodies.csv and bodies_totals.csv: build/venv/bin/python tests/reference/make_bodies.py [NAME...].

All bodies take twenty minutes; with names, the rows of the other bodies stay.
"""

import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from body_tables import ALBEDOS, BODIES, BODY_TABLE, TOTAL_TABLE, photons_for
from plain_bodies import walk


def rows_of(name):
    body, g = BODIES[name]
    (mean, error), (total, total_error) = walk(body, g, ALBEDOS, photons_for(name), seed=43)
    bins = [
        [name, index, *(f"{value:.4g}" for pair in zip(mean[:, index], error[:, index]) for value in pair)]
        for index in range(body.count)
    ]
    totals = [[name, albedo, f"{value:.6f}", f"{se:.6f}"] for albedo, value, se in zip(ALBEDOS, total, total_error)]
    return bins, totals


def stored(path, without):
    """Rows of the other bodies."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8") as file:
        return [row for row in list(csv.reader(file))[1:] if row[0] not in without]


def main(names):
    bins, totals = stored(BODY_TABLE, names), stored(TOTAL_TABLE, names)
    for name in names:
        new_bins, new_totals = rows_of(name)
        bins += new_bins
        totals += new_totals
        print(*new_totals, sep="\n", flush=True)
    header = [column for albedo in ALBEDOS for column in (f"exitance_{albedo}", f"standard_error_{albedo}")]
    order = list(BODIES)
    for path, first, rows in (
        (BODY_TABLE, ["body", "bin", *header], bins),
        (TOTAL_TABLE, ["body", "albedo", "reflectance", "standard_error"], totals),
    ):
        rows.sort(key=lambda row: order.index(row[0]))
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([first, *rows])


if __name__ == "__main__":
    main(sys.argv[1:] or BODIES)
