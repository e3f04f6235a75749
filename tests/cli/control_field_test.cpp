// SPDX-License-Identifier: Apache-2.0
// Control fields of the command: files of all intervals, resumed searches and runs, and the memory predicted by check.
#include "command_support.h"

namespace dpde::testing {
namespace {

constexpr const char* text = R"(model spill {
  field c
  control field F
  param k
  dt(c) = k*lap(c) + F
}
scheme e { time = rk2 }
scene s : spill with e {
  grid x = 0 .. 1, cells 6
  boundary c: x = zero_gradient
  k = 0.02
  initial c = 1 + 0.1*noise(2)
  F = noise(3)*sin(t) every 0.3
  time 0 .. 1, step 0.1
}
task t : s {
  unknown F from 0 in -1 .. 4
  minimise mean((c - 2)^2)
  minimise 1e-2*mean(F^2) over time
  using lbfgs(), iterations 12
}
task further : s {
  unknown F from load("found.npy")
  minimise mean((c - 2)^2)
  minimise 1e-2*mean(F^2) over time
}
)";

class ControlFields : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("spill.dpde", text);
  }
};

TEST_F(ControlFields, AreWrittenAndReadWithAllIntervals) {
  const Outcome found = dpde("optimize spill.dpde t --json --out o");
  ASSERT_EQ(found.status, 0) << found.err;
  const std::string array = content(path("o/F.npy"));
  EXPECT_NE(array.find("'shape': (4, 6)"), std::string::npos) << array.substr(0, 80);
  fs::copy_file(path("o/F.npy"), path("found.npy"));
  const Outcome further = dpde("gradient spill.dpde further --json --out g");
  ASSERT_EQ(further.status, 0) << further.err;
  EXPECT_NEAR(further.json()["loss"].get<double>(), found.json()["loss"].back().get<double>(), 1e-15);
  EXPECT_NE(content(path("g/gradient_F.npy")).find("'shape': (4, 6)"), std::string::npos);
  write("wrong.dpde", std::string(text).replace(std::string(text).find("every 0.3"), 9, "every 0.5"));
  EXPECT_EQ(dpde("check wrong.dpde further --json").codes(), std::vector<std::string>{"E0905"});
}

TEST_F(ControlFields, ScenesReadThemToo) {
  ASSERT_EQ(dpde("optimize spill.dpde t --json --out o").status, 0);
  fs::copy_file(path("o/F.npy"), path("found.npy"));
  std::string read = text;
  read.replace(read.find("noise(3)*sin(t)"), 15, "load(\"found.npy\")");
  write("read.dpde", read);
  ASSERT_EQ(dpde("run read.dpde s --json --out r").status, 0);
  const Outcome verified = dpde("verify read.dpde further --json");  // on other grids, too
  EXPECT_EQ(verified.status, 0) << verified.err << verified.out;
}

TEST_F(ControlFields, ASearchGoesOnToTheSameEnd) {
  ASSERT_EQ(dpde("optimize spill.dpde t --json --out whole").status, 0);
  ASSERT_EQ(dpde("optimize spill.dpde t --json --out part --iterations 5").status, 0);
  const Outcome rest = dpde("optimize spill.dpde t --json --out part --resume");
  ASSERT_EQ(rest.status, 0) << rest.err;
  EXPECT_EQ(content(path("part/F.npy")), content(path("whole/F.npy")));
  const Outcome changed = dpde("optimize spill.dpde t --json --out part --resume --set k=0.03");
  EXPECT_NE(changed.status, 0);
}

TEST_F(ControlFields, ALongerRunGoesOnToTheSameEnd) {
  ASSERT_EQ(dpde("run spill.dpde s --json --out whole").status, 0);
  ASSERT_EQ(dpde("run spill.dpde s --json --set end=0.5 --checkpoint-every 5 --out half").status, 0);
  const Outcome rest = dpde("run spill.dpde s --json --resume --out half --set end=1 --threads 2");
  ASSERT_EQ(rest.status, 0) << rest.err;
  EXPECT_EQ(content(path("half/c.npy")), content(path("whole/c.npy")));
  ASSERT_EQ(dpde("run spill.dpde s --json --set end=0.5 --checkpoint-every 5 --out half").status, 0);
  write("spill.dpde", std::string(text).replace(std::string(text).find("every 0.3"), 9, "every 0.2"));
  EXPECT_EQ(dpde("run spill.dpde s --json --resume --out half --set end=1").codes(), std::vector<std::string>{"E0914"});
}

/// One field per interval, and one more for its gradient.
TEST_F(ControlFields, TheirMemoryIsForetold) {
  const auto memory = [&](const std::string& every, const char* key) {
    write("m.dpde", std::string(text).replace(std::string(text).find("every 0.3"), 9, "every " + every));
    return dpde("check m.dpde t --json").json()[key].get<double>();
  };
  for (const char* key : {"memory_bytes", "gradient_memory_bytes"}) {
    const double one = memory("1", key), two = memory("0.5", key), five = memory("0.2", key), ten = memory("0.1", key);
    EXPECT_GE(two - one, 6 * 8) << key;
    EXPECT_EQ(five - two, 3 * (two - one)) << key;
    EXPECT_EQ(ten - five, 5 * (two - one)) << key;
  }
}

}  // namespace
}  // namespace dpde::testing
