"""Gaussian, mean and principal curvatures from first and second partials.

The second form S_uu · n, S_uv · n, S_vv · n has the unit normal n along S_u × S_v. So a curvature
is positive where the surface bends towards its normal. A sphere of radius r whose normals point
outwards has K = 1/r² and H = −1/r.

References
----------
do Carmo, Differential Geometry of Curves and Surfaces, section 3.3.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.vectors import cross, dot, length


@dataclass(frozen=True, eq=False, slots=True)
class Curvatures:
    """Curvatures at m parameters, shapes (m,); NaN where a limit is infinite or does not exist.

    gaussian : K = k_1 k_2
    mean : H = (k_1 + k_2)/2
    larger, smaller : the principal curvatures k_1 ≥ k_2
    """

    gaussian: FloatArray
    mean: FloatArray
    larger: FloatArray
    smaller: FloatArray


def regular_curvatures(partials: FloatArray, normals: FloatArray) -> FloatArray:
    """Curvatures K, H, k_1, k_2, shape (4, m), from the second form in an orthonormal frame.

    With e_1 along S_u and e_2 = n × e_1 the form has the matrix (a b; b c), and

        K = a c − b²,  H = (a + c)/2,  k = H ± √(((a − c)/2)² + b²)

    At umbilics this formula loses no digits, unlike √(H² − K). The result is not finite where
    S_u × S_v vanishes.

    Parameters
    ----------
    partials : ndarray of float64, shape (6, m, 3)
        S, S_u, S_v, S_uu, S_uv and S_vv.
    normals : ndarray of float64, shape (m, 3)
        The unit normals n.
    """
    _, du, dv, duu, duv, dvv = partials
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        length_u, length_v = (length(d, -1)[:, np.newaxis] for d in (du, dv))
        along_u, along_v = du / length_u, dv / length_v
        cosine = dot(along_u, along_v, -1)
        sine = length(cross(along_u, along_v, -1), -1)
        # The form of the unit vectors along S_u and S_v has the matrix (a f; f g). There are two
        # divisions, because the product of two lengths may underflow.
        a = dot(duu / length_u / length_u, normals, -1)
        f = dot(duv / length_u / length_v, normals, -1)
        g = dot(dvv / length_v / length_v, normals, -1)
        b = (f - cosine * a) / sine
        c = (g - cosine * (f + sine * b)) / (sine * sine)
        mean = (a + c) / 2
        spread = np.hypot((a - c) / 2, b)
        return np.stack([a * c - b * b, mean, mean + spread, mean - spread])
