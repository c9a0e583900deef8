"""From requests to bytes: each product as a list of steps, one file for each product.

HTTP, the command line and whatever else comes call these functions and nothing below them.
"""
