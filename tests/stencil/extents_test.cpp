// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/extents.h"

#include <string>

#include "stencil_text.h"

namespace dpde::stencil {
namespace {

/// How far beyond a wall the stored values need u, where the kernel runs two cells beyond it. What is read under a
/// condition needs no more, also by lets, and by lets of lets, whose values elsewhere are not used.
TEST(Extents, AreThoseOfTheValuesThatAreUsed) {
  struct Case {
    const char* body;
    int extent;
  };
  const Case cases[] = {
      {"w = u", 2},
      {"w = u[-1]", 3},
      {"w = if(inside[0], u[-1], 0)", 1},
      {"w = if(inside[-1], u[-1], 0)", 0},
      {"w = if(inside[-1], 0, u[-1])", 3},
      {"w = if(inside[0] and u > 0, u, 0)", 2},
      {"let a = u[-1]\n w = if(inside[-1], a, 0)", 0},
      {"let a = u[-1]\n w = if(inside[0], a, 0) + if(inside[-1], a, 0)", 1},
      {"let a = u[-1]\n w = if(inside[0], a, 0) + a", 3},
      {"let a = u[-1]\n let b = a*u\n w = if(inside[0] and inside[-1], b, 0)", 0},
      {"let a = u[-1]\n let b = if(inside[0], a, 1)\n w = b", 1},
      {"let a = u[-1]\n let b = if(inside[0], 1, 2)\n w = if(inside[-1], a*b, 0)", 0},
  };
  for (const Case& c : cases) {
    const Module module = module_of(std::string("kernel k(u: field halo 1, out w: field) {\n ") + c.body + "\n}");
    const auto extents = extents_of(module.kernels.front(), 2, {Topology::bounded});
    EXPECT_EQ(extents.at("u"), c.extent) << c.body;
  }
}

/// Many uses under different conditions take no more time than the text is long: 2^20 paths lead to u. They then count
/// as uses without conditions.
TEST(Extents, ManyUsesOfALetAreNoNewWork) {
  std::string lets = "let a0 = u\n";
  for (int i = 1; i <= 20; ++i) {
    const std::string before = "a" + std::to_string(i - 1), offset = "inside[+" + std::to_string(i) + "]";
    lets += "let a" + std::to_string(i) + " = if(" + offset + ", " + before + ", 2*" + before + ")\n";
  }
  const Module module = module_of("kernel k(u: field, out w: field) {\n" + lets + "w = if(inside[0], a20, 0)\n}");
  EXPECT_EQ(extents_of(module.kernels.front(), 2, {Topology::bounded}).at("u"), 2);
}

}  // namespace
}  // namespace dpde::stencil
