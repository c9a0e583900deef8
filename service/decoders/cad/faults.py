"""The one error of geometry that a file describes wrongly."""


class InvalidGeometry(Exception):
    """A curve, a surface or a face of a file can't be made.

    Readers catch it where one entity is read, and list this entity with the reason: a broken entity
    never refuses the file.

    Attributes
    ----------
    reason : str
        A plain phrase such as "a weight is not positive". It never repeats the content of the file.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)
