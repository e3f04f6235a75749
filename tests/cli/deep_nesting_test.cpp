// SPDX-License-Identifier: Apache-2.0
// Each function and operator nested 40 deep, everywhere formulas are allowed: work that doubles per level would never
// end.
#include <fmt/format.h>

#include <functional>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using DeepNesting = Command;

constexpr int levels = 40;

struct Kind {
  std::string name;
  std::function<std::string(const std::string& inner, const std::string& of, int level)> nested;
  bool by_day = false;
};

std::vector<Kind> kinds() {
  std::vector<Kind> result;
  for (const std::string fn : {"sin", "cos", "atan", "tanh", "abs", "fraction"}) {
    result.push_back({fn, [fn](const auto& e, const auto&, int) { return fmt::format("{}({})", fn, e); }, fn == "sin"});
  }
  for (const std::string fn : {"tan", "asin", "acos", "sinh", "cosh", "exp", "sign", "floor"}) {
    result.push_back({fn, [fn](const auto& e, const auto&, int) { return fmt::format("{}(0.1*{} + 0.3)", fn, e); }});
  }
  for (const std::string fn : {"log", "sqrt"}) {
    result.push_back({fn, [fn](const auto& e, const auto&, int) { return fmt::format("{}({} + 2)", fn, e); }});
  }
  for (const std::string fn : {"min", "max"}) {
    const auto nested = [fn](const auto& e, const auto& of, int level) {
      return fmt::format("{}({}, {} + 0.01*{})", fn, e, of, level);
    };
    result.push_back({fn, nested, fn == "max"});
  }
  for (const std::string op : {"+", "-", "*", "/", "^"}) {
    result.push_back({op, [op](const auto& e, const auto&, int level) {
                        return level % 2 == 0 ? "(1.1 " + op + " " + e + ")" : "(" + e + " " + op + " 1.5)";
                      }});
  }
  for (const std::string op : {"<", "<=", ">", ">=", "==", "!="}) {
    const auto nested = [op](const auto& e, const auto&, int) { return fmt::format("if({} {} 0.5, 1, 0)", e, op); };
    result.push_back({op, nested, op == "<"});
  }
  for (const std::string op : {"and", "or"}) {
    result.push_back({op, [op](const auto& e, const auto& of, int) {
                        return fmt::format("if({} > 0.5 {} {} > 0, 1, 0)", e, op, of);
                      }});
  }
  result.push_back({"if_yes", [](const auto& e, const auto& of, int level) {
                      return fmt::format("if({} > 0.01*{}, {}, 0.5)", of, level, e);
                    }});
  result.push_back({"if_no",
                    [](const auto& e, const auto& of, int level) {
                      return fmt::format("if({} > 2 + 0.01*{}, 0.5, {})", of, level, e);
                    },
                    true});
  result.push_back({"minus", [](const auto& e, const auto&, int) { return fmt::format("-(0.5*{})", e); }});
  return result;
}

std::string nested(const Kind& kind, const std::string& of) {
  std::string text = of;
  for (int level = 0; level < levels; ++level) text = kind.nested(text, of, level);
  return text;
}

/// A right-hand side, an initial state, a coefficient, values of a side, a mask and an event, a speed, an observable
/// and a loss. Non-differentiable functions are left out of losses and of right-hand sides with a gradient.
std::string scene_of(const Kind& kind) {
  const auto of = [&](const std::string& what) { return nested(kind, what); };
  const bool has_derivative = kind.name != "floor" && kind.name != "sign" && of("u").find("1, 0") == std::string::npos;
  return fmt::format(R"(model m {{
  field u, w
  coefficient c
  mask solid
  param k = 0.1
  dt(u) = k*lap(u) + 0.001*c*({})
  dt(w) = 0
  w = {} inside solid
}}
scheme q {{ time = euler }}
scene s : m with q {{
  grid x = 0 .. 1, cells 8
  solid = x < 0.5
  initial u = {}
  initial w = 0
  c = {}
  boundary u: x.low = {}, x.high = 0.3
  boundary w: x = zero_gradient
  time 0 .. 0.02, step 0.01, courant 0.5, speed 1e-9*({})
  after step: w = {}
  observe o = mean({})
}}
task t : s {{ unknown k; unknown initial u from 0.3; minimise mean(u^2){} }}
)",
                     kind.name == "floor" ? "u" : of("u"), of("x"), of("(0.3 + 0.1*x)"), of("(0.3 + x)"),
                     of("(0.2 + t)"), of("(0.3 + u)"), of("(0.2 + u)"), of("u"),
                     has_derivative ? " + mean(" + of("u") + ")" : "");
}

/// A chain of lets, each using the one before, and the same in a kernel, where lets are kept.
std::string lets_of(const std::string& next) {
  std::string lets = "let a0 = u\n";
  for (int level = 1; level <= levels; ++level)
    lets += fmt::format("  let a{} = {}\n", level, fmt::vformat(next, fmt::make_format_args(level - 1)));
  return lets;
}

TEST_F(DeepNesting, EndsInEveryPlace) {
  for (const Kind& kind : kinds()) {
    if (!kind.by_day && !is_thorough()) continue;
    write("deep.dpde", scene_of(kind));
    for (const std::string command :
         {"check deep.dpde s --no-cache", "run deep.dpde s --quiet", "run deep.dpde s --quiet --backend interpreter",
          "gradient deep.dpde t --force"}) {
      const Outcome outcome = shell("timeout 60 $DPDE " + command);
      EXPECT_LT(outcome.status, 2) << kind.name << ": " << command << "\n" << outcome.err;
    }
  }
}

TEST_F(DeepNesting, LetsOfModelsAndKernels) {
  const std::string model = "model m {{ field u\n  {}  dt(u) = -u + 0.01*a40 }}\n";
  const std::string kernel =
      "kernel k(u: field, out v: field, dt: param) {{\n  {}  v = u + dt*a40\n}}\nprogram m {{ run k; swap u, v }}\n";
  const std::string scene =
      R"(scene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = 0.7; time 0 .. 0.2, step 0.1 }
task t : s { unknown initial u from 0.3; minimise mean(u^2) at t = 0.2 }
)";
  std::vector<std::string> texts{fmt::format(fmt::runtime(model), lets_of("sin(0.3*a{0} + 0.1)")) + scene};
  for (const std::string next : {"sin(a{0})", "if(a{0} > 0.5, a{0}, 0.5*a{0})", "max(a{0}, u*a{0})",
                                 "if(u > 0.5, sin(a{0}*u + 0.1*a{0})*u + tanh(a{0}*u), 0.5*a{0}*u*u + cos(a{0}))"})
    texts.push_back(fmt::format(fmt::runtime(kernel), lets_of(next)) + scene);
  for (const std::string& text : texts) {
    write("lets.dpde", text);
    const Outcome outcome = shell("timeout 60 $DPDE gradient lets.dpde t --force");
    EXPECT_EQ(outcome.status, 0) << text << outcome.err;
  }
}

/// Texts that expand to more than can be compiled are refused immediately.
TEST_F(DeepNesting, SquaresOfSquaresAreRefused) {
  const std::string deep = "f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(f(";
  for (const std::string of : {"u", "k"}) {
    const std::string value = deep + of + std::string(30, ')');
    write("large.dpde",
          "function f(a) = 0.5*a*a\nmodel m { field u; param k = 1; dt(u) = -u + dx(" + value +
              ") }\nscene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = 1; time 0 .. 0.1, step 0.1 }\n");
    const Outcome outcome = shell("timeout 60 $DPDE check large.dpde s");
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("E0317"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace dpde::testing
