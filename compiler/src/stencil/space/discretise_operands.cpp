// SPDX-License-Identifier: Apache-2.0
// Operands of reductions and operators, as fields that kernels store before.
#include <algorithm>

#include "stencil/build.h"
#include "stencil/space/discretise.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

/// The fields that the preparation stores.
std::vector<std::string> fields_made(const Prerequisite& preparation) {
  return match(
      preparation, [](const Kernel& kernel) { return signature(kernel).writes; },
      [](const Reduce& reduce) { return std::vector<std::string>{reduce.result}; },
      [](const NetworkCall& network_call) { return network_call.results; },
      [](const Transform& transform) { return std::vector<std::string>{transform.result}; },
      [](const PreparedSolve& solve) { return solve.fields_made(); });
}

}  // namespace

/// The field with the values of `e` at `place` of each cell: an existing one, or one that a kernel stores before.
std::string Discretiser::stored_operand(const model::Expr& e, const Place& place) {
  for (const Operand& known : operands_) {
    if (known.place == place && known.value == e) return known.field;
  }
  Discretiser inner(scheme_, names_, rank_, reading_, placements_);
  inner.parts_ = parts_;
  inner.preparations_ = preparations_;
  inner.operands_ = operands_;
  for (const Prerequisite& made : preparations_) {  // its lets may be added to one of these kernels
    const Kernel* kernel = std::get_if<Kernel>(&made);
    for (std::size_t i = 0; kernel && i < kernel->lets.size(); ++i) inner.names_.reserve(kernel->lets[i].name);
  }
  const Expr value = inner.at(e, place).value();
  parts_ = inner.parts_;
  preparations_ = inner.preparations_;
  operands_ = inner.operands_;
  for (const Prerequisite& made : preparations_) {  // those of `inner` too
    for (const std::string& field : fields_made(made)) names_.reserve(field);
  }
  const Access* field = as<Access>(value);
  const bool is_there = field && field->offset == Offset{};
  operands_.push_back({e, place, is_there ? field->field : store_before(inner, value, e->origin)});
  return operands_.back().field;
}

/// Operands without reductions and operators share one kernel, the first.
std::string Discretiser::store_before(const Discretiser& inner, const Expr& value, const Origin& origin) {
  const std::string field = names_.fresh("operand");
  const Kernel kernel{"", rank_, inner.lets_, {{field, false, value, origin}}, {}, {}};
  const Signature reads = signature(kernel);
  const bool is_nested = std::any_of(preparations_.begin(), preparations_.end(), [&](const Prerequisite& made) {
    const Kernel* made_here = std::get_if<Kernel>(&made);
    if (made_here && made_here->name.empty()) return false;  // stores operands, not an operator
    return std::ranges::any_of(fields_made(made),
                               [&](const std::string& field) { return reads.find_read(field) != nullptr; });
  });
  Kernel* first = preparations_.empty() ? nullptr : std::get_if<Kernel>(&preparations_.front());
  if (first && !first->name.empty()) first = nullptr;  // kernel of an operator
  if (is_nested) {
    preparations_.push_back(kernel);
  } else if (!first) {
    preparations_.insert(preparations_.begin(), kernel);
  } else {
    first->lets.insert(first->lets.end(), kernel.lets.begin(), kernel.lets.end());
    first->stores.push_back(kernel.stores[0]);
  }
  return field;
}

/// The field with the result of the reduction.
std::string Discretiser::stored_reduction(Reduce reduce) {
  for (const Prerequisite& made : preparations_) {
    const Reduce* known = std::get_if<Reduce>(&made);
    if (known && known->kind == reduce.kind && known->field == reduce.field && known->over == reduce.over)
      return known->result;
  }
  reduce.result = names_.fresh(reduce.field + "_" + std::string(name_of(reduce.kind)));
  preparations_.push_back(reduce);
  return reduce.result;
}

}  // namespace dpde::stencil
