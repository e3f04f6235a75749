// SPDX-License-Identifier: Apache-2.0
#include "support/program_cases.h"

namespace dpde::testing {

using adjoint::Activity;

namespace {

const std::string burgers_kernel = R"(
kernel k(u: field halo 1, out v: field, nu, hx, dt: param) {
  let ux = (u[+1] - u[-1])/(2*hx)
  v = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/hx^2)
}
)";

const std::string burgers_2d_kernel = R"(
kernel k(u: field halo 1, v: field halo 1, out un: field, out vn: field, nu, hx, hy, dt: param) {
  let ux = (u[+1, 0] - u[-1, 0])/(2*hx)
  let vy = (v[0, +1] - v[0, -1])/(2*hy)
  un = u + dt*(-(u*ux + v*(u[0, +1] - u[0, -1])/(2*hy)) + nu*((u[-1, 0] - 2*u + u[+1, 0])/hx^2 + (u[0, -1] - 2*u + u[0, +1])/hy^2))
  vn = v + dt*(-(u*(v[+1, 0] - v[-1, 0])/(2*hx) + v*vy) + nu*(v[-1, 0] + v[+1, 0] - 4*v + v[0, -1] + v[0, +1])/(hx*hy))
}
)";

const std::string two_stages = R"(
kernel s1(u: field halo 2, kappa: field halo 1, out w: field, dt: param) {
  let flux = kappa[+1]*(u[+2] - u)*exp(u)
  w = u + dt*flux/kappa
}
kernel s2(u: field, w: field halo 1, out v: field, sum e: param, a, dt: param) {
  v = u + dt*(w[+1]*w - sin(w[-1])) + a^2*w^3
  e += a*w^2 + sqrt(u)
}
)";

const std::string interp_kernels = R"(
kernel s1(u: field halo 1, out w: field, nu: param) { w = u + nu*(u[-1] - 2*u + u[+1]) }
kernel s2(w: field halo 1, out v: field, c: param) { v = interp(w, -c*w*w) }
)";

const std::string interp_2d_kernels = R"(
kernel s2(w: field halo 1, q: field halo 1, out v: field, c: param) {
  let d = -c*w*q[+1, 0]
  v = interp(w, d, 2.3*q)*q + interp_dx(q, 0.4*w, d)
}
)";

/// Their adjoints store what many terms have in common: one value, one with the rates of params and sums beside it, two of two fields.
const std::string shared_kernels = R"(
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

const std::string shared_2d_kernels = R"(
kernel k(u: field halo 2, a: field, b: field, d: field, out v: field, c: param) {
  v = u + 0.1*c*a*b*d*exp(-a)*sqrt(d)*sin(b)*log(a)*(u[-2, 0] + 3*u[-1, 0] - 4*u + u[+1, 0] - u[+2, 0] + 2*u[0, -2] + u[0, -1] - u[0, +1] + u[0, +2])
}
kernel use(v: field halo 1, out r: field) { r = v[+1, 0]*v + v[0, -1] }
)";

/// A step along the flow, one back, and half of the difference between the corners of the cell that was read.
const std::string maccormack_kernels = R"(
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

const std::string maccormack_2d_kernels = R"(
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

const std::string cubic_kernels = R"(
kernel s2(u: field halo 2, q: field halo 2, out v: field, c: param) {
  v = u*q^2 + interp_cx(u, -c*u*q) + interp_cdx(q, 0.4*u)*interp_lx(q[+1], -c*u) + interp_cddx(u[-2], c*q)*interp_cdddx(u, 1.7)
}
)";

const std::string cubic_2d_kernels = R"(
kernel s2(u: field halo 2, q: field halo 2, out v: field, c: param) {
  v = u*q^2 + interp_cxcy(u, -c*u, 2.3*q)*q + interp_uxcdy(q, 0.4*u, -c*q) + interp_cddxuy(u[0, +1], c*q, 0.3)
}
)";

const std::string cubic_3d_kernel = R"(
kernel s2(u: field halo 2, out v: field, c: param) { v = u^3 + interp_cxcycz(u, -c*u, 1.3*u, 0.4*u) + interp_lxuycz(u, c, c*u, -c*u) }
)";

const std::string heat_3d_kernel = R"(
kernel k(u: field halo 2, out v: field, nu, h: param) {
  v = u + nu*(u[-1, 0, 0] + u[+1, 0, 0] + u[0, -2, 0] + u[0, +2, 0] + u[0, 0, -1]*u[0, 0, +1] - 6*u)/h^2
}
)";

/// A result of the program that the program itself reads: pn.
const std::string symplectic = R"(
kernel a(p: field, u: field halo 1, out pn: field, c: param) {
  pn = p + c*sin(u)*(u[-1, 0] + u[+1, 0] + u[0, -1] + u[0, +1] - 4*u)
}
kernel b(u: field, pn: field halo 1, out un: field, c: param) { un = u + c*pn*(pn[0, +1] - pn[-1, 0]) }
)";

/// The widest differences there are, on grids of one cell too.
const std::string wide = R"(
kernel k(u: field halo 4, out v: field, c, hx, dt: param) {
  let u_x = (672*(u[+1] - u[-1]) - 168*(u[+2] - u[-2]) + 32*(u[+3] - u[-3]) - 3*(u[+4] - u[-4]))/(840*hx)
  let biased = max(u - c, 0)*(2*(u[+1] - u) + 5*(u - u[-1]) - (u[-1] - u[-2]))/(6*hx)
  v = u - dt*(biased + u*u_x) + c*(u[-4]*u[+4] + 0.3*u[-3] + 0.2*u[+2]^2)
}
)";

const std::string kinks = R"(
kernel k(u: field halo 1, out v: field, c: param) {
  let up = max(u - 1, 0)
  let um = min(u - 1, 0)
  v = up*(u - u[-1]) + um*(u[+1] - u) + abs(u[+1] - 1.01)*c + if(u > 0.9, 1/u, log(u[-1] + 3)) + tanh(u)/cosh(u) + atan(c*u)^c
}
)";

const std::string walls_kernel = R"(
kernel wall(out wc: field, g, dt: param) { wc = g^2 + dt }
)";

const std::string walls_2d_kernel = R"(
kernel wall(x: field, y: field, out wc: field, g, c0: param) { wc = if(x < 0, g^2*y, sin(g*x)*c0 + y) }
)";

/// Shallow water on staggered points: u on the upper faces of the cells, its last value on the high wall.
const std::string staggered_kernel = R"(
kernel k(e: field halo 1, u: field halo 2, out en: field, out un: field, g, c, dt, hx: param) {
  let h = 1 + (e + e[+1])/2
  let hm = 1 + (e[-1] + e)/2
  en = e - dt*(h*u - hm*u[-1])/hx
  un = if(inside[+1], u - dt*(g*(e[+1] - e)/hx + u*(u[+1] - u[-1])/(2*hx) - 0.01*(27*(u[+1] - u) - u[+2] + u[-2])*u[-1]), c)
}
)";

const std::string staggered_2d_kernel = R"(
kernel k(e: field halo 1, u: field halo 1, v: field halo 2, out en: field, out un: field, out vn: field, g, c, dt, hx, hy: param) {
  en = e - dt*((1 + e)*(u - u[-1, 0])/hx + (v - v[0, -1])/hy)
  let vu = (v + v[+1, 0] + v[0, -1] + v[+1, -1])/4
  let uv = (u + u[-1, 0] + u[0, +1] + u[-1, +1])/4
  un = if(inside[+1, 0], u - dt*(g*(e[+1, 0] - e)/hx + vu*(u[0, +1] - u[0, -1])/(2*hy)), c)
  vn = if(inside[0, +1], v - dt*(g*(e[0, +1] - e)/hy + uv*(v[+1, 0] - v[-1, 0])/(2*hx) + v*(v[0, +2] - v[0, -2])), c)
}
)";

/// On the nodes: staggered along all axes. The walls' values are read at n - 1 too.
const std::string node_kernels = R"(
kernel wall(x: field, out wc: field, g, dt: param) on 3 axes { wc = g^2*x + dt }
kernel k(w: field halo 1, out v: field, c: param) {
  v = w[+1, 0, 0]*w[-1, 0, 0] + c*w[0, +1, +1] - w*w[0, -1, 0] + w[0, 0, -1]
}
kernel s(w: field, q: field, v: field, out vn: field, sum e: param) on 3 axes {
  vn = v*w + q^2
  e += w^2*q
}
)";

/// w is reduced by itself, and read by a later kernel.
const std::string mean_field_kernels = R"(
kernel a(u: field halo 1, out w: field, c: param) { w = u*u[+1] + c*u[-1] }
kernel k(u: field halo 1, w: field, m: field, p: field, out v: field, c, nu: param) {
  v = u + nu*(u[-1] - 2*u + u[+1])*m - c*(u - m)*w + c*p*u
}
)";

const std::string zonal_kernels = R"(
kernel a(u: field halo 1, out w: field, c: param) { w = u*u[+1, -1] + c*u[-1, 0]^2 }
kernel k(u: field, m: field halo 1, q: field, out v: field, c: param) {
  v = u - c*m[+1, 0]*(m[-1, 0] + u) + interp(m, 0.3, 0.4)*m[0, +1]/8 + c*q*u^2
}
)";

const std::string planes_kernel = R"(
kernel k(u: field, a: field, b: field halo 1, d: field, e: field, out v: field, c: param) {
  v = u*a + c*(b[0, 0, +1] - b[0, 0, -1])*u + d*e*u/8 + c*sin(a*d/4)
}
)";

/// Alike but for fields, numbers and parameters: one row, with a block of uniforms for each of its sweeps.
const std::string alike_kernels = R"(
kernel a(u: field halo 1, out w: field, sum e: param, c: param) { w = u + c*(u[+1] - 2*u)*u[-1]; e += 2*u^2 }
kernel b(w: field halo 1, out q: field, sum f: param, nu: param) { q = w + nu*(w[+1] - 2*w)*w[-1]; f += 0.5*w^2 }
kernel d(q: field halo 1, out v: field, sum e: param) { v = q + 0.3*(q[+1] - 4*q)*q[-1]; e += 7*q^2 }
)";
const std::string alike_scatters = R"(
kernel zero(out s: field, out r: field) on 1 axis { s = 0; r = 0 }
kernel a(u: field, inout s: field, c: param) { interp(s, c*u) += u^2 }
kernel b(u: field, inout r: field) { interp(r, 0.4*u) += u^2 }
)";

/// Sweeps of an iteration that all see the state as it was.
const std::string jacobi_kernels = R"(
kernel begin(u: field, out w: field, c: param) { w = u + c*u^2/8 }
kernel jacobi(u: field, w: field halo 1, out v: field, sum e: param, c: param) {
  let next = (u + c*(w[-1] + w[+1])*w)/(1 + 2*c)
  v = next
  e += (next - w)^2
}
)";

/// Steps of two kinds, the quick ones within the slow ones; w begins anew in each of the slow.
const std::string repeated_steps = R"(
kernel slow(u: field halo 1, out w: field, c: param) { w = u + c*(u[+1, 0] - u)*u[0, -1] }
kernel fast(w: field halo 1, out q: field, c: param) { q = w + c*(w[-1, 0] + w[0, +1] - 2*w)*w/4 }
kernel both(u: field, w: field, m: field, out v: field, c: param) on 2 axes { v = u/2 + c*w*m }
)";

/// Reads the corners.
const std::string cross_kernel = R"(
kernel k(u: field halo 1, out v: field) { v = u[+1, +1]*u[-1, +1] + u[+1, -1]*u + u[-1, -1] }
)";

}  // namespace

std::vector<ProgramCase> program_cases() {
  const Activity u_nu{{"u"}, {"nu"}};
  const std::string bounded = "fill u x.low = 0.3, x.high = zero_gradient\n";
  return {
      {"burgers periodic", 1, burgers_kernel + "program p { fill u periodic; run k; swap u, v }", u_nu},
      {"burgers bounded", 1, burgers_kernel + "program p { " + bounded + "run k; swap u, v }", u_nu},
      {"wide periodic", 1, wide + "program p { fill u periodic; run k; swap u, v }", {{"u"}, {"c"}}},
      {"wide bounded", 1, wide + "program p { " + bounded + "run k; swap u, v }", {{"u"}, {"c"}}},
      {"burgers 2-D periodic", 2,
       burgers_2d_kernel + "program p { fill u periodic; fill v periodic; run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D mixed", 2,
       burgers_2d_kernel + "program p { fill u x periodic, y.low = 1, y.high = 0.2; fill v x periodic, y = zero_gradient; run k; "
                           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D bounded", 2,
       burgers_2d_kernel + "program p { fill u x = 0.5, y.low = 1, y.high = zero_gradient; fill v x = zero_gradient, y = 0; run k; "
                           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"two stages periodic", 1,
       two_stages + "program p { fill u periodic; fill kappa periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"two stages bounded", 1,
       two_stages + "program p { fill u x = 1.2; fill kappa x = zero_gradient; run s1; fill w x.low = 0.7, x.high = zero_gradient; "
                    "run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"interp periodic", 1, interp_kernels + "program p { fill u periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp bounded", 1, interp_kernels + "program p { fill u x = 0.4; run s1; fill w x.low = 0.4, x.high = zero_gradient; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp 2-D periodic", 2,
       interp_2d_kernels + "program p { fill w periodic; fill q periodic; run s2; keep v }", {{"w", "q"}, {"c"}}},
      {"interp 2-D bounded", 2,
       interp_2d_kernels + "program p { fill w x = 0.3, y periodic; fill q x = zero_gradient, y periodic; run s2; keep v }",
       {{"w", "q"}, {"c"}}},
      {"maccormack periodic", 1, maccormack_kernels + "program p { fill u periodic; run ahead; fill a periodic; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"maccormack bounded", 1, maccormack_kernels + "program p { fill u x.low = 0.4, x.high = zero_gradient; run ahead; "
                                "fill a x.low = 0.4, x.high = zero_gradient; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"maccormack 2-D mixed", 2, maccormack_2d_kernels + "program p { fill u x = zero_gradient, y periodic; run ahead; "
                                  "fill a x = zero_gradient, y periodic; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"cubic periodic", 1, cubic_kernels + "program p { fill u periodic; fill q periodic; run s2; keep v }", {{"u", "q"}, {"c"}}},
      {"cubic bounded", 1, cubic_kernels + "program p { fill u x.low = 0.4, x.high = gradient(0.3); fill q x.low = 0.8, x.high = zero_gradient; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 2-D mixed", 2, cubic_2d_kernels + "program p { fill u x = 0.3, y periodic; fill q x = zero_gradient, y periodic; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 2-D bounded", 2, cubic_2d_kernels + "program p { fill u x = zero_gradient, y = 0.2; fill q x = 0.8, y = zero_gradient; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 3-D mixed", 3, cubic_3d_kernel + "program p { fill u x = 0.3, y periodic, z = zero_gradient; run s2; swap u, v }", {{"u"}, {"c"}}},
      {"a place behind a condition", 1,
       "kernel k(u: field halo 1, out v: field, c: param) { v = if(u > 0.8, interp(u, c*log(u - 0.7)), u^2) }\n"
       "program p { fill u x = 0.4; run k; keep v }", {{"u"}, {"c"}}},
      {"heat 3-D", 3, heat_3d_kernel + "program p { fill u x periodic, y.low = 1, y.high = zero_gradient, z = 0; run k; swap u, v }",
       {{"u"}, {"nu"}}},
      {"halo read by the adjoint only", 1,
       "kernel k(d: field halo 1, u: field, q: field, out v: field, c: param) { v = d*q^2 - c*min(u, 1)*(d[+1] - d)*u }\n"
       "program p { fill d periodic; run k; swap d, v }", {{"d", "u", "q"}, {"c"}}},
      {"scalar parameter only", 1, burgers_kernel + "program p { fill u x = 0.2; run k; keep v }", {{}, {"nu", "dt"}}},
      {"symplectic mixed", 2, symplectic + "program p { fill u x periodic, y = 0.3; run a; fill pn x periodic, y = zero_gradient; run b; "
                                           "swap p, pn; swap u, un }",
       {{"p", "u"}, {"c"}}},
      {"symplectic periodic", 2, symplectic + "program p { fill u periodic; run a; fill pn periodic; run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c"}}},
      {"gradient and mixed", 1, two_stages + "program p { fill u x.low = gradient(g), x.high = mixed(a, 2*g, dt); fill kappa x = 1; run s1; "
                                "fill w x.low = mixed(1, 0.3, 0.1), x.high = gradient(0.4); run s2; swap u, v }",
       {{"u", "kappa"}, {}}},
      {"gradient and mixed 2-D", 2,
       burgers_2d_kernel + "program p { fill u x periodic, y.low = gradient(1), y.high = mixed(1, 2, 0.2); fill v x periodic, "
                           "y.low = mixed(2, 1, nu0), y.high = gradient(-1); run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"values along a wall", 1, walls_kernel + two_stages +
           "program p { run wall grow 2; fill u x.low = wc, x.high = mixed(1, 2, wc); fill kappa x = gradient(wc); run s1; "
           "fill w x.low = gradient(wc), x.high = 0.7; run s2; swap u, v }",
       {{"u", "kappa"}, {"a", "g"}}},
      {"a wall alone", 1, walls_kernel + "kernel k(u: field halo 3, out v: field) { v = u[-3]*u[+2] + sin(u) }\n"
                          "program p { run wall grow 3; fill u x = wc; run k; keep v }", {{}, {"g"}}},
      {"weights that vary", 1, walls_kernel + two_stages +
           "program p { run wall grow 2; fill u x.low = mixed(a, 2*g, wc), x.high = mixed(a*g + dt, sin(g), 0.2); fill kappa x = mixed(1, g, 0.3); run s1; "
           "fill w x.low = mixed(if(g > 0.5, a, a^2), 1, wc), x.high = mixed(1, a, wc); run s2; swap u, v }",
       {{"u", "kappa"}, {"a", "g"}}},
      {"weights that vary, wide", 1, "kernel k(u: field halo 3, out v: field) { v = u[-3]*u[+2] + sin(u)*u[+3] }\n"
           "program p { fill u x = mixed(a, 1 + b, 0.3); run k; keep v }", {{}, {"a", "b"}}},
      {"weights that vary 2-D", 2, walls_2d_kernel + symplectic +
           "program p { run wall grow 2; fill u x.low = mixed(g, 1, wc), x.high = mixed(1, g, wc), y.low = wc, y.high = mixed(1, c0, 0.2); run a; "
           "fill pn x = 0.3, y.low = mixed(c0, 1, wc), y.high = gradient(0.2); run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c0", "g"}}},
      {"weights that vary, corners", 2, "kernel k(u: field halo 1, out v: field) { v = u[+1, +1]*u[-1, +1] + u[+1, -1]*u + u[-1, -1] }\n"
           "program p { fill u x = mixed(1, a, 0.3), y = mixed(a, b, 0.5); run k; keep v }", {{"u"}, {"a", "b"}}},
      {"weights that vary, mixed axes", 2, walls_2d_kernel + cross_kernel +
           "program p { run wall grow 1; fill u x periodic, y.low = mixed(1, g, wc), y.high = mixed(c0, 0.5, 1); run k; swap u, v }", {{"u"}, {"g", "c0"}}},
      {"weights that vary 3-D", 3, heat_3d_kernel + "program p { fill u x periodic, y = mixed(1, a, 0.4), z.low = mixed(b, a, 0), z.high = 0; run k; swap u, v }",
       {{"u"}, {"nu", "a", "b"}}},
      {"weights that vary, interpolated", 1, interp_kernels +
           "program p { fill u x = mixed(1, a, 0.4); run s1; fill w x.low = mixed(a, 1, 0.4), x.high = zero_gradient; run s2; swap u, v }",
       {{"u"}, {"nu", "c", "a"}}},
      {"values along walls 2-D", 2, walls_2d_kernel + symplectic +
           "program p { run wall grow 2; fill u x.low = gradient(wc), x.high = mixed(1, 0.5, wc), y = wc; run a; "
           "fill pn x = 0.3, y.low = wc, y.high = gradient(0.2); run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c0", "g"}}},
      {"values along walls, mixed axes", 2, walls_2d_kernel + cross_kernel +
           "program p { run wall grow 1; fill u x periodic, y = wc; run k; swap u, v }", {{"u"}, {"g"}}},
      {"values along walls, interpolated", 2, walls_2d_kernel + interp_2d_kernels +
           "program p { run wall grow 1; fill w x.low = wc, x.high = gradient(wc), y periodic; fill q x = zero_gradient, y periodic; "
           "run s2; keep v }", {{"w", "q"}, {"c0", "g"}}},
      {"staggered", 1, staggered_kernel + "program p { fill e x = zero_gradient; fill u x = on_wall(c); run k; swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"staggered, two walls", 1, walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(wc), x.high = on_wall(c); run k; swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"staggered 2-D", 2, staggered_2d_kernel +
           "program p { fill e x = zero_gradient, y = zero_gradient; fill u x = on_wall(c), y = zero_gradient; "
           "fill v x = 0, y = on_wall(c); run k; swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"staggered 2-D, one axis periodic", 2, staggered_2d_kernel +
           "program p { fill e x periodic, y = zero_gradient; fill u x periodic, y = 0.2; fill v x periodic, y = on_wall(c); "
           "run k; swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"nodes", 3, node_kernels +
           "program p { run wall grow 1; fill w x.low = on_wall(wc), x.high = on_wall(0.3), y periodic, z = on_wall(wc); run k; "
           "fill q x = on_wall(0.4), y periodic, z = on_wall(wc); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"slopes on walls", 1, walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(gradient(wc)), x.high = on_wall(mixed(1, 0.4, wc)); run k; "
           "fill un x = on_wall(zero_gradient); swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"slopes on walls 2-D", 2, staggered_2d_kernel +
           "program p { fill e x = zero_gradient, y = zero_gradient; fill u x = on_wall(gradient(c)), y = zero_gradient; "
           "fill v x = 0, y.low = on_wall(c), y.high = on_wall(zero_gradient); run k; fill vn x = 0.2, y = on_wall(zero_gradient); swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"slopes on nodes", 3, node_kernels +
           "program p { run wall grow 1; fill w x.low = on_wall(gradient(wc)), x.high = on_wall(0.3), y periodic, z = on_wall(mixed(0.7, 0.2, wc)); run k; "
           "fill q x = on_wall(zero_gradient), y periodic, z.low = on_wall(wc), z.high = on_wall(gradient(wc)); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"weights that vary on walls", 1, walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(mixed(1 + g, g^2, wc)), x.high = on_wall(mixed(c, 1, 0.3)); run k; "
           "swap e, en; swap u, un }",
       {{"e", "u"}, {"g", "c"}}},
      {"weights that vary on nodes", 3, node_kernels +
           "program p { run wall grow 1; fill w x.low = on_wall(mixed(g, 1, wc)), x.high = on_wall(mixed(1, c, 0.3)), y periodic, z = on_wall(mixed(0.7, g, wc)); run k; "
           "fill q x = on_wall(mixed(1, g, 0.2)), y periodic, z.low = on_wall(wc), z.high = on_wall(zero_gradient); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"weights that vary on walls only", 2, "kernel s(u: field, sum e: param) on 2 axes { e += u^2 }\n"
           "program p { fill u x.low = on_wall(0.7), x.high = on_wall(mixed(a, b, 0.4)), y = on_wall(mixed(1, a, 0.3)); run s }", {{"u"}, {"a", "b"}}},
      {"read on the walls only", 2, "kernel s(u: field, q: field, sum e: param) on 2 axes { e += u^2*q }\n"
           "program p { fill u x = on_wall(0.7), y = on_wall(0.3); run s }", {{"u", "q"}, {}}},
      {"mean field periodic", 1, mean_field_kernels +
           "program p { fill u periodic; run a; reduce m = mean u; reduce p = max w; run k; swap u, v }", {{"u"}, {"nu", "c"}}},
      {"mean field bounded", 1, mean_field_kernels +
           "program p { fill u x.low = 0.4, x.high = zero_gradient; run a; reduce m = mean w; reduce p = min u; run k; swap u, v; keep w, m }",
       {{"u"}, {"nu", "c"}}},
      {"a result reduced", 1, "kernel k(u: field halo 1, out v: field, c: param) { v = u*u[+1] + c }\n"
           "kernel s(v: field, m: field, inout n: field, sum e: param) { n += m*v; e += m^2 }\n"
           "program p { fill u x = 0.2; run k; reduce m = mean v; reduce n = sum v; run s; swap u, v; keep n }", {{"u"}, {"c"}}},
      {"zonal means periodic", 2, zonal_kernels +
           "program p { fill u periodic; run a; reduce m = mean w over x; fill m periodic; reduce q = max u over y; run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"zonal means bounded", 2, zonal_kernels +
           "program p { fill u x = 0.3, y.low = 1, y.high = zero_gradient; run a; reduce m = mean w over y; fill m x = 0.1, y = zero_gradient; "
           "reduce q = min u over x; run k; swap u, v; keep m }",
       {{"u"}, {"c"}}},
      {"zonal means, one axis periodic", 2, zonal_kernels +
           "program p { fill u x periodic, y = gradient(0.1); run a; reduce m = mean w over x; fill m x periodic, y = 0.5; "
           "reduce q = max m over y; run k; keep v }",
       {{"u"}, {"c"}}},
      {"planes and lines", 3, planes_kernel +
           "program p { axes x periodic, y bounded, z bounded; reduce a = mean u over x, y; reduce b = mean u over y; "
           "fill b x periodic, y = zero_gradient, z = 0.2; reduce d = max u over x, z; reduce e = min b over z; run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"the rest of the planes and lines", 3, planes_kernel +
           "program p { fill u x = 0.3, y periodic, z periodic; reduce a = mean u over x; reduce b = max u over y, z; "
           "fill b x = zero_gradient, y periodic, z periodic; reduce d = sum u over x; reduce e = mean a over y; run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"a fold behind a fill", 1, "kernel k(u: field, out w: field, c: param) { w = c*u^2 }\n"
       "program p { fill u x.low = 0.3, x.high = gradient(0.2); run k grow 1; fill w x.low = 0.1, x.high = zero_gradient; "
       "fold w grow 1 x.low = 0, x.high = zero_gradient; keep w }", {{"u"}, {"c"}}},
      {"alike", 1, alike_kernels + "program p { fill u periodic; run a; fill w periodic; run b; fill q periodic; run d; swap u, v; keep w }", {{"u"}, {"c", "nu"}}},
      {"alike, bounded", 1, alike_kernels + "program p { fill u x = 0.3; run a; fill w x = c; run b; fill q x = 0.3; run d; swap u, v }", {{"u"}, {"nu"}}},
      {"alike scatters", 1, alike_scatters + "program p { axes x periodic; run zero; run a; run b; keep s, r }", {{"u"}, {"c"}}},
      {"repeat periodic", 1, jacobi_kernels + "program p { run begin; repeat 5 { fill w periodic; run jacobi; swap w, v }; swap u, w }", {{"u"}, {"c"}}},
      {"repeat bounded", 1, jacobi_kernels + "program p { run begin; repeat 3 { fill w x.low = 0.3, x.high = gradient(0.2); run jacobi; swap w, v }; swap u, w }", {{"u"}, {"c"}}},
      {"repeat in repeat", 2, repeated_steps +
           "program p { repeat 2 { fill u x periodic, y = zero_gradient; run slow; repeat 3 { fill w x periodic, y = 0.5; run fast; swap w, q }; "
           "reduce m = mean w over x; run both; swap u, v } }",
       {{"u"}, {"c"}}},
      {"shared values periodic", 1, shared_kernels + "program p { fill u periodic; run k; swap u, v; keep r }", {{"u", "a", "b"}, {"c"}}},
      {"shared values bounded", 1, shared_kernels + "program p { fill u x.low = 0.3, x.high = gradient(0.2); run k; swap u, v; keep r }", {{"u", "a", "b"}, {"c"}}},
      {"shared values in two kernels", 1, shared_kernels +
           "program p { fill u periodic; run k; fill a periodic; fill r periodic; run l; keep v, w }", {{"u", "a", "d"}, {"c"}}},
      {"shared values of two fields", 1, shared_kernels +
           "program p { fill u x = zero_gradient; fill v x.low = 0.2, x.high = gradient(0.1); run zero; run both; swap u, p; keep q }", {{"v", "a", "b"}, {}}},
      {"shared values, one axis periodic", 2, shared_2d_kernels + "program p { fill u x periodic, y = 0.3; run k; swap u, v }", {{"u", "a", "b"}, {"c"}}},
      {"shared values beyond walls", 2, shared_2d_kernels + "program p { fill u x = 0.2, y = zero_gradient; fill a x = 0.9, y = 1.1; fill b x = zero_gradient, y = 1; fill d x = 1.2, y = zero_gradient; run k grow 1; run use; keep r }", {{"u", "b"}, {"c"}}},
      {"kinks", 1, kinks + "program p { fill u periodic; run k; keep v }", {{"u"}, {"c"}}},
      {"kinks bounded", 1, kinks + "program p { fill u x.low = 0.6, x.high = 1.3; run k; keep v }", {{"u"}, {"c"}}},
  };
}

std::vector<ProgramCase> network_cases() {
  const std::string net = "network net(2) -> 1 { padding x periodic; let a = conv(in, 3, 3); let b = tanh(a); out = conv(b, 1, 5) }\n";
  const std::string net_of_walls = "network net(2) -> 1 { padding x reflect; let a = conv(in, 3, 3); let b = gelu(a); out = conv(b, 1, 5) }\n";
  const std::string kernels =
      "kernel a(u: field halo 1, out w: field, c: param) { w = c*u^2 - u[-1] }\n"
      "kernel k(u: field, w: field, n: field halo 1, out v: field, nu: param) { v = u + nu*(n[+1] - 2*n + n[-1])*w + n }\n";
  const std::string plane =
      "network deep(3) -> 2 { padding x periodic, y replicate; let a = conv(in, 4, 3); let b = silu(a); let p = mean_pool(b, 2); "
      "let c = conv(p, 4, 3, groups = 2); let d = upsample(c, 2); let e = add(b, d); let f = concat(e, in); let g = leaky_relu(f, 0.3); "
      "let h = conv(g, 2, 1, bias = 0); let i = fix_sum(h, 1); out = scale(i, 0.5) }\n";
  const std::string plane_kernels =
      "kernel k(u: field halo 1, p: field, q: field halo 1, out v: field, c: param) { v = u[+1, 0] + c*p*(q[0, +1] - q[-1, 0]) }\n"
      "kernel e(v: field, out w: field, nu: param) { w = nu*v^2 }\n";
  const std::string two = "network one(1) -> 2 { padding x zero; let a = conv(in, 3, 3, dilation = 2); let b = softplus(a); out = conv(b, 2, 1) }\n"
                          "network other(2) -> 1 { padding x zero; let a = conv(in, 2, 3, stride = 2); let b = sigmoid(a); let c = upsample(b, 2); out = conv(c, 1, 3) }\n";
  const std::string mirrored =
      "network mirrored(3) -> 2 { padding x periodic, y zero; let a = conv(in, 3, 3); let b = tanh(a); let c = conv(b, 2, 3); "
      "let d = reorient(in, x = -x, channels = (-1, 3, 2)); let e = conv(d, 3, 3, weights = a); let f = tanh(e); let g = conv(f, 2, 3, weights = c); "
      "let h = reorient(g, x = -x, y = -y, channels = (2, -1)); let i = add(c, h); out = scale(i, 0.5) }\n";
  return {
      {"mirror images with shared weights", 2, mirrored + plane_kernels +
           "program p { apply mirrored(u, w, u) to p, q; fill u x periodic, y = 0.2; fill q x periodic, y = zero_gradient; run k; keep v }",
       {{"u", "w"}, {"c", "mirrored"}}},
      {"a network", 1, net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; swap u, v }", {{"u"}, {"c", "nu", "net"}}},
      {"fixed weights", 1, net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; swap u, v }", {{"u"}, {"c"}}},
      {"weights alone", 1, net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; keep v }", {{}, {"net"}}},
      {"a network between walls", 1, net_of_walls + kernels +
           "program p { fill u x.low = 0.3, x.high = zero_gradient; run a; apply net(w, u) to n; fill n x = zero_gradient; run k; swap u, v; keep n }",
       {{"u"}, {"c", "nu", "net"}}},
      {"one field twice", 1, net + "program p { apply net(u, u) to n; keep n }", {{"u"}, {"net"}}},
      {"a correction after the step", 2, plane + plane_kernels +
           "program p { apply deep(u, u, u) to p, q; fill u x periodic, y = 0.2; fill q x periodic, y = zero_gradient; run k; run e; swap u, w }",
       {{"u"}, {"c", "nu", "deep"}}},
      {"a network of a network", 1, two + "program p { axes x bounded; apply one(u) to a, b; apply other(a, b) to n; keep n, a }", {{"u"}, {"one", "other"}}},
      {"an output nobody reads", 1, two + "program p { axes x bounded; apply one(u) to a, b; keep a }", {{"u"}, {"one"}}},
  };
}

std::vector<stencil::Grid> small_grids(int rank) {
  std::vector<stencil::Grid> result;
  if (rank == 1) {
    for (int n = 1; n <= 7; ++n) result.push_back({1, {n, 1, 1}});
    return result;
  }
  for (int nx = 1; nx <= 4; ++nx) {
    for (int ny = 1; ny <= 4; ++ny) {
      if (rank == 2) result.push_back({2, {nx, ny, 1}});
      if (rank == 3) result.push_back({3, {nx, ny, 5 - nx}});
    }
  }
  return result;
}

}  // namespace dpde::testing
