"""The one exception for what a user can mend: its text names the file or key and says what to do."""


class InputError(Exception):
    """Input that cannot be used. The message stands alone: a user reads it without a traceback."""


def summarize_error(error: object) -> str:
    """An error's text as part of a message: one line; of a long one its beginning and its end."""
    text = " ".join(str(error).split())
    return text if len(text) <= 300 else f"{text[:195]} ... {text[-100:]}"
