// SPDX-License-Identifier: Apache-2.0
// Which level reads what, how far it runs behind, and how many rows must be kept.
#include <algorithm>
#include <bit>
#include <map>

#include "wavefront.h"

namespace dpde {
namespace {

using Kind = WavefrontStream::Kind;

/// Values that vary along a wall come from a field, for which there is no ring; fields on the walls have images of other rows.
bool is_known_side(const dpde_side& side) {
  return side.kind == DPDE_PERIODIC || (side.field < 0 && side.kind != DPDE_ON_WALL);
}

/// Takes note of the axes' kinds; false when two fills disagree or a kind is not one that rows can be imaged for.
bool note_axes(const dpde_fill& fill, int rank, std::array<int, 3>& kinds) {
  for (int axis = 0; axis < rank; ++axis) {
    const dpde_boundary& side = fill.axes[axis];
    if (!is_known_side(side.low) || !is_known_side(side.high)) return false;
    const int kind = side.low.kind == DPDE_PERIODIC ? 1 : 2;
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
    int from, to;  // levels; from -1: an input
    int index;     // ring, or field of the input
    std::array<int64_t, 3> offset;
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
      read.offset = {stream.offset[0], stream.offset[1], stream.offset[2]};
      level.streams.push_back(read);
      reads_.push_back({source.level, number, read.index, read.offset});
      if (source.level < 0) continue;
      const bool is_shifted = std::ranges::any_of(read.offset, [](int64_t offset) { return offset != 0; });
      if (read.kind != Kind::ring || (is_shifted && !is_filled(source))) return false;
      level.lag = std::max(level.lag, plan_.levels[static_cast<size_t>(source.level)].lag + delay(read));
    }
    for (const auto& [field, source] : outputs) {
      level.outputs.push_back({source.stream, field, find_fill(operation, field)});
      current_[field] = source;
    }
    plan_.levels.push_back(std::move(level));
    return true;
  }

  size_t last() const { return static_cast<size_t>(program_.rank) - 1; }

  /// Rows by which a reader must be behind: row +k has to be there, and of a wall the row that row -k is the image of.
  int64_t delay(const WavefrontStream& stream) const {
    const int64_t offset = stream.offset[last()];
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
    return found != outputs.end() && found->fill;
  }

  /// Makes `from` reach as far as `to` reads of it.
  template <class From>
  static void reach_for(From& from, const Read& read, const WavefrontLevel& to) {
    for (size_t axis = 0; axis < 3; ++axis) {
      from.below[axis] = std::max(from.below[axis], to.below[axis] - read.offset[axis]);
      from.above[axis] = std::max(from.above[axis], to.above[axis] + read.offset[axis]);
    }
  }

  void find_extents() {
    std::map<int, WavefrontCopy> copies;
    for (auto read = reads_.rbegin(); read != reads_.rend(); ++read) {
      const WavefrontLevel& to = plan_.levels[static_cast<size_t>(read->to)];
      if (read->from >= 0) {
        reach_for(plan_.levels[static_cast<size_t>(read->from)], *read, to);
      } else {
        WavefrontCopy& copy = copies[read->index];
        reach_for(copy, *read, to);
        copy.ahead = std::max(copy.ahead, read->offset[last()] - to.lag);
      }
    }
    for (auto& [field, copy] : copies) {
      copy.field = field;
      plan_.copies.push_back(copy);
    }
  }

  /// A ring holds the rows from the lowest its slowest reader still needs to the one written last, and the images of rows
  /// beyond a wall.
  void find_rings() {
    std::vector<int64_t> rows(static_cast<size_t>(rings_), 1);
    for (const Read& read : reads_) {
      const int64_t lag = plan_.levels[static_cast<size_t>(read.to)].lag - read.offset[last()];
      if (read.from < 0) {
        WavefrontCopy& copy = *std::ranges::find(plan_.copies, read.index, &WavefrontCopy::field);
        copy.slots = std::max(copy.slots, lag + copy.ahead + 1);
      } else {
        int64_t& needed = rows[static_cast<size_t>(read.index)];
        needed = std::max(needed, lag - plan_.levels[static_cast<size_t>(read.from)].lag + 1 + program_.halo[last()]);
      }
    }
    const auto round_up = [](int64_t count) { return static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(count))); };
    for (const int64_t count : rows) plan_.ring_slots.push_back(round_up(count));
    for (WavefrontCopy& copy : plan_.copies) copy.slots = round_up(copy.slots);
  }

  const dpde_program& program_;
  WavefrontPlan plan_;
  std::map<int, Source> current_;
  std::vector<Read> reads_;
  int rings_ = 0;
};

}  // namespace

int64_t WavefrontPlan::reach(size_t axis) const {
  int64_t most = 0;
  for (const WavefrontLevel& level : levels) most = std::max({most, level.below[axis], level.above[axis]});
  return most;
}

std::optional<WavefrontPlan> plan_wavefront(const dpde_program& program, const dpde_layout& layout, int steps) {
  if (program.rank < 2 || program.interpret != nullptr || program.swap_count == 0 || steps < 1) return std::nullopt;
  const std::optional<std::array<bool, 3>> periodic = find_periodic(program);
  if (!periodic) return std::nullopt;
  std::optional<WavefrontPlan> plan = Planner(program, steps).run();
  if (!plan) return std::nullopt;
  plan->periodic = *periodic;
  for (int axis = 1; axis < program.rank; ++axis) {
    if (layout.cells[axis] <= std::max(2 * layout.halo[axis], plan->reach(static_cast<size_t>(axis)))) return std::nullopt;
  }
  return plan;
}

}  // namespace dpde
