// SPDX-License-Identifier: Apache-2.0
// Values that many terms of a gather need, each at another displacement: stored in a field once, they are read there
// instead of recomputed (Devito: cross-iteration redundancy elimination). The adjoint of u_t + dt*c2*lap(u) reads
// c2*u_t_bar at every point of lap.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Contributions of one read field, keyed by offset.
struct ReadBars {
  std::string field;
  std::map<stencil::Offset, stencil::Expr> by_offset;
};

/// Result of the backward walk of a kernel, with all terms at the same point: the term of offset k is used at the point
/// displaced by -k.
struct PointTerms {
  std::vector<stencil::Let> lets;  // each before its use
  std::vector<ReadBars> reads;
  std::vector<std::pair<std::string, stencil::Expr>> params;
};

/// Chooses values to store, one after another. The terms are numbered once; a stored value is a leaf from then on, so
/// that each further choice costs one walk over the numbers.
class SharedValues {
 public:
  explicit SharedValues(PointTerms terms);
  ~SharedValues();
  SharedValues(const SharedValues&) = delete;
  SharedValues& operator=(const SharedValues&) = delete;

  struct Found {
    int number;  // of the value
    stencil::Expr value;
    int operations_saved;  // per point, in exchange for one load per displacement
  };
  /// The value whose storage saves most loads and operations; nullopt if that is less than `least`. It reads no stored
  /// values and has no interpolations.
  std::optional<Found> best(int least);
  void store(const Found& found, const std::string& field);
  /// The terms with stored values replaced by reads of their fields.
  PointTerms terms() const;
  /// The stored fields, each with its value.
  const std::vector<stencil::Let>& stored() const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

}  // namespace dpde::adjoint
