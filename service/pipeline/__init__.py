"""Makes bytes from requests: each product is a list of steps, in a file of its own.

The packages for HTTP and for the command line call these functions to compute; they do not call the
engine and the encoders directly.
"""
