// SPDX-License-Identifier: Apache-2.0
// The Kolmogorov flow example on a quarter of its cells: data from a spectral solver, averaged over faces, fit the
// staggered grid; each network is certified at one of their frames and stays accurate longer than its base scheme.
#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class KolmogorovFlow : public Command {
 protected:
  void make() const {
    const std::string text = rewritten(content(DPDE_SOURCE_DIR "/dsl-examples/kolmogorov/kolmogorov.dpde"),
                                       {{"cells 64", "cells 16"},
                                        {"cells 256", "cells 64"},
                                        {"cells 128", "cells 32"},
                                        {"step 1/48", "step 1/24"},
                                        {"step 1/96", "step 1/48"},
                                        {"step 1/192", "step 1/48"},
                                        {"0 .. 12", "0 .. 3"},
                                        {"from 6 to 12", "from 2 to 3"},
                                        {"runs 16", "runs 2"},
                                        {"conv 16", "conv 6"},
                                        {"over 16 steps", "over 6 steps"},
                                        {"epochs 18, unroll (4, 8, 16)", "epochs 6"},
                                        {"batch 8", "batch 4"},
                                        {"288 steps", "24 steps"},
                                        {"nu = 0.001", "nu = 0.005"},
                                        {"\"train.nc\", u", "\"unseen_64.nc\", u"},
                                        {"rate = 2e-3", "rate = 1e-2"}});
    write("f.dpde", text);
    ASSERT_EQ(dpde("run f.dpde unseen --out . --threads 1 --json").status, 0);
  }
};

TEST_F(KolmogorovFlow, NetworksLastLongerThanTheirBase) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  make();
  std::vector<std::string> tasks = {"correct"};
  if (is_thorough()) tasks.insert(tasks.end(), {"curled", "interpolate_by_network", "curled_rotational"});
  for (const std::string& task : tasks) {
    SCOPED_TRACE(task);
    const Outcome outcome = dpde("optimize f.dpde " + task + " --threads 1 --beside-named-only --json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json lasts = outcome.json()["correlation"]["vorticity"], beside = lasts["beside"];
    EXPECT_GT(lasts["time"]["mean"].get<double>(), 1.05 * lasts["start"]["time"]["mean"].get<double>());
    // After 1/8; a shift of half a cell would give a lower correlation.
    for (const char* fine : {"plain_128", "spectral_128", "rotational_128"})
      EXPECT_GT(beside[fine]["course"][0].get<double>(), 0.99) << fine;
  }
}

TEST_F(KolmogorovFlow, NetworksAreCertifiedAtAFrame) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  make();
  for (const char* task : {"correct", "curled", "interpolate_by_network", "curled_rotational"}) {
    const Json certificate = dpde("verify f.dpde " + std::string(task) + " --threads 1 --json").json();
    EXPECT_TRUE(certificate["passed"].get<bool>()) << task;
    EXPECT_EQ(certificate["window"]["file"], "unseen_64.nc") << task;
  }
}

}  // namespace
}  // namespace dpde::testing
