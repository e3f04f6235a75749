// SPDX-License-Identifier: Apache-2.0
// Files, the evaluation log, and fields moved between grids.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <latch>
#include <stop_token>
#include <thread>
#include <vector>

#include "driver/memory/cost.h"
#include "driver/scene/data.h"
#include "driver_support.h"
#include "files/evaluation_log.h"
#include "files/files.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

namespace fs = std::filesystem;

class Storage : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("dpde_storage_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
  DiagnosticSink sink_;
};

TEST_F(Storage, ReadsBackWhatItWrote) {
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(files::write_file(folder_ / "f", bytes, sink_));
  EXPECT_EQ(files::read_file(folder_ / "f", {}, sink_), bytes);
  EXPECT_FALSE(sink_.has_errors());
  EXPECT_FALSE(files::read_file(folder_ / "g", {3, 4}, sink_).has_value());
  ASSERT_EQ(sink_.all().size(), 1u);
  EXPECT_EQ(sink_.all()[0].kind->code, "E0901");
  EXPECT_EQ(sink_.all()[0].range, (SourceRange{3, 4}));
  EXPECT_FALSE(files::make_folder(folder_ / "f" / "below", sink_));
}

TEST_F(Storage, LooksForDataBesideTheModelFirst) {
  std::ofstream(folder_ / "u.npy") << "x";
  EXPECT_EQ(files::find_data_file("u.npy", (folder_ / "m.dpde").string()), folder_ / "u.npy");
  EXPECT_EQ(files::find_data_file("w.npy", (folder_ / "m.dpde").string()), fs::path("w.npy"));
}

TEST_F(Storage, LogGivesBackItsRecordsAndDropsADamagedOne) {
  const fs::path path = folder_ / "log";
  Eigen::VectorXd gradient(3);
  {
    files::EvaluationLog log(path, 7, 3, false, sink_);
    ASSERT_TRUE(log.is_open());
    for (int k = 0; k < 3; ++k) log.append(k + 0.5, Eigen::Vector3d(k, 2 * k, -k));
  }
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary).seekp(24 + 2 * 40 + 9).put('!');
  double loss = 0;
  {
    files::EvaluationLog log(path, 7, 3, true, sink_);
    EXPECT_EQ(log.recorded(), 2);
    ASSERT_TRUE(log.next(loss, gradient));
    ASSERT_TRUE(log.next(loss, gradient));
    EXPECT_EQ(loss, 1.5);
    EXPECT_EQ(gradient, Eigen::Vector3d(1, 2, -1));
    EXPECT_FALSE(log.next(loss, gradient));
    log.append(9, Eigen::Vector3d(4, 5, 6));
  }
  EXPECT_EQ(files::EvaluationLog(path, 7, 3, true, sink_).recorded(), 3);
  EXPECT_FALSE(sink_.has_errors());
  EXPECT_FALSE(files::EvaluationLog(path, 8, 3, true, sink_).is_open());
  EXPECT_TRUE(sink_.has_errors());
  EXPECT_EQ(files::EvaluationLog(path, 8, 3, false, sink_).recorded(), 0);
}

TEST(Resample, TakesTheNearestCells) {
  const std::vector<model::Axis> from = {{"x", 0, 1, 4}, {"y", 0, 1, 2}}, to = {{"x", 0, 1, 2}, {"y", 0, 1, 3}};
  EXPECT_EQ(driver::resample({0, 1, 2, 3, 4, 5, 6, 7}, from, to), (std::vector<double>{0, 2, 0, 2, 4, 6}));
}

TEST(Data, OfAnotherSceneAreMeansOverItsCells) {
  // Nothing moves, so the datum is the mean of x^2 over two fine cells with centres c -+ 1/16: c^2 + 1/256.
  const SourceFile source(
      "d.dpde",
      "model m {\n  field u\n  dt(u) = 0\n}\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  initial u = 0\n"
      "  time 0 .. 1, step 1/2\n}\nscene fine : m {\n  grid x = 0 .. 1, cells 8, periodic\n  initial u = x^2\n"
      "  time 0 .. 1, step 1/4\n}\ntask t : s {\n  data d = u from scene fine over time\n  unknown initial u\n"
      "  minimise mean((u - d)^2) over time\n}\n");
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  const auto task = compiled(source, options);
  ASSERT_NE(task, nullptr);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, task, {}, sink);
  ASSERT_NE(session, nullptr) << all_messages(source, sink);
  ASSERT_EQ(session->data().size(), 1u);
  EXPECT_EQ(session->data()[0].times, (std::vector<double>{0, 0.5, 1}));
  for (const std::string& field : session->data()[0].fields) {
    const std::vector<double> values = session->workspace().dense(field);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(values[i], (i + 0.5) * (i + 0.5) / 16 + 1.0 / 256, 1e-15);
  }
}

TEST(Cost, CountsEachFieldOfASweepOnce) {
  const SourceFile source("k.dpde",
                          "kernel k(u: field halo 1, c: field, out v: field) {\n  v = c*(u[-1] + u + u[+1])\n}\n"
                          "program p {\n  fill u periodic\n  run k\n  swap u, v\n}\n");
  const auto program = compiled(source, {});
  ASSERT_NE(program, nullptr);
  const driver::Cost cost = driver::cost_of(program->loop, "p");
  EXPECT_EQ(cost.bytes, 24);
  EXPECT_EQ(cost.flops, 3);
}

TEST(Copy, HasAPlausibleRate) {
  const double rate = driver::measure_copy(1 << 16, 1).best;
  EXPECT_GT(rate, 1e8);
  EXPECT_LT(rate, 1e13);
  EXPECT_GT(driver::available_memory(), 1 << 20);
}

TEST(Copy, NeighboursThatWorkDoNotSlowTheRateDown) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: of a busy machine it says nothing";
  constexpr double bytes = 1e8;  // trials longer than the scheduler's time slice of a thread
  const double quiet = driver::measure_copy(bytes, 2).best;
  const unsigned count = 4 * std::max(1u, std::thread::hardware_concurrency());
  std::latch all_run(count);
  std::vector<std::jthread> neighbours;
  for (unsigned n = 0; n < count; ++n) {
    neighbours.emplace_back([&](const std::stop_token& stop) {
      all_run.count_down();
      while (!stop.stop_requested()) {
      }
    });
  }
  all_run.wait();
  const driver::CopyRate busy = driver::measure_copy(bytes, 2);
  EXPECT_GT(busy.best, quiet / 4);  // by wall-clock time it is a fifth at most, with two threads a fiftieth
  EXPECT_TRUE(busy.is_busy);
}

}  // namespace
}  // namespace dpde::testing
