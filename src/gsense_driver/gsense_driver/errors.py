"""Errors that a user can act on."""


class SettingError(ValueError):
    """A parameter has an unusable value; the message names it and says what would do."""


class PortLostError(OSError):
    """The serial port cannot be opened, or went away while it was being read."""


class RawLogError(ValueError):
    """A raw log cannot be read; the message names the file and what is wrong."""
