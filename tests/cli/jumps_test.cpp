// SPDX-License-Identifier: Apache-2.0
// Derivatives that lack the effect of a jump: with each command, with and without --force, in text and JSON. Nothing is
// certified without mentioning the jump.
#include <algorithm>
#include <string>
#include <vector>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

std::string decay_that_jumps(const std::string& rate, const std::string& from) {
  return "model m { field u; param k = 1; dt(u) = -k*" + rate + " }\nscene s : m { initial u = 1; time 0 .. 1, " +
         "step 1/50 }\ntask t : s { unknown k" + from +
         "; minimise (u - 0.3)^2 at t = 1; using lbfgs(), iterations 2 }\n";
}

struct JumpCase {
  std::string rate, from;
  bool jumps;
  bool acts;      // in the run
  bool is_found;  // by the certificate, next to the point
  bool is_watched = true;
};
const std::vector<JumpCase> jump_cases = {{"if(u > 0.5, 1, 0.2)", "", true, true, true},
                                          {"if(u > -5, 1, 0.2)", " from 0.2", true, false, false},
                                          {"(2 + sign(u - 0.5))", "", true, true, false},
                                          {"(1 + floor(2*u))", "", true, true, true, false},
                                          {"max(u, 0.5)", "", false, false, false}};

using JumpsLeftOut = Command;

TEST_F(JumpsLeftOut, AreToldByEachVerb) {
  for (std::size_t i = 0; i < jump_cases.size(); ++i) {
    const JumpCase& c = jump_cases[i];
    if (!is_tried(i, 2)) continue;
    write("j.dpde", decay_that_jumps(c.rate, c.from));
    for (const std::string verb : {"gradient", "optimize", "verify"}) {
      const bool certifies = verb == "verify";  // also without --force
      for (const bool is_forced : {false, true}) {
        const std::string command = verb + " j.dpde t" + (is_forced ? " --force" : "");
        const std::string what = command + ": " + c.rate;
        const Outcome json = dpde(command + " --json"), text = dpde(command);
        const std::vector<std::string> codes = json.codes();
        const bool is_refused = c.acts && !is_forced && !certifies, is_watched = c.is_watched && !is_forced;
        const int status = is_refused ? 2 : certifies && (is_watched ? c.acts : c.is_found) ? 1 : 0;
        const bool is_left_out = c.jumps && !is_refused && !is_watched;
        EXPECT_EQ(json.status, status) << what << json.err;
        EXPECT_EQ(text.status, status) << what << text.err;
        const auto has = [&](const std::string& code) { return std::ranges::count(codes, code); };
        EXPECT_EQ(has("E0609") + has("E0601"), is_refused ? 1 : 0) << what << json.out;
        EXPECT_EQ(has("W0609"), is_left_out ? 1 : 0) << what << json.out;
        EXPECT_EQ(text.err.find("W0609") != std::string::npos, is_left_out) << what;
        const bool says_certified =
            text.out.find("\ncertified:") != std::string::npos || text.out.starts_with("certified:");
        EXPECT_EQ(says_certified, !is_left_out && !c.acts) << what << text.out;
        if (!is_left_out || certifies || verb != "gradient") continue;
        EXPECT_NE(json.json()["certificate"]["left_out"].dump().find("W0609"), std::string::npos) << what << json.out;
      }
    }
  }
}

/// After the jump the right slope is -0.2: the missing part is most of the gradient.
TEST_F(JumpsLeftOut, AreOfTheSizeOfTheGradient) {
  const auto text = [](const std::string& k) {
    return "model m { field u; param k = " + k + "; dt(u) = -k*if(u > 0.5, 1, 0.2) }\n" +
           "scene s : m { initial u = 1; time 0 .. 1, step 1/1000 }\ntask t : s { unknown k; minimise u at t = 1 }\n";
  };
  write("j.dpde", text("1"));
  const Outcome forced = dpde("gradient j.dpde t --force --json");
  EXPECT_NEAR(forced.json()["gradient"]["k"]["value"].get<double>(), -0.6, 1e-3);
  EXPECT_EQ(forced.codes(), std::vector<std::string>{"W0609"});
}

struct SignCase {
  std::string rate, k;
  bool is_lost;
};
/// p decreases from 1 by k.
const std::vector<SignCase> sign_cases = {{"atan(1/p)", "1.3", true},
                                          {"atan(1/(1 + p))", "1.3", false},
                                          {"turned(2*p)", "1.3", true},
                                          {"atan(1/p)", "0.7", false}};

/// A divisor loses the sign for which a formula is written.
TEST_F(JumpsLeftOut, OfSignsThatAreLostAreToldByEachVerb) {
  for (std::size_t i = 0; i < sign_cases.size(); ++i) {
    const SignCase& c = sign_cases[i];
    if (!is_tried(i, 2)) continue;
    write("s.dpde", "operator turned(z) order 0 = atan(1/z)\nmodel m { field p, q; param k = " + c.k +
                        "; dt(p) = -k; dt(q) = " + c.rate +
                        " }\nscene s : m { initial p = 1; initial q = 0; time 0 .. 1, step 1/200 }\n"
                        "task t : s { unknown k; minimise (q + 1)^2; using lbfgs(), iterations 2 }\n");
    for (const std::string verb : {"gradient", "optimize", "verify"}) {
      const Outcome found = dpde(verb + " s.dpde t --json");
      const std::vector<std::string> codes = found.codes();
      const std::string code = verb == "verify" ? "E0804" : "E0609";
      EXPECT_EQ(std::ranges::count(codes, code), c.is_lost ? 1 : 0) << verb << ": " << c.rate << found.out;
      EXPECT_EQ(found.status, !c.is_lost ? 0 : verb == "verify" ? 1 : 2) << verb << ": " << c.rate << found.err;
      if (c.is_lost) EXPECT_NE(found.err.find("(t = 0.77): this divides by "), std::string::npos) << found.err;
    }
    const Outcome forced = dpde("gradient s.dpde t --force --certify");
    EXPECT_EQ(forced.status, 0) << forced.err;
    EXPECT_NE(forced.err.find("W0609"), std::string::npos) << forced.err;
    EXPECT_NE(forced.out.find("certified in part"), std::string::npos) << forced.out;
    EXPECT_NE(forced.out.find("keeps its sign in the run"), std::string::npos) << forced.out;
  }
}

/// p reverses within each step: at the ends of steps it is 1.1.
TEST_F(JumpsLeftOut, WithinSubcyclesAreRefused) {
  const auto expect_codes = [&](const std::string& formula, const std::string& k, bool is_lost) {
    write("s.dpde", "model m { field p, r, q; param k = " + k +
                        "; dt(p) = 20*r + 0*q; dt(r) = -20*(p - k) + 0*q; dt(q) = " + formula +
                        " }\nscheme c { time = rk4 }\nscene s : m with c { initial p = 1.1; initial r = 0; "
                        "initial q = 0; time 0 .. pi/2, step pi/10\n subcycle q in 40\n subcycle p, r in 40\n}\n"
                        "task t : s { unknown k; minimise (q + 1)^2 }\n");
    for (const std::string verb : {"gradient", "verify"}) {
      const Outcome json = dpde(verb + " s.dpde t --json");
      const std::string code = verb == "verify" ? "E0804" : "E0609";
      EXPECT_EQ(json.codes(), is_lost ? std::vector<std::string>{code} : std::vector<std::string>())
          << verb << ": " << formula << json.err;
      EXPECT_EQ(json.status, !is_lost ? 0 : verb == "verify" ? 1 : 2) << verb << ": " << formula << json.err;
    }
  };
  expect_codes("atan(1/p)", "0.8", false);
  expect_codes("atan(1/p)", "0.5", true);
  expect_codes("p*if(p > 0.4, 1, 0)", "0.8", false);
  expect_codes("p*if(p > 0.4, 1, 0)", "0.7", true);
  expect_codes("atan(1/(p^2 + 1))", "0.5", false);
}

/// The first step of Adam takes p through 0; a line search takes shorter ones.
TEST_F(JumpsLeftOut, OfSignsThatStepsOfASearchLose) {
  const auto found = [&](const std::string& method) {
    write("s.dpde",
          "model m { field p, q; param k = 0.7; dt(p) = -k; dt(q) = atan(1/p) }\n"
          "scene s : m { initial p = 1; initial q = 0; time 0 .. 1, step 1/200 }\n"
          "task t : s { unknown k; minimise (q - 2)^2; using " +
              method + ", iterations 30 }\n");
    return dpde("optimize s.dpde t --json");
  };
  const Outcome adam = found("adam(rate = 0.5)"), lbfgs = found("lbfgs()");
  EXPECT_EQ(adam.codes(), std::vector<std::string>{"E0803"}) << adam.err;
  EXPECT_NE(adam.err.find("this divides by p, which changes its sign"), std::string::npos) << adam.err;
  EXPECT_EQ(lbfgs.status, 0) << lbfgs.err;
  EXPECT_LE(lbfgs.json()["unknowns"]["k"]["value"].get<double>(), 1.01) << lbfgs.out;
}

}  // namespace
}  // namespace dpde::testing
