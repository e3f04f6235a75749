// SPDX-License-Identifier: Apache-2.0
// The controllers of dsl-examples/control, trained by the command: one against the linear-quadratic regulator of the
// same discrete plant, computed here with Eigen; one in closed loop with new parameters, initial states and noise.
#include <Eigen/Dense>
#include <cmath>

#include "command_support.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

using Eigen::MatrixXd;

constexpr int cells = 50, actuators = 5, decisions = 100;

// Each kind of expression that Eigen multiplies or solves takes seconds to compile: all are matrices here.
MatrixXd product(const MatrixXd& a, const MatrixXd& b) { return a * b; }
MatrixXd solution(const MatrixXd& a, const MatrixXd& b) { return a.ldlt().solve(b); }

/// One step of 0.1 of the plant with constant actuators: u becomes state*u + input*a.
struct Plant {
  MatrixXd state, input;
};

Plant plant() {
  constexpr double c = 0.1, nu = 0.002, r = 0.1, dt = 0.1, h = 1.0 / cells;
  MatrixXd rate = MatrixXd::Zero(cells, cells), reach = MatrixXd::Zero(cells, actuators);
  for (int i = 0; i < cells; ++i) {
    rate(i, (i + 1) % cells) += -c / (2 * h) + nu / (h * h);
    rate(i, (i + cells - 1) % cells) += c / (2 * h) + nu / (h * h);
    rate(i, i) += r - 2 * nu / (h * h);
    if (i % 10 < 5) reach(i, i / 10) = 1;  // 0 .. 0.1, 0.2 .. 0.3, ...
  }
  const MatrixXd one = MatrixXd::Identity(cells, cells), z = dt * rate;
  // fourth-order Runge-Kutta: 1 + z/2 (1 + z/3 (1 + z/4))
  const MatrixXd held = one + product(z, one + product(z, one + z / 4) / 3) / 2;
  return {one + product(z, held), product(dt * held, reach)};
}

/// u . cost u is the least cost from u: without control at first, then with optimal control at times 1 ... decisions -
/// 1.
MatrixXd least_cost(const Plant& p) {
  const MatrixXd one = MatrixXd::Identity(cells, cells), few = MatrixXd::Identity(actuators, actuators);
  MatrixXd cost = one;
  for (int k = 1; k < decisions; ++k) {
    const MatrixXd by_input = product(p.input.transpose(), cost), by_state = product(p.state.transpose(), cost);
    const MatrixXd gain = solution(few + product(by_input, p.input), product(by_input, p.state));
    cost = one + product(by_state, p.state - product(p.input, gain));
  }
  return one + product(product(p.state.transpose(), cost), p.state);
}

double cost_without_control(const Plant& p) {
  MatrixXd u = MatrixXd::Identity(cells, cells);
  double cost = u.squaredNorm();
  for (int k = 0; k < decisions; ++k) {
    u = product(p.state, u);
    cost += u.squaredNorm();
  }
  return cost;
}

class ControlExample : public Command {
 protected:
  void copy(const std::string& name) const { write(name, content(DPDE_SOURCE_DIR "/dsl-examples/control/" + name)); }
  Json json(const std::string& arguments) const {
    const Outcome outcome = dpde(arguments + " --threads 1 --json");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json();
  }
};

TEST_F(ControlExample, LinearPlantReachesTheRegulator) {
  copy("plant.dpde");
  const Plant p = plant();
  const MatrixXd least = least_cost(p);
  const Json loss = json("optimize plant.dpde regulate --iterations 16 --out .")["loss"];
  ASSERT_GT(loss.size(), 10U);
  EXPECT_NEAR(loss.front().get<double>() / cost_without_control(p), 1,
              1e-10);  // gains start from 0: the plant is the same
  EXPECT_GT(loss.back().get<double>(), least.trace());
  EXPECT_LT(loss.back().get<double>(), 1.001 * least.trace());

  json("run plant.dpde white --set end=0.1 --out white");
  const std::vector<double> states = NetcdfFile(path("white/white.nc")).values("u");
  const Eigen::Map<const MatrixXd> start(states.data(), cells, cells);  // a plant is a row of the file, a column here
  const double best = product(product(start.transpose(), least), start).trace();
  const double cost = json("gradient plant.dpde judge")["loss"];
  EXPECT_GT(cost, best);
  EXPECT_LT(cost, 1.01 * best);
  RecordProperty("cost", std::to_string(cost));
  RecordProperty("least", std::to_string(best));
}

TEST_F(ControlExample, BrusselatorIsHeldOnUnseenParametersAndNoise) {
  copy("brusselator.dpde");
  json("optimize brusselator.dpde hold --set cells.y=4 --set end=10 --iterations 60 --out .");
  const Json end = json("run brusselator.dpde unseen --set cells.y=16 --set end=40")["observables"];
  EXPECT_LT(end["held"], 5e-3);
  EXPECT_LT(end["worst"], 0.2);
  EXPECT_GT(end["free"], 0.2);
}

}  // namespace
}  // namespace dpde::testing
