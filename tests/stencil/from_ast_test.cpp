// SPDX-License-Identifier: Apache-2.0
// What is said about wrong kernels, programs and loops: code, message, the words it points at, and the hint.
#include "stencil/text/from_ast.h"

#include <fmt/format.h>

#include "stencil_text.h"

namespace dpde::stencil {
namespace {

const std::string kernels = R"(kernel smooth(u: field halo 1, out v: field) { v = u[-1] + u[+1] }
kernel flat(u: field, out w: field) on 2 axes { w = u }
kernel more(u: field, inout v: field) { v += u }
)";

TEST(StencilFromAst, SolvesAreRead) {
  const auto in_solve = [](const std::string& head, const std::string& block, const std::string& rest = "") {
    const std::vector<std::string> all = complaints(
        "kernel k(w: field halo 1, out r: field) { r = w[-1] - 2*w + w[+1] } "
        "kernel s(w: field, out r: field, sum e: param) { r = w; e += w } "
        "kernel c(u: field, out r: field) { r = u } kernel x(w: field, out x: field) { x = w }" +
        rest + "program p { " + head + " { " + block + " }; keep w }");
    return all.empty() ? std::string() : all.front();
  };
  EXPECT_EQ(in_solve("solve r = u for w by cg tolerance 1e-8", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r = u for w by multigrid smoother chebyshev", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("solve r = u for w from u by cg", "fill w periodic; run k"), "");
  EXPECT_EQ(in_solve("newton r = u for w", "fill w periodic; run k"), "");
}

}  // namespace
}  // namespace dpde::stencil
