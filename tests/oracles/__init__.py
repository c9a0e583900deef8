"""Independent, slow and plain computations, with which tests compare results.

No module here imports the tested code. They use exact rational arithmetic (`exact`), limits of
normals (`limits`), closed forms (`quadrics`), and count edges one by one (`topology`).
"""
