// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/operator_reach.h"

#include <algorithm>
#include <map>

#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

constexpr int anywhere = -1;
using Reach = std::array<int, max_rank>;

/// Computes, backwards from the image, the distance at which each field is read.
class ReachFinder {
 public:
  ReachFinder(const Module& module, std::size_t rank) : module_(module), rank_(rank) {}

  Reach run(const Solve& solve) {
    for (const std::string& image : solve.images) reach_[image] = {};
    for (auto statement = solve.body.rbegin(); statement != solve.body.rend(); ++statement) add(*statement);
    Reach all{};
    for (const std::string& unknown : solve.unknowns) {
      for (std::size_t axis = 0; axis < rank_; ++axis) {
        const int one = reach_[unknown][axis];
        all[axis] = all[axis] == anywhere || one == anywhere ? anywhere : std::max(all[axis], one);
      }
    }
    return all;
  }

 private:
  void add(const Statement& statement) {
    const auto far = [&] {
      const Effects e = effects(module_, statement);
      for (const auto* fields : {&e.reads, &e.updates}) {
        for (const std::string& field : *fields) set_anywhere(field);
      }
    };
    match(
        statement, [&](const OneOf<Fill, Fold> auto& halo) { add_walls(halo.field, halo.axes); },
        [&](const Run& run) { add_kernel(kernel_of(module_, run)); },
        [&](const OneOf<Reduce, NetworkCall, Transform, Solve, Repeat> auto&) { far(); });
  }

  void set_anywhere(const std::string& field) {
    for (std::size_t axis = 0; axis < rank_; ++axis) reach_[field][axis] = anywhere;
  }

  void widen(const std::string& field, const Reach& by) {
    Reach& known = reach_[field];
    for (std::size_t axis = 0; axis < rank_; ++axis)
      known[axis] = known[axis] == anywhere || by[axis] == anywhere ? anywhere : std::max(known[axis], by[axis]);
  }

  /// Values on walls without a value condition are computed from two cells inside.
  void add_walls(const std::string& field, const std::vector<AxisBoundary>& axes) {
    const auto known = reach_.find(field);
    if (known == reach_.end()) return;
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const auto is_made = [](const Side& side) { return side.on_wall && side.kind != SideKind::value; };
      const bool is_bounded = axes[axis].topology == Topology::bounded;
      if (is_bounded && (is_made(axes[axis].low) || is_made(axes[axis].high)) && known->second[axis] != anywhere)
        known->second[axis] += 3;
    }
  }

  /// Assumes that every store of the kernel depends on all its reads.
  void add_kernel(const Kernel& kernel) {
    const Signature s = signature(kernel);
    std::optional<Reach> from;
    for (const auto* fields : {&s.writes, &s.updates}) {
      for (const std::string& field : *fields) {
        const auto known = reach_.find(field);
        if (known == reach_.end()) continue;
        if (!from) from = Reach{};
        for (std::size_t axis = 0; axis < rank_; ++axis) {
          int& reach = (*from)[axis];
          reach =
              reach == anywhere || known->second[axis] == anywhere ? anywhere : std::max(reach, known->second[axis]);
        }
      }
    }
    if (!from) return;
    for (const Signature::Read& read : s.reads) {
      Reach reach = *from;
      for (std::size_t axis = 0; axis < rank_; ++axis) {
        if (reach[axis] != anywhere) reach[axis] = read.interpolated ? anywhere : reach[axis] + read.halo[axis];
      }
      widen(read.field, reach);
    }
  }

  const Module& module_;
  std::size_t rank_;
  std::map<std::string, Reach> reach_;
};

}  // namespace

std::array<int, max_rank> reach_of_operator(const Module& module, const Solve& solve, std::size_t rank) {
  return ReachFinder(module, rank).run(solve);
}

}  // namespace dpde::stencil
