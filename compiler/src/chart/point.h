// SPDX-License-Identifier: Apache-2.0
// One variant of a scene, run and timed: a point in a chart of speed against accuracy.
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

/// Key of a method that is a named scheme block.
inline constexpr const char* scheme_block = "scheme";

/// Overrides of --set and a scheme block.
struct Variant {
  std::map<std::string, std::string> method;      // scheme keys, precision, "scheme" of a block: one curve each
  std::map<std::string, std::string> resolution;  // cells, step, and solves with their tolerance
  bool operator==(const Variant&) const = default;
};

struct Entry {
  Variant variant;
  double fraction = 0;  // > 0: fraction of the largest stable step; 0: the variant's step, or the scene's
};

/// "advect=central4 time=rk4"; "the scene's own" without overrides.
std::string method_text(const Variant& variant);

/// Sources of a point's error, by Richardson extrapolation of companion runs; relative, like errors.
struct Budget {
  struct Part {
    double error = 0;
    double order = 0;  // measured; 0: unknown, and the error is just the first difference
  };
  std::string failure;  // "": success
  Part space, time;
  std::optional<double> rounding;  // for single precision
  std::optional<double> solves;    // for iterative solves
  double sum = 0;                  // of the signed parts, cell by cell
  std::string measure;             // the measure with the largest error

  /// "space", "time", "rounding" or "solves".
  std::string largest() const;
};

/// An error and its cost: seconds per unit of simulated time for states; seconds of a value with gradient for a
/// gradient.
struct Measured {
  double error = 0;
  double seconds = 0, low_quartile = 0, high_quartile = 0;
  std::vector<double> samples;  // all timings, sorted
  double memory_bytes = 0;      // peak
  bool is_pareto = false;       // no other point is both faster and more accurate

  void take(std::vector<double> timings);
};

/// Result of a variant: it ran; it is not applicable to this model; its step is above the largest stable one, or all
/// steps are unstable, so it was not run; it blew up; it failed otherwise, for example in a solve.
enum class Outcome { ran, does_not_fit, above_limit, never_stable, blew_up, failed };

struct Point : Measured {  // its error is the largest of `errors`
  Variant variant;
  Outcome outcome = Outcome::ran;
  std::string failure;  // "" if it ran; else the reason
  std::vector<int> cells;
  double step = 0;
  int steps = 0;
  double largest_step = 0;               // by the stability analysis; 0: unknown or none
  bool is_above_limit = false;           // it ran all the same, as errors grow too little to ruin it
  std::map<std::string, double> errors;  // by measure, relative to the RMS of the reference
  double compile_seconds = 0;
  driver::Cost cost;  // of a step, per cell
  /// Gradient of the task's loss, if requested; its error is the largest of `gradient_errors`.
  std::optional<Measured> gradient;
  std::map<std::string, double> gradient_errors;  // by unknown, relative to the RMS of the reference
  std::string gradient_failure;                   // why it has no gradient
  std::optional<Budget> budget;                   // if requested

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
  driver::CompileOptions compile;  // of the scene, common to all variants
  std::vector<Measure> measures;   // empty: all states, l2
  std::string task;                // task whose gradients are compared; "": none
  int common_steps = 0;            // of the scene; must be a multiple of chosen steps; 0: all
  int threads = 1;
  bool times_states = true;     // false: the seconds of a run come from one short run
  int samples = 5;              // number of timings, whose median counts
  double sample_seconds = 0.1;  // minimum of each, by repeating runs
  const std::atomic<bool>* stop = nullptr;
};

/// A session of the variant; null on failure, with the reason in `why`. Diagnostics are not passed on.
std::unique_ptr<driver::Session> open(const SourceFile& source, const PointOptions& options, const Variant& variant,
                                      std::string& why);

/// The task of the options with its adjoint, for the variant; null on failure, with the reason in `why`.
std::unique_ptr<TaskGradient> open_gradient(const SourceFile& source, const PointOptions& options,
                                            const Variant& variant, std::string& why);

/// References for points.
struct References {
  Reference states;
  GradientReference gradient;  // empty without a task
};

/// Sets the variant's step according to the fraction: at most `longest`, and a divisor of the common steps of `scene`.
/// Returns false if there is none; `point` has the reason.
bool choose_step(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry& entry,
                 Point& point, double longest = std::numeric_limits<double>::infinity());

/// Exceptions of one variant, e.g. for lack of memory, become its failure and do not affect others. `known`: earlier
/// points. Fractions of a short run may be rounded to a step that one of these has, which is then the result.
Point run_point(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry entry,
                const References& references, const std::vector<Point>& known = {});

/// It ran, was timed, and has an error.
bool is_complete(const Point& point);
bool is_complete(const Measured& measured);
/// Both complete; `a` is no worse in time and, within a hundredth, in error, and better in one of them.
bool beats(const Measured& a, const Measured& b);
/// Marks the points that no other one beats.
void mark_pareto(std::vector<Point>& points);

}  // namespace dpde::chart
