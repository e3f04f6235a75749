// SPDX-License-Identifier: Apache-2.0
// The kernels of program_cases.cpp, as text.
#pragma once

#include <string>

namespace dpde::testing {

inline const std::string burgers_kernel = R"(
kernel k(u: field halo 1, out v: field, nu, hx, dt: param) {
  let ux = (u[+1] - u[-1])/(2*hx)
  v = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/hx^2)
}
)";

inline const std::string burgers_2d_kernel = R"(
kernel k(u: field halo 1, v: field halo 1, out un: field, out vn: field, nu, hx, hy, dt: param) {
  let ux = (u[+1, 0] - u[-1, 0])/(2*hx)
  let vy = (v[0, +1] - v[0, -1])/(2*hy)
  un = u + dt*(-(u*ux + v*(u[0, +1] - u[0, -1])/(2*hy)) + nu*((u[-1, 0] - 2*u + u[+1, 0])/hx^2 + (u[0, -1] - 2*u + u[0, +1])/hy^2))
  vn = v + dt*(-(u*(v[+1, 0] - v[-1, 0])/(2*hx) + v*vy) + nu*(v[-1, 0] + v[+1, 0] - 4*v + v[0, -1] + v[0, +1])/(hx*hy))
}
)";

inline const std::string two_stages = R"(
kernel s1(u: field halo 2, kappa: field halo 1, out w: field, dt: param) {
  let flux = kappa[+1]*(u[+2] - u)*exp(u)
  w = u + dt*flux/kappa
}
kernel s2(u: field, w: field halo 1, out v: field, sum e: param, a, dt: param) {
  v = u + dt*(w[+1]*w - sin(w[-1])) + a^2*w^3
  e += a*w^2 + sqrt(u)
}
)";

inline const std::string interp_kernels = R"(
kernel s1(u: field halo 1, out w: field, nu: param) { w = u + nu*(u[-1] - 2*u + u[+1]) }
kernel s2(w: field halo 1, out v: field, c: param) { v = interp(w, -c*w*w) }
)";

inline const std::string interp_2d_kernels = R"(
kernel s2(w: field halo 1, q: field halo 1, out v: field, c: param) {
  let d = -c*w*q[+1, 0]
  v = interp(w, d, 2.3*q)*q + interp_dx(q, 0.4*w, d)
}
)";

/// The adjoints store common subexpressions: a single value, one with the derivatives of parameters and sums, two of
/// two fields.
inline const std::string shared_kernels = R"(
kernel k(u: field halo 3, a: field, b: field, d: field, out v: field, out r: field, c: param) {
  v = u + 0.1*c*a*b*d*exp(-a)*sqrt(d)*sin(b)*(u[-3] - 2*u[-2] + 3*u[-1] - 4*u + 2*u[+1] + u[+2] - u[+3])
  r = b*u
}
kernel l(r: field halo 3, a: field halo 1, b: field, d: field, out w: field, sum e: param, c: param) {
  w = r + 0.06*c*(r[-3] + r[-2] - 2*r[-1] - r + r[+1] + 2*r[+2] - r[+3])*(a[+1] + a)*if(a > 1, b*exp(a), sqrt(b))*d*sin(d)
  e += c*r*a
}
kernel both(u: field halo 3, v: field halo 3, a: field, b: field, out p: field, inout q: field) {
  let sv = v[-3] - v[-2] + 2*v[-1] - v - v[+1] - v[+2] + v[+3]
  p = u - 0.1*a*a*b*exp(a)*(u[-3] + u[-2] - 2*u[-1] + u + u[+1] - 2*u[+2] + u[+3]) + 0.2*a*b*b*sqrt(b)*sv
  q += v + 0.3*a*b*b*sqrt(b)*b*sv
}
kernel zero(u: field, out q: field) { q = u }
)";

inline const std::string shared_2d_kernels = R"(
kernel k(u: field halo 2, a: field, b: field, d: field, out v: field, c: param) {
  v = u + 0.1*c*a*b*d*exp(-a)*sqrt(d)*sin(b)*log(a)*(u[-2, 0] + 3*u[-1, 0] - 4*u + u[+1, 0] - u[+2, 0] + 2*u[0, -2] + u[0, -1] - u[0, +1] + u[0, +2])
}
kernel use(v: field halo 1, out r: field) { r = v[+1, 0]*v + v[0, -1] }
)";

/// A step along the flow, a step back, and half of the difference, clamped by the corners of the cell that was read.
inline const std::string maccormack_kernels = R"(
kernel ahead(u: field halo 1, w: field, out a: field, c: param) { a = interp(u, -c*w) }
kernel back(u: field halo 1, a: field halo 1, w: field, x: field, out v: field, c: param) {
  let b = -c*w
  let f = c*w*a
  let lower = interp_lx(u, b)
  let upper = interp_ux(u, b)
  let corrected = a + if(max(abs(b), abs(f)) <= min(x, 5 - x), (u - interp(a, f))/2, 0)
  v = min(max(lower, upper), max(corrected, min(lower, upper)))
}
)";

inline const std::string maccormack_2d_kernels = R"(
kernel ahead(u: field halo 1, w: field, out a: field, c: param) { a = interp(u, -c*w, 0.7*w*u) }
kernel back(u: field halo 1, a: field halo 1, w: field, out v: field, c: param) {
  let b = -c*w
  let d = 0.7*w*u
  let ll = interp_lxly(u, b, d)
  let lu = interp_lxuy(u, b, d)
  let ul = interp_uxly(u, b, d)
  let uu = interp_uxuy(u, b, d)
  let corrected = a + 0.5*(u - interp(a, c*w, -0.7*w*a))
  v = min(max(max(ll, lu), max(ul, uu)), max(corrected, min(min(ll, lu), min(ul, uu))))
}
)";

inline const std::string cubic_kernels = R"(
kernel s2(u: field halo 2, q: field halo 2, out v: field, c: param) {
  v = u*q^2 + interp_cx(u, -c*u*q) + interp_cdx(q, 0.4*u)*interp_lx(q[+1], -c*u) + interp_cddx(u[-2], c*q)*interp_cdddx(u, 1.7)
}
)";

inline const std::string cubic_2d_kernels = R"(
kernel s2(u: field halo 2, q: field halo 2, out v: field, c: param) {
  v = u*q^2 + interp_cxcy(u, -c*u, 2.3*q)*q + interp_uxcdy(q, 0.4*u, -c*q) + interp_cddxuy(u[0, +1], c*q, 0.3)
}
)";

inline const std::string cubic_3d_kernel = R"(
kernel s2(u: field halo 2, out v: field, c: param) { v = u^3 + interp_cxcycz(u, -c*u, 1.3*u, 0.4*u) + interp_lxuycz(u, c, c*u, -c*u) }
)";

inline const std::string heat_3d_kernel = R"(
kernel k(u: field halo 2, out v: field, nu, h: param) {
  v = u + nu*(u[-1, 0, 0] + u[+1, 0, 0] + u[0, -2, 0] + u[0, +2, 0] + u[0, 0, -1]*u[0, 0, +1] - 6*u)/h^2
}
)";

/// A result of the program that the program itself reads: pn.
inline const std::string symplectic = R"(
kernel a(p: field, u: field halo 1, out pn: field, c: param) {
  pn = p + c*sin(u)*(u[-1, 0] + u[+1, 0] + u[0, -1] + u[0, +1] - 4*u)
}
kernel b(u: field, pn: field halo 1, out un: field, c: param) { un = u + c*pn*(pn[0, +1] - pn[-1, 0]) }
)";

/// The widest differences, also on grids of one cell.
inline const std::string wide = R"(
kernel k(u: field halo 4, out v: field, c, hx, dt: param) {
  let u_x = (672*(u[+1] - u[-1]) - 168*(u[+2] - u[-2]) + 32*(u[+3] - u[-3]) - 3*(u[+4] - u[-4]))/(840*hx)
  let biased = max(u - c, 0)*(2*(u[+1] - u) + 5*(u - u[-1]) - (u[-1] - u[-2]))/(6*hx)
  v = u - dt*(biased + u*u_x) + c*(u[-4]*u[+4] + 0.3*u[-3] + 0.2*u[+2]^2)
}
)";

inline const std::string kinks = R"(
kernel k(u: field halo 1, out v: field, c: param) {
  let up = max(u - 1, 0)
  let um = min(u - 1, 0)
  v = up*(u - u[-1]) + um*(u[+1] - u) + abs(u[+1] - 1.01)*c + if(u > 0.9, 1/u, log(u[-1] + 3)) + tanh(u)/cosh(u) + atan(c*u)^c
}
)";

inline const std::string walls_kernel = R"(
kernel wall(out wc: field, g, dt: param) { wc = g^2 + dt }
)";

inline const std::string walls_2d_kernel = R"(
kernel wall(x: field, y: field, out wc: field, g, c0: param) { wc = if(x < 0, g^2*y, sin(g*x)*c0 + y) }
)";

/// Shallow water on a staggered grid: u on the upper faces of the cells, its last value on the high wall.
inline const std::string staggered_kernel = R"(
kernel k(e: field halo 1, u: field halo 2, out en: field, out un: field, g, c, dt, hx: param) {
  let h = 1 + (e + e[+1])/2
  let hm = 1 + (e[-1] + e)/2
  en = e - dt*(h*u - hm*u[-1])/hx
  un = if(inside[+1], u - dt*(g*(e[+1] - e)/hx + u*(u[+1] - u[-1])/(2*hx) - 0.01*(27*(u[+1] - u) - u[+2] + u[-2])*u[-1]), c)
}
)";

inline const std::string staggered_2d_kernel = R"(
kernel k(e: field halo 1, u: field halo 1, v: field halo 2, out en: field, out un: field, out vn: field, g, c, dt, hx, hy: param) {
  en = e - dt*((1 + e)*(u - u[-1, 0])/hx + (v - v[0, -1])/hy)
  let vu = (v + v[+1, 0] + v[0, -1] + v[+1, -1])/4
  let uv = (u + u[-1, 0] + u[0, +1] + u[-1, +1])/4
  un = if(inside[+1, 0], u - dt*(g*(e[+1, 0] - e)/hx + vu*(u[0, +1] - u[0, -1])/(2*hy)), c)
  vn = if(inside[0, +1], v - dt*(g*(e[0, +1] - e)/hy + uv*(v[+1, 0] - v[-1, 0])/(2*hx) + v*(v[0, +2] - v[0, -2])), c)
}
)";

/// On the nodes: staggered along all axes. The values on the walls are read at n - 1, too.
inline const std::string node_kernels = R"(
kernel wall(x: field, out wc: field, g, dt: param) on 3 axes { wc = g^2*x + dt }
kernel k(w: field halo 1, out v: field, c: param) {
  v = w[+1, 0, 0]*w[-1, 0, 0] + c*w[0, +1, +1] - w*w[0, -1, 0] + w[0, 0, -1]
}
kernel s(w: field, q: field, v: field, out vn: field, sum e: param) on 3 axes {
  vn = v*w + q^2
  e += w^2*q
}
)";

/// w is reduced, and read by a later kernel.
inline const std::string mean_field_kernels = R"(
kernel a(u: field halo 1, out w: field, c: param) { w = u*u[+1] + c*u[-1] }
kernel k(u: field halo 1, w: field, m: field, p: field, out v: field, c, nu: param) {
  v = u + nu*(u[-1] - 2*u + u[+1])*m - c*(u - m)*w + c*p*u
}
)";

inline const std::string zonal_kernels = R"(
kernel a(u: field halo 1, out w: field, c: param) { w = u*u[+1, -1] + c*u[-1, 0]^2 }
kernel k(u: field, m: field halo 1, q: field, out v: field, c: param) {
  v = u - c*m[+1, 0]*(m[-1, 0] + u) + interp(m, 0.3, 0.4)*m[0, +1]/8 + c*q*u^2
}
)";

inline const std::string planes_kernel = R"(
kernel k(u: field, a: field, b: field halo 1, d: field, e: field, out v: field, c: param) {
  v = u*a + c*(b[0, 0, +1] - b[0, 0, -1])*u + d*e*u/8 + c*sin(a*d/4)
}
)";

/// Equal except for fields, numbers and parameters: one row, with separate uniforms for each sweep.
inline const std::string alike_kernels = R"(
kernel a(u: field halo 1, out w: field, sum e: param, c: param) { w = u + c*(u[+1] - 2*u)*u[-1]; e += 2*u^2 }
kernel b(w: field halo 1, out q: field, sum f: param, nu: param) { q = w + nu*(w[+1] - 2*w)*w[-1]; f += 0.5*w^2 }
kernel d(q: field halo 1, out v: field, sum e: param) { v = q + 0.3*(q[+1] - 4*q)*q[-1]; e += 7*q^2 }
)";
inline const std::string alike_scatters = R"(
kernel zero(out s: field, out r: field) on 1 axis { s = 0; r = 0 }
kernel a(u: field, inout s: field, c: param) { interp(s, c*u) += u^2 }
kernel b(u: field, inout r: field) { interp(r, 0.4*u) += u^2 }
)";

/// Sweeps of an iteration that all read the initial state.
inline const std::string jacobi_kernels = R"(
kernel begin(u: field, out w: field, c: param) { w = u + c*u^2/8 }
kernel jacobi(u: field, w: field halo 1, out v: field, sum e: param, c: param) {
  let next = (u + c*(w[-1] + w[+1])*w)/(1 + 2*c)
  v = next
  e += (next - w)^2
}
)";

/// Fast substeps within slow steps; w restarts in each slow step.
inline const std::string repeated_steps = R"(
kernel slow(u: field halo 1, out w: field, c: param) { w = u + c*(u[+1, 0] - u)*u[0, -1] }
kernel fast(w: field halo 1, out q: field, c: param) { q = w + c*(w[-1, 0] + w[0, +1] - 2*w)*w/4 }
kernel both(u: field, w: field, m: field, out v: field, c: param) on 2 axes { v = u/2 + c*w*m }
)";

/// Passes that leave a field alone, add to it, sum it, fill walls from it, take its maximum, sample it and scatter to
/// it.
inline const std::string passing_kernels = R"(
kernel begin(u: field, out s: field) { s = u/2 }
kernel source(u: field halo 1, b: field halo 1, inout s: field, out v: field, sum e: param, c: param) {
  v = u + c*u*(u[-1] - u[+1]) + c*b[+1]*b
  s += c*u^2
  e += b*u
}
kernel wall(u: field, out h: field, c: param) { h = c*u^2 }
kernel edge(out h: field, c: param) on 1 axis { h = c^2 }
kernel between(u: field halo 1, h: field, out v: field) { v = u/2 + (u[-1] + u[+1])*u/4 + h/3 }
kernel most(u: field, m: field, out v: field, c: param) { v = u*m/2 + c*u }
kernel leap(old: field, u: field halo 1, out v: field, c: param) { v = 2*u - old + c*(u[-1] - 2*u + u[+1])*u }
kernel zero(out r: field) on 1 axis { r = 0 }
kernel give(u: field, inout r: field, c: param) { interp(r, c*u) += u^2 }
kernel take(u: field, r: field, out v: field, c: param) { v = u/2 + interp(r, c*u)/2 }
)";

/// Reads the corners.
inline const std::string cross_kernel = R"(
kernel k(u: field halo 1, out v: field) { v = u[+1, +1]*u[-1, +1] + u[+1, -1]*u + u[-1, -1] }
)";

inline const std::string counting =
    "kernel step(u: field halo 1, out v: field, c, k: param) { v = u + 0.1*c*(k + 0.5)*(u[-1] - 2*u + u[+1])*u }\n"
    "kernel step2(w: field halo 1, out v: field, c, k, n: param) { v = w + 0.1*c*(k + n)*(w[-1] - 2*w + w[+1])*w }\n";

}  // namespace dpde::testing
