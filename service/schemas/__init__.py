"""The JSON language of requests: validates documents and converts them to frozen values.

No other package converts lists of numbers to arrays.
"""
