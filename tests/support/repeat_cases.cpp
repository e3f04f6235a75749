// SPDX-License-Identifier: Apache-2.0
// Programs with repeats.
#include "support/program_cases.h"
#include "support/program_texts.h"

namespace dpde::testing {

std::vector<ProgramCase> repeat_cases() {
  const std::string counted = "fill u x.low = b*(k + t), x.high = gradient(0.1*k); run step; swap u, v";
  return {

      {"repeat periodic",
       1,
       jacobi_kernels + "program p { run begin; repeat 5 { fill w periodic; run jacobi; swap w, v }; swap u, w }",
       {{"u"}, {"c"}}},
      {"repeat bounded",
       1,
       jacobi_kernels + "program p { run begin; repeat 3 { fill w x.low = 0.3, x.high = gradient(0.2); run jacobi; "
                        "swap w, v }; swap u, w }",
       {{"u"}, {"c"}}},
      {"repeat in repeat",
       2,
       repeated_steps + "program p { repeat 2 { fill u x periodic, y = zero_gradient; run slow; repeat 3 { fill w x "
                        "periodic, y = 0.5; run fast; swap w, q }; "
                        "reduce m = mean w over x; run both; swap u, v } }",
       {{"u"}, {"c"}}},
      {"repeat with what it leaves alone and adds to",
       1,
       passing_kernels +
           "program p { run begin; fill b x = 0.2; repeat 3 { fill u x.low = c, x.high = gradient(0.1); run source; "
           "swap u, v }; keep s }",
       {{"u", "b"}, {}}},
      {"repeat with what it leaves alone, periodic",
       1,
       passing_kernels + "program p { run begin; fill b periodic; repeat 4 { fill u periodic; run source; swap u, v }; "
                         "run wall; swap u, h; keep s }",
       {{"u", "b"}, {"c"}}},
      {"repeat with walls of its own",
       1,
       passing_kernels + "program p { repeat 3 { run edge grow 1; fill u x = h; run between; swap u, v } }",
       {{"u"}, {"c"}}},
      {"repeat on walls",
       1,
       passing_kernels +
           "program p { repeat 2 { fill u x.low = on_wall(0.3), x.high = on_wall(gradient(0.2)); run wall; run "
           "between; swap u, v } }",
       {{"u"}, {"c"}}},
      {"repeat with a maximum",
       1,
       passing_kernels + "program p { axes x periodic; repeat 3 { reduce m = max u; run most; swap u, v } }",
       {{"u"}, {"c"}}},
      {"repeat of two steps back",
       1,
       passing_kernels + "program p { repeat 3 { fill u periodic; run leap; swap old, u; swap u, v } }",
       {{"u", "old"}, {"c"}}},
      {"repeat with places",
       1,
       passing_kernels + "program p { repeat 2 { run zero; run give; fill r x = zero_gradient; run take; swap u, v } }",
       {{"u"}, {"c"}}},
      {"repeat that leaves a halo alone",
       1,
       "kernel begin(u: field, out w: field) { w = 0.3*u }\nkernel step(w: field, u: field, out v: field) { v = "
       "0.5*w*u }\nkernel fin(u: field halo 1, w: field, out n: field) { n = w + 0.2*u[-1] }\n"
       "program p { fill u x = 0; run begin; repeat 2 { run step; swap w, v }; run fin; swap u, n }",
       {{"u"}, {}}},
      {"repeat that fills a halo otherwise",
       1,
       "kernel begin(u: field halo 1, out w: field) { w = 0.3*u[-1]^2 + 0.1*u[+1]*u }\nkernel step(w: field, u: field "
       "halo 1, out v: field) { v = 0.5*w*u[+1] }\n"
       "program p { fill u x = 2; run begin; repeat 2 { fill u x = 0; run step; swap w, v }; swap u, w }",
       {{"u"}, {}}},
      {"repeat that fills a halo otherwise, one axis periodic",
       2,
       "kernel begin(u: field halo 1, out w: field) { w = 0.3*u[-1, 0]^2 + 0.1*u[0, +1]*u }\nkernel step(w: field, u: "
       "field halo 1, out v: field) { v = 0.5*w*u[+1, +1] }\n"
       "program p { fill u x periodic, y = 2; run begin; repeat 2 { fill u x periodic, y = 0; run step; swap w, v }; "
       "swap u, w }",
       {{"u"}, {}}},
      {"repeat that counts", 1, counting + "program p { repeat k in 0 .. 3 { " + counted + " } }", {{"u"}, {"c"}}},
      {"repeat that counts down", 1, counting + "program p { repeat k in 4 .. 0 { " + counted + " } }", {{"u"}, {"c"}}},
      {"repeat that counts in one that counts",
       1,
       counting +
           "kernel half(u: field, out w: field, n: param) { w = u/(1 + n) }\nprogram p { repeat n in 2 .. 0 { run "
           "half; repeat k in 0 .. 2 { fill w x = b*n + 0.1*k; run step2; swap w, v }; swap u, w } }",
       {{"u"}, {"c"}}},
  };
}

}  // namespace dpde::testing
