// SPDX-License-Identifier: Apache-2.0
// Data sets that store their runs on several grids.
#include <fmt/format.h>

#include <filesystem>

#include "command_support.h"
#include "dpde/runtime/netcdf.h"

namespace dpde::testing {
namespace {

const std::string grid_scene = R"(
model burgers { field u; vector v on faces; param a; dt(u) = -u*dx(u) + 0.05*lap(u); dt(v) = 0.01*lap(v) }
scene waves : burgers {
  grid x = 0 .. 2*pi, cells 32, periodic
  a = 1
  initial u = a*sin(x)
  initial v = a*cos(x)
  time 0 .. 1, step 1/32
}
)";

class DataSetGrids : public Command {};

/// One file per grid, byte-identical to data sets with a single grid, except for the text of the block.
TEST_F(DataSetGrids, AreFilesOfTheSameRuns) {
  const std::string runs = "dataset d : waves { runs 2; vary a in 0.5 .. 1.5; frames every 1/8 from 1/4 to 1/2; ";
  write("both.dpde", grid_scene + runs + "coarsen 4 in \"a.nc\"; coarsen 2 in \"b.nc\"; coarsen 1 in \"c.nc\" }\n");
  const Outcome made = dpde("run both.dpde d --out both --json");
  ASSERT_EQ(made.status, 0) << made.out << made.err;
  EXPECT_EQ(made.json()["cells"], Json::array({8}));
  EXPECT_EQ(made.json()["others"]["b.nc"]["cells"], Json::array({16}));
  EXPECT_EQ(made.json()["others"]["c.nc"]["cells"], Json::array({32}));
  for (const auto& [file, ratio] : {std::pair("a", 4), std::pair("b", 2), std::pair("c", 1)}) {
    write("one.dpde", grid_scene + runs + fmt::format("coarsen {}; file \"{}.nc\" }}\n", ratio, file));
    const Outcome one = dpde("run one.dpde d --out one --json");
    ASSERT_EQ(one.status, 0) << one.err;
    const NetcdfReader several(content(path(fmt::format("both/{}.nc", file))), "several"),
        alone(content(path(fmt::format("one/{}.nc", file))), "alone");
    for (const NetcdfReader::Variable& variable : alone.variables()) {
      const NetcdfReader::Variable* same = several.find(variable.name);
      ASSERT_NE(same, nullptr) << variable.name;
      EXPECT_EQ(several.read(*same), alone.read(variable)) << file << " " << variable.name;
    }
  }
  const Outcome again = dpde("run both.dpde d --out both --resume --json");
  EXPECT_EQ(again.json()["resumed_runs"], 2);
  EXPECT_EQ(again.json()["others"], made.json()["others"]);
  std::filesystem::remove(path("both/b.nc"));
  EXPECT_EQ(dpde("run both.dpde d --out both --resume --json").json()["resumed_runs"], 0);
  EXPECT_TRUE(std::filesystem::exists(path("both/b.nc")));
  for (const char* wrong : {"coarsen 4 in \"a.nc\"; coarsen 2", "coarsen 4 in \"a.nc\"; coarsen 2 in \"a.nc\"",
                            "file \"b.nc\"; coarsen 4 in \"a.nc\"", "coarsen 4 in a", "coarsen 3 in \"a.nc\""}) {
    write("wrong.dpde", grid_scene + runs + wrong + " }\n");
    const Outcome refused = dpde("run wrong.dpde d --out wrong --json");
    EXPECT_EQ(refused.status, 2) << wrong;
    EXPECT_EQ(refused.codes(), std::vector<std::string>{"E0707"}) << wrong << refused.err;
  }
}

}  // namespace
}  // namespace dpde::testing
