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

/// The runs of `body`, a model and a scene that varies a, made on so many threads: what is said.
struct MadeRuns {
  model::DataSet set;
  std::vector<Diagnostic> said;
};

MadeRuns make_runs(const std::string& file, int threads, const DataSetMaker::Take& take) {
  const SourceFile source("test.dpde", file);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  const std::optional<driver::Compiled> parsed = driver::compile(source, options, sink);
  EXPECT_TRUE(parsed) << testing::all_messages(source, sink);
  std::optional<model::DataSet> set = parsed ? model::data_set_from_ast(parsed->ast, "d", sink) : std::nullopt;
  EXPECT_TRUE(set) << testing::all_messages(source, sink);
  if (!set) return {};
  DataSetOptions how;
  how.backend = driver::Backend::interpreter;
  how.threads = threads;
  const auto maker = DataSetMaker::open(source, *set, how, sink);
  EXPECT_TRUE(maker) << testing::all_messages(source, sink);
  DiagnosticSink said;
  if (maker) EXPECT_FALSE(maker->make([](int) { return false; }, take, said));
  return {*set, said.all()};
}

TEST(DataSetMaker, SaysWhatIsThrownWhereRunsAreTaken) {
  for (const int threads : {1, 4}) {
    const MadeRuns made = make_runs(text, threads, [](int run, const DataRun&) {
      if (run == 2) throw std::runtime_error("the disk is gone");
    });
    ASSERT_EQ(made.said.size(), 1U);
    EXPECT_EQ(made.said[0].message, "run 2 of dataset d: the disk is gone");
    EXPECT_EQ(made.said[0].kind->code, "E0903");
  }
}

/// The first that fails, by its own error.
TEST(DataSetMaker, ARunThatFailsHasTheErrorOfARun) {
  const std::string grows =
      "model m { field u; param a; dt(u) = exp(a*u) }\n"
      "scene s : m { grid x = 0 .. 1, cells 8, periodic; a = 1; initial u = 1; time 0 .. 1/16, step 1/256 }\n"
      "dataset d : s { runs 6; seed 4; vary a in -200 .. 200 }\n";
  for (const int threads : {1, 4}) {
    const MadeRuns made = make_runs(grows, threads, [](int, const DataRun&) {});
    int first = 0;
    while (first < made.set.runs && made.set.value_of(0, first) < 0) ++first;
    ASSERT_GT(made.set.value_of(0, first), 10);
    ASSERT_GT(first, 0);
    ASSERT_EQ(made.said.size(), 1U);
    EXPECT_EQ(made.said[0].kind->code, "E0801");
    EXPECT_TRUE(made.said[0].message.starts_with(fmt::format("run {} of dataset d: u ", first)))
        << made.said[0].message;
    EXPECT_TRUE(made.said[0].range.is_known());
  }
}

/// Lists are gone through in turns, so that all pairs are there; ranges of logarithms have as many in each decade.
TEST(DataSets, ValuesAreOfListsAndOfLogarithms) {
  const SourceFile source(
      "test.dpde",
      "model m { field u; param a, b, c, k; dt(u) = a*b*c*k*u }\n"
      "scene s : m { grid x = 0 .. 1, cells 8, periodic; time 0 .. 1, step 1/4; a = 1; b = 1; c = 1\n"
      "  k = 1; initial u = 1 }\n"
      "dataset d : s { runs 4000; vary a in 3, 1, 2; vary k in 1e-4 .. 1 logarithmic; vary b in 5, 7\n"
      "  vary c from 8 }\n");
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  const std::optional<driver::Compiled> parsed = driver::compile(source, options, sink);
  ASSERT_TRUE(parsed) << testing::all_messages(source, sink);
  const std::optional<model::DataSet> set = model::data_set_from_ast(parsed->ast, "d", sink);
  ASSERT_TRUE(set) << testing::all_messages(source, sink);
  const std::vector<double> first{3, 1, 2, 3, 1, 2, 3}, second{5, 5, 5, 7, 7, 7, 5};
  for (int run = 0; run < 7; ++run) {
    EXPECT_EQ(set->value_of(0, run), first[static_cast<std::size_t>(run)]);
    EXPECT_EQ(set->value_of(2, run), second[static_cast<std::size_t>(run)]);
    EXPECT_EQ(set->value_of(3, run), 8 + run);
  }
  std::vector<int> of_decade(4, 0);
  for (int run = 0; run < set->runs; ++run) {
    const double decade = std::floor(-std::log10(set->value_of(1, run)));
    ASSERT_TRUE(decade >= 0 && decade < 4);
    ++of_decade[static_cast<std::size_t>(decade)];
  }
  for (const int count : of_decade) EXPECT_NEAR(count, 1000, 4 * std::sqrt(1000 * 0.75));
}

/// No logarithm has a range from 0 on, nor an empty one.
TEST(DataSets, RangesThatHaveNoNumberAreRefused) {
  for (const char* range : {"0 .. 1 logarithmic", "-1 .. 1 logarithmic", "2 .. 1 logarithmic", "2 .. 1"}) {
    const SourceFile source("test.dpde", fmt::format("model m {{ field u; param a; dt(u) = a*u }}\n"
                                                     "scene s : m {{ grid x = 0 .. 1, cells 8, periodic; a = 1\n"
                                                     "  time 0 .. 1, step 1/4; initial u = 1 }}\n"
                                                     "dataset d : s {{ runs 4; vary a in {} }}\n",
                                                     range));
    DiagnosticSink sink;
    driver::CompileOptions options;
    options.selection.name = "s";
    const std::optional<driver::Compiled> parsed = driver::compile(source, options, sink);
    ASSERT_TRUE(parsed);
    EXPECT_FALSE(model::data_set_from_ast(parsed->ast, "d", sink)) << range;
    ASSERT_TRUE(sink.has_errors());
    EXPECT_EQ(sink.all().front().kind->code, "E0707") << sink.all().front().message;
  }
}

}  // namespace
}  // namespace dpde::training
