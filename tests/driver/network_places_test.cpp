// SPDX-License-Identifier: Apache-2.0
// Networks on faces, edges and nodes, cell by cell for vectors, and on values at points: placements x topologies x
// layers x uses. Gradients, tangents and Hessian products against differences, back ends against one another, on few
// cells; values against the layers applied to arrays of files; refusals by their code.
#include <fmt/format.h>

#include <cmath>

#include "driver/scene/inverse.h"
#include "driver_support.h"
#include "network/evaluate.h"
#include "support/opened_scene.h"
#include "support/setting.h"

namespace dpde::driver::network_places {
namespace {

using dpde::testing::is_tried;

/// A call whose values have the placement of `owner`; for coordinates and numbers the call `known`. Networks: n(a, b)
/// and, for vectors, v(u, a).
struct CalledAt {
  const char *name, *owner, *call, *known, *on;
};
const CalledAt called_at[] = {
    {"faces_x", "u.x", "n(u.x, interpolate(eta))", "n(x, k)", " on faces.x"},
    {"faces_y", "u.y", "n(u.y, k)", "n(x, y)", " on faces.y"},
    {"nodes", "q", "n(q, curl(u))", "n(x*y, k)", " on nodes"},
    {"made_on_nodes", "q", "n(curl(u), 1)", "n(1, y)", " on nodes"},
    {"made_at_centres", "eta", "n(div(u), eta)", "n(x, k*y)", ""},
    {"cell_by_cell", "u", "v(u, eta)", "v((x, y), k)", " on faces"},
    {"of_edges", "e", "v(e, k)", "v((k, y), x)", " on edges"},
};

struct LayersOf {
  const char *name, *items;
};
const LayersOf layers_of[] = {
    {"dense", "dense 3; tanh; dense out"},
    {"convolutions", "conv 2, 3; tanh; conv out, 3"},
    {"pool", "conv 2, 3; tanh; skip { mean_pool 2; conv 2, 3; silu; upsample 2 }; conv out, 1"},
    {"zero", "padding zero; conv 3, 5; gelu; residual { conv 3, 3; tanh }; dense out"},
    {"reflect", "padding reflect; conv 2, 3, dilation = 2; sigmoid; conv 4, 3, stride = 2; upsample 2; dense out"},
};

enum class Stands { equation, after_step, every, at_time, observable_of_data, coefficient, initial, loss };
const std::pair<const char*, Stands> stands_in[] = {{"equation", Stands::equation},
                                                    {"after_step", Stands::after_step},
                                                    {"every", Stands::every},
                                                    {"at_time", Stands::at_time},
                                                    {"output", Stands::observable_of_data},
                                                    {"coefficient", Stands::coefficient},
                                                    {"initial", Stands::initial},
                                                    {"loss", Stands::loss}};

struct Grid {
  const char *name, *x, *y;
  bool x_has_walls, y_has_walls;
};
const Grid grids[] = {{"periodic", "cells 3, periodic", "cells 2, periodic", false, false},
                      {"walls", "cells 2", "cells 3", true, true},
                      {"channel", "cells 4, periodic", "cells 1", false, true},
                      {"one_cell", "cells 1", "cells 4, periodic", true, false}};

/// Boundary conditions of all fields along the axes with walls.
std::string boundaries(const Grid& grid) {
  std::string text;
  for (const auto& [axis, has_walls] : {std::pair{"x", grid.x_has_walls}, std::pair{"y", grid.y_has_walls}}) {
    if (!has_walls) continue;
    for (const char* field : {"u.x", "u.y", "e.x", "e.y"})
      text += std::string("  boundary ") + field + ": " + axis + " = 0.1\n";
    text += std::string("  boundary eta: ") + axis + " = zero_gradient\n  boundary q: " + axis + " = 0.2\n";
  }
  return text;
}

std::string text_of(const CalledAt& at, const LayersOf& layers, Stands stands, const Grid& grid) {
  const std::string owner = at.owner, call = at.call;
  const bool is_vector = owner == "u" || owner == "e";
  const auto rate = [&](const std::string& field) {
    std::string term = owner == field && stands == Stands::equation ? " + 0.3*" + call : "";
    if (owner == field && stands == Stands::coefficient) term += " + g";
    return term;
  };
  std::string text = "network n(a, b) { initial xavier, seed 3; " + std::string(layers.items) +
                     " }\nnetwork v(u: vector, a) -> vector { initial xavier, seed 4; " + layers.items + " }\n" +
                     "model m {\n  vector u on faces\n  vector e on edges\n  field eta\n  field q on nodes\n"
                     "  param k = 0.6\n";
  if (stands == Stands::coefficient)
    text += std::string("  coefficient ") + (is_vector ? "vector g" : "g") + at.on + "\n";
  if (stands == Stands::observable_of_data) text += "  let shown = " + call + "\n";
  for (const char* axis : {"x", "y"}) {
    const std::string component = std::string("u.") + axis;
    text += "  dt(" + component + ") = -d" + axis + "(eta) - 0.2*" + component + "^2" + rate(component);
    for (const std::string& term : {rate("u")}) {
      if (term.empty()) continue;
      text += stands == Stands::coefficient ? std::string(" + g.") + axis : " + 0.3*(" + call + ")." + axis;
    }
    text += std::string("\n  dt(e.") + axis + ") = -0.3*e." + axis;
    if (!rate("e").empty())
      text += stands == Stands::coefficient ? std::string(" + g.") + axis : " + 0.3*(" + call + ")." + axis;
    text += "\n";
  }
  text += "  dt(eta) = -div(u)" + rate("eta") + "\n  dt(q) = -0.1*q*q" + rate("q") + "\n}\n";
  text += "scheme c { time = rk2; networks = f64 }\nscene z : m with c {\n  grid x = 0 .. 1, " + std::string(grid.x) +
          "\n  grid y = 0 .. 1, " + grid.y + "\n" + boundaries(grid);
  if (stands == Stands::coefficient) text += std::string("  g = ") + at.known + "\n";
  const auto initial = [&](const std::string& field, const std::string& formula) {
    return "  initial " + field + " = " +
           (stands == Stands::initial && owner == field ? at.known + std::string(is_vector ? "" : " + 0.4") : formula) +
           "\n";
  };
  if (stands == Stands::initial && owner == "u") {
    text += std::string("  initial u = ") + at.known + "\n";
  } else if (stands == Stands::initial && owner.starts_with("u.")) {
    const std::string other = owner == "u.x" ? "0.3*cos(x + y)" : "0.4 + 0.2*sin(3*x - y)";
    text += "  initial u = (" + (owner == "u.x" ? at.known + (", " + other) : other + ", " + at.known) + ")\n";
  } else {
    text += "  initial u = (0.4 + 0.2*sin(3*x - y), 0.3*cos(x + y))\n";
  }
  text += initial("eta", "0.3*sin(x + 2*y)") + initial("q", "0.5 + 0.2*cos(4*x - y)") +
          initial("e", "(0.3 + 0.1*y, cos(x))") + "  time 0 .. 0.15, step 0.05\n";
  if (stands == Stands::after_step) text += "  after step: " + owner + " += 0.2*" + call + "\n";
  if (stands == Stands::every) text += "  every 0.1: " + owner + " += 0.2*" + call + "\n";
  if (stands == Stands::at_time) text += "  at t = 0.1: " + owner + " = 0.2*" + call + "\n";
  if (stands == Stands::observable_of_data) text += "  output shown\n";
  text += "}\ntask t : z {\n  unknown k\n  unknown initial eta\n";
  text += is_vector ? "  learn v\n" : "  learn n\n";
  const std::string of_loss = is_vector ? "dot(" + call + ", " + owner + ")" : "(" + call + ")^2";
  return text + "  minimise mean(dot(u, u)) + mean(eta^3) + mean(q^2) + mean(dot(e, e))" +
         (stands == Stands::loss || stands == Stands::observable_of_data ? " + mean(" + of_loss + ")" : "") +
         ", mean over time\n}\n";
}

/// Derivatives of task t against differences, and the interpreter against machine code.
void expect_right(const std::string& text) {
  SCOPED_TRACE(text);
  struct Opened {
    SourceFile source;
    std::unique_ptr<Session> session;
    std::unique_ptr<Inverse> inverse;
    Opened(const std::string& text, Backend backend, bool second) : source("t.dpde", text) {
      CompileOptions compile;
      compile.backend = backend;
      compile.adjoint = true;
      compile.tangent = compile.second = second;
      DiagnosticSink sink;
      const auto compiled = dpde::testing::compiled(source, compile);
      if (compiled) session = Session::open(source, compiled, {}, sink);
      if (session) inverse = Inverse::open(*session, source, sink);
      EXPECT_NE(inverse, nullptr) << dpde::testing::all_messages(source, sink);
    }
  };
  const Opened fast(text, Backend::jit, true);
  ASSERT_NE(fast.inverse, nullptr);
  const Eigen::VectorXd x = fast.inverse->start();
  Eigen::VectorXd gradient(x.size()), other(x.size()), product(x.size()), ahead(x.size()), behind(x.size());
  const double loss = fast.inverse->value_and_gradient(x, gradient);
  for (const Inverse::Part& part : fast.inverse->parts()) {
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(x.size());
    direction.segment(part.offset, part.size) = Eigen::VectorXd::LinSpaced(part.size, 0.6, 1).normalized();
    const auto central = [&](double h) {
      return (fast.inverse->value(x + h * direction) - fast.inverse->value(x - h * direction)) / (2 * h);
    };
    const double difference = (4 * central(5e-4) - central(1e-3)) / 3, got = gradient.dot(direction);
    EXPECT_NEAR(got, difference, 1e-7 * (std::abs(difference) + std::abs(loss))) << part.name;
    EXPECT_NEAR(fast.inverse->rate_along(x, direction), got, 1e-10 * (std::abs(got) + std::abs(loss))) << part.name;
    fast.inverse->product(x, direction, product, Curvature::full);
    fast.inverse->value_and_gradient(x + 1e-4 * direction, ahead);
    fast.inverse->value_and_gradient(x - 1e-4 * direction, behind);
    EXPECT_LT((product - (ahead - behind) / 2e-4).norm(), 1e-5 * (product.norm() + std::abs(loss))) << part.name;
  }
  const Opened slow(text, Backend::interpreter, false);
  ASSERT_NE(slow.inverse, nullptr);
  EXPECT_NEAR(slow.inverse->value_and_gradient(x, other), loss, 1e-12 * std::abs(loss));
  EXPECT_LT((other - gradient).norm(), 1e-10 * (gradient.norm() + std::abs(loss)));
}

/// All at night; by day a selection with each placement, layer, use and grid.
TEST(NetworkPlaces, HaveDerivatives) {
  for (std::size_t count = 0; const CalledAt& at : called_at) {
    for (const LayersOf& layers : layers_of) {
      for (const auto& [name, stands] : stands_in) {
        for (const Grid& grid : grids) {
          if (!is_tried(count++, 131)) continue;
          SCOPED_TRACE(std::string(at.name) + " " + layers.name + " " + name + " " + grid.name);
          expect_right(text_of(at, layers, stands, grid));
        }
      }
    }
  }
}

/// Channel by channel like arrays of files: a cell's values of a vector on faces are those of its upper faces.
TEST(NetworkPlaces, ValuesAreOfTheArrays) {
  for (const Grid& grid : grids) {
    for (const CalledAt& at : {called_at[0], called_at[1], called_at[5]}) {
      const std::string owner = at.owner, call = owner == "u" ? "v(u, eta)" : "n(" + owner + ", k)",
                        time = "time 0 .. 0.15, step 0.05";
      SCOPED_TRACE(call + " " + grid.name);
      std::string text = text_of({"", at.owner, call.c_str(), "", ""}, layers_of[1], Stands::equation, grid);
      text.replace(text.find(time), time.size(), "time 0 .. 1e-9, step 1e-9");
      const auto before = dpde::testing::run_scene(text, "z").state;
      text.insert(text.find("}\ntask"), "  after step: " + owner + " = " + call + "\n");
      const dpde::testing::OpenedScene scene(text, "z");
      ASSERT_NE(scene.session, nullptr);
      const auto values = [&](const std::string& name) { return before.at(name); };
      const model::Problem& problem = scene.session->problem();
      const network::Network& network = *problem.find_network(owner == "u" ? "v" : "n");
      const int nx = problem.axes[0].cells, ny = problem.axes[1].cells;
      std::vector<std::vector<double>> channels{values(owner == "u" ? "u.x" : owner)};
      if (owner == "u") channels.insert(channels.end(), {values("u.y"), values("eta")});
      if (owner != "u") channels.emplace_back(nx * ny, 0.6);
      network::Tensor inputs{network.inputs, {nx, ny, 1}, {}};
      for (const auto& channel : channels) inputs.values.insert(inputs.values.end(), channel.begin(), channel.end());
      const std::vector<double> wanted =
          network::value(network, inputs, scene.session->workspace().weights().at(network.name).values).values;
      const auto reached = dpde::testing::run_scene(text, "z").state;
      for (const std::string& name : owner == "u" ? std::vector<std::string>{"u.x", "u.y"} : std::vector{owner}) {
        for (int cell = 0; cell < nx * ny; ++cell) {
          const bool is_on_wall =
              name == "u.x" ? grid.x_has_walls && cell % nx == nx - 1 : grid.y_has_walls && cell / nx == ny - 1;
          const int first = owner == "u" && name == "u.y" ? nx * ny : 0;
          const double network_value = wanted[static_cast<std::size_t>(first + cell)];
          EXPECT_NEAR(reached.at(name)[static_cast<std::size_t>(cell)], is_on_wall ? 0.1 : network_value, 1e-7);
        }
      }
    }
  }
}

TEST(ValuesAtPoints, AreThoseOfResults) {
  const std::string text =
      "model m { field u, F, G; vector w on faces; dt(u) = 0; dt(w) = 0; dt(F) = 0; dt(G) = 0 "
      "}\nscene s : m {\n  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 1, cells 4, periodic\n"
      "  boundary u: x.low = 0.2, x.high = 0.5\n  boundary w: x.low = (0.3, 0.3), x.high = (0.9, 0.3)\n"
      "  boundary F: x = zero_gradient\n"
      "  boundary G: x = zero_gradient\n  initial u = 0.2 + 0.3*x\n  initial w = (0.3 + 0.6*x, 0.3)\n"
      "  initial F = 0\n  initial G = 0\n  time 0 .. 1, step 0.5\n"
      "  at t = 0.5: F = sample(u*2, at = (0.1 + t/2, 0.9)), G = sensor + x\n"
      "  let sensor = sample(w.x + y, at = (0.4, 0.3))\n}\n";
  const auto reached = dpde::testing::run_scene(text, "s").state;
  for (const double value : reached.at("F")) EXPECT_NEAR(value, 2 * (0.2 + 0.3 * 0.35), 1e-13);
  for (int cell = 0; cell < 20; ++cell)
    EXPECT_NEAR(reached.at("G")[static_cast<std::size_t>(cell)], 0.3 + 0.24 + 0.3 + 0.1 + 0.2 * (cell % 5), 1e-13);
}

/// A thermostat: conditions are not numbers, but the values in them are.
TEST(ValuesAtPoints, Switch) {
  const std::string text =
      "model m { field T, heat; dt(T) = 0; dt(heat) = 0 }\nscene s : m {\n  grid x = 0 .. 1, cells 10\n"
      "  boundary T: x = zero_gradient\n  boundary heat: x = zero_gradient\n  initial T = x\n  initial heat = 0\n"
      "  time 0 .. 1, step 0.5\n"
      "  at t = 0.5: heat = if(sample(T, at = 0.3) < LOW and sample(T, at = 0.7) > 0.6, 2*T, sample(T, at = 0.4))\n}\n";
  for (const double low : {0.29, 0.31}) {
    std::string one = text;
    const auto reached = dpde::testing::run_scene(one.replace(one.find("LOW"), 3, fmt::format("{}", low)), "s").state;
    for (int cell = 0; cell < 10; ++cell)
      EXPECT_NEAR(reached.at("heat")[static_cast<std::size_t>(cell)], low < 0.3 ? 0.4 : 0.1 + 0.2 * cell, 1e-13);
  }
}

/// Values at points during steps: a controller c(s, k) of a value, a tracer, a sensor.
const char* const values_at_points[] = {
    "sample(u.x, at = (X, 0.41))",         "sample(eta^2 + y, at = (X, 0.2 + t))",
    "sample(q, at = (0.31, X))",           "sample(dx(eta), at = (X, 0.41))",
    "sample(div(u)*e.y, at = (0.3, X))",   "dot(sample(u, at = (X, 0.6)), sample(e, at = (0.7, X)))",
    "sample(mean(u.y)*eta, at = (X, X^2))"};
const char* const happens_at[] = {"after step: ", "every 0.1: ", "at t = 0.05, 0.15: "};
const char* const takes_value[] = {"F = c(#, k)",           "F = c(#, F).x*k",
                                   "F += 0.3*# + mean(F)",  "eta = 0.5*eta + #*cos(x)",
                                   "u.x += 0.1*#, q = q*#", "u += 0.1*v(u, #)"};

TEST(ValuesAtPoints, HaveDerivativesInSteps) {
  for (std::size_t count = 0; const char* value : values_at_points) {
    for (const std::string when : happens_at) {
      for (std::string change : takes_value) {
        for (const Grid& grid : grids) {
          if (!is_tried(count++, 83)) continue;
          const char* learned = change.starts_with("F = c(")  ? "  learn c\n"
                                : change.starts_with("u += ") ? "  learn v\n"
                                                              : "";
          for (auto at = change.find('#'); at != std::string::npos; at = change.find('#'))
            change.replace(at, 1, std::string("(") + value + ")");
          const std::size_t of_two = change.find(").x*k");
          if (of_two != std::string::npos) change.replace(of_two, 3, ")");
          std::string text = text_of({"", "none", "v(u, 1)", "", ""}, layers_of[1], Stands::equation, grid);
          const auto put = [&](const std::string& before, const std::string& line) {
            text.insert(text.find(before), line);
          };
          put("  param k", "  field F\n  param X = 0.37\n");
          put("  dt(eta)", "  dt(F) = -0.5*F + 0.1*eta\n");
          put("  initial u", "  initial F = 0.6\n");
          put("  unknown k", "  unknown X\n  unknown initial F\n");
          put("network v", "network c(s, k) { initial xavier, seed 5; dense 3; tanh; dense out }\n");
          put("}\ntask", "  " + when + change + "\n");
          for (const auto& [axis, has_walls] : {std::pair{"x", grid.x_has_walls}, std::pair{"y", grid.y_has_walls}}) {
            if (has_walls) put("  initial u", std::string("  boundary F: ") + axis + " = zero_gradient\n");
          }
          text.replace(text.find("  learn n\n"), 10, learned);
          text.replace(text.find("mean(q^2)"), 9, "mean(q^2) + mean(F^2)");
          expect_right(text);
        }
      }
    }
  }
}

/// The placement of a network is asked for at each level of nested networks.
TEST(NetworkPlaces, OfNetworksAreFoundAtOnce) {
  std::string call = "u.x";
  for (int depth = 0; depth < 14; ++depth) call = "n(0.5*" + call + " + k, " + std::to_string(depth) + ")";
  const std::string text = text_of({"", "u.x", call.c_str(), "", ""}, layers_of[0], Stands::equation, grids[0]);
  EXPECT_EQ(dpde::testing::code_refused(text), "");
}

std::string code_of(const std::string& call, const std::string& owner, const std::string& symmetry,
                    const std::string& after = "", bool has_walls = true) {
  const Grid& grid = grids[has_walls ? 1 : 0];
  const std::string layers = symmetry + "conv 2, 3; tanh; conv out, 3";
  std::string text = text_of({"", owner.c_str(), call.c_str(), "", ""}, {"", layers.c_str()}, Stands::equation, grid);
  const bool is_of_vectors = call.find("v(") != std::string::npos && call.find("div(u)") == std::string::npos;
  text.replace(text.find("  learn "), 10, is_of_vectors ? "  learn v\n" : "  learn n\n");
  if (!after.empty()) text.replace(text.find("  time 0"), 0, "  after step: " + after + "\n");
  return dpde::testing::code_refused(text);
}

TEST(NetworkPlaces, SayWhatTheyCannot) {
  EXPECT_EQ(code_of("n(u.x, k)", "u.x", ""), "");
  EXPECT_EQ(code_of("n(u.x, u.y)", "u.x", ""), "E0331");      // scalars with two placements
  EXPECT_EQ(code_of("0.3*n(u.x, eta)", "eta", ""), "E0331");  // were taken as if both were at the centres
  EXPECT_EQ(code_of("n(n(x, y), k)", "u.x", ""), "");
  EXPECT_EQ(code_of("n(u.y, k)", "u.x", ""), "E0331");               // it has the placement of its arguments
  EXPECT_EQ(code_of("n(interpolate(eta), k)", "u.x", ""), "E0331");  // at the centres, as before
  EXPECT_EQ(code_of("interpolate(n(interpolate(u.y), eta))", "u.x", ""), "");
  EXPECT_EQ(code_of("v(u, q)", "u", ""), "E0331");  // with a vector all other arguments must be at the centres
  EXPECT_EQ(code_of("v((u.y, u.x), k)", "u", ""), "E0331");
  EXPECT_EQ(code_of("v(u, k).x", "eta", ""), "E0331");
  EXPECT_EQ(code_of("div(v(u, k))", "eta", "", "", false), "");
  EXPECT_EQ(code_of("div(v(u, k))", "eta", "", "", true), "E0333");  // its result has no value on the lower wall
  EXPECT_EQ(code_of("dx(n(u.x, x))", "eta", ""), "E0333");
  EXPECT_EQ(code_of("dx(u.x*n(x, y))", "eta", ""), "E0333");  // for coordinates it has the required placement
  EXPECT_EQ(code_of("dy(interpolate(n(u.x, x)))", "eta", ""), "E0333");
  EXPECT_EQ(code_of("interpolate(n(u.y, k))", "u.x", ""), "E0333");
  EXPECT_EQ(code_of("dx(q)", "u.y", "", "q = n(curl(u), k)"), "");  // a field has a boundary
  EXPECT_EQ(code_of("n(u.x, k)", "u.x", "symmetric flips; "), "E0338");
  EXPECT_EQ(code_of("n(u.x, k)", "u.x", "symmetric flip y; "), "");
  EXPECT_EQ(code_of("n(u.x, k)", "u.x", "symmetric flips; ", "", false), "");
  EXPECT_EQ(code_of("n(x, k)", "u.x", "symmetric flips; "), "E0338");
  EXPECT_EQ(code_of("n(div(u), k)", "eta", "symmetric flips; "), "");
  EXPECT_EQ(code_of("v(u, k)", "u", "symmetric flips; ", "", false), "E0338");
  EXPECT_EQ(code_of("interpolate(v(interpolate(u), k))", "u", "symmetric flips; ", "", false), "");
}

}  // namespace
}  // namespace dpde::driver::network_places
