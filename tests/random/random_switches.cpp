// SPDX-License-Identifier: Apache-2.0
#include "random/random_switches.h"

#include <fmt/format.h>

#include <vector>

#include "support/split_mix.h"

namespace dpde::testing {

namespace {

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed), has_grid_(random_.percent(40)) {}

  SwitchModel make() {
    const std::string in_u = term(2), in_v = random_.percent(50) ? term(2) : "0";
    const std::string start = random_.percent(20) ? "0.2*(" + switching(0, false) + ")" : "0";
    const std::string event = random_.percent(30) ? " at t = 0.25: u = 0.5*u + 0.2*(" + switching(0, true) + ")\n" : "";
    const std::string loss = random_.percent(20) ? " + " + mean(switching(0, true)) : "";
    std::string unknowns = "unknown a; ";
    if (seeks_b_) unknowns += "unknown b; ";
    if (seeks_q_) unknowns += "unknown q; ";
    if (random_.percent(30)) unknowns += "unknown initial u; ";
    SwitchModel result{"", may_jump_, seeks_q_};
    result.text = fmt::format(
        "model m {{ field u, v; param a = {:.3f}, b = {:.3f}, q = {:.3f}\n dt(u) = -a*u + {}*({})\n dt(v) = 0.3*u - "
        "b*v + "
        "0.2*a + {}*({})\n}}\nscene s : m {{\n{} initial u = {:.3f}{} + {}\n initial v = {:.3f}\n{} time 0 .. 1, step "
        "1/{}\n}}\ntask t : s {{ {}minimise {} }}\n",
        random_.uniform(0.3, 0.9), random_.uniform(0.2, 0.8), random_.uniform(0.2, 0.7), number(), in_u, number(), in_v,
        has_grid_ ? " grid x = 0 .. 1, cells 5, periodic\n" : "", random_.uniform(0.3, 1.2),
        has_grid_ ? " + 0.5*sin(2*pi*x)" : "", start, random_.uniform(0.2, 0.8), event, random_.percent(50) ? 16 : 32,
        unknowns, mean("u^2 + u*v") + loss);
    return result;
  }

 private:
  std::string number() { return fmt::format("{:.3f}", random_.uniform(0.3, 1)); }
  std::string mean(const std::string& e) const { return has_grid_ ? "mean(" + e + ")" : e; }

  /// Of values that vary, of order one.
  std::string smooth() {
    switch (random_.below(5)) {
      case 0: return "u";
      case 1: return "(v - 0.3*u)";
      case 2: return "sin(u + a)";
      case 3: return "(a + 0.5*t)";
      default: return number();
    }
  }

  struct Side {
    std::string value;  // the condition is value > 0
    bool moves;
  };
  Side side(bool has_states) {
    const std::string place = has_states ? "t" : has_grid_ ? "x" : "0.45";  // initial states know no time
    switch (random_.below(has_states ? 6 : 3)) {
      case 0: return {place + (seeks_b_ ? " - b" : " - 0.4"), seeks_b_};
      case 1: return {place + " - q", seeks_q_};
      case 2: return {has_grid_ ? "x - 0.45" : place + " - 0.6", false};
      case 3: return {fmt::format("u - {}", number()), true};
      case 4: return {fmt::format("v - {}*a", number()), true};
      default: return {fmt::format("u*v - {}", number()), true};
    }
  }

  /// An expression that switches; `depth`: how many more may stand in its branches.
  std::string switching(int depth, bool has_states) {
    const auto inner = [&] {
      return depth > 0 && random_.percent(40) ? "(" + switching(depth - 1, has_states) + ")"
             : has_states                     ? smooth()
                                              : number();
    };
    Side one = side(has_states), other = side(has_states);
    for (Side* side : {&one, &other}) side->value = "(" + side->value + ")";
    const bool meets = random_.percent(75);
    if (!meets) may_jump_ = may_jump_ || one.moves || other.moves;
    const std::string yes = inner(), jump = number();
    switch (random_.below(6)) {
      case 0:
        return meets ? fmt::format("{0}*sign({0})*{1}", one.value, number())
                     : fmt::format("{}*sign({})", jump, one.value);
      case 1:
        return meets ? fmt::format("if({0} > 0 and {1} > 0, {2} + {0}*{1}, {2})", one.value, other.value, yes)
                     : fmt::format("if({0} > 0 and {1} > 0, {2} + {3}, {2})", one.value, other.value, yes, jump);
      case 2:
        return meets ? fmt::format("if({0} < 0 or {1} < 0, {2}, {2} + {0}*{1})", one.value, other.value, yes)
                     : fmt::format("if(not ({0} < 0 or {1} < 0), {2}, {2} + {3})", one.value, other.value, yes, jump);
      case 3:
        return meets ? fmt::format("max({}, 0)*{}", one.value, yes)
                     : fmt::format("{}*fraction({} + {})", jump, one.value, number());
      default:
        return meets ? fmt::format("if({0} > 0, {1} + {0}*{2}, {1})", one.value, yes, number())
                     : fmt::format("if({0} > 0, {1}, {1} - {2})", one.value, yes, jump);
    }
  }

  std::string term(int depth) { return switching(random_.below(depth + 1), true); }

  SplitMix random_;
  bool has_grid_, seeks_b_ = random_.percent(50), seeks_q_ = random_.percent(25);
  bool may_jump_ = false;
};

}  // namespace

SwitchModel random_switches(std::uint64_t seed) { return Maker(seed).make(); }

}  // namespace dpde::testing
