"""From requests to bytes: each product as a list of steps, one file for each product.

HTTP and the command line call these functions, and none of the layers below.
"""
