// SPDX-License-Identifier: Apache-2.0
#include "chart/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace dpde::chart {

namespace {

constexpr double rung_ratio = 1.4142135623730951;
constexpr int cells_to_begin_with = 8, rungs_apart = 2;
constexpr double resolved = 0.1;  // larger errors show no order
constexpr double margin = 0.95;   // predictions aim at this part of the tolerance
constexpr double most_steps = 1000;
constexpr double usual_order = 2, lowest_order = 0.3, doubtful_order = 0.75, highest_order = 10;
constexpr double longest_fraction = 0.9, short_fraction = 0.3;  // of the largest stable step
constexpr std::array all_fractions{short_fraction, 0.45, 0.6, 0.75, longest_fraction};
constexpr double longest_step = 1e4;       // relative to the scene's, if no largest stable step is known
constexpr double doubt = 2;                // factor by which predicted times may be too long
constexpr double single_tolerance = 1e-4;  // above it, single precision (rounding 6e-8 a step) is tried first
constexpr double infinite = std::numeric_limits<double>::infinity();

constexpr double same_error = 1.2;  // factor that counts as no increase, for longer steps
constexpr double hopeless = 1000;   // factor over the best time
constexpr double risen = 1.1;       // increase of the order between pairs of grids

/// One method with one fraction of the largest stable step.
struct Candidate {
  std::map<std::string, std::string> method;
  double fraction;
  std::map<int, Point> runs = {};  // by rung
  std::set<int> proven = {};       // rungs that are fully timed; others are only explored
  int next = 0;                    // first rung expected to meet the tolerance
  double seconds = infinite;       // predicted time there
  double predicted = infinite;     // the prediction before it was proven
  std::string out = "";            // why it was rejected
};

class Tuner {
 public:
  Tuner(const SourceFile& source, const TuneOptions& options, const model::Problem& scene, const References& references)
      : source_(source), options_(options), scene_(scene), references_(references) {
    int fewest = std::numeric_limits<int>::max();
    for (const model::Axis& axis : scene.axes) fewest = std::min(fewest, axis.cells);
    lowest_ = std::min(1.0, static_cast<double>(cells_to_begin_with) / fewest);
    highest_rung_ = static_cast<int>(std::floor(std::log(most() / lowest_) / std::log(rung_ratio) + 1e-9));
  }

  Choice tune(const Wishes& wishes) {
    std::vector<double> fractions = wishes.fractions;
    if (fractions.empty()) {
      fractions = {longest_fraction, short_fraction};
      fractions_.assign(all_fractions.begin(), all_fractions.end());
    }
    for (const auto& method : methods_for(scene_, wishes)) {
      for (const double fraction : fractions) candidates_.push_back({method, fraction});
    }
    is_single_first_ = !wishes.method.contains("real") && options_.tolerance >= single_tolerance;
    for (Candidate& candidate : candidates_) explore(candidate);
    while (Candidate* next = most_promising()) {
      if (!advance(*next)) break;
    }
    try_coarser_cells();
    try_longer_steps();
    try_other_precision(wishes);
    return finish();
  }

 private:
  double factor_of(int rung) const { return lowest_ * std::pow(rung_ratio, rung); }
  /// In units of the scene's cells or steps. Largest stable steps may be far too long for ordinary equations, which are
  /// cheap.
  double most() const { return scene_.has_grid ? options_.most_cells : most_steps; }
  const char* resolution() const { return scene_.has_grid ? "cells" : "steps"; }
  int axes() const { return scene_.has_grid ? static_cast<int>(scene_.axes.size()) : 0; }
  bool is_stopped() const { return options_.point.stop != nullptr && options_.point.stop->load(); }

  /// Uses the minimum of the timings: disturbances only add time.
  Point run(const Entry& entry, const PointOptions& options) {
    Point point = run_point(source_, options, scene_, entry, references_);
    if (point.steps > 0) ++result_.tried;
    if (options_.of_gradient && point.failure.empty()) {
      if (!point.gradient) point.fail(Outcome::failed, point.gradient_failure);
      static_cast<Measured&>(point) = point.gradient.value_or(Measured{});
    }
    if (is_complete(point)) point.seconds = options_.cost ? options_.cost(point) : point.samples.front();
    return point;
  }

  /// Short timings, only to find the trend of error and time.
  const Point& explore_at(Candidate& candidate, int rung) {
    PointOptions options = options_.point;
    options.samples = std::min(options.samples, 3);
    options.sample_seconds = std::min(options.sample_seconds, 0.003);
    options.times_states = !options_.of_gradient;
    return candidate.runs[rung] = run_at(candidate, rung, options);
  }

  const Point& prove_at(Candidate& candidate, int rung) {
    if (!candidate.proven.insert(rung).second) return candidate.runs.at(rung);
    if (is_single_first_) {
      Candidate single = candidate;
      single.method["real"] = "f32";
      const Point point = run_at(single, rung, options_.point);
      if (meets(point)) return candidate.runs[rung] = point;
    }
    const Point& point = candidate.runs[rung] = run_at(candidate, rung, options_.point);
    if (is_single_first_ && meets(point)) is_single_first_ = false;  // then rounding was the reason for missing it
    return point;
  }

  Point run_at(const Candidate& candidate, int rung, const PointOptions& options) {
    const Entry entry = refined(scene_, candidate.method, candidate.fraction, factor_of(rung));
    if (options_.tell)
      options_.tell(
          fmt::format("{} on {:.3g} times the {}", method_text(entry.variant), factor_of(rung), resolution()));
    return run(entry, options);
  }

  /// Takes the uncertainty of the reference into account.
  bool is_near_enough(const Point& point) const {
    const double uncertainty =
        options_.of_gradient ? references_.gradient.uncertainty() : references_.states.uncertainty();
    return point.failure.empty() && point.error + uncertainty <= options_.tolerance;
  }
  bool meets(const Point& point) const { return is_complete(point) && is_near_enough(point); }

  /// Runs two coarse grids, and finer ones as long as they are unstable or do not resolve the solution.
  void explore(Candidate& candidate) {
    std::string why;  // why the finest run failed
    bool was_lengthened = false;
    for (int rung = 0; rung <= highest_rung_ && !is_stopped(); rung += rungs_apart) {
      const Point& point = explore_at(candidate, rung);
      if (!point.failure.empty()) {
        why = point.failure;
        if (!point.is_unstable()) break;
        continue;
      }
      why.clear();
      if (!was_lengthened) lengthen(candidate, rung);
      was_lengthened = true;
      if (rung > 0 && !(point.error > resolved)) break;
    }
    candidate.out = why;
    if (!why.empty()) return;
    predict(candidate);
    look_finer(candidate);
  }

  /// If no largest step is known, the scene's may be far too short: lengthens it as long as the error does not
  /// increase.
  void lengthen(Candidate& candidate, int rung) {
    if (candidate.runs.at(rung).largest_step > 0 || fractions_.empty() || candidate.fraction < longest_fraction) return;
    while (candidate.fraction < longest_step && !is_stopped()) {
      const Point before = candidate.runs.at(rung);
      candidate.fraction *= 2;
      const Point& longer = explore_at(candidate, rung);
      if (longer.failure.empty() && longer.error <= same_error * before.error && longer.steps < before.steps) continue;
      candidate.fraction /= 2;
      candidate.runs[rung] = before;
      return;
    }
  }

  /// Coarse grids may not show a method's order. A candidate that seems to need too many cells is tested on finer
  /// grids, once and as long as its order rises.
  void look_finer(Candidate& candidate) {
    double before = 0;
    while (!candidate.out.empty() && !is_stopped()) {
      const int rung = candidate.runs.rbegin()->first + rungs_apart;
      if (rung > highest_rung_ || !explore_at(candidate, rung).failure.empty()) return;
      const auto last = std::prev(candidate.runs.end()), next = std::prev(last);
      const double order = std::log(next->second.error / last->second.error);
      candidate.out.clear();
      predict(candidate);
      if (!(order > risen * before)) return;
      before = order;
    }
  }

  /// Predicts from the two finest runs.
  void predict(Candidate& candidate) {
    if (candidate.runs.empty()) return;
    const auto last = std::prev(candidate.runs.end());
    const auto [rung, point] = *last;
    bool is_doubtful = false;  // such a low order may be accidental, depending on the position of jumps within cells
    if (!point.failure.empty() || !(point.error > 0)) {  // coarse grids may fail where finer ones do not
      candidate.next = rung + 1;
      candidate.seconds = point.seconds > 0 ? point.seconds : 0;
    } else {
      double order = usual_order, growth_of_steps = 1;
      if (last != candidate.runs.begin() && std::prev(last)->second.failure.empty()) {
        const auto& [before, coarse] = *std::prev(last);
        const double ratio = std::log(factor_of(rung) / factor_of(before));
        order = std::log(coarse.error / point.error) / ratio;
        growth_of_steps = std::log(static_cast<double>(point.steps) / coarse.steps) / ratio;
      }
      is_doubtful = order < doubtful_order;
      order = order > lowest_order ? std::min(order, highest_order) : usual_order;
      const double wanted = std::log(point.error / (margin * options_.tolerance)) / order / std::log(rung_ratio);
      candidate.next = std::max(0, rung + static_cast<int>(std::ceil(wanted)));
      const double growth = growth_of_steps + axes();
      candidate.seconds = point.seconds * std::pow(factor_of(candidate.next) / factor_of(rung), growth);
    }
    for (const auto& [known, run] : candidate.runs) {  // finer than all runs that miss the tolerance
      if (!is_near_enough(run)) candidate.next = std::max(candidate.next, known + 1);
    }
    if (candidate.next > highest_rung_ && is_doubtful && rung < highest_rung_) candidate.next = highest_rung_;
    if (candidate.next > highest_rung_)
      candidate.out = fmt::format("it would need more than {:g} times the scene's {}", most(), resolution());
  }

  Candidate* most_promising() {
    Candidate* best = nullptr;
    for (Candidate& candidate : candidates_) {
      if (!candidate.out.empty() || candidate.runs.empty() || is_stopped()) continue;
      if (best == nullptr || candidate.seconds < best->seconds) best = &candidate;
    }
    return best;
  }

  /// Returns false if no other candidate can be faster than the proven one.
  bool advance(Candidate& candidate) {
    if (proven_ && candidate.seconds > doubt * proven_->seconds) return false;
    if (!meets(prove_at(candidate, candidate.next))) {
      predict(candidate);
      return true;
    }
    candidate.predicted = candidate.seconds;
    int rung = candidate.next;  // as coarse as possible
    while (rung > 0 && !is_stopped() && meets(prove_at(candidate, rung - 1))) --rung;
    const Point& best = candidate.runs.at(rung);
    candidate.seconds = best.seconds;
    candidate.out = fmt::format("it takes {:.3g} s a unit of time", best.seconds);
    if (take(best, candidate)) winner_rung_ = rung, winner_fraction_ = candidate.fraction;
    return true;
  }

  /// Takes the point if it is faster than the best proven one.
  bool take(const Point& point, const Candidate& candidate) {
    if (!meets(point) || (proven_ && point.seconds >= proven_->seconds)) return false;
    proven_ = point;
    winner_ = &candidate;
    return true;
  }

  /// Tries coarser cells with shorter steps, as long as that is cheaper.
  void try_coarser_cells() {
    const bool is_known = proven_ && proven_->largest_step > 0 && scene_.has_grid;
    if (!is_known || winner_rung_ == 0 || winner_fraction_ < longest_fraction) return;
    const double saved = std::pow(rung_ratio, static_cast<double>(scene_.axes.size()) + 1);
    const double shortest = longest_fraction / (margin * saved);
    const auto coarser = cells_of(scene_, factor_of(winner_rung_ - 1));
    try_fractions({proven_->variant.method, coarser}, shortest, longest_fraction);
  }

  /// Coarse grids may have required shorter steps than the chosen one needs.
  void try_longer_steps() {
    if (!proven_) return;
    Variant variant = proven_->variant;
    variant.resolution.erase("step");
    try_fractions(variant, std::nextafter(winner_fraction_, 1), 1);
    if (proven_->largest_step > 0 || fractions_.empty()) return;
    double fraction = 2 * winner_fraction_;  // relative to the scene's step
    const auto is_better = [&](double longer) { return take(run({variant, longer}, options_.point), *winner_); };
    while (fraction < longest_step && !is_stopped() && is_better(fraction)) fraction *= 2;
    if (!is_stopped()) is_better(0.7 * fraction);
  }

  /// Finds the longest steps that meet the tolerance, for fractions from `low` to below `high`, by bisection. Does
  /// nothing if the user named the fractions.
  void try_fractions(const Variant& variant, double low, double high) {
    auto first = std::ranges::lower_bound(fractions_, low), last = std::ranges::lower_bound(fractions_, high);
    while (first < last && !is_stopped()) {
      const auto middle = first + (last - first) / 2;
      if (take(run({variant, *middle}, options_.point), *winner_)) {
        winner_fraction_ = *middle;
        first = middle + 1;
      } else {
        last = middle;
      }
    }
  }

  void try_other_precision(const Wishes& wishes) {
    if (!proven_ || wishes.method.contains("real") || is_stopped()) return;
    Entry other{proven_->variant, 0};
    const bool is_single = proven_->variant.method.contains("real");
    if (is_single && proven_->seconds <= winner_->predicted) return;  // double precision was predicted to be slower
    if (is_single) other.variant.method.erase("real");
    if (!is_single) other.variant.method["real"] = "f32";
    const char* name = is_single ? "double" : "single";
    const Point point = run(other, options_.point), before = *proven_;
    if (take(point, *winner_)) {
      result_.runners_up.push_back({before, fmt::format("{} precision is faster and meets the tolerance", name)});
    } else {
      const std::string why = !point.failure.empty() ? point.failure
                              : meets(point)         ? "it is no faster"
                                                     : fmt::format("its error is {:.3g}", point.error);
      result_.runners_up.push_back({point, why});
    }
  }

  /// Adds the rejected methods, each with its last run.
  Choice finish() {
    result_.chosen = proven_;
    for (Candidate& candidate : candidates_) {
      std::erase_if(candidate.runs, [&](const auto& run) {  // interrupted
        return is_stopped() && run.second.failure.empty() && !is_complete(run.second);
      });
      if (candidate.runs.empty() || &candidate == winner_) continue;
      if (is_stopped() && candidate.out.empty()) candidate.out = "stopped before it was tried further";
      const bool is_hopeless = proven_ && candidate.seconds > hopeless * proven_->seconds;
      const std::string why = !candidate.out.empty() ? candidate.out
                              : is_hopeless ? fmt::format("it should take more than {:g} times as long", hopeless)
                                            : fmt::format("it should take {:.3g} s a unit of time", candidate.seconds);
      result_.runners_up.push_back({std::prev(candidate.runs.end())->second, why});
    }
    return std::move(result_);
  }

  const SourceFile& source_;
  const TuneOptions& options_;
  const model::Problem& scene_;
  const References& references_;
  double lowest_ = 1;
  int highest_rung_ = 0;
  std::vector<Candidate> candidates_;
  bool is_single_first_ = false;
  std::optional<Point> proven_;
  const Candidate* winner_ = nullptr;  // the candidate of that point
  int winner_rung_ = 0;
  double winner_fraction_ = 0;
  std::vector<double> fractions_;
  Choice result_;
};

}  // namespace

Choice tune(const SourceFile& source, const TuneOptions& options, const model::Problem& scene, const Wishes& wishes,
            const References& references) {
  return Tuner(source, options, scene, references).tune(wishes);
}

}  // namespace dpde::chart
