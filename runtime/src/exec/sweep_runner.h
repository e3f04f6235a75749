// SPDX-License-Identifier: Apache-2.0
// Runs sweeps in parts that threads share. On 3-D grids y is tiled, so that the planes z-1, z, z+1 of a tile stay in
// the cache. Row ends are filled while they are in the cache. Inside the runtime only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "exec/sweep.h"

namespace dpde {

class SweepRunner {
 public:
  SweepRunner() = default;
  /// The layout must outlive the object.
  SweepRunner(const dpde_layout& layout, const Team& team);
  /// Allocates memory for the runs of a sweep, before its first one.
  void make_room(const Sweep& sweep);
  /// Adds to the sums of the program. Allocates nothing.
  void run(Sweep& sweep, std::span<void* const> fields, const double* uniforms, std::span<double> sums);

 private:
  /// State of one thread for calling rows; on its own cache line.
  struct alignas(64) Caller {
    dpde_row row{};
    std::vector<void*> pointers;  // at the current row: streams, then fields filled with the sweep
    std::vector<void*> starts;    // the same at row (0, 0)
  };

  void run_all_parts(const Sweep& sweep, std::span<void* const> fields, const double* uniforms);
  void run_part(const Sweep& sweep, const dpde_variant& code, std::span<void* const> fields, int64_t part, int thread);
  template <bool of_subgrid>
  void run_rows(const Sweep& sweep, const dpde_variant& code, Caller& caller, SweepRange y_range, SweepRange planes);

  const dpde_layout* layout_ = nullptr;
  Team team_;
  std::vector<Caller> callers_;   // one a thread
  std::vector<void*> grids_;      // bases of the grids of the running sweep
  std::vector<double> row_sums_;  // sums of each row of the running sweep
};

}  // namespace dpde
