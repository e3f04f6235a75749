// SPDX-License-Identifier: Apache-2.0
// One variant of a scene, run and timed: a point of a chart of speed against accuracy.
#pragma once

#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chart/gradient.h"
#include "chart/reference.h"
#include "driver/memory/cost.h"
#include "driver/scene/session.h"

namespace dpde::chart {

/// The key of a method that is the scheme block of this name.
inline constexpr const char* scheme_block = "scheme";

/// A choice of what --set can override, and of a scheme block.
struct Variant {
  std::map<std::string, std::string> method;      // scheme keys, precision, "scheme" of a block: one curve each
  std::map<std::string, std::string> resolution;  // cells, the step, and solves with their tolerance
  bool operator==(const Variant&) const = default;
};

struct Entry {
  Variant variant;
  double fraction = 0;  // > 0: the step is this part of the largest stable one; 0: the variant's, or the scene's
};

/// "advect=central4 time=rk4"; "the scene's own" where nothing is chosen.
std::string method_text(const Variant& variant);

/// What of a point's error comes from where, by Richardson's extrapolation of companion runs; relative as errors are.
struct Budget {
  struct Part {
    double error = 0;
    double order = 0;  // measured; 0: it could not be, and the error is the first difference alone
  };
  std::string failure;  // "": it could be made
  Part space, time;
  std::optional<double> rounding;  // of single precision
  std::optional<double> solves;    // of solves that come near their tolerance by steps
  double sum = 0;                  // of the parts with their signs, cell by cell
  std::string measure;             // of which, the worst one

  /// "space", "time", "rounding" or "solves".
  std::string largest() const;
};

/// An error, and what it takes: of states seconds per unit of simulated time, of a gradient those of one with its
/// value.
struct Measured {
  double error = 0;
  double seconds = 0, low_quartile = 0, high_quartile = 0;
  std::vector<double> samples;  // all timings, increasing
  double memory_bytes = 0;      // at the peak
  bool is_pareto = false;       // nothing else is both faster and more accurate

  void take(std::vector<double> timings);
};

/// What became of a variant: it makes no sense for this model; by the verdict its step is above the largest stable one,
/// or all steps are, and it was not run; it is no longer finite as it ran; anything else, as a solve that does not end.
enum class Outcome { ran, does_not_fit, above_limit, never_stable, blew_up, failed };

struct Point : Measured {  // its error is the largest of `errors`
  Variant variant;
  Outcome outcome = Outcome::ran;
  std::string failure;  // "" of one that ran; else why not
  std::vector<int> cells;
  double step = 0;
  int steps = 0;
  double largest_step = 0;               // by the verdict; 0: not known or none
  bool is_above_limit = false;           // and ran all the same, as errors grow too little to ruin it
  std::map<std::string, double> errors;  // by measure, over the root mean square of the reference
  double compile_seconds = 0;
  driver::Cost cost;  // of a step, a cell
  /// Of the task's loss by its unknowns, where one is asked for: its error is the largest of `gradient_errors`.
  std::optional<Measured> gradient;
  std::map<std::string, double> gradient_errors;  // by unknown, over the root mean square of the reference's
  std::string gradient_failure;                   // why it has none
  std::optional<Budget> budget;                   // where one is asked for

  void fail(Outcome how, std::string why) {
    outcome = how;
    failure = std::move(why);
  }
  bool is_unstable() const {
    return outcome == Outcome::above_limit || outcome == Outcome::never_stable || outcome == Outcome::blew_up;
  }
  bool does_not_fit() const { return outcome == Outcome::does_not_fit; }
};

struct PointOptions {
  driver::CompileOptions compile;  // of the scene, with what holds for all variants
  std::vector<Measure> measures;   // none: of all states, l2
  std::string task;                // whose gradient is compared too; "": none
  int common_steps = 0;            // of the scene, that a whole number of chosen steps has to make; 0: all of them
  int threads = 1;
  bool times_states = true;     // else one short run tells the seconds of a run
  int samples = 5;              // timings; the median counts
  double sample_seconds = 0.1;  // each at least, of as many runs as that takes
  const std::atomic<bool>* stop = nullptr;
};

/// A session of the variant; null where `why` says why not. Diagnostics stay with it.
std::unique_ptr<driver::Session> open(const SourceFile& source, const PointOptions& options, const Variant& variant,
                                      std::string& why);

/// The task of the options with its adjoint, for the variant; null where `why` says why not.
std::unique_ptr<TaskGradient> open_gradient(const SourceFile& source, const PointOptions& options,
                                            const Variant& variant, std::string& why);

/// What points are compared with.
struct References {
  Reference states;
  GradientReference gradient;  // none where no task is asked for
};

/// Puts the step that the fraction stands for into the variant: a whole number of them makes the common steps of
/// `scene`, `longest` at most. False where there is none, and `point` says why.
bool choose_step(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry& entry,
                 Point& point, double longest = std::numeric_limits<double>::infinity());

/// What one variant throws, for lack of memory as an example, is its failure and leaves the others alone. `known`: what
/// was run before; fractions of a short run may be rounded to a step that one of these has, which is the result then.
Point run_point(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry entry,
                const References& references, const std::vector<Point>& known = {});

/// It ran, was timed, and has an error.
bool is_complete(const Point& point);
bool is_complete(const Measured& measured);
/// Both complete: no worse in time and, within a hundredth, in error, and better in one of them.
bool beats(const Measured& a, const Measured& b);
/// Marks those that no other one beats.
void mark_pareto(std::vector<Point>& points);

}  // namespace dpde::chart
