"""The one exception for what a user can mend: its text names the file or key and says what to do."""


class InputError(Exception):
    """Input that cannot be used. The message stands alone: a user reads it without a traceback."""
