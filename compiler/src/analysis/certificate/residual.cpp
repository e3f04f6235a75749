// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/residual.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace dpde::analysis {

namespace {

/// Sums of squares over cells and intervals.
struct Sums {
  double missed = 0, change = 0;
};

class Intervals {
 public:
  Intervals(driver::Session& session, std::atomic<bool>& stop, const StoredFrames& frames)
      : session_(session), stop_(stop), frames_(frames), sums_(frames.states.size()) {}

  /// Returns false if the steps blow up.
  bool add(int interval) {
    Rollout& rollout = session_.rollout();
    for (std::size_t s = 0; s < sums_.size(); ++s) rollout.initial(static_cast<int>(s)).copy_in(frame(s, interval));
    const int begin = frames_.first + interval * frames_.every, end = begin + frames_.every;
    bool is_there = false;
    const auto look = [&](const Snapshot& snapshot) {
      if (snapshot.step != end) return;
      for (std::size_t s = 0; s < sums_.size(); ++s) compare(s, interval, snapshot.states[s]);
      is_there = true;
      stop_ = true;  // the rest of the run is not needed
    };
    rollout.run({std::gcd(frames_.first, frames_.every), look}, begin);
    stop_ = false;
    return is_there;
  }
  const std::vector<Sums>& sums() const { return sums_; }

 private:
  std::span<const double> frame(std::size_t state, int number) const {
    const std::size_t cells = session_.workspace().cell_count();
    return std::span(frames_.states[state]).subspan(static_cast<std::size_t>(number) * cells, cells);
  }
  void compare(std::size_t state, int interval, const void* found) {
    const std::span<const double> before = frame(state, interval), next = frame(state, interval + 1);
    values_.resize(next.size());
    copy_out(session_.workspace().layout(), found, values_);
    for (std::size_t i = 0; i < next.size(); ++i) {
      sums_[state].missed += (values_[i] - next[i]) * (values_[i] - next[i]);
      sums_[state].change += (next[i] - before[i]) * (next[i] - before[i]);
    }
  }

  driver::Session& session_;
  std::atomic<bool>& stop_;
  const StoredFrames& frames_;
  std::vector<Sums> sums_;
  std::vector<double> values_;
};

}  // namespace

std::vector<Residual> residuals_of(driver::Session& session, std::atomic<bool>& stop, const StoredFrames& frames,
                                   int most) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Intervals intervals(session, stop, frames);
  const int all = frames.count - 1, looked_at = std::min(all, most);
  for (int k = 0; k < looked_at; ++k) {
    const auto interval = static_cast<int>(static_cast<std::int64_t>(k) * all / looked_at);
    if (!intervals.add(interval)) return std::vector<Residual>(frames.states.size(), Residual{infinite, infinite});
  }
  std::vector<Residual> result;
  const double values = static_cast<double>(looked_at) * static_cast<double>(session.workspace().cell_count());
  for (const Sums& sums : intervals.sums()) {
    result.push_back({std::sqrt(sums.missed / values) / (frames.every * session.problem().step),
                      sums.missed == 0 ? 0 : std::sqrt(sums.missed / sums.change)});
  }
  return result;
}

}  // namespace dpde::analysis
