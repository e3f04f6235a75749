// SPDX-License-Identifier: Apache-2.0
// Values that many terms of a gather need, each at another displacement: stored in a field once, they are read there
// and not made again from all they consist of (Devito: cross-iteration redundancy elimination). The adjoint of u_t +
// dt*c2*lap(u) reads c2*u_t_bar at every point of lap.
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

/// What the backward walk of a kernel leaves, all at the same point: the term of offset k is used at the point
/// displaced by -k.
struct PointTerms {
  std::vector<stencil::Let> lets;  // each before its use
  std::vector<ReadBars> reads;
  std::vector<std::pair<std::string, stencil::Expr>> params;
};

/// Which values are best stored, one after another. The terms are numbered once; what was stored is a leaf from then
/// on, so that each further value costs one walk over numbers.
class SharedValues {
 public:
  explicit SharedValues(PointTerms terms);
  ~SharedValues();
  SharedValues(const SharedValues&) = delete;
  SharedValues& operator=(const SharedValues&) = delete;

  struct Found {
    int number;  // of the value
    stencil::Expr value;
    int operations_saved;  // at each point, for one load at each displacement
  };
  /// The value that saves most when a field holds it, as far as loads and operations tell; nullopt when that is less
  /// than `least`. It reads no field that was stored and interpolates nothing.
  std::optional<Found> best(int least);
  void store(const Found& found, const std::string& field);
  /// With the fields in the places of what they hold.
  PointTerms terms() const;
  /// Those stored, each with the value it holds.
  const std::vector<stencil::Let>& stored() const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

}  // namespace dpde::adjoint
