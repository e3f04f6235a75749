// SPDX-License-Identifier: Apache-2.0
// How far beyond the interior fields are read, written and known: what the adjoint has to know of walls.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "adjoint/rules.h"
#include "stencil/build.h"
#include "stencil/effects.h"

namespace dpde::adjoint {

bool has_bounded_axis(const std::vector<Topology>& axes);

/// How far beyond the interior the adjoint kernels must reach along bounded axes: as far as varied reads do, and
/// scatters to varied fields (their transposes read the first halo cell).
int reach(const stencil::Module& module, const stencil::Program& program, const Varied& varied);

/// The fields that `kernel` reads at an offset along a periodic axis. Interpolation wraps by itself.
std::set<std::string> read_around(const stencil::Kernel& kernel, const std::vector<Topology>& axes);

/// How far outside a kernel that runs `grow` cells beyond the interior uses what it reads of each field. Behind
/// inside[o] grow g the point i has i+o at most g outside, so that a read of i+k lies at most g + |k-o| outside.
std::map<std::string, int> extents_of(const stencil::Kernel& kernel, int grow, const std::vector<Topology>& axes);

/// Fields whose periodic halo is right when the program has run.
std::set<std::string> filled_at_the_end(const stencil::Module& module, const stencil::Program& program);

/// The fill in the program itself, not in its repeats, that a field has behind it the statements before `end`.
const stencil::Fill* last_fill(const stencil::Program& program, const std::string& field, std::size_t end);

/// Halos that repeats have left as anything, where the adjoint may read what fills before them had set.
class SpoiledHalos {
 public:
  /// As they are when the program has run.
  SpoiledHalos(const stencil::Module& module, const stencil::Program& program);
  /// Returns what the repeat spoils.
  std::vector<std::string> add(const stencil::Effects& repeat) {
    fields_.insert(repeat.spoils.begin(), repeat.spoils.end());
    return repeat.spoils;
  }
  /// Adds the fill that lets the halo, and values on walls, be what they were where the statement of this number has
  /// read them, and notes what it needs; false where they are so.
  bool restore(const std::string& field, int statement, std::map<std::string, int>& needed,
               std::vector<stencil::Statement>& body);

 private:
  const stencil::Program& program_;
  std::set<std::string> fields_;
};

/// The fields that the program reads, sets on walls or scatters to.
std::set<std::string> fields_read_inside(const stencil::Module& module, const stencil::Program& program);

/// Whether one of the statements uses the values of a field; that a fill sets its halo does not count.
bool is_read_by(const stencil::Module& kernels, const std::vector<stencil::Statement>& body, const std::string& field);

/// Bounded sides of a seed are masked by inside[...], so their kind is never seen.
std::vector<stencil::AxisBoundary> seed_boundary(const std::vector<Topology>& axes);

/// Of a primal field that only the adjoint reads beside periodic axes. Nothing beyond walls is read here; filled as
/// other programs do it, the halo of a coefficient stays right for them and is not made anew in each run. Not so on
/// walls, where that fill would undo what this program has added to the value there since.
std::vector<stencil::AxisBoundary> primal_boundary(const stencil::Module& module, const stencil::Program& program,
                                                   const std::string& field);

/// Fields computed beyond the interior.
std::set<std::string> grown_fields(const stencil::Module& module, const stencil::Program& program);

}  // namespace dpde::adjoint
