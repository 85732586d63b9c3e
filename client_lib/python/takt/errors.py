"""Errors of takt.Client and takt.Arm; the text of each is a whole sentence."""

from __future__ import annotations


class CellError(RuntimeError):
    """Base of all errors of a client. `result` is the code of the server's reply (docs/requests.md), else None."""

    result: int | None = None
    """Code of the server's reply to a refused request; None for other errors."""


class CellTimeout(CellError):
    """No answer within the time allowed."""


class NotFound(CellError):
    """The cell does not answer, or has no robot, gripper, device or component of that name."""


class Invalid(CellError):
    """Refused before it is sent: a wrong count or shape, an unknown word, a number that is not finite."""


class Refused(CellError):
    """Refused by the server; `result` is its code."""


class Lost(CellError):
    """The server is gone, or the cell that a controller commands was reset."""


class MotionError(CellError):
    """A pose or motion of an arm does not exist; the text has the request and the allowed values."""
