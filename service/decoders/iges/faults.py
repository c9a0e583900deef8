"""Faults of single entities, which are reported; the rest of the file is read."""


class Fault(Exception):
    """An entity cannot be read; the text is the reason, in plain words, without the input."""


class OnePoint(Fault):
    """A curve is one point; at a pole, a composite curve may have such a part."""


class Unsupported(Fault):
    """An entity is of a type or a form that is not read."""
