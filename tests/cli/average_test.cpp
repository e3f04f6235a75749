// SPDX-License-Identifier: Apache-2.0
// Losses of averages over states: meaning of average(...), and its derivatives through samples of all kinds.
#include <cmath>
#include <cstdlib>

#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string averaged_scenes = R"(
network closure(u) { real f64; initial he, seed 1; conv 2, 3; tanh; conv out, 1, gain = 0.1 }
model burgers { field u; param nu, a = 1; dt(u) = -u*dx(u) + nu*lap(u) }
function far(p, q) = (average(p)/average(q) - 1)^2
scene fine : burgers {
  grid x = 0 .. 2*pi, cells 8, periodic
  nu = 0.05
  initial u = a*sin(x) + 0.3*cos(2*x + 1)
  time 0 .. 1/2, step 1/32
}
scene coarse = fine { after step: u += closure(u) }
scene loose = fine { time 0 .. 1/2, step 1/32, tolerance 1e-3 }
scene split = fine { time 0 .. 1/2, step 1/32, courant 0.05, speed |u| }
dataset train : fine { runs 2; seed 1; vary a in 0.5 .. 1.5; frames every 1/16; file "train.nc" }
)";

std::string over_time(const std::string& losses, const std::string& scene = "fine") {
  return averaged_scenes + "task t : " + scene + R"( {
    data seen = u from scene fine over time
    unknown nu from 0.02; unknown initial u from 0.5*sin(x)
)" + losses +
         "\n using lbfgs(), iterations 4 }\n";
}
std::string over_windows(const std::string& losses, const std::string& options, const std::string& steps = "8") {
  std::string text = losses;
  for (std::size_t at = 0; (at = text.find(" N ", at)) != std::string::npos;) text.replace(at + 1, 1, steps);
  return averaged_scenes +
         "task t : coarse { data r = trajectories(\"train.nc\", u); learn closure; unknown nu from 0.04\n" + text +
         "\n using " + options + " }\n";
}

class Averages : public Command {
 protected:
  Json gradient(const std::string& text) const {
    write("t.dpde", text);
    const Outcome outcome = dpde("gradient t.dpde t --json");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.json();
  }
  Json learn(const std::string& text, const std::string& more = "") const {
    write("t.dpde", text);
    const Outcome outcome = dpde("optimize t.dpde t --json " + more);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.json();
  }
  void make_data() const {
    write("t.dpde", averaged_scenes);
    ASSERT_EQ(dpde("run t.dpde train --out .").status, 0);
  }
};

void expect_near(const Json& one, const Json& other, double relative, double factor = 1) {
  const double wanted = factor * other.get<double>();
  EXPECT_NEAR(one.get<double>(), wanted, relative * std::abs(wanted));
}

TEST_F(Averages, AreMeansOverTheStates) {
  const Json plain = gradient(over_time("minimise mean((u - seen)^2) over time"));
  const Json one = gradient(over_time("minimise average(mean((u - seen)^2)) over time"));
  const Json square = gradient(over_time("minimise 3*average(mean((u - seen)^2))^2 + nu over time"));
  const double q = plain["loss"].get<double>();
  expect_near(one["loss"], plain["loss"], 1e-13);
  EXPECT_NEAR(square["loss"].get<double>(), 3 * q * q + 0.02, 1e-13);
  expect_near(one["gradient"]["nu"]["value"], plain["gradient"]["nu"]["value"], 1e-11);
  EXPECT_NEAR(square["gradient"]["nu"]["value"].get<double>(),
              6 * q * plain["gradient"]["nu"]["value"].get<double>() + 1, 1e-11);
  expect_near(square["gradient"]["u"]["norm"], plain["gradient"]["u"]["norm"], 1e-11, 6 * q);
}

/// The loss of a quantity's average over a sample's states equals the ordinary loss of the quantity: with frames at
/// every second step, growing samples, and truncated gradients.
TEST_F(Averages, OfWindowsAreThoseOfTheirFrames) {
  make_data();
  const std::string options = "adam(rate = 1e-3), batch 3, epochs 4, unroll (4, 8), cut 4, clip 1, noise 0.01";
  const Json plain = learn(over_windows("minimise mean((u - r)^2) over N steps", options));
  const Json same = learn(over_windows("minimise average(mean((u - r)^2)) over N steps", options));
  ASSERT_EQ(same["loss"].size(), plain["loss"].size());
  for (std::size_t k = 0; k < plain["loss"].size(); ++k) expect_near(same["loss"][k], plain["loss"][k], 1e-9);
}

TEST_F(Averages, TrainToTheSameBitsWhateverHappens) {
  make_data();
  const std::string text = over_windows(
      "minimise (average(mean(u^2)) - average(mean(r^2)))^2 over N steps\n"
      "minimise far(mean(dx(u)^2), mean(dx(r)^2)) over N steps",
      "adam(rate = 1e-3), batch 3, epochs 4");
  const Json whole = learn(text, "--threads 2 --out whole");
  EXPECT_LT(whole["epochs"][3]["loss"].get<double>(), whole["epochs"][0]["loss"].get<double>());
  EXPECT_EQ(learn(text, "--threads 1")["loss"], whole["loss"]);
  learn(text, "--out parts --epochs 2");
  EXPECT_EQ(learn(text, "--out parts --resume")["loss"], whole["loss"]);
  EXPECT_EQ(content(path("parts/closure.safetensors")), content(path("whole/closure.safetensors")));
  const Json tested = dpde("verify t.dpde t --json").json();
  EXPECT_EQ(tested["passed"], true) << tested;
  EXPECT_NEAR(tested["taylor"]["slope"].get<double>(), 2, 0.01);
}

/// Every kind of time step and every position in a sample.
TEST_F(Averages, HaveExactDerivatives) {
  const std::string energy = "minimise (average(mean(u^2)) - average(mean(seen^2)))^2 over time\n",
                    shape =
                        "minimise nu*log(average(mean(u^4))/average(mean(u^2))^2) + far(mean(u^2), mean(seen^2)) "
                        "over time; minimise 1e-2*mean((u - seen)^2)\n";
  std::vector<std::string> cases{over_time(energy + shape)};
  if (std::getenv("DPDE_THOROUGH") != nullptr) {
    for (const char* scene : {"loose with careful", "split", "coarse"}) cases.push_back(over_time(shape, scene));
    cases.push_back(over_time("minimise far(mean(abs(u)), max(u)) over time"));
    cases.push_back(over_time("minimise exp(-average(sample(u, at = 1)))  over time"));
    cases.push_back(over_time("minimise (average(mean(u*closure(u))) - 1)^2 over time; learn closure", "coarse"));
  }
  for (const std::string& text : cases) {
    write("t.dpde", text + "scheme careful { time = bs32 }\n");
    const Outcome verified = dpde("verify t.dpde t --json");
    EXPECT_EQ(verified.status, 0) << text << verified.err << verified.out;
    EXPECT_TRUE(verified.json()["untested"].empty()) << text;
  }
}

TEST_F(Averages, AreOfLossesAlone) {
  make_data();
  const std::string of_windows = "minimise (average(mean(u^2)) - 1)^2 over N steps";
  const struct {
    std::string text;
    const char* said;
  } cases[] = {
      {over_time("minimise average(mean(u^2)) + mean(u^2) over time"), "once a run"},
      {over_time("minimise average(mean(u^2))*t over time"), "once a run"},
      {over_time("minimise average(mean(u^2))"), "over time, or over 8 steps"},
      {over_time("minimise average(mean(u^2)) at t = 1/2"), "over time, or over 8 steps"},
      {over_time("minimise average(mean(u^2)), sum over time"), "one number a run"},
      {over_time("minimise average(average(mean(u^2))) over time"), "an average"},
      {over_time("minimise average(u^2) over time"), "write mean(u^2)"},
      {over_time("minimise mean(u^2) over time; test e = average(mean(u^2)) over time"), "states of a loss"},
      {over_time("minimise if(average(mean(u^2)) > 0.2, 1, 2)*average(mean(u^2)) over time"), "jump"},
      {over_windows(of_windows, "newton_cg(), epochs 2"), "newton_cg"},
  };
  for (const auto& [text, said] : cases) {
    write("t.dpde", text);
    const Outcome refused = dpde("optimize t.dpde t");
    EXPECT_EQ(refused.status, 2) << text << refused.out << refused.err;
    EXPECT_NE(refused.err.find(said), std::string::npos) << text << refused.err;
  }
}

}  // namespace
}  // namespace dpde::testing
