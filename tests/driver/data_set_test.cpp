// SPDX-License-Identifier: Apache-2.0
// Making data sets: what goes wrong where runs are taken is said, on any number of threads, and ends nothing but the
// making.
#include "training/data_set.h"

#include <stdexcept>

#include "driver_support.h"

namespace dpde::training {
namespace {

constexpr const char* text = R"(
model m { field u; param a; dt(u) = lap(u) }
scene s : m { grid x = 0 .. 1, cells 8, periodic; a = 1; initial u = a*sin(2*pi*x); time 0 .. 1/64, step 1/256 }
dataset d : s { runs 6; vary a from 1 }
)";

TEST(DataSetMaker, SaysWhatIsThrownWhereRunsAreTaken) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  const std::optional<driver::Compiled> parsed = driver::compile(source, options, sink);
  ASSERT_TRUE(parsed) << testing::all_messages(source, sink);
  std::optional<model::DataSet> set = model::data_set_from_ast(parsed->ast, "d", sink);
  ASSERT_TRUE(set) << testing::all_messages(source, sink);
  for (const int threads : {1, 4}) {
    DataSetOptions how;
    how.backend = driver::Backend::interpreter;
    how.threads = threads;
    const auto maker = DataSetMaker::open(source, *set, how, sink);
    ASSERT_TRUE(maker) << testing::all_messages(source, sink);
    DiagnosticSink said;
    const auto take = [](int run, const DataRun&) {
      if (run == 2) throw std::runtime_error("the disk is gone");
    };
    EXPECT_FALSE(maker->make([](int) { return false; }, take, said));
    ASSERT_EQ(said.all().size(), 1U);
    EXPECT_EQ(said.all()[0].message, "run 2 of dataset d: the disk is gone");
  }
}

}  // namespace
}  // namespace dpde::training
