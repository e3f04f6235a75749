// SPDX-License-Identifier: Apache-2.0
#include "random/model_ties.h"

#include <fmt/format.h>

namespace dpde::testing {

namespace {

/// "max(s, s[+1])" of two texts.
std::string choice(int kind, const std::string& one, const std::string& other) {
  switch (kind) {
    case 0: return fmt::format("max({}, {})", one, other);
    case 1: return fmt::format("min({}, {})", one, other);
    case 2: return fmt::format("if({0} > {1}, {0}, {1})", one, other);
    case 3: return fmt::format("if({0} <= {1}, 1.5*({0}), {1} + 0.5*({0}))", one, other);
    case 4: return fmt::format("(abs({0} - ({1})) + {0} + {1})", one, other);
    default: return fmt::format("if(({0})*({1}) < 0, 0, min(abs({0}), abs({1})))", one, other);
  }
}

std::string neighbour(const std::string& name, std::size_t rank, std::size_t axis, const char* step) {
  std::string offsets;
  for (std::size_t a = 0; a < rank; ++a) offsets += std::string(a == 0 ? "" : ", ") + (a == axis ? step : "0");
  return fmt::format("{}[{}]", name, offsets);
}

}  // namespace

std::string tie_operator(SplitMix& random, const std::vector<std::string>& axes) {
  const auto axis = static_cast<std::size_t>(random.below(static_cast<int>(axes.size())));
  const auto up = [&](const char* name) { return neighbour(name, axes.size(), axis, "+1"); };
  const auto down = [&](const char* name) { return neighbour(name, axes.size(), axis, "-1"); };
  const int kind = random.below(6);
  const std::string body = random.percent(70) ? fmt::format("({}*({} - g) - {}*(g - {}))", choice(kind, "s", up("s")),
                                                            up("g"), choice(kind, down("s"), "s"), down("g"))
                                              : fmt::format("g*{}", choice(kind, up("s") + " - s", "s - " + down("s")));
  return fmt::format("operator tie(g, s) order 0 = {}/h{}", body, axes[axis]);
}

Part tie_term(SplitMix& random, const std::string& self, const std::vector<std::string>& fields) {
  const auto any = [&] {
    return expression(fields[static_cast<std::size_t>(random.below(static_cast<int>(fields.size())))]);
  };
  const Part a = any(), b = any(), number = expression(fmt::format("{:.3g}", random.uniform(0.3, 1.7)));
  Part speed;
  switch (random.below(5)) {
    case 0: speed = expression("(abs(@/(1.5 + @^2)) + sqrt(1 + @*@^2))", {a, b, number, a}); break;
    case 1: speed = expression("(@*@^2 + @*@*0.7)", {number, a, b, b}); break;
    case 2: speed = expression("sqrt(@^2 + @*@^2 + 0.3)", {a, number, b}); break;
    case 3: speed = expression("(abs(@)*@ + @*@*0.3)", {a, number, a, b}); break;
    default: speed = expression("(@*@*@ - @*@)", {a, a, a, number, b}); break;
  }
  return expression("0.1*tie(@, @)", {expression(self), speed});
}

}  // namespace dpde::testing
