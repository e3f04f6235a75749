// SPDX-License-Identifier: Apache-2.0
#include "support/program_cases.h"

namespace dpde::testing {

std::vector<ProgramCase> network_cases() {
  const std::string net =
      "network net(2) -> 1 { padding x periodic; let a = conv(in, 3, 3); let b = tanh(a); out = conv(b, 1, 5) }\n";
  const std::string net_of_walls =
      "network net(2) -> 1 { padding x reflect; let a = conv(in, 3, 3); let b = gelu(a); out = conv(b, 1, 5) }\n";
  const std::string kernels =
      "kernel a(u: field halo 1, out w: field, c: param) { w = c*u^2 - u[-1] }\n"
      "kernel k(u: field, w: field, n: field halo 1, out v: field, nu: param) { v = u + nu*(n[+1] - 2*n + n[-1])*w + n "
      "}\n";
  const std::string plane =
      "network deep(3) -> 2 { padding x periodic, y replicate; let a = conv(in, 4, 3); let b = silu(a); let p = "
      "mean_pool(b, 2); "
      "let c = conv(p, 4, 3, groups = 2); let d = upsample(c, 2); let e = add(b, d); let f = concat(e, in); let g = "
      "leaky_relu(f, 0.3); "
      "let h = conv(g, 2, 1, bias = 0); let i = fix_sum(h, 1); out = scale(i, 0.5) }\n";
  const std::string plane_kernels =
      "kernel k(u: field halo 1, p: field, q: field halo 1, out v: field, c: param) { v = u[+1, 0] + c*p*(q[0, +1] - "
      "q[-1, 0]) }\n"
      "kernel e(v: field, out w: field, nu: param) { w = nu*v^2 }\n";
  const std::string two =
      "network one(1) -> 2 { padding x zero; let a = conv(in, 3, 3, dilation = 2); let b = softplus(a); out = conv(b, "
      "2, 1) }\n"
      "network other(2) -> 1 { padding x zero; let a = conv(in, 2, 3, stride = 2); let b = sigmoid(a); let c = "
      "upsample(b, 2); out = conv(c, 1, 3) }\n";
  const std::string mirrored =
      "network mirrored(3) -> 2 { padding x periodic, y zero; let a = conv(in, 3, 3); let b = tanh(a); let c = conv(b, "
      "2, 3); "
      "let d = reorient(in, x = -x, channels = (-1, 3, 2)); let e = conv(d, 3, 3, weights = a); let f = tanh(e); let g "
      "= conv(f, 2, 3, weights = c); "
      "let h = reorient(g, x = -x, y = -y, channels = (2, -1)); let i = add(c, h); out = scale(i, 0.5) }\n";
  return {
      {"mirror images with shared weights",
       2,
       mirrored + plane_kernels +
           "program p { apply mirrored(u, w, u) to p, q; fill u x periodic, y = 0.2; fill q x periodic, y = "
           "zero_gradient; run k; keep v }",
       {{"u", "w"}, {"c", "mirrored"}}},
      {"a network",
       1,
       net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; swap u, v }",
       {{"u"}, {"c", "nu", "net"}}},
      {"fixed weights",
       1,
       net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"weights alone",
       1,
       net + kernels + "program p { fill u periodic; run a; apply net(u, w) to n; fill n periodic; run k; keep v }",
       {{}, {"net"}}},
      {"a network between walls",
       1,
       net_of_walls + kernels +
           "program p { fill u x.low = 0.3, x.high = zero_gradient; run a; apply net(w, u) to n; fill n x = "
           "zero_gradient; run k; swap u, v; keep n }",
       {{"u"}, {"c", "nu", "net"}}},
      {"one field twice", 1, net + "program p { apply net(u, u) to n; keep n }", {{"u"}, {"net"}}},
      {"a correction after the step",
       2,
       plane + plane_kernels +
           "program p { apply deep(u, u, u) to p, q; fill u x periodic, y = 0.2; fill q x periodic, y = zero_gradient; "
           "run k; run e; swap u, w }",
       {{"u"}, {"c", "nu", "deep"}}},
      {"a network of a network",
       1,
       two + "program p { axes x bounded; apply one(u) to a, b; apply other(a, b) to n; keep n, a }",
       {{"u"}, {"one", "other"}}},
      {"an output nobody reads",
       1,
       two + "program p { axes x bounded; apply one(u) to a, b; keep a }",
       {{"u"}, {"one"}}},
  };
}

}  // namespace dpde::testing
