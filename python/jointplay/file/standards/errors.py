"""What a standard does not have."""


class NotInStandard(ValueError):
    """What is asked has no value in the standard; the message is a sentence."""
