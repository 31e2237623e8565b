"""What is not sure counts less: shrinking of differences that virtual sensors show."""

_SURE = 2.5  # standard errors below which a difference counts as none


def sure(value: float, error: float) -> float:
    """Return a value shrunk by how sure it is; nothing below `_SURE` standard errors."""
    return value * max(1 - (_SURE * error / value) ** 2, 0.0) if value else 0.0
