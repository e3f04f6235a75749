// SPDX-License-Identifier: Apache-2.0
// Given adjoints, from the model to the gradient: the numbers equal those of derived adjoints, and a wrong one stops
// the command.
#include <cmath>
#include <regex>

#include "command_support.h"

namespace dpde::testing {
namespace {

class GivenAdjointCommand : public Command {
 protected:
  static std::string replaced(const std::string& text, const std::string& a, const std::string& b) {
    const std::string result = std::regex_replace(text, std::regex(a), b);
    EXPECT_NE(result, text) << a;
    return result;
  }
  static std::string derived(const std::string& text) {
    return std::regex_replace(text, std::regex("\n  adjoint [^\n]*"), "");
  }
  static std::string operator_text() {
    return content(fs::path(DPDE_SOURCE_DIR) / "tests/golden/given_adjoint/in.dpde");
  }

  /// Loss and gradients: for fields norm and largest value.
  std::vector<double> numbers(const std::string& file, const std::string& more) {
    const Outcome outcome = dpde("gradient " + file + " --json " + more);
    EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const Json json = outcome.json();
    std::vector<double> values{json.value("loss", NAN)};
    for (const Json& of_unknown : json["gradient"]) {
      for (const Json& number : of_unknown) values.push_back(number.is_number() ? number.get<double>() : NAN);
    }
    return values;
  }
};

/// Also on grids of 1, 2, 3 cells, on one and two axes, with and without walls.
TEST_F(GivenAdjointCommand, GradientsAreThoseThatAreDerived) {
  const std::string periodic =
      replaced(replaced(operator_text(), "cells 8", "cells 8, periodic"), "  boundary [^\n]*\n", "");
  write("walls.dpde", operator_text());
  write("around.dpde", periodic);
  write("walls_derived.dpde", derived(operator_text()));
  write("around_derived.dpde", derived(periodic));
  for (const std::string name : {"walls", "around"}) {
    for (const std::string more :
         {"--set cells=1", "--set cells=2", "--set cells=3", "", "--backend cpp", "--set time=rk4", "--set time=ab2"}) {
      const std::vector<double> a = numbers(name + ".dpde", more), b = numbers(name + "_derived.dpde", more);
      ASSERT_EQ(a.size(), b.size());
      ASSERT_GE(a.size(), 4u) << "loss and three gradients";
      for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_NEAR(a[i], b[i], 1e-13 * std::max(1.0, std::abs(b[i]))) << name << " " << more << " " << i;
    }
  }
}

TEST_F(GivenAdjointCommand, IsCertified) {
  write("walls.dpde", operator_text());
  const Outcome outcome = dpde("verify walls.dpde t --json");
  EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
  EXPECT_TRUE(outcome.json()["passed"].get<bool>());
}

TEST_F(GivenAdjointCommand, AWrongOneStopsWhateverMakesAGradient) {
  write("wrong.dpde", replaced(operator_text(), "smooth_bar \\+ a", "smooth_bar - a"));
  for (const char* command :
       {"verify wrong.dpde t", "gradient wrong.dpde t", "gradient wrong.dpde t --no-certify", "optimize wrong.dpde t",
        "build wrong.dpde t -o made", "gradient wrong.dpde t --backend cpp"}) {
    const Outcome outcome = dpde(std::string(command) + " --json");
    EXPECT_NE(outcome.status, 0) << command;
    const std::vector<std::string> codes = outcome.codes();
    ASSERT_FALSE(codes.empty()) << command;
    EXPECT_EQ(codes[0], "E0606") << command;
    const Json told = outcome.json()["diagnostics"][0];
    EXPECT_EQ(told["line"], 3);
    EXPECT_NE(told["message"].get<std::string>().find("smooth is not its transpose: tangent and adjoint differ by"),
              std::string::npos)
        << told;
  }
  EXPECT_EQ(dpde("run wrong.dpde s").status, 0) << "no gradient, no adjoint";
}

/// Of fields of two equations, of results of another application, of expressions, and displaced by a derivative.
TEST_F(GivenAdjointCommand, TwiceInOneStepAndInDerivatives) {
  const std::string text = R"(
operator upwind(u, c) order 1 = c*(u - u[-1, 0])
  adjoint u_bar = c*upwind_bar - c[+1, 0]*upwind_bar[+1, 0]
  adjoint c_bar = (u - u[-1, 0])*upwind_bar
model m {
  field u, v
  param nu
  dt(u) = -upwind(u, v) + dx(upwind(v*u, u)) + nu*lap(u)
  dt(v) = -upwind(upwind(v, u), u) + upwind(u, u) - upwind(v, 2)
}
scene s : m {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 3
  boundary u: all = 0.2
  boundary v: x.low = 0.1*y, x.high = gradient(0.3), y = zero_gradient
  initial u = sin(3*x)*y
  initial v = x + y^2
  nu = 0.03
  time 0 .. 1/16, step 1/64
}
scheme rk { time = rk2 }
task t : s {
  unknown initial u
  unknown initial v
  unknown nu
  minimise mean(u^2 + upwind(u, v)^2)
}
)";
  write("twice.dpde", text);
  write("derived.dpde", derived(text));
  write("around.dpde", replaced(replaced(text, "cells 5", "cells 5, periodic"),
                                "cells 3\n  boundary [^\n]*\n  boundary [^\n]*", "cells 3, periodic"));
  write("around_derived.dpde", derived(content(path("around.dpde"))));
  for (const std::string name : {"twice", "around"}) {
    const Outcome outcome = dpde("verify " + name + ".dpde t --json");
    EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
  }
  for (const auto& [a, b] :
       {std::pair("twice.dpde", "derived.dpde"), std::pair("around.dpde", "around_derived.dpde")}) {
    const std::vector<double> given = numbers(a, ""), plain = numbers(b, "");
    ASSERT_EQ(given.size(), plain.size());
    for (std::size_t i = 0; i < given.size(); ++i)
      EXPECT_NEAR(given[i], plain[i], 1e-13 * std::max(1.0, std::abs(plain[i]))) << a << " " << i;
  }
}

/// The lines of an adjoint may use the spacing, even if the operator does not.
TEST_F(GivenAdjointCommand, ReadsTheSpacingOfTheGrid) {
  const std::string text = R"(
operator rise(u) order 1 = (1 + u)*(u - u[-1])
  adjoint u_bar = (1 + 2*u - u[-1])*rise_bar - (1 + u[+1])*rise_bar[+1]*hx/hx
model m { field u; dt(u) = -rise(u) }
scene s : m {
  grid x = 0 .. 1, cells 8
  boundary u: x = 0.2
  initial u = sin(3*x)
  time 0 .. 1/4, step 1/16
}
task t : s { unknown initial u; minimise mean(u^2) }
)";
  write("spaced.dpde", text);
  write("derived.dpde", derived(text));
  const std::vector<double> given = numbers("spaced.dpde", ""), plain = numbers("derived.dpde", "");
  ASSERT_EQ(given.size(), plain.size());
  for (std::size_t i = 0; i < given.size(); ++i) EXPECT_NEAR(given[i], plain[i], 1e-14) << i;
  write("twice.dpde", replaced(text, "hx/hx", "hx"));
  EXPECT_EQ(dpde("gradient twice.dpde t").status, 2);
}

/// Passes of a repeat can turn two inputs of a kernel into one field: its adjoint is the sum of both.
TEST_F(GivenAdjointCommand, OfInputsThatARepeatMakesOne) {
  const std::string text = R"(
kernel mul(u: field, w: field halo 1, out v: field) {
  v = 0.1*u*(w[-1] + 0.3*w[+1]) + 0.5*w
  adjoint u_bar = 0.1*v_bar*(w[-1] + 0.3*w[+1])
  adjoint w_bar = 0.1*v_bar[+1]*u[+1] + 0.03*v_bar[-1]*u[-1] + 0.5*v_bar
}
kernel begin(u: field, out w: field) { w = u + 0.1 }
program step {
  run begin
  repeat 3 { fill w x = 0.4; run mul; swap w, v; swap u, v }
  swap u, w
}
scene s : step {
  grid x = 0 .. 1, cells 8
  initial u = 0.5 + 0.2*sin(pi*x)
  time 0 .. 1/4, step 1/16
}
task t : s { unknown initial u; minimise mean((u - 0.2)^2) at t = 1/4 }
)";
  write("both.dpde", text);
  write("one.dpde", replaced(text, "  adjoint w_bar[^\n]*\n", ""));
  write("derived.dpde", derived(text));
  const std::vector<double> plain = numbers("derived.dpde", "");
  for (const char* file : {"both.dpde", "one.dpde"}) {
    const std::vector<double> given = numbers(file, "");
    ASSERT_EQ(given.size(), plain.size()) << file;
    for (std::size_t i = 0; i < given.size(); ++i)
      EXPECT_NEAR(given[i], plain[i], 1e-13 * std::max(1.0, std::abs(plain[i]))) << file << " " << i;
  }
}

TEST_F(GivenAdjointCommand, SaysWhereItCannotStand) {
  const std::string body = "operator f(u) order 1 = u[-1] + u\n  adjoint u_bar = f_bar[+1] + f_bar\n";
  const std::string rest = "scene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = x; time 0 .. 1, step 1 }\n";
  const auto codes = [&](const std::string& text) {
    write("wrong.dpde", text);
    return dpde("run wrong.dpde --set step=0.001 --set end=0.001 --json").codes();
  };
  const std::vector<std::string> none, not_here{"E0311"}, bad{"E0371"};
  EXPECT_EQ(codes(body + "model m { field u; dt(u) = f(u*u) }\n" + rest), none);
  EXPECT_EQ(codes(body + "model m { field u on faces.x; dt(u) = f(u) }\n" + rest), none);
  const std::string body_2 = "operator f(u) order 1 = u[-1, 0] + u\n  adjoint u_bar = f_bar[+1, 0] + f_bar\n";
  const std::string rest_2 =
      "scene s : m { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells 2; boundary u: all = 0; initial u = x; "
      "time 0 .. 1, step 1 }\n";
  EXPECT_EQ(codes(body_2 + "model m { field u; dt(u) = f(u) + dy(f(u)) }\n" + rest_2), none);
  EXPECT_EQ(codes(body_2 + "model m { field u; dt(u) = f(mean(u, x)) }\n" + rest_2), not_here);
  EXPECT_EQ(codes(body_2 + "model m { field u; dt(u) = f(u^2) }\n" + rest_2), not_here)
      << "walls along one of two axes";
  EXPECT_EQ(codes(body + "model m { vector u; dt(u) = f(u) }\n" + rest), none);
  EXPECT_EQ(codes("operator f(u) order 1 = u[-1]\n  adjoint v_bar = f_bar\nmodel m { field u; dt(u) = f(u) }\n" + rest),
            bad);
  EXPECT_EQ(
      codes("operator f(u) order 1 = u[-1]\n  adjoint u_bar = f_bar[-1]\nmodel m { field u; dt(u) = f(u) }\n" + rest),
      bad);
  EXPECT_EQ(
      codes("operator f(u) order 2 = mean(u)\n  adjoint u_bar = f_bar\nmodel m { field u; dt(u) = f(u) }\n" + rest),
      not_here);
}

/// A line for a field would be ignored if the argument is a number, and the derived adjoint certified.
TEST_F(GivenAdjointCommand, OfNumbersIsWrittenAsASum) {
  const auto outcome = [&](const std::string& lines, const std::string& argument, const std::string& unknown = "k") {
    write("n.dpde", "operator f(u, k) order 0 = k*u^2\n" + lines +
                        "model m { field u; coefficient c; param k = 0.7; dt(u) = -f(u, " + argument +
                        ") + 0*c + 0*k }\nscene s : m { grid x = 0 .. 1, cells 4, periodic; c = 1; initial u = 1 + x; "
                        "time 0 .. 0.1, step 0.1 }\ntask t : s { unknown " +
                        unknown + "; minimise mean(u^2) }\n");
    return dpde("gradient n.dpde t --json");
  };
  const std::vector<std::string> none, bad{"E0371"};
  const std::string as_field = "  adjoint k_bar = u^2*f_bar\n", as_number = "  adjoint k_bar += u^2*f_bar\n";
  EXPECT_EQ(outcome(as_field, "k").codes(), bad);
  EXPECT_EQ(outcome(as_field, "2*k").codes(), bad);
  EXPECT_EQ(outcome(as_number, "k").codes(), none);
  for (const char* formula : {"2*k", "k*t", "sin(k)"}) EXPECT_EQ(outcome(as_number, formula).codes(), bad) << formula;
  EXPECT_EQ(outcome(as_field + as_number, "k").codes(), none);
  EXPECT_EQ(outcome(as_field, "c").codes(), none);
  EXPECT_EQ(outcome(as_number, "c").codes(), bad);
  EXPECT_EQ(outcome(as_field, "k", "initial u").codes(), none) << "nothing goes to k";
  EXPECT_EQ(outcome(as_field, "0.7").codes(), none);
}

TEST_F(GivenAdjointCommand, IsFormattedAsItStands) {
  const std::string text =
      "# a filter\noperator f(u) order 1 = u[-1] + u  # beside\n  # why\n  adjoint u_bar=f_bar[+1]+f_bar\n\nfunction "
      "g(x) = x\n";
  write("f.dpde", text);
  ASSERT_EQ(dpde("fmt f.dpde").status, 0);
  const std::string once = content(path("f.dpde"));
  EXPECT_NE(once.find("operator f(u) order 1 = u[-1] + u\n  adjoint u_bar = f_bar[+1] + f_bar"), std::string::npos)
      << once;
  for (const char* comment : {"# a filter", "# beside", "# why"})
    EXPECT_NE(once.find(comment), std::string::npos) << once;
  EXPECT_NE(once.find("\n\nfunction g(x) = x\n"), std::string::npos) << once;
  ASSERT_EQ(dpde("fmt f.dpde").status, 0);
  EXPECT_EQ(content(path("f.dpde")), once);
}

}  // namespace
}  // namespace dpde::testing
