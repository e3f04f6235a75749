// SPDX-License-Identifier: Apache-2.0
// Programs whose ghost cells lie half a turn away, across a pole.
#include "support/program_cases.h"
#include "support/program_texts.h"

namespace dpde::testing {

std::vector<ProgramCase> pole_cases() {
  return {
      {"poles",
       2,
       burgers_2d_kernel + "program p { fill u x periodic, y = pole; fill v x periodic, y = opposite_pole; run k; "
                           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"a pole and a wall",
       2,
       burgers_2d_kernel + "program p { fill u x.low = opposite_pole, x.high = 0.4, y periodic; fill v x.low = pole, "
                           "x.high = gradient(1), y periodic; run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"poles, wide",
       2,
       "kernel k(u: field halo 3, out w: field, c: param) { w = c*u[-3, 0]*u[0, +3] + u[0, -2]^2 - u[-1, +1] }\n"
       "program p { fill u x.low = pole, x.high = zero_gradient, y periodic; run k; swap u, w }",
       {{"u"}, {"c"}}}};
}

}  // namespace dpde::testing
