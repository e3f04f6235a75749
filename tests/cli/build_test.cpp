// SPDX-License-Identifier: Apache-2.0
// dpde build: files of a library compiled ahead of time, and its errors. tests/hosts compiles libraries into host
// programs and compares them with closed forms.
#include <regex>

#include "command_support.h"

namespace dpde::testing {
namespace {

using BuildCommand = Command;

TEST_F(BuildCommand, WritesSourceHeaderLibraryAndCMake) {
  write("rod.dpde", rod_text);
  const Outcome outcome = dpde("build rod.dpde find -o made --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["files"],
            Json::array({"made/find.cpp", "made/find.h", "made/find.cmake", "made/libfind.so"}));
  const std::string header = content(path("made/find.h"));
  for (const char* part : {"class find : public dpde::Simulation", "void set_k(double value)",
                           "void get_u(dpde::Target to) const", "double k_bar() const", "double observe_size()"}) {
    EXPECT_NE(header.find(part), std::string::npos) << part << "\n" << header;
  }
  EXPECT_EQ(shell("nm -D --defined-only made/libfind.so").out.find("_row"), std::string::npos);
  EXPECT_NE(shell("nm -D --defined-only made/libfind.so").out.find("find_scene"), std::string::npos);
  EXPECT_EQ(shell("ldd made/libfind.so").out.find("LLVM"), std::string::npos);
  // The name of a macro.
  write("capital.dpde", std::regex_replace(std::string(rod_text), std::regex("\\bk\\b"), "D_1"));
  EXPECT_EQ(dpde("build capital.dpde find -o made --name other --set cells=8 --march x86-64-v2").status, 0);
  const std::string other = content(path("made/other.h"));
  EXPECT_NE(other.find("void set_D_1(double value)"), std::string::npos) << other;
  EXPECT_NE(other.find("double D_1_bar() const"), std::string::npos) << other;
  EXPECT_EQ(dpde("build rod.dpde find -o made --quiet").status, 0) << "its own files are replaced";
}

TEST_F(BuildCommand, MistakesAreToldApart) {
  write("rod.dpde", rod_text);
  Outcome outcome = shell("CXX=/no/such/compiler $DPDE build rod.dpde rod -o made --json");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0903"});
  EXPECT_NE(outcome.err.find("/no/such/compiler"), std::string::npos) << outcome.err;
  outcome = dpde("build rod.dpde rod -o /proc/nowhere --json");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0902"});
  outcome = dpde("build rod.dpde rod -o made --name class --json");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0904"});
  outcome = shell("mkdir -p mine && echo hello > mine/rod.h && $DPDE build rod.dpde rod -o mine --json");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(content(path("mine/rod.h")), "hello\n");
  outcome = dpde("build rod.dpde rood -o made --json");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(dpde("build rod.dpde rod").status, 2) << "no folder";
  write("kernel.dpde", "kernel k(u: field, out v: field) { v = 2*u }\nprogram p { run k\n swap u, v }\n");
  outcome = dpde("build kernel.dpde -o made --json");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0908"}) << "a program without a scene";
}

TEST_F(BuildCommand, NothingIsWrittenWhereItFails) {
  write("rod.dpde", rod_text);
  for (const std::string name : {"9x", "1", "dpde", "std", "a-b", "int"}) {
    const Outcome outcome = dpde("build rod.dpde rod -o made --name " + name + " --json");
    EXPECT_EQ(outcome.status, 2) << name << outcome.err;
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0904"}) << name;
    EXPECT_FALSE(fs::exists(path("made"))) << name;
  }
  EXPECT_EQ(shell("CXX=/no/such/compiler $DPDE build rod.dpde rod -o made").status, 3);
  EXPECT_FALSE(fs::exists(path("made")));
}

TEST_F(BuildCommand, MembersOfTheSameNameAreRefused) {
  write("clash.dpde",
        "model m { field u; param initial_u; dt(u) = initial_u*u }\n"
        "scene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = x; initial_u = 1; time 0 .. 1, step 1 }\n");
  const Outcome outcome = dpde("build clash.dpde s -o made");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("clash.dpde:2:7: error[E0904]: class s would have two members called set_initial_u"),
            std::string::npos)
      << outcome.err;
}

/// A control has one setter for all its intervals.
TEST_F(BuildCommand, AControlIsNoParameterOfTheClass) {
  write("c.dpde",
        "model m { field u; control F; dt(u) = F - u }\nscene s : m { grid x = 0 .. 1, cells 4, periodic\n"
        "F = t every 0.02; initial u = 1; time 0 .. 0.04, step 0.01 }\n");
  ASSERT_EQ(dpde("build c.dpde s -o made --name c --quiet").status, 0);
  const std::string header = content(path("made/c.h"));
  EXPECT_NE(header.find("set_control_F("), std::string::npos) << header;
  EXPECT_EQ(header.find("set_F("), std::string::npos) << header;
}

}  // namespace
}  // namespace dpde::testing
