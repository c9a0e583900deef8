"""Makes bytes from requests: each product is a list of steps.

The packages for HTTP and for the command line call these functions to compute; they do not call the
engine and the encoders directly.
"""
