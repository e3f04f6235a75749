// SPDX-License-Identifier: Apache-2.0
// Making data sets: errors in a run are reported, for any number of threads, and end only the data set.
#include "training/data/data_set.h"

#include <fmt/format.h>

#include <functional>
#include <map>
#include <stdexcept>

#include "driver_support.h"
#include "syntax/parser.h"

namespace dpde::training {
namespace {

constexpr const char* text = R"(
model m { field u; param a; dt(u) = lap(u) }
scene s : m { grid x = 0 .. 1, cells 8, periodic; a = 1; initial u = a*sin(2*pi*x); time 0 .. 1/64, step 1/256 }
dataset d : s { runs 6; vary a from 1 }
)";

/// The runs of `body`, a model and a scene with varying a, with this number of threads: messages.
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

/// The first failing run, with its own error.
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

/// Lists are combined such that all pairs occur; logarithmic ranges have equally many values in each decade.
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

/// A logarithmic range cannot start from 0 or be empty.
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

/// The frames of each variable and run in data set `d` of the text; only stored ones.
using Frames = std::map<std::string, std::vector<double>>;
std::vector<Frames> frames_of(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  const std::optional<driver::Compiled> parsed = driver::compile(source, options, sink);
  EXPECT_TRUE(parsed) << testing::all_messages(source, sink);
  const std::optional<model::DataSet> set = parsed ? model::data_set_from_ast(parsed->ast, "d", sink) : std::nullopt;
  EXPECT_TRUE(set) << testing::all_messages(source, sink);
  if (!set) return {};
  DataSetOptions how;
  how.backend = driver::Backend::interpreter;
  const auto maker = DataSetMaker::open(source, *set, how, sink);
  EXPECT_TRUE(maker) << text << testing::all_messages(source, sink);
  std::vector<Frames> all(static_cast<std::size_t>(set->runs));
  const auto take = [&](int run, const DataRun& data) {
    for (std::size_t v = 0; v < maker->variables().size(); ++v) {
      const FrameVariable& variable = maker->variables()[v];
      EXPECT_EQ(data.grids[0].frames[v].empty(), !variable.is_kept);
      if (variable.is_kept) all[static_cast<std::size_t>(run)][variable.name] = data.grids[0].frames[v];
    }
  };
  if (maker) EXPECT_TRUE(maker->make([](int) { return false; }, take, sink)) << testing::all_messages(source, sink);
  return all;
}

constexpr int side = 8, frame_count = 3;
constexpr double h = 1.0 / side;

/// Values of one frame on the fine grid, i along x, j along y, periodic.
struct Plane {
  const std::vector<double>& all;
  int frame;
  double operator()(int i, int j) const {
    const int x = (i + side) % side, y = (j + side) % side;
    return all[static_cast<std::size_t>((frame * side + y) * side + x)];
  }
};

/// The values of a formula on the fine grid, computed by hand from frames of the states; 1 on upper faces.
struct FormulaCase {
  const char *formula, *name;  // name of the variable, of the compared component
  bool on_x, on_y;
  double (*by_hand)(const Plane& u, const Plane& v, const Plane& c, double t, int i, int j);
};

/// Coarsening: averages along axes on which values are at centres; values on faces are sampled at the coarse faces.
double coarsened(const FormulaCase& each, int ratio, const std::function<double(int, int)>& fine, int i, int j) {
  double sum = 0;
  int count = 0;
  for (int b = each.on_y ? ratio - 1 : 0; b < ratio; ++b) {
    for (int a = each.on_x ? ratio - 1 : 0; a < ratio; ++a, ++count) sum += fine(i * ratio + a, j * ratio + b);
  }
  return sum / count;
}

void expect_frames_by_hand(const std::string& vector, const std::vector<FormulaCase>& cases) {
  const std::string text =
      "model m { vector u" + vector +
      "; field c; param a; let g = c*c\n"
      "  dt(u) = 0.01*lap(u); dt(c) = 0.01*lap(c) + t }\n"
      "scene s : m { grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 1, cells 8, periodic; a = 1\n"
      "  initial u = (a*sin(2*pi*y) + cos(2*pi*x), sin(4*pi*x)*a); initial c = a*cos(2*pi*x)*sin(2*pi*y)\n"
      "  time 0 .. 1/16, step 1/64 }\n";
  const std::vector<Frames> states = frames_of(text + "dataset d : s { runs 2; vary a in 1, 2; frames every 1/32 }\n");
  for (const FormulaCase& each : cases) {
    for (const int ratio : {1, 2, 4}) {
      const std::vector<Frames> made = frames_of(
          text + fmt::format("dataset d : s {{ runs 2; vary a in 1, 2; frames of {} every 1/32; coarsen {} }}\n",
                             each.formula, ratio));
      for (std::size_t run = 0; run < made.size(); ++run) {
        ASSERT_TRUE(made[run].contains(each.name)) << each.formula;
        const std::vector<double>& found = made[run].at(each.name);
        const int n = side / ratio;
        ASSERT_EQ(std::ssize(found), frame_count * n * n);
        for (int k = 0; k < std::ssize(found); ++k) {
          const int frame = k / (n * n), j = k / n % n, i = k % n;
          const Plane u{states[run].at("u.x"), frame}, v{states[run].at("u.y"), frame}, c{states[run].at("c"), frame};
          const auto fine = [&](int a, int b) { return each.by_hand(u, v, c, frame / 32.0, a, b); };
          ASSERT_NEAR(found[static_cast<std::size_t>(k)], coarsened(each, ratio, fine, i, j), 1e-13)
              << each.formula << ", " << each.name << ", coarsen " << ratio << ", run " << run << ", value " << k;
        }
      }
    }
  }
}

/// Error estimates from three runs: the estimate, or why there is none.
TEST(DataSets, SayWhyAnErrorIsNotKnown) {
  struct Case {
    const char *model, *scene, *data, *why;
  };
  for (const Case& each : std::initializer_list<Case>{
           {"field u; dt(u) = 0.01*lap(u)", "cells 32; initial u = sin(2*pi*x); time 0 .. 1, step 1/64", "", ""},
           {"field u; dt(u) = 0.01*lap(u)", "cells 32; initial u = sin(2*pi*x); time 0 .. 1, step 1/64",
            "frames of q = u^2, t2 = u*t every 1/8", ""},
           {"field u; dt(u) = t^3", "cells 32; initial u = sin(2*pi*x); time 0 .. 1, step 1/64", "frames every 1/4",
            ""},
           {"field u; dt(u) = 0.01*lap(u)", "cells 30; initial u = sin(2*pi*x); time 0 .. 1, step 1/64", "",
            "is no grid of 4 or more cells along x, which has 30"},
           {"field u; dt(u) = 0.01*lap(u)", "cells 32; initial u = sin(2*pi*x); time 0 .. 5/64, step 1/64",
            "frames every 1/64 from 1/16", "ends at step 5, they meet at step 8"},
           {"field u; dt(u) = 0.01*lap(u)", "cells 32; initial u = sin(2*pi*x); time 0 .. 1, step 1/64, tolerance 1e-3",
            "", "its steps are as long as they can be"},
           {"field u; dt(u) = -0.3*u", "cells 32; initial u = 1; time 0 .. 1, step 1/64", "frames of q = 3 every 1/8",
            "gives the same"},
           {"field u; dt(u) = 0.01*lap(u)", "cells 32; initial u = sin(2*pi*32/3*x + 0.2); time 0 .. 1/8, step 1/64",
            "", "go ways of their own"},
           {"field u; dt(u) = 0.004*lap(u)", "cells 32; initial u = sin(2*pi*x); time 0 .. 2, step 1/16", "", ""}}) {
    SCOPED_TRACE(std::string(each.model) + each.scene + each.data);
    const SourceFile source(
        "test.dpde",
        fmt::format("scheme by {{ time = bs32 }}\nmodel m {{ {} }}\nscene s : m {{ grid x = 0 .. 1, periodic; {} }}\n"
                    "dataset d : s {{ {} }}\n",
                    each.model, each.scene, each.data));
    DiagnosticSink sink;
    const ast::File file = ast::parse(source, sink);
    const std::optional<model::DataSet> set = model::data_set_from_ast(file, "d", sink);
    ASSERT_TRUE(set) << testing::all_messages(source, sink);
    DataSetOptions how;
    how.backend = driver::Backend::interpreter;
    const auto maker = DataSetMaker::open(source, *set, how, sink);
    ASSERT_TRUE(maker) << testing::all_messages(source, sink);
    for (const OrderEstimate& estimate : maker->estimate_order()) {
      if (*each.why == '\0') EXPECT_TRUE(estimate.is_known()) << estimate.why_not;
      EXPECT_NE(estimate.why_not.find(each.why), std::string::npos) << estimate.why_not;
    }
  }
}

/// Formulas that cannot be evaluated or named are reported at their position.
TEST(DataSets, FormulasThatCannotBeKeptAreSaidWhereTheyStand) {
  for (const auto& [of, message] : std::map<std::string, std::string>{
           {"curl(u)", "expected the name of a field, or a name and its formula but found 'curl'"},
           {"w = vorticity(u)", "there is no function called vorticity"},
           {"v", "v is not known here"},
           {"c = u.x", "c is given twice"},
           {"nu = c", "nu is given twice"},
           {"slope = c", "slope is given twice"},
           {"u, u", "u is given twice"},
           {"q = c, q = 2*c", "q is given twice"},
           {"x = c", "x has a meaning of its own and cannot name a number"},
           {"q on nodes = c", "c is at cell centres, but here its value at nodes is wanted"},
           {"q on faces = c", "faces of a number is not a placement"},
           {"u on faces", "expected '=' but found 'every'"},
           {"u.x = c", "expected ',' or 'every' but found '='"},
           {"q = (c > 0)", "expected a number but this is a condition"}}) {
    const SourceFile source(
        "test.dpde",
        fmt::format("model m {{ vector u on faces; field c; param nu; let slope = grad(c)\n"
                    "  dt(u) = nu*lap(u); dt(c) = nu*lap(c) }}\n"
                    "scene s : m {{ grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 1, cells 8, periodic; nu = 1\n"
                    "  initial u = (1, 1); initial c = 1; time 0 .. 1/16, step 1/64 }}\n"
                    "dataset d : s {{ frames of {} every 1/32 }}\n",
                    of));
    DiagnosticSink sink;
    const ast::File file = ast::parse(source, sink);
    const std::optional<model::DataSet> set =
        sink.has_errors() ? std::nullopt : model::data_set_from_ast(file, "d", sink);
    if (set) EXPECT_FALSE(DataSetMaker::open(source, *set, {}, sink)) << of;
    ASSERT_TRUE(sink.has_errors()) << of;
    EXPECT_EQ(sink.all().front().message, message);
    EXPECT_TRUE(testing::all_messages(source, sink).starts_with("test.dpde:5:")) << of;
  }
}

/// Once small differences of a chaotic flow have grown large, its error has no order; before that it has.
TEST(DataSets, ChaosHasNoOrder) {
  for (const bool is_late : {false, true}) {
    const SourceFile source(
        "test.dpde",
        fmt::format(
            "model lorenz {{ field u, v, w; dt(u) = 10*(v - u); dt(v) = u*(28 - w) - v; dt(w) = u*v - 8/3*w }}\n"
            "scheme s4 {{ time = rk4 }}\n"
            "scene s : lorenz with s4 {{ grid x = 0 .. 1, cells 32, periodic; time 0 .. 45, step 1/128\n"
            "  initial u = 1 + 0.1*sin(2*pi*x); initial v = 2; initial w = 20 }}\n"
            "dataset d : s {{ frames of u, q = u*v every 1/4 from {} }}\n",
            is_late ? 40 : 0));
    DiagnosticSink sink;
    const std::optional<model::DataSet> set = model::data_set_from_ast(ast::parse(source, sink), "d", sink);
    ASSERT_TRUE(set) << testing::all_messages(source, sink);
    DataSetOptions how;
    how.backend = driver::Backend::jit;
    const auto maker = DataSetMaker::open(source, *set, how, sink);
    ASSERT_TRUE(maker) << testing::all_messages(source, sink);
    const std::vector<OrderEstimate> estimates = maker->estimate_order();
    ASSERT_EQ(estimates.size(), 2U);
    for (const OrderEstimate& estimate : estimates) {
      EXPECT_EQ(estimate.is_known(), !is_late) << estimate.variable << ": " << estimate.why_not << estimate.order;
      EXPECT_EQ(estimate.why_not.find("go ways of their own") != std::string::npos, is_late) << estimate.why_not;
    }
  }
}

TEST(DataSets, FramesOfFormulasAreThoseMadeOfFramesOfStatesWhereFieldsAreAtCentres) {
  expect_frames_by_hand(
      "", {{"omega = curl(u)", "omega", false, false,
            [](const Plane& u, const Plane& v, const Plane&, double, int i, int j) {
              return (v(i + 1, j) - v(i - 1, j) - u(i, j + 1) + u(i, j - 1)) / (2 * h);
            }},
           {"q = c^2 + t", "q", false, false,
            [](const Plane&, const Plane&, const Plane& c, double t, int i, int j) { return c(i, j) * c(i, j) + t; }},
           {"c, q = u*c", "q.y", false, false,
            [](const Plane&, const Plane& v, const Plane& c, double, int i, int j) { return v(i, j) * c(i, j); }},
           {"q = u*c, u.y", "u.y", false, false,
            [](const Plane&, const Plane& v, const Plane&, double, int i, int j) { return v(i, j); }},
           {"g", "g", false, false,
            [](const Plane&, const Plane&, const Plane& c, double, int i, int j) { return c(i, j) * c(i, j); }},
           {"e = c - mean(c)", "e", false, false, [](const Plane&, const Plane&, const Plane& c, double, int i, int j) {
              double sum = 0;
              for (int k = 0; k < side * side; ++k) sum += c(k % side, k / side);
              return c(i, j) - sum / (side * side);
            }}});
}

TEST(DataSets, FramesOfFormulasLieWhereTheirPartsDo) {
  expect_frames_by_hand(
      " on faces",
      {{"omega = curl(u)", "omega", true, true,
        [](const Plane& u, const Plane& v, const Plane&, double, int i, int j) {
          return (v(i + 1, j) - v(i, j) - u(i, j + 1) + u(i, j)) / h;
        }},
       {"omega on centres = interpolate(curl(u))", "omega", false, false,
        [](const Plane& u, const Plane& v, const Plane&, double, int i, int j) {
          double sum = 0;
          for (const int a : {i - 1, i}) {
            for (const int b : {j - 1, j}) sum += (v(a + 1, b) - v(a, b) - u(a, b + 1) + u(a, b)) / h;
          }
          return sum / 4;
        }},
       {"q = div(u)", "q", false, false,
        [](const Plane& u, const Plane& v, const Plane&, double, int i, int j) {
          return (u(i, j) - u(i - 1, j) + v(i, j) - v(i, j - 1)) / h;
        }},
       {"slope = grad(c)", "slope.x", true, false,
        [](const Plane&, const Plane&, const Plane& c, double, int i, int j) { return (c(i + 1, j) - c(i, j)) / h; }},
       {"flux = u*interpolate(c)", "flux.y", false, true,
        [](const Plane&, const Plane& v, const Plane& c, double, int i, int j) {
          return v(i, j) * (c(i, j) + c(i, j + 1)) / 2;
        }},
       {"q on faces.x = interpolate(c)", "q", true, false,
        [](const Plane&, const Plane&, const Plane& c, double, int i, int j) { return (c(i, j) + c(i + 1, j)) / 2; }},
       {"e = dot(u, u)", "e", false, false, [](const Plane& u, const Plane& v, const Plane&, double, int i, int j) {
          const auto square = [](double x) { return x * x; };
          return (square(u(i, j)) + square(u(i - 1, j)) + square(v(i, j)) + square(v(i, j - 1))) / 2;
        }}});
}

}  // namespace
}  // namespace dpde::training
