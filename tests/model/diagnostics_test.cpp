// SPDX-License-Identifier: Apache-2.0
// Tables of formulas, and expressions too large for a file. Wording is in tests/diagnostics.
#include "model/model_support.h"

namespace dpde::model {
namespace {

std::string in_equation(const std::string& rhs, int axes = 1) {
  return outcome_of(text_with(rhs + " + 0*w*k*c", axes)).code_and_hint();
}

/// A field that stands in an integral over s as a factor or a term is that of the point, wherever s is.
TEST(Diagnostics, FieldsInIntegralsOfFormulas) {
  const auto code = [](const std::string& rate, const std::string& observed) {
    const Outcome outcome =
        outcome_of("function K(z) = exp(-8*z^2)\nmodel m { field u; coefficient c; param k = 1\n dt(u) = " + rate +
                   "\n}\nscene s : m {\n grid x = 0 .. 1, cells 8, periodic\n initial u = 1\n c = 2\n"
                   " time 0 .. 1, step 1/8\n observe e = " +
                   observed + "\n}\n");
    for (const Diagnostic& d : outcome.diagnostics) {
      if (d.kind->severity == Severity::error) return std::string(d.kind->code);
    }
    return std::string();
  };
  for (const char* formula : {"K(x - s)*u", "u", "(u^2 + s)*c", "K(s)*c", "K(x - s)/u", "-u*s", "if(s < x, dx(u), 0)",
                              "K(x - s)*(u - mean(u))", "s + k*u", "3*s*u", "s*(u*s)", "2*(u + K(s))", "(u*s)^2",
                              "u/(1 + s*u)", "if(u > 0, u, s)", "u*integral(exp(-s*r*u), r, from = 0, to = 1)"}) {
    const std::string integral = std::string("integral(") + formula + ", s, from = 0, to = 1)";
    EXPECT_EQ(code(integral + " - u", "mean(u)"), "E0311") << formula;
    EXPECT_EQ(code("-u", "mean(" + integral + ")"), "E0311") << formula;
  }
  for (const char* formula : {"K(x - s)", "exp(-s*u)", "u^s", "K(x - s)*mean(u)", "k*s", "if(s < u, s, 0)",
                              "1/(1 + s*u)", "1/(1 + 3*s*u)", "exp(-3*s*u)", "if(s < u, u, s)", "max(u, s)",
                              "(s - u)^2", "(s - u)*(s - u)", "s/(s + u)", "integral(s^r, r, from = 0, to = u)"}) {
    const std::string integral = std::string("u*integral(") + formula + ", s, from = 0, to = 1)";
    EXPECT_EQ(code(integral, "mean(u)"), "") << formula;
  }
  EXPECT_EQ(code("-u", "integral(K(s)*sample(u, at = s), s, from = 0, to = 1)"), "");
  for (const char* formula : {"s", "2*s + k", "exp(-s)*s^2"})
    EXPECT_EQ(code(std::string("integral(") + formula + ", s, from = 0, to = u)", "mean(u)"), "") << formula;
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

TEST(Diagnostics, LargeExpressionsEndQuickly) {
  EXPECT_EQ(in_equation(repeated("lap(", 150) + "u" + repeated(")", 150), 3).substr(0, 5), "E0317");
  EXPECT_EQ(in_equation(repeated("u + ", 1400) + "u").substr(0, 5), "E0317");
  EXPECT_EQ(in_equation(repeated("lap(", 7) + "u" + repeated(")", 7)), "E0327 ");
  EXPECT_EQ(in_equation(repeated("lap(", 6) + "u" + repeated(")", 6)), "0 diagnostics:");
  const std::string in_sum = "observe e = mean(" + repeated("lap(", 150) + "u" + repeated(")", 150) + ")\n";
  EXPECT_EQ(outcome_of(text_with("k*c*w*u", 3, in_sum)).code_and_hint(),
            "E0317 split it into several fields or scenes");
  EXPECT_EQ(in_equation(repeated("u + ", 700) + "u"), "0 diagnostics:");
}

}  // namespace
}  // namespace dpde::model
