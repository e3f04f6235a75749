// SPDX-License-Identifier: Apache-2.0
#include "support/program_cases.h"

#include <algorithm>
#include <iterator>

#include "support/program_texts.h"

namespace dpde::testing {

using adjoint::Activity;

std::vector<ProgramCase> program_cases() {
  const Activity u_nu{{"u"}, {"nu"}};
  const std::string bounded = "fill u x.low = 0.3, x.high = zero_gradient\n";
  std::vector<ProgramCase> cases{
      {"burgers periodic", 1, burgers_kernel + "program p { fill u periodic; run k; swap u, v }", u_nu},
      {"burgers bounded", 1, burgers_kernel + "program p { " + bounded + "run k; swap u, v }", u_nu},
      {"wide periodic", 1, wide + "program p { fill u periodic; run k; swap u, v }", {{"u"}, {"c"}}},
      {"wide bounded", 1, wide + "program p { " + bounded + "run k; swap u, v }", {{"u"}, {"c"}}},
      {"burgers 2-D periodic",
       2,
       burgers_2d_kernel + "program p { fill u periodic; fill v periodic; run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D mixed",
       2,
       burgers_2d_kernel +
           "program p { fill u x periodic, y.low = 1, y.high = 0.2; fill v x periodic, y = zero_gradient; run k; "
           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D bounded",
       2,
       burgers_2d_kernel +
           "program p { fill u x = 0.5, y.low = 1, y.high = zero_gradient; fill v x = zero_gradient, y = 0; run k; "
           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"two stages periodic",
       1,
       two_stages + "program p { fill u periodic; fill kappa periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"two stages bounded",
       1,
       two_stages + "program p { fill u x = 1.2; fill kappa x = zero_gradient; run s1; fill w x.low = 0.7, x.high = "
                    "zero_gradient; "
                    "run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"interp periodic",
       1,
       interp_kernels + "program p { fill u periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp bounded",
       1,
       interp_kernels +
           "program p { fill u x = 0.4; run s1; fill w x.low = 0.4, x.high = zero_gradient; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp 2-D periodic",
       2,
       interp_2d_kernels + "program p { fill w periodic; fill q periodic; run s2; keep v }",
       {{"w", "q"}, {"c"}}},
      {"interp 2-D bounded",
       2,
       interp_2d_kernels +
           "program p { fill w x = 0.3, y periodic; fill q x = zero_gradient, y periodic; run s2; keep v }",
       {{"w", "q"}, {"c"}}},
      {"maccormack periodic",
       1,
       maccormack_kernels + "program p { fill u periodic; run ahead; fill a periodic; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"maccormack bounded",
       1,
       maccormack_kernels + "program p { fill u x.low = 0.4, x.high = zero_gradient; run ahead; "
                            "fill a x.low = 0.4, x.high = zero_gradient; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"maccormack 2-D mixed",
       2,
       maccormack_2d_kernels + "program p { fill u x = zero_gradient, y periodic; run ahead; "
                               "fill a x = zero_gradient, y periodic; run back; swap u, v }",
       {{"u", "w"}, {"c"}}},
      {"cubic periodic",
       1,
       cubic_kernels + "program p { fill u periodic; fill q periodic; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic bounded",
       1,
       cubic_kernels + "program p { fill u x.low = 0.4, x.high = gradient(0.3); fill q x.low = 0.8, x.high = "
                       "zero_gradient; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 2-D mixed",
       2,
       cubic_2d_kernels +
           "program p { fill u x = 0.3, y periodic; fill q x = zero_gradient, y periodic; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 2-D bounded",
       2,
       cubic_2d_kernels +
           "program p { fill u x = zero_gradient, y = 0.2; fill q x = 0.8, y = zero_gradient; run s2; keep v }",
       {{"u", "q"}, {"c"}}},
      {"cubic 3-D mixed",
       3,
       cubic_3d_kernel + "program p { fill u x = 0.3, y periodic, z = zero_gradient; run s2; swap u, v }",
       {{"u"}, {"c"}}},
      {"a place behind a condition",
       1,
       "kernel k(u: field halo 1, out v: field, c: param) { v = if(u > 0.8, interp(u, c*log(u - 0.7)), u^2) }\n"
       "program p { fill u x = 0.4; run k; keep v }",
       {{"u"}, {"c"}}},
      {"heat 3-D",
       3,
       heat_3d_kernel + "program p { fill u x periodic, y.low = 1, y.high = zero_gradient, z = 0; run k; swap u, v }",
       {{"u"}, {"nu"}}},
      {"halo read by the adjoint only",
       1,
       "kernel k(d: field halo 1, u: field, q: field, out v: field, c: param) { v = d*q^2 - c*min(u, 1)*(d[+1] - d)*u "
       "}\n"
       "program p { fill d periodic; run k; swap d, v }",
       {{"d", "u", "q"}, {"c"}}},
      {"scalar parameter only", 1, burgers_kernel + "program p { fill u x = 0.2; run k; keep v }", {{}, {"nu", "dt"}}},
      {"symplectic mixed",
       2,
       symplectic + "program p { fill u x periodic, y = 0.3; run a; fill pn x periodic, y = zero_gradient; run b; "
                    "swap p, pn; swap u, un }",
       {{"p", "u"}, {"c"}}},
      {"symplectic periodic",
       2,
       symplectic + "program p { fill u periodic; run a; fill pn periodic; run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c"}}},
      {"gradient and mixed",
       1,
       two_stages + "program p { fill u x.low = gradient(g), x.high = mixed(a, 2*g, dt); fill kappa x = 1; run s1; "
                    "fill w x.low = mixed(1, 0.3, 0.1), x.high = gradient(0.4); run s2; swap u, v }",
       {{"u", "kappa"}, {}}},
      {"gradient and mixed 2-D",
       2,
       burgers_2d_kernel +
           "program p { fill u x periodic, y.low = gradient(1), y.high = mixed(1, 2, 0.2); fill v x periodic, "
           "y.low = mixed(2, 1, nu0), y.high = gradient(-1); run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"straight lines",
       1,
       two_stages + "program p { fill u x = linear; fill kappa x.low = linear, x.high = zero_gradient; run s1; "
                    "fill w x.low = mixed(1, 0.3, 0.1), x.high = linear; run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"slopes at cells, wide",
       1,
       wide + "program p { fill u x.low = gradient_at_cell(0.4), x.high = gradient_at_cell(-0.2); run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"straight lines, wide", 1, wide + "program p { fill u x = line(1.4); run k; swap u, v }", {{"u"}, {"c"}}},
      {"straight lines 2-D",
       2,
       burgers_2d_kernel + "program p { fill u x periodic, y = linear; fill v x periodic, "
                           "y.low = gradient(1), y.high = linear; run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"weights that vary beside straight lines",
       2,
       burgers_2d_kernel + "program p { fill u x.low = mixed(nu, 1, 0.3), x.high = linear, y = linear; fill v x = "
                           "linear, y = mixed(1, nu, 0.2); run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"straight lines beyond a fold",
       1,
       "kernel k(u: field, out w: field, c: param) { w = c*u^2 }\n"
       "program p { fill u x = linear; run k grow 2; fold w grow 2 x = linear; keep w }",
       {{"u"}, {"c"}}},
      {"straight lines on walls",
       1,
       walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = linear; fill u x.low = on_wall(linear), x.high = "
           "on_wall(mixed(1, 0.4, wc)); run k; fill un x.low = on_wall(wc), x.high = on_wall(linear); swap e, en; swap "
           "u, un }",
       {{"e", "u"}, {"g"}}},
      {"open walls",
       1,
       walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = outflow; fill u x.low = on_wall(linear), x.high = "
           "on_wall(outflow); run k; fill un x.low = on_wall(wc), x.high = on_wall(outflow); swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"straight lines on nodes",
       3,
       node_kernels + "program p { run wall grow 1; fill w x.low = on_wall(linear), x.high = on_wall(0.3), y "
                      "periodic, z = on_wall(linear); run k; "
                      "fill q x = on_wall(linear), y periodic, z.low = on_wall(wc), z.high = on_wall(linear); run s; "
                      "keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"waves that leave",  // dt(u) + c*du/dn = 0 at the walls: their values are a state, in the cells next to them
       1,
       "kernel edge(w: field, out at_wall: field) on 1 axes { at_wall = w }\n"
       "kernel move(v: field, u: field halo 1, out v_next: field, c, dt, hx: param) { v_next = v + dt*c^2*(u[-1] - 2*u "
       "+ "
       "u[+1])/hx^2 }\n"
       "kernel shift(u: field, v_next: field, w: field, out u_next: field, out w_next: field, c, dt, hx: param) { "
       "u_next "
       "= u + dt*v_next; w_next = w - 2*dt*c*(w - u)/hx }\n"
       "program p { fill w x = zero_gradient; run edge grow 1; fill u x = at_wall; run move; run shift; swap u, "
       "u_next; "
       "swap v, v_next; swap w, w_next }",
       {{"u", "v", "w"}, {"c"}}},
      {"values along a wall",
       1,
       walls_kernel + two_stages +
           "program p { run wall grow 2; fill u x.low = wc, x.high = mixed(1, 2, wc); fill kappa x = gradient(wc); run "
           "s1; "
           "fill w x.low = gradient(wc), x.high = 0.7; run s2; swap u, v }",
       {{"u", "kappa"}, {"a", "g"}}},
      {"a wall alone",
       1,
       walls_kernel + "kernel k(u: field halo 3, out v: field) { v = u[-3]*u[+2] + sin(u) }\n"
                      "program p { run wall grow 3; fill u x = wc; run k; keep v }",
       {{}, {"g"}}},
      {"weights that vary",
       1,
       walls_kernel + two_stages +
           "program p { run wall grow 2; fill u x.low = mixed(a, 2*g, wc), x.high = mixed(a*g + dt, sin(g), 0.2); fill "
           "kappa x = mixed(1, g, 0.3); run s1; "
           "fill w x.low = mixed(if(g > 0.5, a, a^2), 1, wc), x.high = mixed(1, a, wc); run s2; swap u, v }",
       {{"u", "kappa"}, {"a", "g"}}},
      {"weights that vary, wide",
       1,
       "kernel k(u: field halo 3, out v: field) { v = u[-3]*u[+2] + sin(u)*u[+3] }\n"
       "program p { fill u x = mixed(a, 1 + b, 0.3); run k; keep v }",
       {{}, {"a", "b"}}},
      {"weights that vary 2-D",
       2,
       walls_2d_kernel + symplectic +
           "program p { run wall grow 2; fill u x.low = mixed(g, 1, wc), x.high = mixed(1, g, wc), y.low = wc, y.high "
           "= mixed(1, c0, 0.2); run a; "
           "fill pn x = 0.3, y.low = mixed(c0, 1, wc), y.high = gradient(0.2); run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c0", "g"}}},
      {"weights that vary, corners",
       2,
       "kernel k(u: field halo 1, out v: field) { v = u[+1, +1]*u[-1, +1] + u[+1, -1]*u + u[-1, -1] }\n"
       "program p { fill u x = mixed(1, a, 0.3), y = mixed(a, b, 0.5); run k; keep v }",
       {{"u"}, {"a", "b"}}},
      {"weights that vary, mixed axes",
       2,
       walls_2d_kernel + cross_kernel +
           "program p { run wall grow 1; fill u x periodic, y.low = mixed(1, g, wc), y.high = mixed(c0, 0.5, 1); run "
           "k; swap u, v }",
       {{"u"}, {"g", "c0"}}},
      {"weights that vary 3-D",
       3,
       heat_3d_kernel + "program p { fill u x periodic, y = mixed(1, a, 0.4), z.low = mixed(b, a, 0), z.high = 0; run "
                        "k; swap u, v }",
       {{"u"}, {"nu", "a", "b"}}},
      {"weights that vary, interpolated",
       1,
       interp_kernels + "program p { fill u x = mixed(1, a, 0.4); run s1; fill w x.low = mixed(a, 1, 0.4), x.high = "
                        "zero_gradient; run s2; swap u, v }",
       {{"u"}, {"nu", "c", "a"}}},
      {"values along walls 2-D",
       2,
       walls_2d_kernel + symplectic +
           "program p { run wall grow 2; fill u x.low = gradient(wc), x.high = mixed(1, 0.5, wc), y = wc; run a; "
           "fill pn x = 0.3, y.low = wc, y.high = gradient(0.2); run b; swap p, pn; swap u, un }",
       {{"p", "u"}, {"c0", "g"}}},
      {"values along walls, mixed axes",
       2,
       walls_2d_kernel + cross_kernel + "program p { run wall grow 1; fill u x periodic, y = wc; run k; swap u, v }",
       {{"u"}, {"g"}}},
      {"values along walls, interpolated",
       2,
       walls_2d_kernel + interp_2d_kernels +
           "program p { run wall grow 1; fill w x.low = wc, x.high = gradient(wc), y periodic; fill q x = "
           "zero_gradient, y periodic; "
           "run s2; keep v }",
       {{"w", "q"}, {"c0", "g"}}},
      {"staggered",
       1,
       staggered_kernel +
           "program p { fill e x = zero_gradient; fill u x = on_wall(c); run k; swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"staggered, two walls",
       1,
       walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(wc), x.high = on_wall(c); "
           "run k; swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"staggered 2-D",
       2,
       staggered_2d_kernel +
           "program p { fill e x = zero_gradient, y = zero_gradient; fill u x = on_wall(c), y = zero_gradient; "
           "fill v x = 0, y = on_wall(c); run k; swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"staggered 2-D, one axis periodic",
       2,
       staggered_2d_kernel + "program p { fill e x periodic, y = zero_gradient; fill u x periodic, y = 0.2; fill v x "
                             "periodic, y = on_wall(c); "
                             "run k; swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"nodes",
       3,
       node_kernels + "program p { run wall grow 1; fill w x.low = on_wall(wc), x.high = on_wall(0.3), y periodic, z = "
                      "on_wall(wc); run k; "
                      "fill q x = on_wall(0.4), y periodic, z = on_wall(wc); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"slopes on walls",
       1,
       walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(gradient(wc)), x.high = "
           "on_wall(mixed(1, 0.4, wc)); run k; "
           "fill un x = on_wall(zero_gradient); swap e, en; swap u, un }",
       {{"e", "u"}, {"g"}}},
      {"slopes on walls 2-D",
       2,
       staggered_2d_kernel + "program p { fill e x = zero_gradient, y = zero_gradient; fill u x = "
                             "on_wall(gradient(c)), y = zero_gradient; "
                             "fill v x = 0, y.low = on_wall(c), y.high = on_wall(zero_gradient); run k; fill vn x = "
                             "0.2, y = on_wall(zero_gradient); swap e, en; swap u, un; swap v, vn }",
       {{"e", "u", "v"}, {"g"}}},
      {"slopes on nodes",
       3,
       node_kernels + "program p { run wall grow 1; fill w x.low = on_wall(gradient(wc)), x.high = on_wall(0.3), y "
                      "periodic, z = on_wall(mixed(0.7, 0.2, wc)); run k; "
                      "fill q x = on_wall(zero_gradient), y periodic, z.low = on_wall(wc), z.high = "
                      "on_wall(gradient(wc)); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"weights that vary on walls",
       1,
       walls_kernel + staggered_kernel +
           "program p { run wall grow 2; fill e x = zero_gradient; fill u x.low = on_wall(mixed(1 + g, g^2, wc)), "
           "x.high = on_wall(mixed(c, 1, 0.3)); run k; "
           "swap e, en; swap u, un }",
       {{"e", "u"}, {"g", "c"}}},
      {"weights that vary on nodes",
       3,
       node_kernels + "program p { run wall grow 1; fill w x.low = on_wall(mixed(g, 1, wc)), x.high = on_wall(mixed(1, "
                      "c, 0.3)), y periodic, z = on_wall(mixed(0.7, g, wc)); run k; "
                      "fill q x = on_wall(mixed(1, g, 0.2)), y periodic, z.low = on_wall(wc), z.high = "
                      "on_wall(zero_gradient); run s; keep vn }",
       {{"w", "q"}, {"c", "g"}}},
      {"weights that vary on walls only",
       2,
       "kernel s(u: field, sum e: param) on 2 axes { e += u^2 }\n"
       "program p { fill u x.low = on_wall(0.7), x.high = on_wall(mixed(a, b, 0.4)), y = on_wall(mixed(1, a, 0.3)); "
       "run s }",
       {{"u"}, {"a", "b"}}},
      {"read on the walls only",
       2,
       "kernel s(u: field, q: field, sum e: param) on 2 axes { e += u^2*q }\n"
       "program p { fill u x = on_wall(0.7), y = on_wall(0.3); run s }",
       {{"u", "q"}, {}}},
      {"waves",
       1,
       "program p { axes x periodic; transform u by c*ikx + nu*ikx^2/(1 + c) within two_thirds, "
       "u by heaviside0(ikx^2 + 9)*(c*ikx + 1) to v; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"waves, exponentials",
       1,
       "kernel n(u: field halo 1, out w: field, c: param) { w = c*u*(u[+1] - u[-1]) }\n"
       "program p { fill u periodic; run n; transform u by phi0(dt*(nu*ikx^2 - 0.01*c*ikx^3)), w by "
       "phi1(dt*nu*ikx^2)*(dt), w by phi3(0.1*c*ikx)*(c*dt*ikx - nu), u by c to v; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"waves, high exponentials",
       1,
       "program p { axes x periodic; transform u by phi9(c*ikx^2)*(360000), w by phi6(nu*ikx)*(700*c) to v; swap u, v "
       "}",
       {{"u", "w"}, {"nu", "c"}}},
      {"waves divided",
       2,
       "program p { axes x periodic, y periodic; transform u by inverse1(ikx^2 + iky^2 + c*ikx*iky)*(a + c*ikx), w by "
       "inverse2(2 + nu - 0.1*ikx^2 - 0.2*iky^2 + c*ikx) to v; swap u, v }",
       {{"u", "w"}, {"a", "nu", "c"}}},
      {"waves read around",
       2,
       "kernel s(u: field, out w: field) { w = u^2 }\n"
       "kernel k(g: field halo 1, u: field, out v: field) { v = u + g[+1, 0]*g[0, -1] }\n"
       "program p { axes x periodic, y periodic; run s; transform w by 0.01*ikx^2 + 0.01*a*iky*ikx, u by 0.1*ikx to g; "
       "fill g "
       "periodic; run k; swap u, v }",
       {{"u"}, {"a"}}},
      {"waves along one axis",
       2,
       "kernel k(g: field halo 1, u: field, out v: field) { v = u + g[+1, 0]*g[0, -1] }\n"
       "program p { transform u by a*iky, u by phi1(c*iky^2) to g; fill g x = 0.3, y periodic; run k; "
       "swap u, v }",
       {{"u"}, {"a", "c"}}},
      {"waves in 3-D",
       3,
       "program p { axes x periodic, y periodic, z bounded; transform u by ikx^2 + a*iky^4, w by a*ikx^3*iky to v; "
       "swap u, v }",
       {{"u", "w"}, {"a"}}},
      {"waves in passes",
       1,
       "program p { axes x periodic; repeat 3 { transform u by phi0(c*ikx^2) to v; swap u, v } }",
       {{"u"}, {"c"}}},
      {"mean field periodic",
       1,
       mean_field_kernels +
           "program p { fill u periodic; run a; reduce m = mean u; reduce p = max w; run k; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"mean field bounded",
       1,
       mean_field_kernels + "program p { fill u x.low = 0.4, x.high = zero_gradient; run a; reduce m = mean w; reduce "
                            "p = min u; run k; swap u, v; keep w, m }",
       {{"u"}, {"nu", "c"}}},
      {"a result reduced",
       1,
       "kernel k(u: field halo 1, out v: field, c: param) { v = u*u[+1] + c }\n"
       "kernel s(v: field, m: field, inout n: field, sum e: param) { n += m*v; e += m^2 }\n"
       "program p { fill u x = 0.2; run k; reduce m = mean v; reduce n = sum v; run s; swap u, v; keep n }",
       {{"u"}, {"c"}}},
      {"zonal means periodic",
       2,
       zonal_kernels + "program p { fill u periodic; run a; reduce m = mean w over x; fill m periodic; reduce q = max "
                       "u over y; run k; swap u, v }",
       {{"u"}, {"c"}}},
      {"zonal means bounded",
       2,
       zonal_kernels + "program p { fill u x = 0.3, y.low = 1, y.high = zero_gradient; run a; reduce m = mean w over "
                       "y; fill m x = 0.1, y = zero_gradient; "
                       "reduce q = min u over x; run k; swap u, v; keep m }",
       {{"u"}, {"c"}}},
      {"zonal means, one axis periodic",
       2,
       zonal_kernels + "program p { fill u x periodic, y = gradient(0.1); run a; reduce m = mean w over x; fill m x "
                       "periodic, y = 0.5; "
                       "reduce q = max m over y; run k; keep v }",
       {{"u"}, {"c"}}},
      {"planes and lines",
       3,
       planes_kernel +
           "program p { axes x periodic, y bounded, z bounded; reduce a = mean u over x, y; reduce b = mean u over y; "
           "fill b x periodic, y = zero_gradient, z = 0.2; reduce d = max u over x, z; reduce e = min b over z; run k; "
           "swap u, v }",
       {{"u"}, {"c"}}},
      {"the rest of the planes and lines",
       3,
       planes_kernel +
           "program p { fill u x = 0.3, y periodic, z periodic; reduce a = mean u over x; reduce b = max u over y, z; "
           "fill b x = zero_gradient, y periodic, z periodic; reduce d = sum u over x; reduce e = mean a over y; run "
           "k; swap u, v }",
       {{"u"}, {"c"}}},
      {"a fold behind a fill",
       1,
       "kernel k(u: field, out w: field, c: param) { w = c*u^2 }\n"
       "program p { fill u x.low = 0.3, x.high = gradient(0.2); run k grow 1; fill w x.low = 0.1, x.high = "
       "zero_gradient; "
       "fold w grow 1 x.low = 0, x.high = zero_gradient; keep w }",
       {{"u"}, {"c"}}},
      {"alike",
       1,
       alike_kernels +
           "program p { fill u periodic; run a; fill w periodic; run b; fill q periodic; run d; swap u, v }",
       {{"u"}, {"c", "nu"}}},
      {"alike, bounded",
       1,
       alike_kernels + "program p { fill u x = 0.3; run a; fill w x = c; run b; fill q x = 0.3; run d; swap u, v }",
       {{"u"}, {"nu"}}},
      {"alike scatters",
       1,
       alike_scatters + "program p { axes x periodic; run zero; run a; run b; keep s, r }",
       {{"u"}, {"c"}}},
      {"shared values periodic",
       1,
       shared_kernels + "program p { fill u periodic; run k; swap u, v; keep r }",
       {{"u", "a", "b"}, {"c"}}},
      {"shared values bounded",
       1,
       shared_kernels + "program p { fill u x.low = 0.3, x.high = gradient(0.2); run k; swap u, v; keep r }",
       {{"u", "a", "b"}, {"c"}}},
      {"shared values in two kernels",
       1,
       shared_kernels + "program p { fill u periodic; run k; fill a periodic; fill r periodic; run l; keep v, w }",
       {{"u", "a", "d"}, {"c"}}},
      {"shared values of two fields",
       1,
       shared_kernels + "program p { fill u x = zero_gradient; fill v x.low = 0.2, x.high = gradient(0.1); run zero; "
                        "run both; swap u, p; keep q }",
       {{"v", "a", "b"}, {}}},
      {"shared values, one axis periodic",
       2,
       shared_2d_kernels + "program p { fill u x periodic, y = 0.3; run k; swap u, v }",
       {{"u", "a", "b"}, {"c"}}},
      {"shared values beyond walls",
       2,
       shared_2d_kernels + "program p { fill u x = 0.2, y = zero_gradient; fill a x = 0.9, y = 1.1; fill b x = "
                           "zero_gradient, y = 1; fill d x = 1.2, y = zero_gradient; run k grow 1; run use; keep r }",
       {{"u", "b"}, {"c"}}},
      {"kinks", 1, kinks + "program p { fill u periodic; run k; keep v }", {{"u"}, {"c"}}},
      {"kinks bounded", 1, kinks + "program p { fill u x.low = 0.6, x.high = 1.3; run k; keep v }", {{"u"}, {"c"}}},
  };
  for (const auto& others : {repeat_cases(), pole_cases()}) std::ranges::copy(others, std::back_inserter(cases));
  std::ranges::move(solve_cases(), std::back_inserter(cases));
  return cases;
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
