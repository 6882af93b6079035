"""Least-recently-used cache."""


def keep_recent(cache: dict, key, value, capacity: int):
    """Make the value the most recent entry, drop the oldest beyond `capacity`, and return the value."""
    cache.pop(key, None)
    cache[key] = value
    while len(cache) > capacity:
        del cache[next(iter(cache))]
    return value
