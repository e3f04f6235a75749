// SPDX-License-Identifier: Apache-2.0
#include "limit_watch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "stability/report/verdict_cache.h"

namespace dpde::tools {

namespace {

constexpr double part_of_time = 0.1;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

LimitWatch::LimitWatch(Job& job, TaskRun& run) : job_(job), run_(run), begin_(seconds_now()) {
  const auto is_network = [](const driver::Inverse::Part& part) { return part.is_network(); };
  is_told_ = std::ranges::all_of(run.inverse->parts(), is_network);  // weights do not change the judged step
}

/// Numbers with their values, fields only by name.
std::string LimitWatch::values_text(const Eigen::VectorXd& x) const {
  std::vector<std::string> texts;
  for (const driver::Inverse::Part& part : run_.inverse->parts()) {
    const bool is_number = !part.is_field() && !part.is_control() && !part.is_network();
    texts.push_back(is_number ? fmt::format("{} = {:.6g}", part.name, x[part.offset]) : "this " + part.name);
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

void LimitWatch::look(int iteration, const Eigen::VectorXd& x, bool is_last) {
  const double start = seconds_now();
  if (is_told_ || (iteration > 0 && !is_last && spent_ > part_of_time * (start - begin_))) return;
  run_.inverse->assign(x);
  // Not cached: these values do not occur again.
  const bool may_grow = !stability::look_for_growth(*run_.session);
  const stability::StabilityReport verdict =
      may_grow ? stability::examine(*run_.session) : stability::StabilityReport{};
  spent_ += seconds_now() - start;
  if (!may_grow || !verdict.is_above() || verdict.limit.kind != stability::StepLimit::Kind::limit) return;
  is_told_ = true;
  job_.sink().report("walks-over-limit", run_.session->problem().time_origin.range,
                     {fmt::format("{}", iteration), fmt::format("{:.6g}", verdict.step),
                      fmt::format("{:.6g}", verdict.limit.step), values_text(x)},
                     "a shorter step (--set step=...), or bounds that keep the unknowns below it: unknown ... in "
                     "low .. high");
}

}  // namespace dpde::tools
