"""Newton-Euler and Walker-Orin recursions for any chain, compiled, in real or dual numbers.

The Newton-Euler recursion follows appendix B of the thesis (link quantities in link axes, inertia about a
point of the link instead of its centre of mass), with two differences: the reference point is the origin of
the link's own frame, because for a prismatic joint the origin before it is not fixed to the link; and the
prismatic terms are added. Gravity enters as an acceleration of the base, −g. Rotors add n²J q̈ at their own
joint; the gyroscopic torque of their spin is neglected, as in (8.3).

Every array of a call has one dtype: float64, or complex128 for exact sensitivities (see `model.dynamics.dual`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics.compilation import compiled, inlined
from model.dynamics.dual import sin_cos
from model.dynamics.linear_solve import solve_symmetric
from model.kinematics.chain import ChainArrays

Array = NDArray[Any]

# Columns of the table that a recursion keeps per link: sine and cosine of θ and α, then the origin of the frame from
# the previous one, in own axes (p), then force and moment about the frame's origin.
_ST, _CT, _SA, _CA, _P, _F, _N = 0, 1, 2, 3, 4, 7, 10
_COLUMNS = 13


@inlined
def _cross(ax: complex, ay: complex, az: complex, bx: complex, by: complex, bz: complex) -> Any:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inlined
def _to_link(table: Array, i: int, x: complex, y: complex, z: complex) -> Any:
    """Returns components of a vector in link axes, from those in the axes of the previous frame (transpose of 3.8)."""
    turned_x = table[i, _CT] * x + table[i, _ST] * y
    turned_y = table[i, _CT] * y - table[i, _ST] * x
    return turned_x, table[i, _CA] * turned_y + table[i, _SA] * z, table[i, _CA] * z - table[i, _SA] * turned_y


@inlined
def _to_previous(table: Array, i: int, x: complex, y: complex, z: complex) -> Any:
    """Returns components in the axes of the previous frame, from those in link axes (3.8)."""
    tilted_y = table[i, _CA] * y - table[i, _SA] * z
    tilted_z = table[i, _SA] * y + table[i, _CA] * z
    return table[i, _CT] * x - table[i, _ST] * tilted_y, table[i, _ST] * x + table[i, _CT] * tilted_y, tilted_z


@inlined
def _tensor_times(body: Array, i: int, x: complex, y: complex, z: complex) -> Any:
    """Multiplies the tensor in columns 4 to 9 (xx xy xz yy yz zz) of row i by a vector."""
    return (
        body[i, 4] * x + body[i, 5] * y + body[i, 6] * z,
        body[i, 5] * x + body[i, 7] * y + body[i, 8] * z,
        body[i, 6] * x + body[i, 8] * y + body[i, 9] * z,
    )


@compiled
def _link_table(chain: ChainArrays, q: Array) -> Array:
    """Returns the (n, 13) table with the geometry columns filled for the posture `q`."""
    n = q.shape[0]
    table = np.empty((n, _COLUMNS), dtype=q.dtype)
    for i in range(n):
        theta, d = chain.geometry[i, 0], chain.geometry[i, 1]
        if chain.prismatic[i]:
            d += q[i]
        else:
            theta += q[i]
        table[i, _ST], table[i, _CT] = sin_cos(theta)
        table[i, _SA], table[i, _CA] = sin_cos(chain.geometry[i, 3])
        table[i, _P] = chain.geometry[i, 2]
        table[i, _P + 1] = d * table[i, _SA]
        table[i, _P + 2] = d * table[i, _CA]
    return table


@compiled
def newton_euler(chain: ChainArrays, q: Array, velocity: Array, acceleration: Array, gravity: Array) -> Array:
    """Returns joint torques or forces for a given motion (appendix B; 3.30 to 3.39).

    Args:
        chain: packed chain.
        q: (n,) joint variables, rad or m.
        velocity: (n,) their rates.
        acceleration: (n,) their second derivatives.
        gravity: (3,) in the base frame, m/s²: `chain.gravity`, or zeros to leave gravity out.

    Returns:
        (n,) torques, N·m, or forces, N, reflected rotor inertia included.
    """
    table = _link_table(chain, q)
    _forward(chain, table, velocity, acceleration, gravity)
    return _backward(chain, table, acceleration)


@compiled
def _forward(chain: ChainArrays, table: Array, velocity: Array, acceleration: Array, gravity: Array) -> None:
    """Computes velocities and accelerations from the base outwards, and each link's own force and moment."""
    zero = 0.0 * gravity[0]
    wx, wy, wz = zero, zero, zero
    ux, uy, uz = zero, zero, zero  # angular acceleration
    vx, vy, vz = -gravity[0], -gravity[1], -gravity[2]  # linear acceleration of the frame's origin
    for i in range(velocity.shape[0]):
        rate, change = velocity[i], acceleration[i]
        vx, vy, vz = _to_link(table, i, vx, vy, vz)
        if chain.prismatic[i]:
            wx, wy, wz = _to_link(table, i, wx, wy, wz)
            ux, uy, uz = _to_link(table, i, ux, uy, uz)
            kx, ky, kz = _cross(wx, wy, wz, zero, table[i, _SA] * rate, table[i, _CA] * rate)
            vx += 2.0 * kx
            vy += 2.0 * ky + table[i, _SA] * change
            vz += 2.0 * kz + table[i, _CA] * change
        else:
            ux, uy, uz = _to_link(table, i, ux + wy * rate, uy - wx * rate, uz + change)
            wx, wy, wz = _to_link(table, i, wx, wy, wz + rate)
        px, py, pz = table[i, _P], table[i, _P + 1], table[i, _P + 2]
        ax, ay, az = _turning_acceleration(wx, wy, wz, ux, uy, uz, px, py, pz)
        vx, vy, vz = vx + ax, vy + ay, vz + az

        body = chain.inertial
        mass, sx, sy, sz = body[i, 0], body[i, 1], body[i, 2], body[i, 3]
        ax, ay, az = _turning_acceleration(wx, wy, wz, ux, uy, uz, sx, sy, sz)
        table[i, _F], table[i, _F + 1], table[i, _F + 2] = mass * vx + ax, mass * vy + ay, mass * vz + az
        ex, ey, ez = _tensor_times(body, i, ux, uy, uz)
        hx, hy, hz = _tensor_times(body, i, wx, wy, wz)
        gx, gy, gz = _cross(wx, wy, wz, hx, hy, hz)
        nx, ny, nz = _cross(sx, sy, sz, vx, vy, vz)
        table[i, _N], table[i, _N + 1], table[i, _N + 2] = ex + gx + nx, ey + gy + ny, ez + gz + nz


@inlined
def _turning_acceleration(
    wx: complex,
    wy: complex,
    wz: complex,
    ux: complex,
    uy: complex,
    uz: complex,
    x: complex,
    y: complex,
    z: complex,
) -> Any:
    """Returns ω̇ × r + ω × (ω × r)."""
    ax, ay, az = _cross(ux, uy, uz, x, y, z)
    bx, by, bz = _cross(wx, wy, wz, x, y, z)
    cx, cy, cz = _cross(wx, wy, wz, bx, by, bz)
    return ax + cx, ay + cy, az + cz


@compiled
def _backward(chain: ChainArrays, table: Array, acceleration: Array) -> Array:
    """Sums forces and moments from the end inwards and projects them on the joint axes (3.37 to 3.39)."""
    n = acceleration.shape[0]
    torque = np.empty_like(acceleration)
    zero = 0.0 * acceleration[0]
    fx, fy, fz = zero, zero, zero
    nx, ny, nz = zero, zero, zero
    for i in range(n - 1, -1, -1):
        fx, fy, fz = fx + table[i, _F], fy + table[i, _F + 1], fz + table[i, _F + 2]
        mx, my, mz = _cross(table[i, _P], table[i, _P + 1], table[i, _P + 2], fx, fy, fz)
        nx, ny, nz = nx + table[i, _N] + mx, ny + table[i, _N + 1] + my, nz + table[i, _N + 2] + mz
        fx, fy, fz = _to_previous(table, i, fx, fy, fz)
        nx, ny, nz = _to_previous(table, i, nx, ny, nz)
        torque[i] = (fz if chain.prismatic[i] else nz) + chain.rotor_inertia[i] * acceleration[i]
    return torque


@inlined
def _add_to_previous(table: Array, bodies: Array, i: int) -> None:
    """Adds body i + 1, given in frame i + 1 (about its origin), to body i in frame i; the joint between is i."""
    k = i + 1
    mass = bodies[k, 0]
    px, py, pz = table[i, _P], table[i, _P + 1], table[i, _P + 2]
    sx, sy, sz = bodies[k, 1], bodies[k, 2], bodies[k, 3]
    tx, ty, tz = sx + mass * px, sy + mass * py, sz + mass * pz
    xx = bodies[k, 4] + py * (sy + ty) + pz * (sz + tz)
    yy = bodies[k, 7] + px * (sx + tx) + pz * (sz + tz)
    zz = bodies[k, 9] + px * (sx + tx) + py * (sy + ty)
    xy = bodies[k, 5] - px * sy - tx * py
    xz = bodies[k, 6] - px * sz - tx * pz
    yz = bodies[k, 8] - py * sz - ty * pz
    # turn by α about x
    ca, sa = table[i, _CA], table[i, _SA]
    xy, xz = ca * xy - sa * xz, sa * xy + ca * xz
    mixed = 2.0 * ca * sa * yz
    yy_turned = ca * ca * yy - mixed + sa * sa * zz
    yz = ca * sa * (yy - zz) + (ca * ca - sa * sa) * yz
    zz = sa * sa * yy + mixed + ca * ca * zz
    yy = yy_turned
    # turn by θ about z
    ct, st = table[i, _CT], table[i, _ST]
    xz, yz = ct * xz - st * yz, st * xz + ct * yz
    mixed = 2.0 * ct * st * xy
    xx_turned = ct * ct * xx - mixed + st * st * yy
    xy = ct * st * (xx - yy) + (ct * ct - st * st) * xy
    yy = st * st * xx + mixed + ct * ct * yy
    tx, ty, tz = _to_previous(table, i, tx, ty, tz)
    bodies[i, 0] += mass
    bodies[i, 1] += tx
    bodies[i, 2] += ty
    bodies[i, 3] += tz
    bodies[i, 4] += xx_turned
    bodies[i, 5] += xy
    bodies[i, 6] += xz
    bodies[i, 7] += yy
    bodies[i, 8] += yz
    bodies[i, 9] += zz


@compiled
def _composites(chain: ChainArrays, table: Array) -> Array:
    """Returns (n + 1, 10): row i is link i with everything beyond it as one rigid body, in frame i about its origin.

    Links are numbered from 1; row 0 is the whole arm in the base frame.
    """
    n = table.shape[0]
    bodies = np.zeros((n + 1, 10), dtype=table.dtype)
    for i in range(n):
        for k in range(10):  # assigning a slice would take numba seconds to compile
            bodies[i + 1, k] = chain.inertial[i, k]
    for i in range(n - 1, -1, -1):
        _add_to_previous(table, bodies, i)
    return bodies


@inlined
def _unit_acceleration_wrench(prismatic: bool, table: Array, bodies: Array, j: int) -> Any:
    """Returns force and moment, in link axes about its origin, that give joint j of the composite unit acceleration."""
    k = j + 1
    mass, sx, sy, sz = bodies[k, 0], bodies[k, 1], bodies[k, 2], bodies[k, 3]
    zy, zz = table[j, _SA], table[j, _CA]  # the joint's axis in link axes; its x component is zero
    zx = 0.0 * zy
    if prismatic:
        fx, fy, fz = mass * zx, mass * zy, mass * zz
        nx, ny, nz = _cross(sx, sy, sz, zx, zy, zz)
    else:
        vx, vy, vz = _cross(zx, zy, zz, table[j, _P], table[j, _P + 1], table[j, _P + 2])
        ax, ay, az = _cross(zx, zy, zz, sx, sy, sz)
        fx, fy, fz = mass * vx + ax, mass * vy + ay, mass * vz + az
        mx, my, mz = _cross(sx, sy, sz, vx, vy, vz)
        nx, ny, nz = _tensor_times(bodies, k, zx, zy, zz)
        nx, ny, nz = nx + mx, ny + my, nz + mz
    return fx, fy, fz, nx, ny, nz


@compiled
def _mass_matrix(chain: ChainArrays, table: Array) -> Array:
    n = table.shape[0]
    bodies = _composites(chain, table)
    result = np.empty((n, n), dtype=table.dtype)
    for j in range(n):
        fx, fy, fz, nx, ny, nz = _unit_acceleration_wrench(chain.prismatic[j], table, bodies, j)
        for i in range(j, -1, -1):
            mx, my, mz = _cross(table[i, _P], table[i, _P + 1], table[i, _P + 2], fx, fy, fz)
            fx, fy, fz = _to_previous(table, i, fx, fy, fz)
            nx, ny, nz = _to_previous(table, i, nx + mx, ny + my, nz + mz)
            result[i, j] = fz if chain.prismatic[i] else nz
            result[j, i] = result[i, j]
        result[j, j] += chain.rotor_inertia[j]
    return result


@compiled
def mass_matrix(chain: ChainArrays, q: Array) -> Array:
    """Returns D(q) by composite bodies (Walker and Orin 1982), (n, n), reflected rotor inertia on the diagonal."""
    return _mass_matrix(chain, _link_table(chain, q))


@compiled
def gravity_torques(chain: ChainArrays, q: Array) -> Array:
    """Returns G(q): rates and accelerations zero, (n,)."""
    rest = np.zeros_like(q)
    return newton_euler(chain, q, rest, rest, chain.gravity)


@compiled
def gravity_along(chain: ChainArrays, positions: Array) -> Array:
    """Returns G(q) at every row of positions, (k, n)."""
    found = np.empty_like(positions)
    for k in range(positions.shape[0]):
        found[k] = gravity_torques(chain, positions[k])
    return found


@compiled
def velocity_torques(chain: ChainArrays, q: Array, velocity: Array) -> Array:
    """Returns H(q, q̇), Coriolis and centrifugal: accelerations and gravity zero, (n,)."""
    return newton_euler(chain, q, velocity, np.zeros_like(q), np.zeros_like(chain.gravity))


@compiled
def inverse_dynamics(chain: ChainArrays, q: Array, velocity: Array, acceleration: Array) -> Array:
    """Returns τ = D(q) q̈ + H(q, q̇) + G(q) (3.40), (n,)."""
    return newton_euler(chain, q, velocity, acceleration, chain.gravity)


@compiled
def inverse_dynamics_along(chain: ChainArrays, positions: Array, velocities: Array, accelerations: Array) -> Array:
    """Returns τ at every row of a motion, (k, n) each."""
    found = np.empty_like(positions)
    for k in range(positions.shape[0]):
        found[k] = inverse_dynamics(chain, positions[k], velocities[k], accelerations[k])
    return found


@compiled
def forward_dynamics(chain: ChainArrays, q: Array, velocity: Array, torque: Array) -> Array:
    """Returns q̈ for given joint torques or forces, (n,); inf or nan if D(q) is singular."""
    table = _link_table(chain, q)
    rest = np.zeros_like(q)
    _forward(chain, table, velocity, rest, chain.gravity)
    remaining = _backward(chain, table, rest)
    for i in range(q.shape[0]):
        remaining[i] = torque[i] - remaining[i]
    return solve_symmetric(_mass_matrix(chain, table), remaining)


@compiled
def kinetic_energy(chain: ChainArrays, q: Array, velocity: Array) -> Any:
    """Returns ½ q̇ᵀ D(q) q̇, rotors included, J."""
    matrix = mass_matrix(chain, q)
    total = 0.0 * velocity[0]
    for i in range(q.shape[0]):
        for j in range(q.shape[0]):
            total += velocity[i] * matrix[i, j] * velocity[j]
    return 0.5 * total


@compiled
def potential_energy(chain: ChainArrays, q: Array) -> Any:
    """Returns the energy in the field of gravity, zero for mass at the base's origin, J."""
    whole = _composites(chain, _link_table(chain, q))[0]
    return -(chain.gravity[0] * whole[1] + chain.gravity[1] * whole[2] + chain.gravity[2] * whole[3])
