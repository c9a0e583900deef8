"""The recipes of CONTRIBUTING.md, followed with toys in a copy of this checkout: do they hold?"""
