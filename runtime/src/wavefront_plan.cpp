// SPDX-License-Identifier: Apache-2.0
// Which level reads what, how far it runs behind, and how many rows must be kept.
#include <algorithm>
#include <bit>
#include <map>

#include "wavefront.h"

namespace dpde {
namespace {

using Kind = WavefrontStream::Kind;

bool is_known_side(int32_t kind) { return kind == DPDE_PERIODIC || kind == DPDE_VALUE || kind == DPDE_ZERO_GRADIENT; }

/// Takes note of the axes' kinds; false when two fills disagree or a kind is not one that rows can be imaged for.
bool note_axes(const dpde_fill& fill, int rank, std::array<int, 3>& kinds) {
  for (int axis = 0; axis < rank; ++axis) {
    const dpde_boundary& side = fill.axes[axis];
    if (!is_known_side(side.low) || !is_known_side(side.high)) return false;
    const int kind = side.low == DPDE_PERIODIC ? 1 : 2;
    if (kinds[static_cast<size_t>(axis)] != 0 && kinds[static_cast<size_t>(axis)] != kind) return false;
    kinds[static_cast<size_t>(axis)] = kind;
  }
  return true;
}

bool is_plain_sweep(const dpde_program& program, const dpde_operation& operation) {
  if (operation.kind != DPDE_SWEEP || operation.serial != 0) return false;
  if (std::ranges::any_of(operation.grow, [](int64_t grow) { return grow != 0; })) return false;
  const dpde_kernel& kernel = program.kernels[operation.kernel];
  const std::span streams(kernel.streams, static_cast<size_t>(kernel.stream_count));
  return kernel.grid_count == 0 && kernel.sum_count == 0 && std::ranges::none_of(streams, [](const dpde_stream& s) { return s.is_written == 2; });
}

std::optional<std::array<bool, 3>> find_periodic(const dpde_program& program) {
  std::array<int, 3> kinds{};
  for (int i = 0; i < program.prepare_count; ++i) {
    if (!note_axes(program.prepare[i], program.rank, kinds)) return std::nullopt;
  }
  for (int i = 0; i < program.operation_count; ++i) {
    const dpde_operation& operation = program.operations[i];
    if (!is_plain_sweep(program, operation)) return std::nullopt;
    for (int f = 0; f < operation.then_count; ++f) {
      if (!note_axes(operation.then[f], program.rank, kinds)) return std::nullopt;
    }
  }
  return std::array<bool, 3>{kinds[0] != 2, kinds[1] != 2, kinds[2] != 2};
}

/// Builds the levels of all steps, one after the other.
class Planner {
 public:
  Planner(const dpde_program& program, int steps) : program_(program) { plan_.steps = steps; }

  std::optional<WavefrontPlan> run() {
    for (int field = 0; field < program_.field_count; ++field) current_[field] = {Source{{Kind::input, field}, -1}};
    for (int step = 0; step < plan_.steps; ++step) {
      std::vector<bool> written(static_cast<size_t>(program_.field_count));
      for (int i = 0; i < program_.operation_count; ++i) {
        if (!add_level(step, program_.operations[i], written)) return std::nullopt;
      }
      const std::map<int, Source> before = current_;
      for (int s = 0; s < program_.swap_count; ++s) current_[program_.swaps[s].state] = before.at(program_.swaps[s].next);
    }
    find_extents();
    find_rings();
    return std::move(plan_);
  }

 private:
  /// Where the present value of a field is, and which level writes it (-1: none).
  struct Source {
    WavefrontStream stream;
    int level = -1;
    int field = -1;  // as that level calls it
  };
  struct Read {
    int from, to;  // levels
    int ring;
    std::array<int64_t, 2> offset;
  };

  bool add_level(int step, const dpde_operation& operation, std::vector<bool>& written) {
    const dpde_kernel& kernel = program_.kernels[operation.kernel];
    const int number = static_cast<int>(plan_.levels.size());
    WavefrontLevel level;
    level.row = kernel.row;
    level.step = step;
    std::map<int, Source> outputs;
    for (int s = 0; s < kernel.stream_count; ++s) {
      const dpde_stream& stream = kernel.streams[s];
      if (stream.is_written != 0) {
        if (written[static_cast<size_t>(stream.field)] && !outputs.contains(stream.field)) return false;
        written[static_cast<size_t>(stream.field)] = true;
        if (!outputs.contains(stream.field)) outputs[stream.field] = Source{make_output(step, stream.field), number, stream.field};
        level.streams.push_back(outputs[stream.field].stream);
        continue;
      }
      const Source& source = current_.at(stream.field);
      WavefrontStream read = source.stream;
      read.x = stream.offset[0], read.y = stream.offset[1], read.z = stream.offset[2];
      level.streams.push_back(read);
      if (source.level < 0) continue;
      if ((read.y != 0 || read.z != 0 || read.x != 0) && !is_filled(source)) return false;
      if (source.stream.kind != Kind::ring) return false;  // results are not read
      reads_.push_back({source.level, number, source.stream.index, {read.y, read.z}});
      level.lag = std::max(level.lag, plan_.levels[static_cast<size_t>(source.level)].lag + delay(read));
    }
    for (const auto& [field, source] : outputs) {
      level.outputs.push_back({source.stream, field, false, find_fill(operation, field)});
      level.outputs.back().filled = level.outputs.back().fill.has_value();
      current_[field] = source;
    }
    plan_.levels.push_back(std::move(level));
    return true;
  }

  /// Rows by which a reader must be behind: row +k has to be there, and of a wall the row that row -k is the image of.
  int64_t delay(const WavefrontStream& stream) const {
    const int64_t offset = program_.rank == 3 ? stream.z : stream.y;
    return std::max(offset, -offset - 1);
  }

  WavefrontStream make_output(int step, int field) {
    if (step == plan_.steps - 1) {
      for (int s = 0; s < program_.swap_count; ++s) {
        if (program_.swaps[s].next == field) return {Kind::result, s};
      }
    }
    return {Kind::ring, rings_++};
  }

  static std::optional<dpde_fill> find_fill(const dpde_operation& operation, int field) {
    for (int f = 0; f < operation.then_count; ++f) {
      if (operation.then[f].field == field) return operation.then[f];
    }
    return std::nullopt;
  }

  bool is_filled(const Source& source) const {
    const std::vector<WavefrontLevel::Output>& outputs = plan_.levels[static_cast<size_t>(source.level)].outputs;
    const auto found = std::ranges::find(outputs, source.field, &WavefrontLevel::Output::field);
    return found != outputs.end() && found->filled;
  }

  void find_extents() {
    for (auto read = reads_.rbegin(); read != reads_.rend(); ++read) {
      WavefrontLevel& from = plan_.levels[static_cast<size_t>(read->from)];
      const WavefrontLevel& to = plan_.levels[static_cast<size_t>(read->to)];
      for (size_t axis = 0; axis < 2; ++axis) {
        from.below[axis] = std::max(from.below[axis], to.below[axis] - read->offset[axis]);
        from.above[axis] = std::max(from.above[axis], to.above[axis] + read->offset[axis]);
      }
    }
  }

  /// A ring holds the rows from the lowest its slowest reader still needs to the one written last, and the images of rows
  /// beyond a wall.
  void find_rings() {
    std::vector<int64_t> rows(static_cast<size_t>(rings_), 1);
    const size_t axis = program_.rank == 3 ? 1 : 0;
    for (const Read& read : reads_) {
      const int64_t behind = plan_.levels[static_cast<size_t>(read.to)].lag - plan_.levels[static_cast<size_t>(read.from)].lag;
      int64_t& needed = rows[static_cast<size_t>(read.ring)];
      needed = std::max(needed, behind - read.offset[axis] + 1 + program_.halo[program_.rank - 1]);
    }
    for (const int64_t count : rows) plan_.ring_slots.push_back(static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(count))));
  }

  const dpde_program& program_;
  WavefrontPlan plan_;
  std::map<int, Source> current_;
  std::vector<Read> reads_;
  int rings_ = 0;
};

}  // namespace

std::optional<WavefrontPlan> plan_wavefront(const dpde_program& program, const dpde_layout& layout, int steps) {
  if (program.rank < 2 || program.interpret != nullptr || program.swap_count == 0 || steps < 1) return std::nullopt;
  const std::optional<std::array<bool, 3>> periodic = find_periodic(program);
  if (!periodic) return std::nullopt;
  std::optional<WavefrontPlan> plan = Planner(program, steps).run();
  if (!plan) return std::nullopt;
  plan->periodic = *periodic;
  for (int axis = 1; axis < program.rank; ++axis) {
    int64_t reach = 2 * layout.halo[axis];
    for (const WavefrontLevel& level : plan->levels) reach = std::max({reach, level.below[axis - 1], level.above[axis - 1]});
    if (layout.cells[axis] < reach + 1) return std::nullopt;
  }
  return plan;
}

}  // namespace dpde
