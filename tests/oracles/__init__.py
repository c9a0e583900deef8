"""Independent, slow and plain ways to the right answer.

Nothing here imports what is tested: exact rational arithmetic (`exact`), limits of normals
(`limits`), closed forms (`quadrics`), counting edges one by one (`topology`).
"""
