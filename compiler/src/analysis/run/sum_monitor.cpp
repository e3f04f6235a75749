// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "analysis/run/conserved_sums.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "model/boundary/metric.h"

namespace dpde::analysis {

namespace {

struct WeightedSums {
  double sum = 0, magnitude = 0;
};

/// Sums row by row, which reduces the rounding error compared with one sum over all cells.
template <class Real>
WeightedSums sums_over(const dpde_layout& layout, const Real* base, const std::vector<double>& volumes,
                       bool of_squares) {
  WeightedSums all;
  const double* volume = volumes.data();
  for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
    for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
      const Real* row = base + index_of(layout, 0, y, z);
      WeightedSums of_row;
      for (std::int64_t x = 0; x < layout.cells[0]; ++x) {
        const double value = static_cast<double>(row[x]);
        const double part = *volume++ * (of_squares ? value * value : value);
        of_row.sum += part;
        of_row.magnitude += std::abs(part);
      }
      all.sum += of_row.sum;
      all.magnitude += of_row.magnitude;
    }
  }
  return all;
}

}  // namespace

double rounding_of_sums(Precision real, int steps) {
  const double unit = real == Precision::f64 ? 0x1p-53 : 0x1p-24;
  return unit * (steps + 1000.0);
}

SumMonitor::SumMonitor(driver::Session& session, std::vector<ConservedSum> sums)
    : session_(session), sums_(std::move(sums)), values_(sums_.size()) {}

SumMonitor::Value SumMonitor::integral(const void* state, const std::string& field, bool of_square) const {
  const dpde_layout& layout = session_.workspace().layout();
  const model::State* known = session_.problem().find_state(field);
  const std::vector<double> volumes = model::cell_volumes(session_.axes(), session_.problem().metric,
                                                          known == nullptr ? model::Placement{} : known->placement);
  const WeightedSums sums = layout.real == DPDE_F32
                                ? sums_over(layout, static_cast<const float*>(state), volumes, of_square)
                                : sums_over(layout, static_cast<const double*>(state), volumes, of_square);
  return {sums.sum, sums.magnitude};
}

std::vector<std::pair<std::string, double>> SumMonitor::sizes(double t, const std::vector<void*>& states) const {
  const dpde_layout& layout = session_.workspace().layout();
  std::vector<Field> magnitudes;
  std::vector<void*> bases;
  std::vector<double> values(session_.workspace().cell_count());
  for (const void* state : states) {
    copy_out(layout, state, values);
    for (double& value : values) value = std::abs(value);
    magnitudes.emplace_back(layout, static_cast<int>(magnitudes.size())).copy_in(values);
    bases.push_back(magnitudes.back().base());
  }
  return session_.observe(t, bases);
}

/// Size of the vector's other components: a component that is 0 except for rounding has no size of its own.
double SumMonitor::size_beside(const std::vector<void*>& states, const std::string& field, bool of_square) const {
  const std::string vector = field.substr(0, field.find('.') + 1);  // with the dot; "" for a scalar
  double size = 0;
  for (std::size_t s = 0; !vector.empty() && s < states.size(); ++s) {
    const std::string& other = session_.rollout().state_name(static_cast<int>(s));
    if (other != field && other.starts_with(vector)) size += integral(states[s], other, of_square).magnitude;
  }
  return size;
}

void SumMonitor::look(int step, double t, const std::vector<void*>& states) {
  if (sums_.empty() || (!times_.empty() && step <= last_)) return;
  if (times_.empty()) first_ = step;
  last_ = step;
  times_.push_back(t);
  const auto observes = [](const ConservedSum& sum) { return sum.fields.empty(); };
  std::vector<std::pair<std::string, double>> observed;
  if (std::ranges::any_of(sums_, observes)) {
    observed = session_.observe(t, states);
    if (times_.size() == 1) sizes_ = sizes(t, states);
  }
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    Value value;
    for (const std::string& field : sums_[i].fields) {
      const int state = session_.rollout().state_index(field);
      const Value part = integral(states[static_cast<std::size_t>(state)], field, sums_[i].of_squares);
      value.sum += part.sum;
      value.magnitude += part.magnitude + size_beside(states, field, sums_[i].of_squares);
    }
    for (const auto& [name, number] : observed) {
      if (observes(sums_[i]) && name == sums_[i].name) value = {number, std::abs(number)};
    }
    values_[i].push_back(value);
  }
}

std::vector<SumDrift> SumMonitor::drifts() const {
  std::vector<SumDrift> result;
  if (times_.size() < 2) return result;
  const double allowed = rounding_of_sums(session_.problem().scheme.real, last_ - first_);
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const std::vector<Value>& values = values_[i];
    SumDrift drift{sums_[i].name, values.front().sum, values.back().sum};
    drift.per_time = (drift.end - drift.begin) / (times_.back() - times_.front());
    double magnitude = 0, distance = 0;
    for (const Value& value : values) {
      magnitude = std::max(magnitude, value.magnitude);
      distance = std::max(distance, std::abs(value.sum - drift.begin));
    }
    for (const auto& [name, size] : sizes_) {
      if (sums_[i].fields.empty() && name == sums_[i].name && std::isfinite(size))
        magnitude = std::max(magnitude, std::abs(size));
    }
    drift.largest = magnitude > 0 ? distance / magnitude : 0;
    drift.but_for_steps = sums_[i].but_for_steps;
    drift.until_switched = sums_[i].until_switched;
    drift.exceeds_rounding = !(drift.largest <= allowed);
    result.push_back(std::move(drift));
  }
  return result;
}

}  // namespace dpde::analysis
