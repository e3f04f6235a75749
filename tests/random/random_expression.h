// SPDX-License-Identifier: Apache-2.0
// Random expressions of the fields, params and locals that a kernel may read.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"
#include "support/split_mix.h"

namespace dpde::testing {

/// A field a kernel may read.
struct Readable {
  std::string field;
  int reach = 0;           // largest offset along bounded axes
  bool is_around = false;  // whether periodic axes may be crossed
  bool interpolates = false;
  bool is_active = true;  // may depend on the variables of differentiation
  int grown = 0;          // cells beyond the interior with known values, for reads guarded by inside[]
};

struct Scope {
  std::vector<Topology> axes;
  std::vector<Readable> fields;     // not empty
  std::vector<std::string> params;  // not empty
  std::vector<std::string> locals;
};

class ExpressionGenerator {
 public:
  ExpressionGenerator(SplitMix& random, const Scope& scope) : random_(random), scope_(scope) {}

  /// Any value; it grows no faster than a product of a few inputs.
  stencil::Expr value(int depth);
  /// The value of a store: an update u + dt*(...), a linear stencil or a bounded value.
  stencil::Expr stored();
  stencil::Interp place(const Readable& field);
  const Readable* interpolated_field();

 private:
  stencil::Expr leaf();
  stencil::Expr read(const Readable& field);
  stencil::Expr number();
  stencil::Expr small_number();
  stencil::Expr condition(int depth);
  stencil::Expr function(int depth);
  stencil::Expr jump();
  stencil::Expr two(BinaryOp op, int depth);
  stencil::Expr product(int depth);
  stencil::Expr choice(int depth);
  stencil::Expr positive(int depth);
  stencil::Expr quotient(int depth);
  stencil::Expr powers(int depth);
  stencil::Expr bounded(int depth);
  stencil::Expr linear_stencil();
  stencil::Expr behind_inside();
  stencil::Expr displacement();
  stencil::Offset offset(const Readable& field);
  const Readable& any_field() { return scope_.fields[random_.below(static_cast<int>(scope_.fields.size()))]; }
  int rank() const { return static_cast<int>(scope_.axes.size()); }

  SplitMix& random_;
  const Scope& scope_;
};

int node_count(const stencil::Expr& e);

}  // namespace dpde::testing
