"""Nominal stiffness of the flexspline under two opposed radial loads.

Each theory maps a geometry and Young's modulus to force per *radial*
displacement of the loaded point [N/mm]; all of them are linear in the modulus.
"""

from collections.abc import Callable

import jax.numpy as jnp
from jax import jit
from jaxtyping import Float

from hdcal.data.records import Array, Geometry

Scalar = Float[Array, ""] | float
Stiffness = Callable[[Geometry, Scalar], Scalar]

# S = Σ_{n=2,4,…} 1/(n²−1)², the compliance series of the inextensible ring.
RING_SERIES = (jnp.pi**2 - 8.0) / 16.0


def ring(geometry: Geometry, modulus: Scalar) -> Scalar:
    """Return the stiffness of an inextensible ring: k = π E L δ³ / (24 R³ S).

    Source: minimised bending energy of a ring on a diameter; the same as Castigliano's
    diameter change 0.14878 F R³/(E I) (Timoshenko, Strength of Materials).
    """
    slenderness = geometry.wall_thickness / geometry.radius
    return jnp.pi * modulus * geometry.length * slenderness**3 / (24.0 * RING_SERIES)


@jit
def cup(geometry: Geometry, modulus: Scalar) -> Scalar:
    """Return the stiffness of a cup with a held base, deforming inextensionally.

    k = (π D / 2R³) (L/c)² / Σ_{n=2,4,…} 1/((n²−1)² (A + B/n²)),
    D = E δ³/(12 (1−ν²)),  A = L/3,  B = 2 (1−ν) R²/L.

    The load acts at height c from the base, where the wall can warp freely. The
    series is summed in closed form by partial fractions in n².

    Source: Rayleigh's inextensional deformation of a cylinder (Theory of Sound, ch.
    Xa), displacement growing linearly from the base.
    """
    g = geometry
    bending = modulus * g.wall_thickness**3 / (12.0 * (1.0 - g.poisson**2))
    a = g.length / 3.0
    b = 2.0 * (1.0 - g.poisson) * g.radius**2 / g.length
    beta = jnp.pi * jnp.sqrt(b / a) / 2.0
    series = RING_SERIES / (a + b) + (a + b - a * beta / jnp.tanh(beta)) / (
        2.0 * (a + b) ** 2
    )
    lever = g.length / g.load_height
    return jnp.pi * bending / (2.0 * g.radius**3) * lever**2 / series


def article(geometry: Geometry, modulus: Scalar) -> Scalar:
    """Return the stiffness that the article plots, scaled from its own gear.

    k = 1625.19 N/mm · (E/210 GPa) (δ/0.68 mm)³ (40 mm/R)³.

    The number follows from no combination of the article's inputs; it is kept so
    that the article's influence coefficient K ≈ 0.13 can be compared. The length is not
    used, as in the article.

    Source: "Study on Flexible Gear Deformation in Harmonic Drive Gear", slope K₁.
    """
    return (
        1625.19
        * (modulus / 210e3)
        * (geometry.wall_thickness / 0.68) ** 3
        * (40.0 / geometry.radius) ** 3
    )


def spring(_geometry: Geometry, modulus: Scalar) -> Scalar:
    """Return the stiffness where no sizes are known: k = E · 1 mm.

    With E fixed at 1 MPa K is the stiffness itself in N/mm. Sizes may be NaN.

    Source: Hooke's law.
    """
    return modulus * 1.0


THEORIES: dict[str, Stiffness] = {
    "ring": ring,
    "cup": cup,
    "article": article,
    "spring": spring,
}


def peak_stress(geometry: Geometry, modulus: Scalar, deformation: Scalar) -> Scalar:
    """Return the largest hoop bending stress of a ring: σ = E δ ω / (4 S R²) [MPa].

    It acts in the outer surface under the load and follows from the radial displacement
    ω [mm], not from the force: what stiffens a real gear by K does not change the
    curvature of its wall. The wall is smooth and free to contract along its axis; held,
    the stress is larger by 1/(1 − ν²). Notches at teeth are not in it.

    Source: Castigliano's ring, moment 0.318 F R under the load (Timoshenko, Strength of
    Materials).
    """
    curvature = 0.5 * deformation / RING_SERIES / geometry.radius**2
    return 0.5 * modulus * geometry.wall_thickness * curvature
