"""The one error a person sees."""


class UserError(Exception):
    """One line that says what is wrong and what to do; `exit_status` is 1 (an error) or 2 (wrong usage)."""

    def __init__(self, message: str, *, exit_status: int = 1) -> None:
        super().__init__(" ".join(message.splitlines()))
        self.exit_status = exit_status
