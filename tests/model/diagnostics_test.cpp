// SPDX-License-Identifier: Apache-2.0
// Tables of mistakes, more than one has words of its own for. Words: tests/diagnostics.
#include <algorithm>

#include "model/model_support.h"

namespace dpde::model {
namespace {

TEST(Diagnostics, SeveralAtOnce) {
  const Outcome outcome = outcome_of(text_with("k*lapp(u) + q", 1, "  boundary u: x = 0\n  nu = 3\n"));
  std::vector<std::string> codes;
  for (const Diagnostic& d : outcome.diagnostics) codes.emplace_back(d.kind->code);
  std::sort(codes.begin(), codes.end());
  EXPECT_EQ(codes, (std::vector<std::string>{"E0301", "E0301", "E0302", "E0409"}));
}

std::string in_equation(const std::string& rhs, int axes = 1) {
  return outcome_of(text_with(rhs + " + 0*w*k*c", axes)).code_and_hint();
}

TEST(Diagnostics, SayWhatAControlIs) {
  const Outcome outcome = outcome_of(
      "model m { field u; control field F; control G; dt(u) = F*G }\nscene s : m {\n grid x = 0 .. 1, cells 8, "
      "periodic\n initial u = 0\n F = 0\n G = 0\n"
      " output F\n initial G = 0\n time 0 .. 1, step 1\n}");
  ASSERT_EQ(outcome.diagnostics.size(), 2u);
  EXPECT_EQ(outcome.diagnostics[0].message, "G is a control; only a field has an initial state");
  EXPECT_EQ(outcome.diagnostics[1].message, "F is a control field; only a field has an output");
}

TEST(Diagnostics, OfExpressions) {
  EXPECT_EQ(in_equation("\"u\""), "E0307 a file is read by load(\"name.npy\")");
  EXPECT_EQ(in_equation("(u, u)", 2),
            "E0323 a number may scale a vector, not be added to it; div(v) and dot(a, b) make numbers");
  EXPECT_EQ(in_equation("mean(u, r)"), "E0402 write mean(u, y) or max(u, over = y)");
  EXPECT_EQ(in_equation("mean(u, 2)"), "E0402 write mean(u, y) or max(u, over = y)");
  EXPECT_EQ(in_equation("mean(u, z)"), "E0321 axes of the scene: x; a grid line adds one");
  EXPECT_EQ(in_equation("mean(u, x, x)", 2), "E0303 ");
  EXPECT_EQ(in_equation("max(u, over = (x, y, x))", 2), "E0303 ");
  EXPECT_EQ(in_equation("sum(u, along = x)"), "E0305 write sum(u, over = y)");
  EXPECT_EQ(in_equation("mean()"), "E0305 ");
  EXPECT_EQ(in_equation("max(u, u, u)"), "E0305 ");
  EXPECT_EQ(in_equation("mean(u > 0)"), "E0307 write if(condition, 1, 0)");
  EXPECT_EQ(
      in_equation("dt(u)"),
      "E0311 dt(u) is known where the model has dt(dt(u)) = ...; elsewhere put the right-hand side of dt(u) here");
  EXPECT_EQ(in_equation("u[+1]"),
            "E0311 neighbours are read in kernels and operators; formulas have dx, lap and the like");
  EXPECT_EQ(in_equation("load(\"u.npy\")"),
            "E0311 load(\"name.npy\") stands alone behind the = of data, an initial state or a coefficient");
  EXPECT_EQ(in_equation("d(u, r, 2)"), "E0402 write d(u, x, 2)");
  EXPECT_EQ(in_equation("d(u, z, 2)"), "E0321 axes of the scene: x; a grid line adds one");
  EXPECT_EQ(in_equation("d(u, x, k)"), "E0322 nest derivatives, as in lap(lap(lap(u))), for higher orders");
  EXPECT_EQ(in_equation("y"), "E0321 axes of the scene: x; a grid line adds one");
  EXPECT_EQ(in_equation("div(u)", 2), "E0309 one component an axis: (vx, vy)");
  EXPECT_EQ(in_equation("advect(u, u)", 3), "E0309 one component an axis: (vx, vy, vz)");
  EXPECT_EQ(in_equation("dot((u, u), (u, u, u))", 2), "E0309 ");
  EXPECT_EQ(in_equation("sin(x = u)"), "E0305 leave the name out");
  EXPECT_EQ(in_equation("if(u > 0, u)"), "E0305 ");
  EXPECT_EQ(in_equation("if(u > 0, u, (u, u))", 2), "E0309 both results of an if are of the same length");
  EXPECT_EQ(in_equation("div((u, u)^2)", 2), "E0323 dot(a, b) multiplies vectors");
  EXPECT_EQ(in_equation("sin((u, u))", 2),
            "E0307 a component as (v).x is a number; dot(a, b) and div(v) make one of vectors");
  EXPECT_EQ(in_equation("if(u > 0 and k, 1, 2)"), "E0308 compare it with something, as in u > 0");
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

TEST(Diagnostics, CountAxes) {
  const Outcome outcome = outcome_of(text_with("dot(cross(u, (u, u, u)), (k, c, w))", 3));
  ASSERT_EQ(outcome.diagnostics.size(), 1u);
  EXPECT_EQ(outcome.diagnostics[0].message, "cross is not defined for 3 axes");
}

/// One mistake, called as the scene calls the axis, at its line.
TEST(Diagnostics, OfPolesWithoutABoundary) {
  const std::string text =
      "model m { field u; dt(u) = lap(u) }\nscene s : m { coordinates sphere(1)\n"
      "  grid lon = 0 .. 2*pi, cells 8, periodic\n  grid lat = LOW .. pi/2, cells 6\n"
      "  initial u = 1; time 0 .. 0.1, step 0.01 }\n";
  const auto from = [&](const std::string& low) {
    return outcome_of(std::string(text).replace(text.find("LOW"), 3, low));
  };
  const Outcome both = from("-pi/2");
  EXPECT_EQ(both.code_and_hint(), "E0437 write lat = pole: what lies beyond it lies half a turn away");
  EXPECT_EQ(both.diagnostics.at(0).message, "u has no condition for the pole at lat");
  EXPECT_EQ(both.diagnostics.at(0).range.begin, static_cast<int>(text.find("lat = LOW")));
  const Outcome cap = from("0.1");
  ASSERT_EQ(cap.diagnostics.size(), 2u);
  EXPECT_EQ(cap.diagnostics[0].hint, "write boundary u: lat.low = 0, or = zero_gradient; or periodic in the grid line");
  EXPECT_EQ(cap.diagnostics[1].hint, "write lat.high = pole: what lies beyond it lies half a turn away");
}

/// What a difference reads on the pole itself, in a model with something on faces and in one without.
TEST(Diagnostics, OfDivisionsOnPoles) {
  const auto is_refused = [](const std::string& rate, bool has_faces, const std::string& scheme = "") {
    const std::string faces = "; vector v on faces; dt(v) = -v";
    const Outcome outcome = outcome_of(
        "model m { field q; param less = -1; dt(q) = " + rate + (has_faces ? faces : "") + " }\nscheme r { " + scheme +
        " }\nscene s : m with r { coordinates sphere(1)\n  grid lon = 0 .. 2*pi, cells 8, periodic\n"
        "  grid lat = -pi/2 .. pi/2, cells 6\n  boundary q: lat = pole\n" +
        (has_faces ? "  boundary v.x: lat = pole\n  boundary v.y: lat = 0\n  initial v = 0\n" : "") +
        "  initial q = 1; time 0 .. 0.1, step 0.01 }\n");
    return std::ranges::any_of(outcome.diagnostics,
                               [](const Diagnostic& d) { return std::string_view(d.kind->code) == "E0441"; });
  };
  for (const bool has_faces : {false, true}) {
    for (const char* rate :
         {"dy(q*dy(q)/cos(lat))", "dy((q + dy(q))/cos(lat))", "dy(dy(q)/cos(lat))", "dy(if(q > -9, dy(q), 0)/cos(lat))",
          "dy(if(dx(q) > 0, dy(q), 0)*tan(lat))", "dy((1 - t)/cos(lat)*dy(q))", "dy(cos(lat)^less*dy(q))"})
      EXPECT_TRUE(is_refused(rate, has_faces)) << rate << has_faces;
    for (const char* rate : {"dy(q/cos(lat))", "dy(q*dy(q)*cos(lat))", "lap(q)", "div(q*grad(q))", "div(grad(q))/2"})
      EXPECT_FALSE(is_refused(rate, has_faces)) << rate << has_faces;
  }
  const std::string leaves_out = "interpolate(if(|lat| < 1.2, inner(grad(v), grad(v)), 0))";
  EXPECT_FALSE(is_refused(leaves_out, true));
  EXPECT_TRUE(is_refused(leaves_out, true, "dx = central(4)"));
}

/// Rings have no outside.
TEST(Diagnostics, PlacesOnRingsWrap) {
  EXPECT_EQ(in_equation("inject(1, at = 17.3)"), "0 diagnostics:");
  EXPECT_EQ(in_equation("inject(1, at = 1/0)").substr(0, 5), "E0423");
}

TEST(Diagnostics, LetsStandBeforeTheirUse) {
  EXPECT_EQ(outcome_of(text_with("a*w*k*c", 1, "", "  let a = b\n  let b = u\n")).code_and_hint().substr(0, 5),
            "E0301");
}

std::string in_scene(const std::string& line) {
  return outcome_of(text_with("k*c*w*u", 1, "  " + line + "\n")).code_and_hint();
}

TEST(Diagnostics, OfScenes) {
  EXPECT_EQ(in_scene("exact v = 1"), "E0301 known here: u");
  EXPECT_EQ(in_scene("exact k = 1"), "E0313 ");
  EXPECT_EQ(in_scene("exact u = u"), "E0311 an exact solution is made of numbers, parameters, coordinates and t");
  EXPECT_EQ(in_scene("k = 3"), "E0303 ");
  EXPECT_EQ(in_scene("w = 3"), "E0303 ");
  EXPECT_EQ(in_scene("x = 3"), "E0325 ");
  EXPECT_EQ(in_scene("time 0 .. 1, step 1"), "E0303 ");
  EXPECT_EQ(in_scene("step 1"), "E0303 ");
  EXPECT_EQ(in_scene("grid x = 0 .. 1, cells 4"), "E0303 ");
  EXPECT_EQ(in_scene("observe u = mean(u)"), "E0303 ");
  EXPECT_EQ(in_scene("observe loss = mean(u)"), "E0304 choose another name");
  EXPECT_EQ(in_scene("exact u = max(x)"), "E0311 an exact solution is made of numbers, parameters, coordinates and t");
  EXPECT_EQ(in_scene("observe e = (u, u)"),
            "E0307 a component as (v).x is a number; dot(a, b) and div(v) make one of vectors");
  for (const char* value : {"sqrt(mean(u^2) + x)", "mean(u)*u", "mean(u) + u", "x*mean(u)", "1/u", "mean(u)/w",
                            "-max(mean(u), w)", "dx(u)"}) {
    EXPECT_EQ(in_scene(std::string("observe e = ") + value).substr(0, 5), "E0705") << value;
  }
}

TEST(Diagnostics, OfSubcycles) {
  const auto with = [](const std::string& scheme, const std::string& line) {
    return outcome_of("model m { field u, v; dt(u) = -advect(1, u); dt(v) = lap(v) }\nscheme c { " + scheme +
                      " }\nscene s : m with c {\n grid x = 0 .. 1, cells 8, periodic\n initial u = 0\n initial v = 0\n "
                      "time 0 .. 1, step 1\n " +
                      line + "\n}")
        .code_and_hint();
  };
  const std::string shorter = "E0428 with more of them, take a shorter step for the scene";
  EXPECT_EQ(with("time = rk4", "subcycle u in 1000001"), shorter);
  for (const std::string parts : {"0", "-3", "2.5"}) {
    EXPECT_EQ(with("time = rk4", "subcycle u in " + parts),
              "E0428 parts are equal: write subcycle u in 4 for four of them");
  }
  EXPECT_EQ(with("time = rk4", "subcycle u, v in 2; subcycle u in 4"), "E0303 ");
  EXPECT_EQ(with("time = rk4", "subcycle w in 4").substr(0, 5), "E0301");
  EXPECT_EQ(with("time = ab2", "subcycle v in 4"), "E0555 take time = rk2 or rk4");
  EXPECT_EQ(with("time = rk4; advect = semi_lagrangian", "subcycle v in 4"),
            "E0311 take advect = upwind(3) or central(4)");
}

TEST(Diagnostics, OfNumbers) {
  const auto number = [](const std::string& value) {
    const Outcome outcome = outcome_of(
        "model m { field u; param a; dt(u) = a*u }\nscene s : m {\n grid x = 0 .. 1, cells 8, periodic\n a = " + value +
        "\n initial u = 0\n time 0 .. 1, step 1\n}");
    return outcome.diagnostics.size() == 1 ? outcome.diagnostics[0].message : outcome.code_and_hint();
  };
  EXPECT_EQ(number("sqrt(-1)"), "this is not a finite number: sqrt(-1) is undefined or too large");
  EXPECT_EQ(number("log(0)"), "this is not a finite number: log(0) is undefined or too large");
  EXPECT_EQ(number("1e300*1e300"), "this is not a finite number: the result is too large or undefined");
  EXPECT_EQ(number("0/0"), "this is not a finite number: division by zero");
  EXPECT_EQ(number("x"), "coordinate x cannot appear in a number of the scene");
  EXPECT_EQ(number("t"), "the time t cannot appear in a number of the scene");
  EXPECT_EQ(number("u"), "field u cannot appear in a number of the scene");
  EXPECT_EQ(number("a"), "a has no value yet at this place");
  EXPECT_EQ(number("1 < 2"), "expected a number but this is a condition");
}

TEST(Diagnostics, OfBoundaries) {
  const auto boundary = [](const std::string& sides) {
    return outcome_of(
               "model m { field u; param a; dt(u) = a*lap(u) }\nscene s : m {\n grid x = 0 .. 1, cells 8\n grid y = 0 "
               ".. 1, cells 8, periodic\n"
               " a = 2\n boundary u: " +
               sides + "\n initial u = 0\n time 0 .. 1, step 1\n}")
        .code_and_hint();
  };
  EXPECT_EQ(boundary("x.low = t, x.high = 0"), "0 diagnostics:");
  EXPECT_EQ(boundary("all = sin(y)*x"), "0 diagnostics:");
  EXPECT_EQ(boundary("x = gradient(-u^4)"), "0 diagnostics:");
  EXPECT_EQ(boundary("x = dx(u)"),
            "E0311 a boundary value is made of numbers, parameters, coordinates, t, fields, and coefficients at cell "
            "centres");
  EXPECT_EQ(boundary("x.low = gradient(y*t), x.high = mixed(a, t, y)"), "0 diagnostics:");
  EXPECT_EQ(boundary("x = mixed(a, 1, y)"), "0 diagnostics:");
  EXPECT_EQ(boundary("x = gradient(1, 2)"), "E0305 write gradient(g), the derivative along the outward normal");
  EXPECT_EQ(boundary("x = linear(2)"), "E0305 write linear");
  EXPECT_EQ(boundary("x = mixed(y, 1, 0)"),
            "E0311 in mixed(a, b, c), a*u + b*du/dn = c, c may vary along the wall; a and b are made of numbers, "
            "parameters and t");
  EXPECT_EQ(boundary("x = 0, x.high = 1"), "E0303 ");
  EXPECT_EQ(boundary("x = a, y.low = 0"), "E0409 leave this out, or periodic in the grid line");
  EXPECT_EQ(boundary("x.low = 0"),
            "E0408 write boundary u: x.high = 0, or = zero_gradient; or periodic in the grid line");
  EXPECT_EQ(boundary("x periodic"), "E0311 write it in the grid line: grid x = 0 .. 1, cells 128, periodic");
  EXPECT_EQ(boundary("z = 0, x = 0").substr(0, 5), "E0410");
  EXPECT_EQ(boundary("all = 2*a"), "0 diagnostics:");
}

std::string in_task(const std::string& lines) {
  return outcome_of(text_with("k*c*w*u") + "task t : s {\n  unknown k\n  minimise mean(u^2)\n" + lines + "\n}\n")
      .code_and_hint();
}

TEST(Diagnostics, OfTasks) {
  EXPECT_EQ(in_task("data v = u + 1 from scene s"),
            "E0703 write load(\"name.npy\"), load(\"name.nc\", u), or u from scene NAME at t = 1");
  EXPECT_EQ(in_task("data v = u from scene ss"), "E0318 did you mean s?");
  EXPECT_EQ(in_task("data v = u from scene s at t = 2"), "E0418 the nearest is t = 1");
  EXPECT_EQ(in_task("data u = load(\"u.npy\")"), "E0303 ");
  EXPECT_EQ(in_task("data v = load(\"\")"),
            "E0710 write load(\"name.npy\"), load(\"name.nc\") or load(\"name.nc\", u)");
  EXPECT_EQ(in_task("unknown kk"), "E0301 did you mean k?");
  EXPECT_EQ(in_task("unknown k from 2"), "E0303 ");
  EXPECT_EQ(in_task("unknown pi"), "E0702 unknowns are parameters, coefficients and initial states");
  EXPECT_EQ(in_task("unknown initial k"), "E0313 ");
  EXPECT_EQ(in_task("unknown c from k"),
            "E0709 it must be known before the run: write a number, or a parameter that is not sought");
  EXPECT_EQ(in_task("minimise mean(v)"), "E0301 known here: c, k, pi, t, u, w, x, y, z");
  EXPECT_EQ(in_task("minimise mean(u) at t = -1/8"), "E0418 the nearest is t = 0");
  EXPECT_EQ(in_task("test a = mean(u)\ntest a = sum(u)"), "E0303 ");
  EXPECT_EQ(in_task("using lbfgs()\nusing lbfgs()"), "E0303 ");
  EXPECT_EQ(in_task("using lbfgs(rate = 1)"), "E0707 write lbfgs()");
  EXPECT_EQ(in_task("using gradient_descent()"), "E0707 write gradient_descent(rate = 0.1)");
  EXPECT_EQ(in_task("using adam(0.1)"), "E0707 write adam(rate = 0.1)");
  EXPECT_EQ(in_task("using adam(rate = -1)"), "E0707 ");
  EXPECT_EQ(in_task("using 5"), "E0706 known here: gradient_descent, adam, lbfgs, newton_cg");
  EXPECT_EQ(in_task("using lbfgs(), iterations 0"), "E0708 ");
}

/// Of a scene with the control field F and the coefficient w.
std::string with_control_field(const std::string& lines, const std::string& equation = "k*F*w*u",
                               const std::string& task = "") {
  return outcome_of("model m { field u; control field F; coefficient w; control c; param k; dt(u) = " + equation +
                    " }\nscene s : m {\n grid x = 0 .. 1, cells 8, periodic\n" +
                    " k = 2\n initial u = 0\n time 0 .. 1, step 1/8\n" + lines + "\n}\n" + task)
      .code_and_hint();
}

TEST(Diagnostics, OfControlFieldsAndNoise) {
  const std::string rest = "w = x\nc = t\n";
  EXPECT_EQ(with_control_field(rest + "F = k*x*t*noise(1) every 1/4", "k*F*w*u*c"), "0 diagnostics:");
  EXPECT_EQ(with_control_field(rest), "E0314 write F = 1 or F = load(\"name.npy\") in scene s");
  EXPECT_EQ(with_control_field(rest + "F = x every 0.3"), "E0422 the nearest that is one is 0.25");
  EXPECT_EQ(with_control_field(rest + "F = u"),
            "E0311 a control field is made of numbers, parameters, coordinates and t");
  EXPECT_EQ(with_control_field(rest + "F = c*x"),
            "E0311 a control field is made of numbers, parameters, coordinates and t");
  EXPECT_EQ(with_control_field("F = 1\nc = t\nw = x every 1/4"), "E0311 declare it in the model: control field w");
  EXPECT_EQ(with_control_field("F = 1\nc = t\nw = x*t"),
            "E0311 a coefficient is made of numbers, parameters, coordinates and other coefficients");
  EXPECT_EQ(with_control_field(rest + "F = k*x", "k*F*w*u", "task t : s { unknown k; minimise mean(u) }"),
            "E0709 write the formula in the model with let, so that it can be differentiated");
  EXPECT_EQ(with_control_field(rest + "F = x", "k*F*w*noise(3)"),
            "E0311 noise is drawn once a run: write coefficient f in the model, f = noise(7) in the scene, and f here");
  EXPECT_EQ(with_control_field(rest + "F = noise(-1)"), "E0336 write noise(7)");
  EXPECT_EQ(with_control_field(rest + "F = noise()"), "E0305 write noise(7)");
  EXPECT_EQ(with_control_field(rest + "F = noise(x)").substr(0, 5), "E0311");
  EXPECT_EQ(outcome_of("model m { field noise_7; dt(noise_7) = 0 }\nscene s : m {\n grid x = 0 .. 1, cells 8, "
                       "periodic\n initial noise_7 = 0\n time 0 .. 1, step 1\n}\n")
                .code_and_hint()
                .substr(0, 5),
            "E0304");
}

TEST(Diagnostics, UnknownsReachNoNumberOfTheScene) {
  const std::string text =
      "model m { field u; param k, c; dt(u) = k*c*u }\nscene s : m {\n grid x = 0 .. 1, cells 8, periodic\n k = 1\n c "
      "= 2*k\n"
      " initial u = 0\n time 0 .. 1, step 1\n}\ntask t : s { unknown k; minimise mean(u) }";
  EXPECT_EQ(outcome_of(text, {"s", {}, ""}).diagnostics.size(), 0u);
  EXPECT_EQ(outcome_of(text).code_and_hint(),
            "E0709 write the formula in the model with let, so that it can be differentiated");
}

// ---- input that is too much ----------------------------------------------------------------------------------------

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
