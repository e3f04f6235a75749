// SPDX-License-Identifier: Apache-2.0
// Programs with solves: definite, singular, unsymmetric, wide, in several kernels, for several fields, and with
// Newton's method. Coefficients are unknowns, too.
#include <algorithm>
#include <iterator>

#include "support/program_cases.h"

namespace dpde::testing {

namespace {

const std::string operators_1d = R"(
kernel square(u: field, out b: field, c: param) { b = u*u + c*u }
kernel diffuse(phi: field halo 1, k: field halo 1, out image: field, c, hx: param) {
  image = (1 + c)*phi - ((k + k[+1])/2*(phi[+1] - phi) - (k[-1] + k)/2*(phi - phi[-1]))/hx^2
}
kernel poisson(phi: field halo 1, out image: field, hx: param) { image = (phi[-1] - 2*phi + phi[+1])/hx^2 }
kernel transport(phi: field halo 2, u: field, out image: field, c, hx: param) {
  image = 2*phi + 0.1*c*u*(phi[-2] - 4*phi[-1] + 3*phi)/(2*hx)
}
kernel bend(phi: field halo 1, out w: field, hx: param) { w = (phi[-1] - 2*phi + phi[+1])/hx^2 }
kernel stiff(phi: field, w: field halo 1, out image: field, c, hx: param) {
  image = phi + 1e-3*c*(w[-1] - 2*w + w[+1])/hx^2
}
kernel use(u: field, phi: field halo 1, out v: field, sum e: param, c: param) {
  v = u + 0.2*c*(phi[+1] - phi[-1])*phi
  e += c*phi*phi
}
)";

const std::string operators_2d = R"(
kernel square(u: field, out b: field, c: param) { b = u*u + c*u }
kernel diffuse(phi: field halo 1, k: field halo 1, out image: field, c, hx, hy: param) {
  image = (1 + c)*phi - ((k + k[+1, 0])/2*(phi[+1, 0] - phi) - (k[-1, 0] + k)/2*(phi - phi[-1, 0]))/hx^2 - (
    (k + k[0, +1])/2*(phi[0, +1] - phi) - (k[0, -1] + k)/2*(phi - phi[0, -1]))/hy^2
}
kernel poisson(phi: field halo 1, out image: field, hx, hy: param) {
  image = (phi[-1, 0] - 2*phi + phi[+1, 0])/hx^2 + (phi[0, -1] - 2*phi + phi[0, +1])/hy^2
}
kernel use(u: field, phi: field halo 1, out v: field, c: param) {
  v = u + 0.2*c*(phi[+1, 0] - phi[0, -1])*phi
}
)";

std::vector<ProgramCase> linear_cases() {
  const adjoint::Activity all{{"u", "k"}, {"c"}}, without_k{{"u"}, {"c"}};
  return {
      {"solve periodic", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill phi periodic; fill k periodic; run diffuse }; "
           "fill phi periodic; run use; swap u, v }",
       all},
      {"solve with walls", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill k x = zero_gradient; fill phi x.low = 0, x.high "
           "= zero_gradient; run diffuse }; fill phi x.low = 0.3, x.high = zero_gradient; run use; swap u, v }",
       all},
      {"weights that vary, in a solve", 1,
       operators_1d + "program p { run square; solve image = b for phi { fill k x = zero_gradient; fill phi x.low = "
                      "mixed(c, 0.7, 0), x.high = 0; run diffuse }; fill phi x = zero_gradient; run use; swap u, v }",
       all},
      {"solve singular periodic", 1,
       operators_1d + "program p { run square; solve image = b for phi { fill phi periodic; run poisson }; "
                      "fill phi periodic; run use; swap u, v }",
       without_k},
      {"solve singular between walls", 1,
       operators_1d + "program p { run square; solve image = b for phi { fill phi x = zero_gradient; "
                      "run poisson }; fill phi x = zero_gradient; run use; swap u, v }",
       without_k},
      {"solve that is not symmetric", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill phi x.low = 0, x.high = zero_gradient; run "
           "transport }; fill phi x.low = 0.1, x.high = zero_gradient; run use; swap u, v }",
       without_k},
      {"solve that is not symmetric, periodic", 1,
       operators_1d + "program p { run square; solve image = b for phi { fill phi periodic; run transport }; "
                      "fill phi periodic; run use; swap u, v }",
       without_k},
      {"solve by two kernels", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill phi x = 0; run bend; fill w x = 0; run stiff }; "
           "fill phi x = 0; run use; swap u, v }",
       without_k},
      {"solves one after the other", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill phi periodic; fill k periodic; run diffuse }; "
           "solve r = phi for q { fill q periodic; run again }; fill phi periodic; run use; swap u, v; keep q } "
           "kernel again(q: field halo 1, out r: field, c, hx: param) { r = 2*q - c*(q[-1] - 2*q + q[+1])/hx^2 }",
       all},
      {"solve that begins with a field", 1,
       operators_1d +
           "program p { run square; solve image = b for phi from u by cg { fill phi periodic; fill k periodic; run "
           "diffuse }; fill phi periodic; run use; swap u, v }",
       all},
      {"solves that begin with a carried field", 1,
       operators_1d +
           "program p { repeat 2 { run square; solve image = b for phi from q { fill phi periodic; fill k periodic; "
           "run diffuse }; fill phi periodic; run use; swap u, v; swap q, phi } }",
       all},
      {"solve in a repeat", 1,
       operators_1d +
           "program p { repeat 3 { run square; solve image = b for phi { fill phi periodic; fill k periodic; run "
           "diffuse }; fill phi periodic; run use; swap u, v } }",
       all},
      {"passes in a solve", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { run take; repeat 2 { fill q periodic; fill k periodic; "
           "run "
           "pass; swap q, q_next } to image }; fill phi periodic; run use; swap u, v } "
           "kernel take(phi: field, out q: field) { q = 2*phi } "
           "kernel pass(q: field halo 1, k: field halo 1, out q_next: field, c, hx: param) { q_next = q - 0.01*c*(k + "
           "k[+1])*(q[-1] - 2*q + q[+1])/hx^2 }",
       all},
      {"a coefficient that the block makes", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill k periodic; run soften; fill phi periodic; fill kk "
           "periodic; run diffuse_softly }; fill phi periodic; run use; swap u, v } "
           "kernel soften(k: field halo 1, out kk: field) { kk = k + 0.1*k[+1]*k[-1] } "
           "kernel diffuse_softly(phi, kk: field halo 1, out image: field, c, hx: param) { image = (1 + c)*phi - ((kk "
           "+ "
           "kk[+1])/2*(phi[+1] - phi) - (kk[-1] + kk)/2*(phi - phi[-1]))/hx^2 }",
       all},
      {"passes in a solve, with a coefficient that they change", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { run take; repeat 2 { run "
           "pass; swap q, q_next; swap r, r_next } to image, r_end }; fill phi periodic; run use; swap u, v } "
           "kernel take(phi: field, k: field, out q: field, out r: field) { q = 2*phi; r = k } "
           "kernel pass(q: field, r: field, out q_next: field, out r_next: field) { q_next = q*(1 + 0.1*r*r); r_next = "
           "0.5*r*r }",
       all},
      {"a kernel that makes a coefficient, and of the unknown something else", 1,
       operators_1d +
           "program p { run square; solve image = b for phi { fill phi periodic; run both; run join }; "
           "fill phi periodic; run use; swap u, v } "
           "kernel both(phi: field halo 1, k: field, out q: field, out kk: field) { q = 3*phi - 0.1*phi[+1]; kk = "
           "1 + 0.1*k*k } kernel join(q, kk: field, out image: field) { image = kk*q }",
       all},
      {"solve 2-D, one axis periodic", 2,
       operators_2d +
           "program p { run square; solve image = b for phi { fill k x periodic, y = zero_gradient; fill phi x "
           "periodic, y.low = 0, y.high = zero_gradient; run diffuse }; fill phi x periodic, y.low = 0.2, "
           "y.high = zero_gradient; run use; swap u, v }",
       all},
      {"solve singular 2-D", 2,
       operators_2d + "program p { run square; solve image = b for phi { fill phi periodic; run poisson }; "
                      "fill phi periodic; run use; swap u, v }",
       without_k},
  };
}

const std::string reactions = R"(
kernel begin(u: field, k: field, out b: field, out d: field, c: param) { b = u; d = k + 0.1*c*u }
kernel react(p: field, q: field, out r: field, out s: field, c: param) {
  r = p - 0.3*(1 - (c + 1)*p + p^2*q)
  s = q - 0.3*(c*p - p^2*q)
}
kernel spread(p: field halo 1, q: field halo 1, m: field halo 1, out r: field, out s: field, c, hx: param) {
  r = p - 0.3*(1 - (c + 1)*p + p^2*q + 0.05*((m + m[+1])/2*(p[+1] - p) - (m[-1] + m)/2*(p - p[-1]))/hx^2)
  s = q - 0.3*(c*p - p^2*q + 0.02*(q[-1] - 2*q + q[+1])/hx^2)
}
kernel couple(p: field halo 1, q: field halo 1, m: field halo 1, out r: field, out s: field, c, hx: param) {
  r = (2 + c)*p - m*q[+1] - 0.1*p[-1]
  s = 3*q + c*p + 0.05*(q[-1] - 2*q + q[+1])/hx
}
kernel cubic(p: field halo 1, out r: field, c, hx: param) { r = p + c*p^3 - 0.02*(p[-1] - 2*p + p[+1])/hx^2 }
kernel end(u: field, p: field halo 1, q: field, out v: field, out w: field, sum e: param, c: param) {
  v = u + 0.2*c*(p[+1] - p[-1])*q
  w = q*p
  e += c*p*q
}
kernel end_one(u: field, p: field halo 1, out v: field, c: param) { v = u + 0.2*c*(p[+1] - p[-1])*p }
)";
const std::string reactions_2d = R"(
kernel begin(u: field, k: field, out b: field, out d: field, c: param) { b = u; d = k + 0.1*c*u }
kernel spread(p: field halo 1, q: field, out r: field, out s: field, c, hx, hy: param) {
  r = p - 0.3*(1 - (c + 1)*p + p^2*q + 0.02*(p[+1, 0] - 2*p + p[-1, 0])/hx^2 + 0.02*(p[0, +1] - 2*p + p[0, -1])/hy^2)
  s = q - 0.3*(c*p - p^2*q)
}
kernel end(u: field, p: field halo 1, q: field, out v: field, c: param) {
  v = u + 0.2*c*(p[+1, 0] - p[0, -1]) + 0.3*c*p*q
}
)";

std::vector<ProgramCase> coupled_cases() {
  const adjoint::Activity all{{"u", "k"}, {"c"}};
  const std::string ends = "fill p x.low = 0.4, x.high = zero_gradient; run end; swap u, v; keep w }";
  return {
      {"solve for two fields, periodic", 1,
       reactions +
           "program p { run begin; solve r, s = b, d for p, q { fill p periodic; fill q periodic; run couple }; "
           "fill p periodic; run end; swap u, v; keep w }",
       all},
      {"solve for two fields between walls, coefficients of it", 1,
       reactions +
           "program p { run begin; solve r, s = b, d for p, q { fill p x.low = 0, x.high = zero_gradient; fill "
           "q x = zero_gradient; run couple }; " +
           ends,
       all},
      {"newton in each cell", 1,
       reactions + "program p { run begin; newton r, s = b, d for p, q { run react }; " + ends, all},
      {"newton periodic",
       1,
       reactions + "program p { run begin; newton r, s = b, d for p, q { fill p periodic; fill q periodic; fill m "
                   "periodic; run spread }; fill p periodic; run end; swap u, v; keep w }",
       {{"u", "k", "m"}, {"c"}}},
      {"weights that vary, in a newton",
       1,
       reactions +
           "program p { run begin; newton r, s = b, d for p, q { fill p x.low = 0.3, x.high = mixed(c, 0.7, "
           "0.2); fill q x = zero_gradient; fill m x = zero_gradient; run spread }; " +
           ends,
       {{"u", "k", "m"}, {"c"}}},
      {"newton for one field, of another newton", 1,
       reactions +
           "program p { run begin; newton r = b for p { fill p x = zero_gradient; run cubic }; newton r_2 = p for "
           "q { fill q x = 0.2; run cubic_2 }; fill q x = 0.2; run end_2; swap u, v } "
           "kernel cubic_2(q: field halo 1, out r_2: field, c, hx: param) { r_2 = q + c*q^3 - 0.02*(q[-1] - 2*q + "
           "q[+1])/hx^2 } kernel end_2(u: field, q: field halo 1, out v: field, c: param) { v = u + 0.2*c*(q[+1] - "
           "q[-1])*q }",
       all},
      {"newton in a repeat", 1,
       reactions +
           "program p { repeat 3 { run begin; newton r = b for p { fill p periodic; run cubic }; fill p periodic; "
           "run end_one; swap u, v } }",
       all},
      {"newton in 2-D", 2,
       reactions_2d + "program p { run begin; newton r, s = b, d for p, q { fill p x periodic, y.low = 0.3, y.high = "
                      "zero_gradient; run spread }; fill p x periodic, y.low = 0.3, y.high = zero_gradient; run end; "
                      "swap u, v }",
       all},
  };
}

}  // namespace

std::vector<ProgramCase> solve_cases() {
  std::vector<ProgramCase> cases = linear_cases();
  std::ranges::move(coupled_cases(), std::back_inserter(cases));
  return cases;
}

}  // namespace dpde::testing
