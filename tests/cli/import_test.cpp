// SPDX-License-Identifier: Apache-2.0
// import: blocks of other files, and messages with the right file name.
#include "command_support.h"

namespace dpde::testing {
namespace {

class Import : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    fs::create_directories(path("lib"));
    write("lib/shapes.dpde", "function hill(x, w) = exp(-(x/w)^2)\n");
    write("lib/heat.dpde", heat);
    write("bar.dpde", "import \"lib/heat.dpde\"\nimport \"lib/shapes.dpde\"  # once more\n" + scene);
  }
  const std::string heat =
      "import \"shapes.dpde\"\nmodel heat {\n  field u\n  param D\n  dt(u) = D*lap(u)\n}\n"
      "scene other : heat { grid x = 0 .. 1, cells 4, periodic; D = 1; initial u = 0; time 0 .. 1, step 1 }\n";
  const std::string scene =
      "scene bar : heat {\n  grid x = 0 .. 1, cells 16, periodic\n  D = 0.1\n  initial u = hill(x - 0.5, 0.1)\n"
      "  time 0 .. 0.1, step 0.01\n  observe peak = mean(|u - 1|)\n}\n";
};

TEST_F(Import, RunsLikeOneFile) {
  write("one.dpde",
        "function hill(x, w) = exp(-(x/w)^2)\nmodel heat {\n  field u\n  param D\n  dt(u) = D*lap(u)\n}\n" + scene);
  const Outcome several = dpde("run bar.dpde --json --out a"), one = dpde("run one.dpde --json --out b");
  ASSERT_EQ(several.status, 0) << several.err;
  EXPECT_EQ(several.json()["scene"], "bar");  // not an imported one
  EXPECT_EQ(several.json()["observables"], one.json()["observables"]);
  EXPECT_EQ(content(path("a/u.npy")), content(path("b/u.npy")));
  EXPECT_EQ(dpde("run bar.dpde other --force --json").json()["scene"], "other");
}

TEST_F(Import, IsSpelledOutInDumpsAndFiles) {
  const Outcome whole = dpde("emit bar.dpde --stage ast");
  ASSERT_EQ(whole.status, 0) << whole.err;
  EXPECT_EQ(whole.out.find("import"), std::string::npos);
  write("whole.dpde", whole.out);
  EXPECT_EQ(dpde("emit whole.dpde --stage ast").out, whole.out);
  EXPECT_EQ(dpde("run whole.dpde bar --json").json()["observables"], dpde("run bar.dpde --json").json()["observables"]);
  ASSERT_EQ(dpde("run bar.dpde --out out").status, 0);
  EXPECT_EQ(content(path("out/bar.nc")).find("import \"lib"), std::string::npos);
  EXPECT_NE(content(path("out/bar.nc")).find("function hill"), std::string::npos);
}

TEST_F(Import, IsKeptByTheFormatter) {
  const std::string before = content(path("bar.dpde"));
  EXPECT_EQ(dpde("fmt bar.dpde").status, 0);
  EXPECT_EQ(content(path("bar.dpde")), "import \"lib/heat.dpde\"\nimport \"lib/shapes.dpde\"  # once more\n" + scene);
}

TEST_F(Import, MistakesAreToldWhereTheyStand) {
  std::string wrong = heat;
  write("lib/heat.dpde", wrong.replace(wrong.find("lap"), 3, "lapp"));
  const Json told = dpde("run bar.dpde --json").json()["diagnostics"][0];
  EXPECT_EQ(told["code"], "E0302");
  EXPECT_EQ(told["file"], "lib/heat.dpde");
  EXPECT_EQ(told["line"], 5);
  EXPECT_EQ(told["column"], 13);
  EXPECT_NE(dpde("run bar.dpde").err.find("lib/heat.dpde:5:13: error[E0302]"), std::string::npos);
}

TEST_F(Import, NamesAreGivenOnce) {
  write("bar.dpde", "import \"lib/heat.dpde\"\nmodel heat {\n  field v\n  dt(v) = 0\n}\n" + scene);
  const Outcome twice = dpde("run bar.dpde --json");
  EXPECT_EQ(twice.status, 2);
  EXPECT_EQ(twice.codes(), std::vector<std::string>{"E0303"});
  EXPECT_EQ(twice.json()["diagnostics"][0]["file"], "lib/heat.dpde");
}

TEST_F(Import, CyclesAndMissingFilesAreErrors) {
  write("lib/shapes.dpde", "import \"../bar.dpde\"\nfunction hill(x, w) = 1\n");
  const Outcome cycle = dpde("run bar.dpde --json");
  EXPECT_EQ(cycle.status, 2);
  EXPECT_EQ(cycle.codes(), std::vector<std::string>{"E0913"});
  EXPECT_EQ(cycle.json()["diagnostics"][0]["file"], "lib/shapes.dpde");
  write("self.dpde", "import \"self.dpde\"\n" + scene);
  EXPECT_EQ(dpde("check self.dpde --json").codes(), std::vector<std::string>{"E0913"});
  write("bar.dpde", "import \"none.dpde\"\nimport \"lib\"\nimport lib\n" + scene);
  EXPECT_EQ(dpde("check bar.dpde --json").codes(), (std::vector<std::string>{"E0901", "E0901"}));
  write("bar.dpde", "import lib\n" + scene);
  EXPECT_EQ(dpde("check bar.dpde --json").codes(), std::vector<std::string>{"E0201"});
}

using Magnitude = Command;

TEST_F(Magnitude, IsTheNormOfVectorsAndAbsOfNumbers) {
  const auto text = [](const std::string& value) {
    return "model m {\n  vector v\n  field u\n  dt(v) = 0\n  dt(u) = 0\n}\nscene s : m {\n  grid x = 0 .. 1, cells 4, "
           "periodic\n"
           "  grid y = 0 .. 1, cells 2, periodic\n  initial v = (-3, 4)\n  initial u = -x\n  time 0 .. 1, step 1\n  "
           "observe q = mean(" +
           value + ")\n}\n";
  };
  write("m.dpde", text("|v|^2 - |v|*|u - |u||"));  // 25 - 5*2x
  const Outcome nested = dpde("run m.dpde --json");
  ASSERT_EQ(nested.status, 0) << nested.err;
  EXPECT_DOUBLE_EQ(nested.json()["observables"]["q"], 20.0);
  EXPECT_NE(dpde("emit m.dpde --stage ast").out.find("mean(|v|^2 - |v|*|u - |u||)"), std::string::npos);
  write("m.dpde", text("|v"));
  EXPECT_EQ(dpde("run m.dpde --json").codes(), std::vector<std::string>{"E0201"});
  write("m.dpde", text("||"));
  EXPECT_EQ(dpde("run m.dpde --json").codes(), std::vector<std::string>{"E0201"});
}

}  // namespace
}  // namespace dpde::testing
