"""Errors that reach the artist: each is one sentence that says what is wrong and how to mend it."""


class BakeError(ValueError):
    """A bake that cannot start or finish; its text is shown to the artist as it stands."""


class ReceiverError(BakeError):
    """The mesh or its UV map cannot be baked."""


class MaterialError(BakeError):
    """A material property lies outside what light transport allows."""


class ImageError(BakeError):
    """The target image or output file cannot be filled."""


def sentence(error: Exception) -> str:
    """What to tell the artist about an exception."""
    if isinstance(error, MemoryError):
        return "There is not enough memory: lower the resolution."
    if not isinstance(error, ValueError | OSError):
        # Nothing that an artist does should lead here: keep what a bug report needs.
        import logging

        logging.getLogger(__name__).error("unexpected error", exc_info=error)
    return str(error) or type(error).__name__
