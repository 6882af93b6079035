"""Messages for the artist. Each bake has one list of them, which panels, popups, the report and the console show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """Severity of a message; the values are Blender's names of report types."""

    ERROR = "ERROR"
    WARNING = "WARNING"
    INFO = "INFO"


@dataclass(frozen=True)
class Message:
    """One message in whole sentences.

    Attributes
    ----------
    subject : name of the target, object, material, light or image that it is about; "" for none.
    text : names the problem, or the change that was made.
    remedy : advice for the artist; "" for none.
    """

    level: Level
    subject: str
    text: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.text} {self.remedy}" if self.remedy else self.text

    def line(self) -> str:
        """The message for a list of several subjects: an error begins with its subject, other texts name theirs."""
        return f"{self.subject}: {self}" if self.level == Level.ERROR and self.subject else str(self)


def warning(subject: str, text: str, remedy: str = "") -> Message:
    return Message(Level.WARNING, subject, text, remedy)


def note(subject: str, text: str, remedy: str = "") -> Message:
    return Message(Level.INFO, subject, text, remedy)


class Messages:
    """Errors, then warnings, then notes, each in the order of arrival; a text about the same subject comes once."""

    def __init__(self, messages: Iterable[Message] = ()) -> None:
        self._by_key: dict[tuple[str, str], Message] = {}
        self.add(*messages)

    def add(self, *messages: Message) -> None:
        for message in messages:
            self._by_key.setdefault((message.subject, message.text), message)

    def of(self, *levels: Level) -> tuple[Message, ...]:
        """The messages of these levels."""
        return tuple(message for message in self if message.level in levels)

    def __iter__(self) -> Iterator[Message]:
        levels = list(Level)
        return iter(sorted(self._by_key.values(), key=lambda message: levels.index(message.level)))

    def __len__(self) -> int:
        return len(self._by_key)

    def __contains__(self, message: Message) -> bool:
        return (message.subject, message.text) in self._by_key
