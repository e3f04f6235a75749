// SPDX-License-Identifier: Apache-2.0
// Temporal blocking: several steps of a program in one pass over memory, as a wavefront. Level s (one sweep of one
// step) runs along the last axis, some rows behind the levels it reads. Intermediate values between the first and the
// last step are in rings of few rows (planes in 3-D) that stay in the core's cache. Tiles (strips along x in 2-D, along
// y in 3-D; a part for each thread) recompute the cells they need of their neighbours, so they never wait. Every value
// is computed by the same row function from the same values as in the plain schedule: results are bit-identical.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/layout.h"

namespace dpde {

/// Location of the rows that a sweep reads or writes.
struct WavefrontStream {
  enum class Kind { input, result, ring } kind = Kind::input;
  int index = 0;    // field of the program (input), swap (result) or ring
  int program = 0;  // of an input: 0 the step, 1 its adjoint
  std::array<int64_t, 3> offset{};
};

struct WavefrontLevel {
  dpde_row_fn row = nullptr;
  int own = 0;  // index of the first of its own uniforms
  int pass = 0;
  int uniforms = 0;  // index in the plan
  std::vector<WavefrontStream> streams;
  struct Output {
    WavefrontStream stream;  // offset 0
    int field = 0;
    std::optional<dpde_fill> fill;  // of its halo
    int added = -1;                 // index of the sum over steps to which the values are added
    int copied = -1;                // result (a swap) to which the tile's own cells are copied
  };
  std::vector<Output> outputs;
  std::vector<int> sums;                    // of the program
  std::vector<size_t> leading;              // 3-D: for each input, the stream that is the first to reach new memory
  int64_t lag = 0;                          // in rows along the last axis
  std::array<int64_t, 3> below{}, above{};  // cells computed beyond the tile's, along each axis
};

/// An input for tiles that extend beyond the ends of a periodic x axis: its rows are copied to a ring.
struct WavefrontCopy {
  int program = 0, field = 0;
  int64_t ahead = 0, slots = 1;
  std::array<int64_t, 3> below{}, above{};
};

/// One run of a program: of the step (0) or its adjoint (1), for a step of the block.
struct WavefrontPass {
  int program = 0, step = 0;
};

/// The uniforms of a pass with given values of its counters.
struct WavefrontUniforms {
  int pass = 0;
  std::vector<std::pair<size_t, double>> counted;
  bool operator==(const WavefrontUniforms&) const = default;
};

struct WavefrontPlan {
  std::vector<WavefrontLevel> levels;
  std::vector<WavefrontPass> passes;
  std::vector<WavefrontUniforms> uniforms;
  std::vector<int64_t> ring_slots;  // rows (planes) of each ring, powers of two
  std::vector<WavefrontCopy> copies;
  std::array<bool, 3> periodic{true, true, true};
  /// Rows (planes in 3-D) that a level computes in one go, so that what it reads stays in the first-level cache.
  int64_t rows_at_once = 1;
  /// Largest number of cells beyond a tile along an axis, of all levels.
  int64_t reach(size_t axis) const;
};

/// nullopt if the program cannot be blocked. Required: only sweeps over the interior, no sums, scatters or explicit
/// fills, every field written once, and axes longer than the levels' reach.
std::optional<WavefrontPlan> plan_wavefront(const dpde_program& program, const dpde_layout& layout, int steps);

/// Fields of the adjoint of a step.
struct AdjointFields {
  std::vector<int> states;                 // field of each state of the step; -1: not read
  std::vector<std::pair<int, int>> added;  // results summed over steps, and the index of each sum
};

/// The same for the adjoints of `steps` steps; those may have sums.
std::optional<WavefrontPlan> plan_reverse_wavefront(const dpde_program& step, const dpde_program& adjoint,
                                                    const AdjointFields& fields, const dpde_layout& layout, int steps);

class Wavefront {
 public:
  /// `executor` is the plain schedule of the program: its bindings, fills and uniforms are used. nullopt: see above.
  static std::optional<Wavefront> make(const Executor& executor, int steps, const Team& team);
  /// Adjoints of steps, the last one first. States that the adjoint reads need not be bound in `adjoint`.
  static std::optional<Wavefront> make_reverse(const Executor& step, const Executor& adjoint,
                                               const AdjointFields& fields, int steps, const Team& team);
  ~Wavefront();
  Wavefront(Wavefront&&) noexcept;
  Wavefront& operator=(Wavefront&&) noexcept;

  int steps() const;
  const std::vector<WavefrontPass>& passes() const;
  /// Number of cells computed, relative to the plain schedule.
  double work() const;
  /// Sets the uniforms of a pass from the present parameters of its program.
  void set_uniforms(size_t pass, std::span<const double> uniforms);
  /// Destinations of results that are summed over steps: base pointers of fields of doubles, by index.
  void set_totals(std::span<double* const> totals);
  /// Reads the bound inputs, whose halos must be filled, and writes results[s] (base pointers, one for each swap of the
  /// last pass's program, none of the inputs): the states after steps() steps, or adjoints before them, with their
  /// halos.
  void run(std::span<void* const> results);
  /// The sums of the program of a pass, from the last run().
  std::span<const double> sums(size_t pass) const;

 private:
  struct Impl;
  explicit Wavefront(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
