// SPDX-License-Identifier: Apache-2.0
// Reports of certificates on unknowns whose derivative no test checks, as text and JSON, for each command.
#include "command_support.h"

namespace dpde::testing {
namespace {

class UntestedCommand : public Command {
 protected:
  /// A decay with rate k; c is in a source term and in a term of the loss.
  std::string decay(const std::string& name, const std::string& source, const std::string& loss,
                    const std::string& scheme = "") const {
    return write(name, "model m { field u; param k = 1.3; param c = 0.0333; dt(u) = -k*u" + source +
                           " }\n"
                           "scheme e { time = euler" +
                           scheme +
                           " }\n"
                           "scene s : m with e { grid x = 0 .. 1, cells 4, periodic\n"
                           "  initial u = 1 + 0.1*sin(2*pi*x); time 0 .. 0.1, step 1/100 }\n"
                           "task find : s { unknown k; unknown c; minimise mean(u^2)" +
                           loss + "; using gradient_descent(rate = 1e-3), iterations 1 }\n");
  }
};

using Names = std::vector<std::string>;

struct Row {
  const char *verb, *certificate;  // where the JSON has it
  Names said;                      // names in the text
};

const Row untested_rows[] = {
    {"verify", "", {"certified but for c: ", "by c the derivative is 0, or below rounding, and was not tested: "}},
    {"gradient --certify",
     "certificate",
     {"certified in part: ", "not checked: c: ", "d loss / d c = 0\n  exactly 0: "}},
    {"optimize --certify", "certificate", {"certified in part: ", "not checked: c: "}},
};

/// A ramp narrower than a step: c has a derivative, which is 0 at almost every c.
TEST_F(UntestedCommand, IsNamedByEachVerb) {
  const std::string file = decay("ramp.dpde", " + min(1, max(0, 1e9*(t - c)))", "");
  for (const Row& row : untested_rows) {
    const std::string verb = row.verb;
    const std::string command =
        verb.substr(0, verb.find(' ')) + " " + file + verb.substr(std::min(verb.size(), verb.find(' ')));
    const Outcome text = dpde(command);
    EXPECT_EQ(text.status, 0) << text.err;
    for (const std::string& part : row.said) EXPECT_NE(text.out.find(part), std::string::npos) << part << text.out;
    EXPECT_NE(text.out.find("a ramp narrower than a step or a cell"), std::string::npos) << text.out;
    EXPECT_EQ(text.out.find("f32"), std::string::npos) << text.out;
    const Outcome told = dpde(command + " --json");
    EXPECT_EQ(told.status, 0) << told.err;
    const Json json = told.json();
    const Json& certificate = *row.certificate == 0 ? json : json[row.certificate];
    EXPECT_EQ(certificate["untested"], Json(Names{"c"})) << json;
  }
}

/// A derivative that is small compared with the others is checked separately and counts as tested. Losses do not help
/// against rounding.
TEST_F(UntestedCommand, IsNoneThatIsOnlySmall) {
  for (const auto& [source, loss] : {std::pair{" + 1e-13*c*u", ""}, std::pair{"", " + 1e-12*(c - 5)^2"}}) {
    const std::string file = decay("small.dpde", source, loss);
    const Outcome verified = dpde("verify " + file);
    EXPECT_EQ(verified.status, 0) << verified.err;
    EXPECT_NE(verified.out.find("\ncertified: "), std::string::npos) << verified.out;
    EXPECT_NE(verified.out.find(", by c alone"), std::string::npos) << verified.out;
    EXPECT_EQ(dpde("verify " + file + " --json").json()["untested"], Json::array());
    const Json certificate = dpde("gradient " + file + " --certify --json").json()["certificate"];
    EXPECT_EQ(certificate["untested"], Json(Names{"c"})) << certificate;
  }
}

TEST_F(UntestedCommand, IsNoneWhereAllIsTested) {
  const std::string file = decay("plain.dpde", " + c", "");
  EXPECT_EQ(dpde("verify " + file + " --json").json()["untested"], Json::array());
  const Outcome first = dpde("gradient " + file + " --certify --json");
  EXPECT_EQ(first.json()["certificate"]["untested"], Json::array()) << first.out;
  EXPECT_EQ(dpde("gradient " + file + " --certify").out.find("in part"), std::string::npos);
}

/// Also from the cache; and all unknowns if nothing was checked.
TEST_F(UntestedCommand, IsKept) {
  const std::string file = decay("ramp.dpde", " + min(1, max(0, 1e9*(t - c)))", "");
  EXPECT_EQ(dpde("gradient " + file + " --certify").status, 0);
  const Json kept = dpde("gradient " + file + " --json").json()["certificate"];
  EXPECT_EQ(kept["from_cache"], true);
  EXPECT_EQ(kept["untested"], Json(Names{"c"})) << kept;
}

TEST_F(UntestedCommand, MayBeWhatSinglePrecisionLoses) {
  const Outcome found = dpde("gradient " + decay("single.dpde", "", " + 1e-60*c", "; real = f32"));
  EXPECT_EQ(found.status, 0) << found.err;
  EXPECT_NE(found.out.find("below what f32 holds"), std::string::npos) << found.out;
}

}  // namespace
}  // namespace dpde::testing
