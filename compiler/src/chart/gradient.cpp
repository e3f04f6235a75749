// SPDX-License-Identifier: Apache-2.0
#include "chart/gradient.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "driver/memory/memory_plan.h"
#include "model/analyse/placement.h"
#include "stability/stability_report.h"

namespace dpde::chart {

namespace {

model::Placement placement_of(const model::Problem& problem, const driver::Inverse::Part& part) {
  return part.is_initial() ? problem.find_state(part.name)->placement : problem.find_coefficient(part.name)->placement;
}

/// Divides each value by the volume of its cell; `values` may contain several fields.
void divide_by_volumes(const std::vector<model::Axis>& axes, std::vector<double>& values) {
  std::size_t below = 1;
  for (const model::Axis& axis : axes) {
    const auto cells = static_cast<std::size_t>(axis.cells);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] /= axis.width(std::int64_t(i / below % cells));
    below *= cells;
  }
}

std::size_t size_of(const std::vector<model::Axis>& axes) {
  std::size_t size = 1;
  for (const model::Axis& axis : axes) size *= static_cast<std::size_t>(axis.cells);
  return size;
}

/// Interpolates each field of `from` to the points of `axes`.
std::vector<double> fields_at_points(const GradientPart& from, const std::vector<model::Axis>& axes) {
  const std::size_t size = size_of(from.axes);
  std::vector<double> values;
  for (std::size_t first = 0; first < from.values.size(); first += size) {
    const auto begin = from.values.begin() + static_cast<std::ptrdiff_t>(first);
    const std::vector<double> one = at_points({from.axes, {begin, begin + static_cast<std::ptrdiff_t>(size)}}, axes);
    values.insert(values.end(), one.begin(), one.end());
  }
  return values;
}

driver::StorageOptions storage_of(const driver::Session& session) {
  return {session.options().threads, session.options().checkpoint_bytes, session.options().checkpoint_folder};
}

}  // namespace

std::unique_ptr<TaskGradient> TaskGradient::open(std::unique_ptr<driver::Session> session, const SourceFile& source,
                                                 std::string& why) {
  if (session == nullptr) return nullptr;
  if (!session->problem().task || session->problem().task->training) {
    why = session->problem().task ? "it learns from trajectories" : "it is no task";
    return nullptr;
  }
  DiagnosticSink sink;
  if (!driver::gradient_fits(session->compiled(), storage_of(*session), source, sink)) {
    why = sink.all().front().message;
    return nullptr;
  }
  std::unique_ptr<TaskGradient> task(new TaskGradient());
  task->session_ = std::move(session);
  task->inverse_ = driver::Inverse::open(*task->session_, source, sink);
  if (task->inverse_ == nullptr) {
    why = sink.all().empty() ? "it has no gradient" : sink.all().front().message;
    return nullptr;
  }
  // Steps are fractions of the scene's stable step: the task may start where the stable step is smaller.
  task->inverse_->assign(task->inverse_->start());
  const stability::StabilityReport verdict = stability::verdict_of(*task->session_);
  if (verdict.ruins_run()) {
    why = fmt::format("the step is above {:.4g}, the largest stable one where the task begins", verdict.bounded_step());
    return nullptr;
  }
  return task;
}

double TaskGradient::memory_bytes(const SourceFile& source) const {
  const auto plan = driver::plan_of_gradient_memory(session_->compiled(), storage_of(*session_), source);
  return plan ? plan->peak : 0;
}

bool TaskGradient::run() {
  gradient_.resize(inverse_->size());
  loss_ = inverse_->value_and_gradient(inverse_->start(), gradient_);
  const std::atomic<bool>* stop = session_->options().stop;
  return stop == nullptr || !stop->load();
}

bool TaskGradient::is_finite() const { return std::isfinite(loss_) && gradient_.allFinite(); }

GradientParts TaskGradient::parts(const std::vector<double>& values) const {
  GradientParts parts;
  for (const driver::Inverse::Part& part : inverse_->parts()) {
    const auto begin = values.begin() + part.offset;
    GradientPart result{{}, {begin, begin + part.size}};
    if (part.is_field()) {
      result.axes = model::axes_at(session_->axes(), placement_of(session_->problem(), part));
      divide_by_volumes(result.axes, result.values);
    }
    parts[(part.is_initial() ? "initial " : "") + part.name] = std::move(result);
  }
  return parts;
}

GradientReference::GradientReference(GradientParts finest, const GradientParts& second, std::string text)
    : finest_(std::move(finest)), text_(std::move(text)) {
  for (const auto& [name, error] : errors(second)) uncertainty_ = std::max(uncertainty_, error);
}

std::map<std::string, double> GradientReference::errors(const GradientParts& parts) const {
  std::map<std::string, double> result;
  for (const auto& [name, part] : parts) {
    const auto found = finest_.find(name);
    if (found == finest_.end()) continue;
    const std::vector<double> fine =
        part.axes.empty() ? found->second.values : fields_at_points(found->second, part.axes);
    if (fine.size() == part.values.size()) result[name] = relative_difference(part.values, fine, model::ErrorNorm::l2);
  }
  return result;
}

}  // namespace dpde::chart
