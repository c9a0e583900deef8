"""Shares threads between callers: what each has used, whose turn it is, and limits of use.

It knows neither HTTP nor threads: a caller is a name, and a piece of work is any value.
"""
