"""The one error of the set-up."""


class SetupError(Exception):
    """Something that the user has to mend; its text is the one line that says what, and how."""
