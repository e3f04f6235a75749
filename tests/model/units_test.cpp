// SPDX-License-Identifier: Apache-2.0
// Units of formulas: what fits, what does not, and what is said of it.
#include "support/names/units.h"

#include <fmt/format.h>

#include <random>

#include "model/model_support.h"

namespace dpde::model {
namespace {

/// A rod in SI units. `model` and `scene` are more lines, `rhs` stands in dt(u).
std::string rod(const std::string& rhs, const std::string& model = "", const std::string& scene = "",
                const std::string& head = "") {
  return head +
         "model heat {\n  field u in K\n  param k = 1e-3 in m^2/s, q = 1 in K/s, L = 2 in m, v = 1 in m/s, free = 1\n" +
         model + "  dt(u) = " + rhs +
         "\n}\nscene rod : heat {\n  grid x = 0 .. 1 in m, cells 8, periodic\n  initial u = 1\n"
         "  time 0 .. 1 in s, step 1/8\n" +
         scene + "}\n";
}

/// "" where all fits, else the message.
std::string misfit(const std::string& text) {
  const Outcome outcome = outcome_of(text);
  if (outcome.problem) return "";
  return outcome.diagnostics.size() == 1 ? outcome.diagnostics[0].message : outcome.code_and_hint();
}
std::string misfit_of(const std::string& rhs) { return misfit(rod(rhs)); }

TEST(Units, OfEquationsFit) {
  for (const char* rhs : {"k*lap(u)",
                          "-v*dx(u) + q",
                          "q - 0.5*u*v/L",
                          "free*u",
                          "k*d(u, x, 2) + 0",
                          "q*exp(-(x/L)^2)",
                          "q*sin(2*pi*x/L)",
                          "dx(k*dx(u))",
                          "-advect(v, u)",
                          "q*(1 - u/mean(u))",
                          "sqrt(q^2 + (u*v/L)^2)",
                          "if(x > L, q, k*lap(u))",
                          "max(q, k*lap(u))",
                          "|q|",
                          "q*(x/L)^1.5",
                          "q*(x/L)^free",
                          "integral(u)*v/L^2",
                          "mean(u*v)/L",
                          "inject(q*L, at = L/4)",
                          "0.1*exp(-x/L)",
                          "q*(1 + 2*t*v/L)",
                          "u*sqrt(k/L*v)/sqrt(L*L)",
                          "div(k*grad(u))",
                          "-u*v/L + abs(q)"})
    EXPECT_EQ(misfit_of(rhs), "") << rhs;
}

TEST(Units, OfLets) {
  EXPECT_EQ(misfit(rod("flux/L", "  let flux = -k*dx(u)\n")), "");
  EXPECT_EQ(misfit(rod("flux", "  let flux = -k*dx(u)\n")), "this is in K*m/s, but dt(u) in K/s");
  EXPECT_EQ(misfit(rod("q*sin(n*x)", "  let n = 2*pi in 1/m\n")), "");
  EXPECT_EQ(misfit(rod("q", "  let n = k*u in 1/m\n")), "this is in K*m^2/s, but let n in 1/m");
  EXPECT_EQ(misfit(rod("q", "  let idle = k + u\n")), "this is in K, but k in m^2/s");
  EXPECT_EQ(misfit(rod("q", "", "  let n = 2*pi in 1/m\n  let w = cos(n*x)\n")), "");
  EXPECT_EQ(misfit(rod("q", "", "  let w = cos(2*x)\n")), "cos takes a pure number, but this is in m");
}

const std::string flow_with_units = R"(
model flow {
  vector u on faces in m/s
  field p in m^2/s^2, c in mol/L
  param nu = 1e-3 in m^2/s
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  dt(c) = -advect(u, c)
}
scene box : flow {
  grid x = 0 .. 1 in m, cells 8, periodic
  grid y = 0 .. 1 in m, cells 8, periodic
  let n = 2*pi in 1/m
  initial u = (0.1*sin(n*y), 0.1*cos(n*x))
  initial p = 0
  initial c = 1
  time 0 .. 1 in s, step 1/8
  observe energy = integral(dot(u, u))
  observe turn = max(curl(u))
}
)";

TEST(Units, OfVectors) {
  const Problem problem = problem_of(flow_with_units);
  EXPECT_EQ(problem.unit_of("u.x"), "m/s");
  EXPECT_EQ(problem.unit_of("c"), "mol/L");
  EXPECT_EQ(problem.unit_of("energy"), "m^4/s^2");
  EXPECT_EQ(problem.unit_of("turn"), "1/s");
  EXPECT_EQ(problem.unit_of("t"), "s");
  EXPECT_EQ(problem.unit_of("y"), "m");
  std::string wrong = flow_with_units;
  wrong.replace(wrong.find("m^2/s^2"), 7, "Pa");
  EXPECT_EQ(misfit(wrong), "this is in Pa/m, but dt(u) in m/s^2");
}

/// Space and velocity as axes: each derivative has its own unit.
TEST(Units, OfAxesThatDiffer) {
  const auto text = [](const std::string& rhs) {
    return "model vlasov { field f; param E = 1 in m/s^2, D = 1 in m^2/s; dt(f) = " + rhs +
           " }\nscene s : vlasov { grid x = 0 .. 1 in m, cells 8, periodic; grid y = -1 .. 1 in m/s, cells 8, "
           "periodic\n"
           "initial f = 0; time 0 .. 1 in s, step 1 }";
  };
  EXPECT_EQ(misfit(text("-y*dx(f) - E*dy(f)")), "");
  EXPECT_EQ(misfit(text("-advect((y, E), f)")), "");
  EXPECT_EQ(misfit(text("-advect((E, y), f)")), "this is in 1, but another component in 1/s^2");
}

TEST(Units, OfFunctionsOfTheFile) {
  const std::string gauss =
      "function gauss(z, w) = exp(-(z/w)^2)\nfunction bare(z) = exp(-z^2)\n"
      "operator second(f) order 2 = (f[+1] - 2*f + f[-1])/hx^2\n";
  EXPECT_EQ(misfit(rod("q*gauss(x - L, L)", "", "", gauss)), "");
  EXPECT_EQ(misfit(rod("k*second(u)", "", "", gauss)), "");
  EXPECT_EQ(misfit(rod("second(u)", "", "", gauss)), "this is in K/m^2, but dt(u) in K/s");
  EXPECT_EQ(outcome_of(rod("q*sin(a)", "  param a = 90 in deg\n")).code_and_hint(),
            "E0343 1 deg is 0.0174533: multiply by that");
  EXPECT_EQ(misfit(rod("q*bare(x)", "", "", gauss)), "exp takes a pure number, but this is in m^2");
  const std::string text = rod("q*bare(x)", "", "", gauss);
  const Outcome outcome = outcome_of(text);
  ASSERT_EQ(outcome.diagnostics.size(), 1u);
  ASSERT_EQ(outcome.diagnostics[0].notes.size(), 1u);
  EXPECT_EQ(outcome.diagnostics[0].notes[0].range.begin, static_cast<int>(text.find("bare(x)")));
}

TEST(Units, OfIntegralsOfFormulas) {
  EXPECT_EQ(misfit(rod("q*integral(exp(-s^2), s, from = 0, to = x/L)")), "");
  EXPECT_EQ(misfit(rod("integral(q*s/L^2, s, from = 0, to = L)")), "");
  EXPECT_EQ(misfit(rod("integral(q*s/L, s, from = 0, to = L)")), "this is in K*m/s, but dt(u) in K/s");
  EXPECT_EQ(misfit(rod("q*integral(exp(-s), s, from = 0, to = L)/L")), "exp takes a pure number, but this is in m");
}

TEST(Units, OfArraysAndSecondDerivatives) {
  const std::string text = R"(
model m {
  field c[2] in mol/m^3
  param D[2] = (1, 2) in m^2/s, K[2, 2] in 1/s
  field w in m
  param v in m/s
  dt(c[i]) = D[i]*lap(c[i]) + sum(K[i, j]*c[j], j)
  dt(dt(w)) = v^2*lap(w)
}
scene s : m {
  grid x = 0 .. 1 in m, cells 8, periodic
  K = ((0, 1), (1, 0))
  v = 2
  initial c = 0; initial w = 0; initial dt(w) = v
  time 0 .. 1 in s, step 1
}
)";
  const Problem problem = problem_of(text);
  EXPECT_EQ(problem.unit_of("c_2"), "mol/m^3");
  EXPECT_EQ(problem.unit_of("D_1"), "m^2/s");
  EXPECT_EQ(problem.unit_of("w_t"), "m/s");
  std::string wrong = text;
  wrong.replace(wrong.find("K[2, 2] in 1/s"), 14, "K[2, 2] in 1/m");
  EXPECT_EQ(outcome_of(wrong).diagnostics.front().message, "this is in mol/m^4, but dt(c_1) in mol/(m^3*s)");
}

TEST(Units, OfCurvedCoordinates) {
  const std::string text = R"(
model m { field u in K; param k = 1 in m^2/s, a = 6e6 in m; dt(u) = k*lap(u) }
scene ball : m {
  grid lon = 0 .. 2*pi, cells 8, periodic
  grid lat = -1 .. 1 in rad, cells 4
  coordinates sphere(a)
  boundary u: lat = 0
  initial u = cos(lat)
  time 0 .. 1 in s, step 1
  observe heat = integral(u)
}
)";
  EXPECT_EQ(problem_of(text).unit_of("heat"), "K*m^2");
  std::string wrong = text;
  wrong.replace(wrong.find("in m^2/s"), 8, "in 1/s");
  EXPECT_EQ(misfit(wrong), "this is in K/(m^2*s), but dt(u) in K/s");
  const std::string disc =
      "model m { field u in K; param k = 1 in m^2/s; dt(u) = k*lap(u) }\nscene d : m {\n"
      "grid r = 1 .. 2 in m, cells 4; grid theta = 0 .. 2*pi, cells 8, periodic\n"
      "coordinates polar; boundary u = 0; initial u = 0; time 0 .. 1 in s, step 1\n"
      "observe heat = integral(u) }";
  EXPECT_EQ(problem_of(disc).unit_of("heat"), "K*m^2");
}

TEST(Units, OfScenesMadeFromOthersStay) {
  const Selection longer{"longer"};
  const auto units = [&](const std::string& lines) {
    return problem_of(rod("k*lap(u)") + "scene longer = rod { " + lines + " }\n", longer).remarks.units;
  };
  EXPECT_EQ(units("grid x = 0 .. 2, cells 16, periodic; time 0 .. 2, step 1/8"), units(""));
  EXPECT_EQ(units("k = 2").at("k"), "m^2/s");
  const Outcome other =
      outcome_of(rod("k*lap(u)") + "scene longer = rod { grid x = 0 .. 2 in km, cells 8, periodic }\n", longer);
  ASSERT_EQ(other.diagnostics.size(), 1u);
  EXPECT_EQ(other.diagnostics[0].kind->name, "units-of-other-scale");
}

TEST(Units, OfFilesAndNetworksAreUnknown) {
  const std::string net = "network law(u) { dense out }\n";
  EXPECT_EQ(misfit(rod("law(u)", "", "", net)), "");
  EXPECT_EQ(misfit(rod("law(u + x)", "", "", net)), "this is in m, but u in K");
}

TEST(Units, OfSolvedFieldsAndMasks) {
  const auto text = [](const std::string& solved) {
    return "model m { field w in 1/s\nsolve " + solved +
           "\nmask wall\nw = 0 inside wall\ndt(w) = -bracket(psi, w) }\n"
           "scene s : m { grid x = 0 .. 1 in m, cells 8, periodic; grid y = 0 .. 1 in m, cells 8, periodic\n"
           "wall = x < 0.1\ninitial w = 0; time 0 .. 1 in s, step 1 }";
  };
  EXPECT_EQ(misfit(text("lap(psi) = -w for psi in m^2/s")), "");
  EXPECT_EQ(misfit(text("lap(psi) = -w for psi")), "");
  EXPECT_EQ(misfit(text("lap(psi) = -w for psi in m/s")),
            "2 diagnostics: E0341 this is in 1/s, but the left side in 1/(m*s);"
            " E0341 this is in 1/(m*s^2), but dt(w) in 1/s^2;");
}

TEST(Units, OfGuessesAreThoseOfTheUnknownIfIterationsBeginThere) {
  const auto text = [](const std::string& unit, const std::string& solved) {
    return "model m { field w in 1/s, g in " + unit + "\nsolve lap(psi) = -w for psi in m^2/s from g" + solved +
           "\ndt(w) = -bracket(psi, w)\ndt(g) = 0 }\nscene s : m { grid x = 0 .. 1 in m, cells 8, periodic\n"
           "grid y = 0 .. 1 in m, cells 8, periodic\ninitial w = 0; initial g = 0; time 0 .. 1 in s, step 1 }";
  };
  EXPECT_EQ(misfit(text("m^2/s", " after 5 iterations")), "");
  EXPECT_EQ(misfit(text("m", " after 5 iterations")), "this is in m, but psi in m^2/s");
  EXPECT_EQ(misfit(text("m", "")), "");  // only multiples of it are used
}

/// Names that stand for something else take its unit along: parts of lets, arguments, variables and outputs.
TEST(Units, GoWithNames) {
  const auto plane = [](const std::string& let, const std::string& rhs, const std::string& head = "") {
    return head + "model m { field u in K\nvector a in m/s\nparam k = 1 in m^2/s, L = 1 in m\nlet " + let +
           "\ndt(u) = " + rhs +
           "\ndt(a) = 0 }\nscene s : m { grid x = 0 .. 1 in m, cells 8, periodic\n"
           "grid y = 0 .. 1 in m, cells 8, periodic\ninitial u = 0; initial a = 0; time 0 .. 1 in s, step 0.01 }";
  };
  const std::string twice = "function twice(v) = v.x + v.x\noperator slope(f) order 1 = (f[+1, 0] - f)/hx\n";
  EXPECT_EQ(misfit(plane("q = k*grad(u)", "-dx(q.x) - dy(q.y)")), "");
  EXPECT_EQ(misfit(plane("q = k*grad(u)", "q.x")), "this is in K*m/s, but dt(u) in K/s");
  EXPECT_EQ(misfit(plane("q = (k, L)", "lap(u)*q.x")), "");
  EXPECT_EQ(misfit(plane("q = (k, L)", "lap(u)*q.y")), "this is in K/m, but dt(u) in K/s");
  EXPECT_EQ(misfit(plane("S = outer(a, a)", "u*S.xy/k")), "");
  EXPECT_EQ(misfit(plane("S = outer(a, a)", "u*S.xy/L")), "this is in K*m/s^2, but dt(u) in K/s");
  EXPECT_EQ(misfit(plane("q = 1", "-a.x*slope(u)", twice)), "");
  EXPECT_EQ(misfit(plane("q = 1", "slope(u)", twice)), "this is in K/m, but dt(u) in K/s");
  EXPECT_EQ(misfit(plane("q = 1", "u*twice(a)/L", twice)), "");
  EXPECT_EQ(misfit(plane("q = 1", "twice(a)*twice((k, k)/L^2)", twice)), "this is in m/s^2, but dt(u) in K/s");
  const std::string net = "network law(u) -> flux { dense out }\n";
  EXPECT_EQ(misfit(plane("q = 1", "law(u + x).flux", net)), "this is in m, but u in K");
}

/// Formulas that fit, made from the unit that they are to have; each name stands once.
class RandomFormula {
 public:
  explicit RandomFormula(unsigned seed) : random_(seed) {}

  std::string of(const Unit& unit, int depth) {
    const Unit m = *Unit::of_symbol("m"), other = any_unit();
    switch (depth > 0 ? below(11) : 0) {
      case 1: return fmt::format("({} + {})", of(unit, depth - 1), of(unit, depth - 1));
      case 2: return fmt::format("({} - 3*{})", of(unit, depth - 1), of(unit, depth - 1));
      case 3: return fmt::format("{}*({})", of(other, depth - 1), of(unit.per(other), depth - 1));
      case 4: return fmt::format("{}/({})", of(unit.times(other), depth - 1), of(other, depth - 1));
      case 5: return fmt::format("sqrt({})", of(unit.to({2, 1}), depth - 1));
      case 6: return fmt::format("({})^2", of(unit.to({1, 2}), depth - 1));
      case 7: return fmt::format("-abs({})", of(unit, depth - 1));
      case 8:
        return fmt::format("if({} < {}, {}, {})", of(other, depth - 1), of(other, depth - 1), of(unit, depth - 1),
                           of(unit, depth - 1));
      case 9: return fmt::format("dx(u*{})", of(unit.times(m).per(*Unit::of_symbol("K")), depth - 1));
      case 10:
        return fmt::format("max({}, mean(u*{}))", of(unit, depth - 1), of(unit.per(*Unit::of_symbol("K")), depth - 1));
      default: units_.push_back(unit); return fmt::format("p{}", units_.size());
    }
  }
  /// The parameters, one of them (from 0 on) with a metre too much.
  std::string lines(int wrong) const {
    std::string text;
    for (int i = 0; i < std::ssize(units_); ++i) {
      const Unit unit = i == wrong ? units_[std::size_t(i)].times(*Unit::of_symbol("m")) : units_[std::size_t(i)];
      text += fmt::format("  param p{} = 1 in {}\n", i + 1, unit.text());
    }
    return text;
  }
  int count() const { return static_cast<int>(units_.size()); }
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }

 private:
  Unit any_unit() {
    Unit unit;
    for (const char* symbol : {"m", "s", "kg"}) unit = unit.times(Unit::of_symbol(symbol)->to({below(5) - 2, 1}));
    return unit;
  }

  std::mt19937 random_;
  std::vector<Unit> units_;
};

TEST(Units, OfRandomFormulas) {
  const Unit rate = std::get<Unit>(read_unit("K/s"));
  for (unsigned seed = 0; seed < 100; ++seed) {
    RandomFormula formula(seed);
    const std::string rhs = formula.of(rate, 4);
    EXPECT_EQ(misfit(rod(rhs, formula.lines(-1))), "") << rhs << "\n" << formula.lines(-1);
    const int wrong = formula.below(formula.count());
    EXPECT_NE(misfit(rod(rhs, formula.lines(wrong))), "") << rhs << "\n" << formula.lines(wrong);
  }
}

TEST(Units, OfModelsTogether) {
  const std::string text =
      "model f { field h in m; param U = 1 in 1/s; dt(h) = -U*h }\n"
      "model g { coefficient h in UNIT; field q in K; param a = 1 in 1/(m*s); dt(q) = a*h*q }\n"
      "scene s : f, g { grid x = 0 .. 1 in m, cells 4, periodic; time 0 .. 1 in s, step 0.1; initial h = 0; initial q "
      "= 0 }\n";
  const auto with = [&](const std::string& unit) {
    std::string one = text;
    return one.replace(one.find("UNIT"), 4, unit);
  };
  EXPECT_EQ(misfit(with("m")), "");
  EXPECT_EQ(misfit(with("km")), "this is in km, but h in m: nothing converts them");
}

TEST(Units, OfDataAreThoseOfTheirScene) {
  const std::string text = rod("k*lap(u)", "", "  observe o = mean(u)\n") +
                           "scene d = rod { observe o = integral(u) }\n"
                           "scene far = rod { grid x = 0 .. 1 in km, cells 8, periodic }\n"
                           "scene other = rod { k = 1e-3 in m^2/min }\n";
  const auto with = [&](const std::string& scene, const std::string& loss) {
    return text + "task t : rod { unknown k; data e = o from scene " + scene + "; minimise (" + loss + " - e)^2 }\n";
  };
  const auto told = [](const std::string& whole) {
    const Outcome outcome = outcome_of(whole, {.name = "t"});
    return outcome.problem ? "" : outcome.diagnostics[0].message;
  };
  EXPECT_EQ(told(with("d", "integral(u)")), "");
  EXPECT_EQ(told(with("d", "mean(u)")), "this is in K*m, but mean(u) in K");
  EXPECT_EQ(told(with("other", "mean(u)")), "this is in m^2/min, but k in m^2/s: nothing converts them");
  EXPECT_EQ(told(with("far", "mean(u)")), "this is in km, but axis x of this scene in m: nothing converts them");
}

TEST(Units, OfCurvedCoordinatesAndNamesOfAxes) {
  const auto on = [](const std::string& coordinates, const std::string& axes, const std::string& rhs) {
    return "model m { field u in K; param r = 3 in 1/s, k = 1 in m^2/s; dt(u) = " + rhs + " }\nscene s : m {\n" +
           coordinates + "\n" + axes + "\n initial u = 0; time 0 .. 1 in s, step 0.1 }\n";
  };
  const std::string globe = "grid lon = 0 .. 2*pi, cells 4, periodic; grid lat = -1 .. 1, cells 4; boundary u: lat = 0";
  EXPECT_EQ(misfit(on("coordinates sphere(6e6)", globe, "k*lap(u)")), "");
  const std::string disc =
      "grid r = 1 .. 2 in m, cells 4; grid theta = 0 .. 2*pi, cells 4, periodic; boundary u: r = 0";
  EXPECT_EQ(misfit(on("coordinates polar", disc, "r*u + k*lap(u)")), "");  // r is the parameter
  EXPECT_EQ(misfit(on("coordinates polar", disc, "k*dx(u)")), "this is in K*m/s, but dt(u) in K/s");
  std::string with_let = on("coordinates polar", disc, "r*u + k*lap(u)");
  with_let.replace(with_let.find("r = 3 in 1/s,"), 13, "q = 3 in 1/s,")
      .replace(with_let.find("dt(u)"), 0, "let r = 2*q; ");
  EXPECT_EQ(misfit(with_let), "");  // r is the let
  with_let.replace(with_let.find("r*u"), 3, "r*2");
  EXPECT_EQ(misfit(with_let), "this is in 1/s, but dt(u) in K/s");
}

TEST(Units, WhereNoneIsToldNothingIsChecked) {
  const Problem problem = problem_of(text_with("k*lap(u) + u + sin(u)"));
  EXPECT_TRUE(problem.remarks.units.empty());
}

TEST(Units, OfAxesAloneAreKnown) {
  const std::string text =
      "model m { field u; dt(u) = -u }\nscene s : m { grid x = 0 .. 1 in m, cells 4, periodic; initial u = sin(x); "
      "time 0 .. 1 in s, step 1/8 }\n";
  const std::map<std::string, std::string> wanted{{"t", "s"}, {"x", "m"}};
  EXPECT_EQ(misfit(text), "sin takes a pure number, but this is in m");
  EXPECT_EQ(problem_of(std::string(text).replace(text.find("sin(x)"), 6, "x")).remarks.units, wanted);
}

TEST(Units, OfAnObservableAloneIsKnown) {
  const std::string text =
      "model m { field u; dt(u) = -u }\nscene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = x; "
      "time 0 .. 1, step 1/8; observe total = integral(u) in kg }\n";
  EXPECT_EQ(problem_of(text).remarks.units, (std::map<std::string, std::string>{{"total", "kg"}}));
}

TEST(Units, OfAVectorAsBoundaryFit) {
  const std::string text =
      "model m { vector u in m/s; vector w in K; param k = 1e-3 in m^2/s; dt(u) = k*lap(u); dt(w) = k*lap(w) }\n"
      "scene s : m { grid x = 0 .. 1 in m, cells 8; grid y = 0 .. 1 in m, cells 8; boundary u: x = w, y = 0; "
      "boundary w: x = (1, 2), y = 0; initial u = (0, 0); initial w = (1, 1); time 0 .. 1 in s, step 1/8 }\n";
  EXPECT_EQ(misfit(text), "this is in K, but u in m/s");
}

TEST(Units, OfScenesOfPrograms) {
  const std::string text =
      "kernel decay(u: field, out w: field, k, dt: param) {\n  w = u - dt*k*u\n}\n"
      "program p {\n  run decay\n  swap u, w\n}\nscene s : p {\n  grid x = 0 .. 1 in m, cells 4, periodic\n"
      "  k = 1 in 1/s\n  initial u = x\n  time 0 .. 1 in s, step 0.1\n}\n";
  EXPECT_EQ(problem_of(text).remarks.units, (std::map<std::string, std::string>{{"k", "1/s"}, {"t", "s"}, {"x", "m"}}));
  std::string other = text;
  EXPECT_EQ(misfit(other.replace(other.find("step 0.1"), 8, "step 0.1*k")), "this is in 1/s, but the time in s");
}

TEST(Units, AreReadFromTexts) {
  const auto text = [](const char* written) {
    const auto unit = read_unit(written);
    return std::holds_alternative<Unit>(unit) ? std::get<Unit>(unit).text() : "?" + std::get<UnitMistake>(unit).part;
  };
  EXPECT_EQ(text("m/s"), "m/s");
  EXPECT_EQ(text("kg*m/s^2"), "kg*m/s^2");
  EXPECT_EQ(text("W/(m*K)"), "W/(K*m)");
  EXPECT_EQ(text("s^-1"), "1/s");
  EXPECT_EQ(text("m^(1/2)"), "m^(1/2)");
  EXPECT_EQ(text("1"), "1");
  EXPECT_EQ(text("m*m/m^2"), "1");
  EXPECT_EQ(text("degC"), "?degC");
  EXPECT_EQ(text("foot"), "?foot");
  EXPECT_EQ(text("m//s"), "?m//s");
  EXPECT_EQ(std::get<UnitMistake>(read_unit("m**")).hint, "a power is written m^2");
  EXPECT_EQ(std::get<UnitMistake>(read_unit("Ohm")).hint, "write ohm");
  EXPECT_EQ(text("m^"), "?m^");
  EXPECT_EQ(text("(m"), "?(m");
  EXPECT_EQ(text("m^100"), "?m^100");
  EXPECT_EQ(text("m^(1/0)"), "?0");
  EXPECT_EQ(text("(((((((((m)))))))))"), "?(");
  EXPECT_EQ(text(""), "?");
}

TEST(Units, KnowWhatTheyAre) {
  const auto unit = [](const char* written) { return std::get<Unit>(read_unit(written)); };
  const std::pair<const char*, const char*> same[] = {
      {"N", "kg*m/s^2"}, {"Pa", "N/m^2"}, {"J", "N*m"},  {"W", "J/s"},    {"V", "W/A"},  {"C", "A*s"},  {"F", "C/V"},
      {"ohm", "V/A"},    {"S", "1/ohm"},  {"Wb", "V*s"}, {"T", "Wb/m^2"}, {"H", "Wb/A"}, {"Hz", "1/s"}, {"L", "dm^3"}};
  for (const auto& [a, b] : same) EXPECT_TRUE(unit(a).is_same_as(unit(b))) << a << " " << b;
  EXPECT_DOUBLE_EQ(unit("bar").scale(), 1e5);
  EXPECT_DOUBLE_EQ(unit("hPa").scale(), 100);
  EXPECT_DOUBLE_EQ(unit("min").scale(), 60);
  EXPECT_DOUBLE_EQ(unit("mm").scale(), 1e-3);
  EXPECT_DOUBLE_EQ(unit("day").scale(), 86400);
  EXPECT_DOUBLE_EQ(unit("km^2").scale(), 1e6);
  EXPECT_TRUE(unit("km/h").has_dimension_of(unit("m/s")));
  EXPECT_FALSE(unit("km/h").is_same_as(unit("m/s")));
  EXPECT_FALSE(unit("deg").is_pure_number());
  EXPECT_TRUE(unit("rad").is_pure_number());
}

}  // namespace
}  // namespace dpde::model
