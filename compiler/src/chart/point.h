// SPDX-License-Identifier: Apache-2.0
// One variant of a scene, run and timed: a point of a chart of speed against accuracy.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chart/reference.h"
#include "driver/session.h"

namespace dpde::chart {

/// A choice of what --set can override.
struct Variant {
  std::map<std::string, std::string> method;      // scheme keys and precision: one curve each
  std::map<std::string, std::string> resolution;  // cells and the step
};

struct Entry {
  Variant variant;
  double fraction = 0;  // > 0: the step is this part of the largest stable one; 0: the variant's, or the scene's
};

/// "advect=central4 time=rk4"; "the scene's own" where nothing is chosen.
std::string method_text(const Variant& variant);

struct Point {
  Variant variant;
  std::string failure;        // "": it ran; else why it did not, or what became of it
  bool is_unstable = false;   // by the verdict (and was not run), or as it ran
  bool does_not_fit = false;  // the variant makes no sense for this model
  std::vector<int> cells;
  double step = 0;
  int steps = 0;
  double largest_step = 0;                                  // by the verdict; 0: not known or none
  std::map<std::string, double> errors;                     // by state: root mean square over that of the reference
  double error = 0;                                         // the largest of them
  double seconds = 0, low_quartile = 0, high_quartile = 0;  // per unit of simulated time
  double compile_seconds = 0;
  double memory_bytes = 0;
  bool is_pareto = false;
};

struct PointOptions {
  driver::CompileOptions compile;  // of the scene, with what holds for all variants
  int threads = 1;
  int samples = 5;              // timings; the median counts
  double sample_seconds = 0.1;  // each at least, of as many runs as that takes
  const std::atomic<bool>* stop = nullptr;
};

/// A session of the variant; null where `why` says why not. Diagnostics stay with it.
std::unique_ptr<driver::Session> open(const SourceFile& source, const PointOptions& options, const Variant& variant,
                                      std::string& why);

/// Puts the step that the fraction stands for into the variant: a whole number of them makes the run of `scene`. False
/// where there is none, and `point` says why.
bool choose_step(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry& entry,
                 Point& point);

/// What one variant throws, for lack of memory as an example, is its failure and leaves the others alone.
Point run_point(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry entry,
                const Reference& reference);

/// It ran, was timed, and has an error.
bool is_complete(const Point& point);
/// Both complete: no worse in error and time, and better in one of them.
bool beats(const Point& a, const Point& b);
/// Marks those that no other one beats.
void mark_pareto(std::vector<Point>& points);

}  // namespace dpde::chart
