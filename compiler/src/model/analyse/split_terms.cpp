// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/split_terms.h"

#include "model/analyse/implicit_part.h"
#include "model/build.h"

namespace dpde::model {

Expr terms_for(const Problem& problem, const std::string& state, const Expr& rate, Split::Terms terms) {
  Expr carried = 0.0, others = 0.0;
  for (const Term& term : terms_of(rate)) {
    const bool transports = holds_any<Advect>(term.value);
    Expr& sum = transports ? carried : others;
    sum = binary(term.negative ? BinaryOp::subtract : BinaryOp::add, sum, term.value, term.value->origin);
  }
  if (terms == Split::Terms::advect) return carried;
  const LinearPart parts = implicit_part(problem, state, others);
  return terms == Split::Terms::diffusion ? parts.part : parts.rest;
}

}  // namespace dpde::model
