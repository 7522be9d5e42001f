"""Every error that a user can cause or meet, and the exit code it ends in."""

EXIT_AS_EXPECTED = 0
EXIT_NOT_AS_EXPECTED = 1
EXIT_BAD_INPUT = 2
EXIT_PROCESS_DIED = 3


class HilError(Exception):
    """Base of all errors whose message is meant for a person: one line, no traceback."""

    exit_code = 1


class InputError(HilError):
    """A file, field or option is wrong. The message names file, field, value, limit and remedy."""

    exit_code = EXIT_BAD_INPUT


class ProcessDiedError(HilError):
    """A process of the run died, or a link never came up. The message names which."""

    exit_code = EXIT_PROCESS_DIED
