"""Errors that reach the artist: each says in whole sentences what is wrong and how to mend it."""

from __future__ import annotations

from .messages import Level, Message


class BakeError(ValueError):
    """A bake cannot start or finish.

    Attributes
    ----------
    text : names the problem.
    remedy : advice for the artist; "" if there is none.
    """

    def __init__(self, text: str, remedy: str = "") -> None:
        super().__init__(f"{text} {remedy}".strip())
        self.text, self.remedy = text, remedy


class ReceiverError(BakeError):
    """The mesh or its UV map cannot be baked."""


class MaterialError(BakeError):
    """A material property lies outside what light transport allows."""


class ImageError(BakeError):
    """The target image or output file cannot be filled."""


class NotSupportedError(BakeError):
    """A node or an image that only Cycles can evaluate.

    Parameters
    ----------
    kind : "node" or "image".
    name : of the node or image.
    reason : clause that says which of its settings is not supported; "" if the whole kind is not.
    """

    def __init__(self, kind: str, name: str, reason: str = "") -> None:
        super().__init__(f"The {kind} '{name}' is not supported{': ' if reason else ''}{reason}.")


class MissingImageError(NotSupportedError):
    """An image that no renderer can load; Cycles shows it in magenta."""

    REMEDY = "Choose its file again, or use File > External Data > Find Missing Files."

    def __init__(self, image: str = "", node: str = "") -> None:
        text = f"The image '{image}' is missing." if image else f"The node '{node}' has no image."
        BakeError.__init__(self, text, self.REMEDY if image else "Choose an image.")


def message_of(error: Exception, subject: str = "") -> Message:
    """The message that tells the artist about an exception."""
    if isinstance(error, BakeError):
        return Message(Level.ERROR, subject, error.text, error.remedy)
    if isinstance(error, MemoryError):
        return Message(Level.ERROR, subject, "There is not enough memory.", "Lower the resolution.")
    if not isinstance(error, ValueError | OSError):
        # An artist should never get here: keep the details for a bug report.
        import logging

        logging.getLogger(__name__).error("unexpected error", exc_info=error)
    return Message(Level.ERROR, subject, str(error) or type(error).__name__)


def text_of(error: Exception) -> str:
    """The text and remedy of `message_of`."""
    return str(message_of(error))
