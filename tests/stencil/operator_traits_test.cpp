// SPDX-License-Identifier: Apache-2.0
// What is known of the operators of solves whatever their coefficients are. References: each by the sums of its rows
// and columns, on paper.
#include "stencil/analyse/operator_traits.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "stencil/stencil_text.h"

namespace dpde::stencil {
namespace {

struct Case {
  std::string image;  // of w, by a field c and parameters a, k, v, hx
  std::string fill;
  std::string traits;  // S: symmetric, Z: constants to 0, C: columns sum to 0
};

std::string letters(const OperatorTraits& traits) {
  return std::string(traits.is_symmetric ? "S" : "") + (traits.takes_constants_to_zero ? "Z" : "") +
         (traits.sums_to_zero ? "C" : "");
}

OperatorTraits certain_traits(const Case& one) {
  const bool has_field = one.image.find('c') != std::string::npos;
  const std::string ends = one.fill == "periodic" ? "periodic" : "x = zero_gradient";
  const Module module =
      module_of(std::string("kernel left(w: field halo 2, ") + (has_field ? "c: field halo 2, " : "") +
                "out image: field, a, k, v, hx: param) {\n  image = " + one.image +
                "\n}\nprogram step {\n  solve image = u for w {\n" + (has_field ? "    fill c " + ends + "\n" : "") +
                "    fill w " + one.fill + "\n    run left\n  }\n  swap u, w\n}\n");
  const Program& program = module.programs.front();
  return certain_traits_of(module, program, std::get<Solve>(program.body.front()));
}

TEST(OperatorTraits, AreThoseOfAllCoefficients) {
  const std::string lap = "(w[-1] - 2*w + w[+1])/hx^2",
                    wide = "(-w[-2] + 16*w[-1] - 30*w + 16*w[+1] - w[+2])/(12*hx^2)",
                    flux = "((c + c[+1])*(w[+1] - w) - (c[-1] + c)*(w - w[-1]))/(2*hx^2)",
                    slope = "(w[+1] - w[-1])/(2*hx)";
  const std::vector<Case> cases{
      {lap, "periodic", "SZC"},
      {lap, "x = 0", "S"},
      {lap, "x = zero_gradient", "SZC"},
      {lap, "x.low = zero_gradient, x.high = 0", "S"},
      {lap, "x = mixed(a, k, 0)", "S"},
      {lap, "x = linear", "Z"},
      {wide, "periodic", "SZC"},
      {wide, "x = zero_gradient", "SZC"},
      {wide, "x = mixed(a, k, 0)", ""},
      {flux, "periodic", "SZC"},
      {flux, "x = zero_gradient", "SZC"},
      {flux, "x = 0", "S"},
      {"c*" + lap, "periodic", "Z"},
      {lap + " - k*w", "periodic", "S"},
      {"w - a*" + lap, "periodic", "S"},
      {lap + " - (k - k)*w", "periodic", "SZC"},
      {lap + " + v*" + slope, "periodic", "ZC"},
      {lap + " + c*" + slope, "periodic", "Z"},
      {lap + " + (c[+1]*w[+1] - c[-1]*w[-1])/(2*hx)", "periodic", "C"},
      {lap + " + v*" + slope, "x = zero_gradient", "Z"},
      {lap + " - if(c > 3, w, 0)", "periodic", ""},
      {"max(c, 0)*" + lap, "periodic", ""},
      {"k*w", "periodic", "S"},
      {"0.00001*" + lap, "periodic", "SZC"},
      {lap + " - 0.00001*w", "periodic", "S"},
      // a term that values near 1 hide: nothing is said
      {lap + " - exp(-1000*c^2)*w", "periodic", ""},
      {"(1 + tanh(200*c))*" + lap, "periodic", ""},
      {lap + " - c^900*w", "periodic", ""},
      {lap + " - a^k*w", "periodic", ""},
      {lap + " - 0.0000000000001*w", "periodic", ""},
      {"0.00000000000001*c*" + lap, "periodic", ""},
  };
  for (const Case& one : cases) EXPECT_EQ(letters(certain_traits(one)), one.traits) << one.image << "; " << one.fill;
}

}  // namespace
}  // namespace dpde::stencil
