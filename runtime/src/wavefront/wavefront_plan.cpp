// SPDX-License-Identifier: Apache-2.0
// Plans the levels: their inputs, their lag, and the number of rows to store.
#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <tuple>

#include "grid/halo_axis.h"
#include "wavefront/wavefront.h"

namespace dpde {
namespace {

using Kind = WavefrontStream::Kind;

/// For 2-D programs whose step is one sweep (4096^2: 0.87 times the time). Stages of a step are read by several others,
/// and storing the additional rows costs more than it saves (RK4: 1.07 times the time).
constexpr int64_t rows_at_once = 4;

/// Records whether axes are periodic or bounded. Returns false if two fills disagree, or if ghost rows need more than
/// mirror rows: boundary values that vary along a wall come from a field, which has no ring.
bool note_axes(const dpde_fill& fill, int rank, std::array<int, 3>& kinds) {
  for (int axis = 0; axis < rank; ++axis) {
    const dpde_boundary& side = fill.axes[axis];
    if (!is_mirrored(side.low) || !is_mirrored(side.high)) return false;
    const int kind = side.low.rule == nullptr ? 1 : 2;
    if (kinds[static_cast<size_t>(axis)] != 0 && kinds[static_cast<size_t>(axis)] != kind) return false;
    kinds[static_cast<size_t>(axis)] = kind;
  }
  return true;
}

bool is_plain_sweep(const dpde_program& program, const dpde_operation& operation, bool may_sum) {
  if (operation.kind != DPDE_SWEEP || operation.serial != 0) return false;
  if (std::ranges::any_of(operation.grow, [](int64_t grow) { return grow != 0; })) return false;
  const dpde_kernel& kernel = program.kernels[operation.kernel];
  return kernel.grid_count == 0 && (may_sum || kernel.sum_count == 0);
}

/// Limit on the sweeps of a step, passes of repeats included: larger blocks need too many rings.
constexpr int64_t most_sweeps = 64;

int64_t sweeps_in(const dpde_operation* operations, int32_t count) {
  int64_t sweeps = 0;
  for (int32_t i = 0; i < count && sweeps <= most_sweeps; ++i) {
    const dpde_repeat& repeat = operations[i].repeat;
    const bool is_repeat = operations[i].kind == DPDE_REPEAT;
    sweeps +=
        is_repeat ? std::min(repeat.count, most_sweeps) * sweeps_in(repeat.operations, repeat.operation_count) : 1;
  }
  return sweeps;
}

bool note_operations(const dpde_program& program, const dpde_operation* operations, int32_t count, bool may_sum,
                     std::array<int, 3>& kinds) {
  for (int32_t i = 0; i < count; ++i) {
    const dpde_operation& operation = operations[i];
    if (operation.kind == DPDE_REPEAT) {
      const dpde_repeat& repeat = operation.repeat;
      if (!note_operations(program, repeat.operations, repeat.operation_count, may_sum, kinds)) return false;
      continue;
    }
    if (!is_plain_sweep(program, operation, may_sum)) return false;
    for (int f = 0; f < operation.then_count; ++f) {
      if (!note_axes(operation.then[f], program.rank, kinds)) return false;
    }
  }
  return true;
}

/// Records the axes of all fills of a program; returns false if it cannot be blocked.
bool note_program(const dpde_program& program, bool may_sum, std::array<int, 3>& kinds) {
  for (int i = 0; i < program.prepare_count; ++i) {
    if (!note_axes(program.prepare[i], program.rank, kinds)) return false;
  }
  return program.stack_count == 0 && sweeps_in(program.operations, program.operation_count) <= most_sweeps &&
         note_operations(program, program.operations, program.operation_count, may_sum, kinds);
}

/// Builds the levels of all passes, in order.
class Planner {
 public:
  explicit Planner(const dpde_program& step) : programs_{&step, nullptr} {}
  Planner(const dpde_program& step, const dpde_program& adjoint, const AdjointFields& fields)
      : programs_{&step, &adjoint}, adjoint_(fields) {}

  std::optional<WavefrontPlan> forward(int steps) {
    Sources now = inputs(0);
    for (int step = 0; step < steps; ++step) {
      if (!add_pass({0, step}, now, step == steps - 1)) return std::nullopt;
    }
    return finish();
  }

  std::optional<WavefrontPlan> reverse(int steps) {
    const std::span swaps(programs_[0]->swaps, static_cast<size_t>(programs_[0]->swap_count));
    const bool reads_states = std::ranges::any_of(adjoint_.states, [](int field) { return field >= 0; });
    std::vector<Sources> before{inputs(0)};  // one for each step
    for (int step = 0; reads_states && step < steps - 1; ++step) {
      before.push_back(before.back());
      if (!add_pass({0, step}, before.back(), false)) return std::nullopt;
    }
    Sources now = inputs(1);
    for (int step = steps; step-- > 0;) {
      for (size_t s = 0; s < swaps.size(); ++s) {
        if (adjoint_.states[s] >= 0) now[adjoint_.states[s]] = before[static_cast<size_t>(step)].at(swaps[s].state);
      }
      if (!add_pass({1, step}, now, step == 0)) return std::nullopt;
    }
    return finish();
  }

 private:
  /// Location of the present value of a field, and the level that writes it (-1: none).
  struct Source {
    WavefrontStream stream;
    int level = -1;
    int field = -1;  // its field in that level's program
  };
  using Sources = std::map<int, Source>;  // keys: fields of a program
  struct Read {
    int from, to;  // levels; from -1: an input
    WavefrontStream stream;
  };

  Sources inputs(int program) const {
    Sources sources;
    for (int field = 0; field < programs_[static_cast<size_t>(program)]->field_count; ++field)
      sources[field] = {{Kind::input, field, program}, -1};
    return sources;
  }

  /// `now`: sources of fields before the pass; updated to those after it.
  bool add_pass(WavefrontPass pass, Sources& now, bool is_last) {
    const dpde_program& program = *programs_[static_cast<size_t>(pass.program)];
    plan_.passes.push_back(pass);
    if (!add_operations(program, program.operations, program.operation_count, now, is_last)) return false;
    const Sources ended = now;
    for (int s = 0; s < program.swap_count; ++s) now[program.swaps[s].state] = ended.at(program.swaps[s].next);
    return true;
  }

  bool add_operations(const dpde_program& program, const dpde_operation* operations, int32_t count, Sources& now,
                      bool is_last) {
    std::vector<bool> written(static_cast<size_t>(program.field_count));
    for (int32_t i = 0; i < count; ++i) {
      const bool is_repeat = operations[i].kind == DPDE_REPEAT;
      if (is_repeat && !add_repeat(program, operations[i].repeat, now, is_last)) return false;
      if (!is_repeat && !add_level(program, operations[i], now, written, is_last)) return false;
    }
    return true;
  }

  /// Pass by pass: a level reads values, whatever name the field has in the repeat.
  bool add_repeat(const dpde_program& program, const dpde_repeat& repeat, Sources& now, bool is_last) {
    const std::span carries(repeat.carries, static_cast<size_t>(repeat.carry_count));
    const Sources before = now;
    for (int64_t pass = 0; pass < repeat.count; ++pass) {
      const std::map<int, int> outer = results_;
      for (const dpde_carry& carry : carries) {
        const auto known = outer.find(carry.result);
        results_[carry.next] = pass + 1 < repeat.count ? -1 : known == outer.end() ? carry.result : known->second;
      }
      if (repeat.step != 0)
        counted_.emplace_back(repeat.counter, static_cast<double>(repeat.first + repeat.step * pass));
      if (!add_operations(program, repeat.operations, repeat.operation_count, now, is_last)) return false;
      if (repeat.step != 0) counted_.pop_back();
      results_ = outer;
      const Sources ended = now;
      for (const dpde_carry& carry : carries) now[carry.state] = ended.at(carry.next);
    }
    for (const dpde_carry& carry : carries) {
      now[carry.result] = now.at(carry.next);
      now[carry.state] = before.at(carry.state);
    }
    return true;
  }

  bool add_level(const dpde_program& program, const dpde_operation& operation, Sources& now, std::vector<bool>& written,
                 bool is_last) {
    const dpde_kernel& kernel = program.kernels[operation.kernel];
    const int number = static_cast<int>(plan_.levels.size());
    WavefrontLevel level;
    level.row = kernel.row;
    level.own = kernel.own;
    level.pass = static_cast<int>(plan_.passes.size()) - 1;
    const WavefrontUniforms uniforms{level.pass, counted_};
    level.uniforms = static_cast<int>(std::ranges::find(plan_.uniforms, uniforms) - plan_.uniforms.begin());
    if (level.uniforms == static_cast<int>(plan_.uniforms.size())) plan_.uniforms.push_back(uniforms);
    level.sums.assign(kernel.sums, kernel.sums + kernel.sum_count);
    Sources outputs;
    for (int s = 0; s < kernel.stream_count; ++s) {
      const dpde_stream& stream = kernel.streams[s];
      if (stream.is_written == 0) {
        if (!add_read(now.at(stream.field), stream, number, level)) return false;
        continue;
      }
      if (stream.is_written == 2) {
        const std::optional<Source> sum = add_to(now.at(stream.field), number, level);
        if (!sum || outputs.contains(stream.field)) return false;
        outputs[stream.field] = *sum;
        continue;
      }
      if (!outputs.contains(stream.field)) {
        if (written[static_cast<size_t>(stream.field)]) return false;
        written[static_cast<size_t>(stream.field)] = true;
        outputs[stream.field] = Source{make_output(program, stream.field, is_last), number, stream.field};
      }
      level.streams.push_back(outputs[stream.field].stream);
    }
    if (std::ranges::find(level.streams, Kind::input, &WavefrontStream::kind) != level.streams.end())
      level.row = row_for_memory(kernel);
    for (const auto& [field, source] : outputs) {
      level.outputs.push_back({source.stream, field, find_fill(operation, field), find_total(level.pass, field)});
      now[field] = source;
    }
    plan_.levels.push_back(std::move(level));
    return true;
  }

  /// The row variant with prefetching: inputs come from memory, rings from the core's cache.
  static dpde_row_fn row_for_memory(const dpde_kernel& kernel) {
    const std::span variants(kernel.variants, static_cast<size_t>(kernel.variant_count));
    const auto ahead = std::ranges::find_if(
        variants, [](const dpde_variant& variant) { return variant.ahead != 0 && variant.streams == 0; });
    return ahead == variants.end() ? kernel.row : ahead->row;
  }

  /// A result of the same pass to which a later level adds in place; no level may read it in between.
  std::optional<Source> add_to(const Source& source, int number, WavefrontLevel& level) {
    const auto is_read = [&](const Read& read) {
      return read.from == source.level && read.stream.kind == source.stream.kind &&
             read.stream.index == source.stream.index;
    };
    if (source.level < 0 || std::ranges::any_of(reads_, is_read)) return std::nullopt;
    WavefrontLevel& before = plan_.levels[static_cast<size_t>(source.level)];
    if (before.pass != level.pass) return std::nullopt;
    std::ranges::find(before.outputs, source.field, &WavefrontLevel::Output::field)->added = -1;
    level.streams.push_back(source.stream);
    reads_.push_back({source.level, number, source.stream});
    level.lag = std::max(level.lag, before.lag);
    return Source{source.stream, number, source.field};
  }

  bool add_read(const Source& source, const dpde_stream& stream, int number, WavefrontLevel& level) {
    WavefrontStream read = source.stream;
    read.offset = {stream.offset[0], stream.offset[1], stream.offset[2]};
    level.streams.push_back(read);
    reads_.push_back({source.level, number, read});
    if (source.level < 0) return true;
    const bool is_shifted = std::ranges::any_of(read.offset, [](int64_t offset) { return offset != 0; });
    if (read.kind != Kind::ring || (is_shifted && !is_filled(source))) return false;
    level.lag = std::max(level.lag, plan_.levels[static_cast<size_t>(source.level)].lag + delay(read));
    return true;
  }

  WavefrontPlan finish() {
    plan_.rows_at_once = last() == 1 && plan_.levels.size() == plan_.passes.size() ? rows_at_once : 1;
    find_extents();
    for (const WavefrontLevel& level : plan_.levels) keep_to_tile(level);
    for (WavefrontLevel& level : plan_.levels) find_leading(level);
    find_rings();
    return std::move(plan_);
  }

  size_t last() const { return static_cast<size_t>(programs_[0]->rank) - 1; }

  /// Number of rows by which a reader must lag: row +k must exist, and at a wall the mirror row of row -k.
  int64_t delay(const WavefrontStream& stream) const {
    const int64_t offset = stream.offset[last()];
    return std::max(offset, -offset - 1);
  }

  WavefrontStream make_output(const dpde_program& program, int field, bool is_last) {
    const auto known = results_.find(field);
    const int result = known == results_.end() ? field : known->second;
    for (int s = 0; is_last && s < program.swap_count; ++s) {
      if (program.swaps[s].next == result) return {Kind::result, s};
    }
    return {Kind::ring, rings_++};
  }

  int find_total(int pass, int field) const {
    if (plan_.passes[static_cast<size_t>(pass)].program == 0) return -1;
    const auto found = std::ranges::find(adjoint_.added, field, &std::pair<int, int>::first);
    return found == adjoint_.added.end() ? -1 : found->second;
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

  /// Extends `from` to the cells that `to` reads of it.
  template <class From>
  static void reach_for(From& from, const Read& read, const WavefrontLevel& to) {
    for (size_t axis = 0; axis < 3; ++axis) {
      from.below[axis] = std::max(from.below[axis], to.below[axis] - read.stream.offset[axis]);
      from.above[axis] = std::max(from.above[axis], to.above[axis] + read.stream.offset[axis]);
    }
  }

  void find_extents() {
    std::map<std::pair<int, int>, WavefrontCopy> copies;  // keys: program and field
    for (auto read = reads_.rbegin(); read != reads_.rend(); ++read) {
      const WavefrontLevel& to = plan_.levels[static_cast<size_t>(read->to)];
      if (read->from >= 0) {
        reach_for(plan_.levels[static_cast<size_t>(read->from)], *read, to);
      } else {
        WavefrontCopy& copy = copies[{read->stream.program, read->stream.index}];
        reach_for(copy, *read, to);
        copy.ahead = std::max(copy.ahead, read->stream.offset[last()] - to.lag);
      }
    }
    for (auto& [place, copy] : copies) {
      std::tie(copy.program, copy.field) = place;
      plan_.copies.push_back(copy);
    }
  }

  /// Results hold the cells of all tiles: a level that recomputes cells of neighbours, for its other outputs, must not
  /// write there. Its results are in rings and are copied.
  void keep_to_tile(const WavefrontLevel& level) {
    if (level.below == std::array<int64_t, 3>{} && level.above == std::array<int64_t, 3>{}) return;
    for (const WavefrontLevel::Output& output : level.outputs) {
      if (output.stream.kind == Kind::result) move_to_ring(output.stream.index);
    }
  }

  void move_to_ring(int result) {
    const int ring = rings_++;
    const auto move = [&](WavefrontStream& stream) {
      if (stream.kind != Kind::result || stream.index != result) return false;
      stream.kind = Kind::ring;
      stream.index = ring;
      return true;
    };
    WavefrontLevel::Output* last_one = nullptr;
    for (WavefrontLevel& level : plan_.levels) {
      for (WavefrontStream& stream : level.streams) move(stream);
      for (WavefrontLevel::Output& output : level.outputs) {
        if (move(output.stream)) last_one = &output;
      }
    }
    for (Read& read : reads_) move(read.stream);
    last_one->copied = result;
  }

  void find_leading(WavefrontLevel& level) const {
    const auto is_ahead = [&](const WavefrontStream& a, const WavefrontStream& b) {
      return std::pair(a.offset[2], a.offset[1]) > std::pair(b.offset[2], b.offset[1]);
    };
    for (size_t s = 0; s < level.streams.size(); ++s) {
      const WavefrontStream& stream = level.streams[s];
      if (last() != 2 || stream.kind != Kind::input || stream.offset[2] < 0) continue;
      const auto same = [&](size_t other) {
        return level.streams[other].program == stream.program && level.streams[other].index == stream.index;
      };
      const auto found = std::ranges::find_if(level.leading, same);
      if (found == level.leading.end()) {
        level.leading.push_back(s);
      } else if (is_ahead(stream, level.streams[*found])) {
        *found = s;
      }
    }
  }

  /// A ring holds the rows from the lowest that its slowest reader needs to the last written, and the rows beyond
  /// walls.
  void find_rings() {
    std::vector<int64_t> rows(static_cast<size_t>(rings_), 1),
        first_lag(rows.size(), std::numeric_limits<int64_t>::max());
    for (const WavefrontLevel& level : plan_.levels) {
      for (const WavefrontLevel::Output& output : level.outputs) {
        if (output.stream.kind != Kind::ring) continue;
        int64_t& first = first_lag[static_cast<size_t>(output.stream.index)];
        first = std::min(first, level.lag);
      }
    }
    for (const Read& read : reads_) {
      const int64_t lag = plan_.levels[static_cast<size_t>(read.to)].lag - read.stream.offset[last()];
      if (read.from < 0) {
        WavefrontCopy& copy = *std::ranges::find_if(plan_.copies, [&](const WavefrontCopy& one) {
          return one.program == read.stream.program && one.field == read.stream.index;
        });
        copy.slots = std::max(copy.slots, lag + copy.ahead + plan_.rows_at_once);
      } else if (read.stream.kind == Kind::ring) {
        const auto ring = static_cast<size_t>(read.stream.index);
        rows[ring] = std::max(rows[ring], lag - first_lag[ring] + plan_.rows_at_once + halo());
      }
    }
    const auto round_up = [](int64_t count) {
      return static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(count)));
    };
    for (const int64_t count : rows) plan_.ring_slots.push_back(round_up(count));
    for (WavefrontCopy& copy : plan_.copies) copy.slots = round_up(copy.slots);
  }

  int64_t halo() const {
    return std::max(programs_[0]->halo[last()], programs_[1] == nullptr ? 0 : programs_[1]->halo[last()]);
  }

  std::array<const dpde_program*, 2> programs_;
  AdjointFields adjoint_;
  WavefrontPlan plan_;
  std::vector<Read> reads_;
  std::map<int, int> results_;                      // the field outside of the repeat for a field of a pass; -1: none
  std::vector<std::pair<size_t, double>> counted_;  // of the active repeats
  int rings_ = 0;
};

}  // namespace

int64_t WavefrontPlan::reach(size_t axis) const {
  int64_t most = 0;
  for (const WavefrontLevel& level : levels) most = std::max({most, level.below[axis], level.above[axis]});
  return most;
}

namespace {

bool is_known(const dpde_program& program) {
  return program.rank >= 2 && program.interpret == nullptr && program.swap_count > 0;
}

/// nullopt if an axis is too short.
std::optional<WavefrontPlan> on_grid(std::optional<WavefrontPlan> plan, const std::array<int, 3>& kinds,
                                     const dpde_layout& layout) {
  if (!plan) return std::nullopt;
  plan->periodic = {kinds[0] != 2, kinds[1] != 2, kinds[2] != 2};
  for (int axis = 1; axis < layout.rank; ++axis) {
    if (layout.cells[axis] <= std::max(2 * layout.halo[axis], plan->reach(static_cast<size_t>(axis))))
      return std::nullopt;
  }
  return plan;
}

}  // namespace

std::optional<WavefrontPlan> plan_wavefront(const dpde_program& program, const dpde_layout& layout, int steps) {
  std::array<int, 3> kinds{};
  if (!is_known(program) || steps < 1 || !note_program(program, false, kinds)) return std::nullopt;
  return on_grid(Planner(program).forward(steps), kinds, layout);
}

std::optional<WavefrontPlan> plan_reverse_wavefront(const dpde_program& step, const dpde_program& adjoint,
                                                    const AdjointFields& fields, const dpde_layout& layout, int steps) {
  std::array<int, 3> kinds{};
  if (!is_known(step) || !is_known(adjoint) || steps < 1) return std::nullopt;
  if (!note_program(step, false, kinds) || !note_program(adjoint, true, kinds)) return std::nullopt;
  return on_grid(Planner(step, adjoint, fields).reverse(steps), kinds, layout);
}

}  // namespace dpde
