"""What is asked for in, bytes out: each product as a list of steps, one file a product.

HTTP, the command line and whatever else comes call these functions and nothing below them.
"""
