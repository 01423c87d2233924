"""Shape, bending moment and stress of a ring that two opposed loads deform.

φ is measured from one of the loads, w outward, and the loads push outward from
inside, as a wave generator does; with the other sign of ω everything changes sign.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array, Geometry
from hdcal.physics.theory import RING_SERIES, Scalar

# Σ 1/(n²−1) over n = 2, 4, …: curvature under the load per coefficient A.
_AT_LOAD = 0.5


class Profile(eqx.Module):
    """A deformed ring, angle by angle.

    Attributes:
        angle: φ from the load [rad].
        radial: w, outward positive [mm].
        tangential: v, towards larger φ [mm].
        curvature: gain of curvature κ [1/mm].
        moment: bending moment M = E I κ, positive where it bends more sharply [N·mm].
        stress: hoop bending stress of the outer surface, tension positive [MPa].
    """

    angle: Float[Array, " n"]
    radial: Float[Array, " n"]
    tangential: Float[Array, " n"]
    curvature: Float[Array, " n"]
    moment: Float[Array, " n"]
    stress: Float[Array, " n"]


def ring_profile(
    geometry: Geometry, modulus: Scalar, deformation: Scalar, angle: Float[Array, " n"]
) -> Profile:
    """Compute shape, moment and stress of a ring deformed by two opposed loads.

    w(φ) = Σ aₙ cos nφ over n = 2, 4, …, aₙ = ω / (S (n²−1)²), so that w(0) = ω; the
    ring does not stretch, v' = −w; κ = −(w'' + w)/R², M = E I κ, σ = E (δ/2) κ.

    The shape is imposed, so that the stress follows from ω and not from the force:
    what stiffens a real gear by K (teeth, closed end) changes the force and not the
    curvature of its wall. The wall is taken as smooth and free to contract along its
    axis; held, the stress is larger by 1/(1 − ν²). Notches at teeth are not in it.

    Args:
        geometry: sizes [mm].
        modulus: Young's modulus E [MPa].
        deformation: radial displacement ω under each load [mm].
        angle: φ from one of the loads [rad], shape (n,).

    Returns:
        The profile, differentiable in every argument.

    Source:
        Series: the article's displacement series with the coefficients of least
        energy. Closed form: Castigliano's ring, M = F R (1/π − sin φ / 2) over half a
        turn, 0.318 F R under the load and −0.182 F R at 90° (Timoshenko, Strength of
        Materials).
    """
    angle = jnp.asarray(angle, dtype=float)
    shape, slip, bend = _sums(angle)
    scale = deformation / RING_SERIES
    curvature = scale * bend / geometry.radius**2
    inertia = geometry.length * geometry.wall_thickness**3 / 12.0
    return Profile(
        angle=angle,
        radial=scale * shape,
        tangential=scale * slip,
        curvature=curvature,
        moment=modulus * inertia * curvature,
        stress=0.5 * modulus * geometry.wall_thickness * curvature,
    )


def _sums(angle):
    """Return Σ cos nφ/(n²−1)², −Σ sin nφ/(n (n²−1)²) and Σ cos nφ/(n²−1).

    Over n = 2, 4, …, to infinity; they repeat after half a turn.
    """
    x = jnp.mod(angle, jnp.pi)
    sine, cosine, left = jnp.sin(x), jnp.cos(x), 0.5 * jnp.pi - x
    eighth = jnp.pi / 8.0
    return (
        -0.5 + eighth * (sine + left * cosine),
        0.5 * x - eighth * (2.0 - 2.0 * cosine + left * sine),
        _AT_LOAD - 2.0 * eighth * sine,
    )


def peak_stress(geometry: Geometry, modulus: Scalar, deformation: Scalar) -> Scalar:
    """Return the largest hoop bending stress, under the load: E δ ω / (4 S R²).

    Args:
        geometry: sizes [mm].
        modulus: Young's modulus E [MPa].
        deformation: radial displacement ω [mm].

    Returns:
        Stress of the outer surface [MPa]; see `ring_profile` for what it leaves out.
    """
    bend = deformation * _AT_LOAD / RING_SERIES / geometry.radius**2
    return 0.5 * modulus * geometry.wall_thickness * bend
