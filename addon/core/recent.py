"""What was used last, kept."""


def keep_recent(kept: dict, key, value, most: int):
    """Put the value last, drop the first where there are more than `most`; returns the value."""
    kept.pop(key, None)
    kept[key] = value
    while len(kept) > most:
        del kept[next(iter(kept))]
    return value
