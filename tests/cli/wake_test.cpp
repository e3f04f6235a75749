// SPDX-License-Identifier: Apache-2.0
// The wake of Um and others (2020) against the "no model" column of their table: row A16a of the acceptance table, here
// for one Reynolds number and 50 of its 500 steps. tests/bench/wake.py does all.
#include <fstream>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// The velocities on the faces of n x 2n cells, x fastest: vx on (n+1) x 2n of them, vy on n x (2n+1).
struct Faces {
  int n;
  std::vector<double> vx, vy;
};

/// A run's last states, without values beyond the faces.
Faces faces_of(const std::string& folder, int n) {
  const NpyArray x = read_npy(folder + "/vx.npy"), y = read_npy(folder + "/vy.npy");
  Faces result{n, {}, {}};
  const auto at = [&](const NpyArray& a, int i, int j) {
    return a.values.at(static_cast<std::size_t>(j * (n + 2) + i));
  };
  for (int j = 1; j <= 2 * n; ++j) {
    for (int i = 0; i <= n; ++i) result.vx.push_back(at(x, i, j));
  }
  for (int j = 0; j <= 2 * n; ++j) {
    for (int i = 1; i <= n; ++i) result.vy.push_back(at(y, i, j));
  }
  return result;
}

/// Every second face along the component's axis, averages of two across it.
Faces halved(const Faces& fine) {
  const int n = fine.n / 2;
  Faces result{n, {}, {}};
  const auto x = [&](int i, int j) { return fine.vx.at(static_cast<std::size_t>(j * (fine.n + 1) + i)); };
  const auto y = [&](int i, int j) { return fine.vy.at(static_cast<std::size_t>(j * fine.n + i)); };
  for (int j = 0; j < 2 * n; ++j) {
    for (int i = 0; i <= n; ++i) result.vx.push_back((x(2 * i, 2 * j) + x(2 * i, 2 * j + 1)) / 2);
  }
  for (int j = 0; j <= 2 * n; ++j) {
    for (int i = 0; i < n; ++i) result.vy.push_back((y(2 * i, 2 * j) + y(2 * i + 1, 2 * j)) / 2);
  }
  return result;
}

/// In arrays with a ring of additional cells; values beyond the faces are never read.
void write_arrays(const Faces& faces, const std::string& folder) {
  const int n = faces.n;
  std::vector<double> vx(static_cast<std::size_t>((n + 2) * (2 * n + 2))), vy(vx.size());
  const auto at = [&](std::vector<double>& a, int i, int j) -> double& {
    return a.at(static_cast<std::size_t>(j * (n + 2) + i));
  };
  std::size_t next = 0;
  for (int j = 1; j <= 2 * n; ++j) {
    for (int i = 0; i <= n; ++i) at(vx, i, j) = faces.vx.at(next++);
  }
  next = 0;
  for (int j = 0; j <= 2 * n; ++j) {
    for (int i = 1; i <= n; ++i) at(vy, i, j) = faces.vy.at(next++);
  }
  fs::create_directories(folder);
  const std::vector<int64_t> shape{2 * n + 2, n + 2};
  write_npy(folder + "/vx.npy", shape, vx);
  write_npy(folder + "/vy.npy", shape, vy);
}

/// Over (2n+1) x (n+1) pairs; pairs without a face are 0 in both.
double difference(const Faces& a, const Faces& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.vx.size(); ++i) sum += std::abs(a.vx[i] - b.vx.at(i));
  for (std::size_t i = 0; i < a.vy.size(); ++i) sum += std::abs(a.vy[i] - b.vy.at(i));
  return sum / (2.0 * (2 * a.n + 1) * (a.n + 1));
}

class Wake : public Command {
 protected:
  static constexpr const char* example = DPDE_SOURCE_DIR "/dsl-examples/wake/wake.dpde";

  /// A scene of n cells that starts from the files in `folder`.
  void add_scene(const std::string& name, int n, const std::string& folder) {
    const std::string inside = "(x*100/{n} - 50)^2 + (y*100/{n} - 50)^2 <= 100";
    std::string text = "\nscene " + name + " : wake_step {\n  grid x = -1 .. {n}+1, cells {n}+2\n" +
                       "  grid y = -1 .. 2*{n}+1, cells 2*{n}+2\n  n = {n}\n  viscosity = 1e4/240000\n" +
                       "  open = if(" + inside + ", 0, 1)\n  fluid = if(x < 0 or y < 0 or x > {n} or y > 2*{n} or " +
                       inside + ", 0, 1)\n  initial vx = load(\"" + folder + "/vx.npy\")\n  initial vy = load(\"" +
                       folder + "/vy.npy\")\n  time 0 .. 50, step 1\n}\n";
    for (std::size_t at = text.find("{n}"); at != std::string::npos; at = text.find("{n}"))
      text.replace(at, 3, std::to_string(n));
    std::ofstream(path("wake.dpde"), std::ios::app) << text;
  }
  void run(const std::string& scene, const std::string& more) {
    const Outcome outcome = dpde("run wake.dpde " + scene + " --quiet --out " + scene + more);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  }
};

TEST_F(Wake, OnACoarseGridLosesWhatIsPublished) {
  if (!is_thorough()) GTEST_SKIP() << "at night: the flow that it begins with takes 1000 steps of 128 x 256";
  fs::copy(example, path("wake.dpde"));
  run("fine", "");
  const Faces reference = faces_of(path("fine"), 128), coarse = halved(halved(reference));
  write_arrays(reference, path("reference_start"));
  write_arrays(coarse, path("coarse_start"));
  add_scene("reference", 128, "reference_start");
  add_scene("coarse", 32, "coarse_start");
  for (const auto& [steps, error] :
       std::initializer_list<std::pair<int, double>>{{1, 0.0050}, {10, 0.0188}, {50, 0.0566}}) {
    for (const std::string scene : {"reference", "coarse"}) run(scene, " --set end=" + std::to_string(steps));
    const double found = difference(faces_of(path("coarse"), 32), halved(halved(faces_of(path("reference"), 128))));
    EXPECT_NEAR(found, error, 6e-5) << "after " << steps << " steps";
  }
}

/// The example's network with 954 weights on a quarter of its cells and a few of its frames: it is better than the
/// plain scheme, also on twice the cells. Gradients are certified at a frame of the data.
TEST_F(Wake, ANetworkGivesBackWhatACoarseGridLoses) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("hybrid.dpde",
        rewritten(content(DPDE_SOURCE_DIR "/dsl-examples/wake/hybrid.dpde"), {{"cells 128", "cells 32"},
                                                                              {"cells 256", "cells 64"},
                                                                              {"{ cells 32, 64 }", "{ cells 8, 16 }"},
                                                                              {"{ cells 64, 128 }", "{ cells 16, 32 }"},
                                                                              {"time 0 .. 1500", "time 0 .. 60"},
                                                                              {"runs 6", "runs 2"},
                                                                              {"in 0, 1, 2, 3, 4, 5", "in 0, 3"},
                                                                              {"from 1000 to 1495", "from 20 to 60"},
                                                                              {"runs 4", "runs 1"},
                                                                              {"from 1000 to 1500", "from 20 to 60"},
                                                                              {"for 100 steps", "for 20 steps"},
                                                                              {"for 500 steps", "for 40 steps"},
                                                                              {", trials 3", ""}}));
  for (const char* set : {"train", "unseen"})
    ASSERT_EQ(dpde(std::string("run hybrid.dpde ") + set + " --out . --json").status, 0);
  const Outcome certified = dpde("verify hybrid.dpde sol4 --json --threads 1");
  ASSERT_EQ(certified.status, 0) << certified.err;
  EXPECT_TRUE(certified.json()["passed"].get<bool>());
  EXPECT_TRUE(certified.json().contains("window"));
  const Outcome learnt = dpde("optimize hybrid.dpde small_4 --threads 1 --beside-named-only --json");
  ASSERT_EQ(learnt.status, 0) << learnt.err;
  for (const char* test : {"relative", "far"}) {
    const Json found = learnt.json()["test"][test];
    const double error = found["mean"].get<double>();
    EXPECT_LT(error, 0.5 * found["beside"]["plain"]["mean"].get<double>()) << test;
    EXPECT_LT(error, 0.9 * found["beside"]["doubled"]["mean"].get<double>()) << test;
  }
}

}  // namespace
}  // namespace dpde::testing
