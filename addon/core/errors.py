"""Errors that reach the artist: each is one sentence that says what is wrong and how to mend it."""


class BakeError(ValueError):
    """A bake that cannot start or finish; its text is shown to the artist as it stands."""


class ReceiverError(BakeError):
    """The mesh or its UV map cannot be baked."""


class MaterialError(BakeError):
    """A material property lies outside what light transport allows."""


class ImageError(BakeError):
    """The target image or output file cannot be filled."""
