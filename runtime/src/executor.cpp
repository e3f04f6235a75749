// SPDX-License-Identifier: Apache-2.0
// The schedule of row calls: see executor.h for what holds.
//
// A program that consists of sweeps of one row (every 1-D program without explicit fills) is a list of Lines, with nothing
// left to do but pointers and calls. Else sweeps go through run_part, one call a thread: y in tiles where the grid is
// 3-D, so that the planes z-1, z, z+1 of a tile stay in the cache, the rows' own ends filled while they are in cache, the
// y and z halos afterwards.
#include "dpde/runtime/executor.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>

#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "fill.h"
#include "inference.h"
#include "real.h"
#include "reduce.h"
#include "sweep_tuner.h"

namespace dpde {
namespace {

constexpr int64_t tile_bytes = 640 * 1024;  // of one plane of a tile
constexpr int64_t least_cells_for_threads = 32 * 1024;
constexpr int64_t least_bytes_for_prefetch = 4 * 1024 * 1024;  // of a field: smaller ones stay near the core
constexpr int64_t cache_line = 64;                              // bytes
constexpr int64_t least_tile = 8;                               // rows

struct Stream {
  int field;
  int64_t delta;  // bytes from cell (0,0,0) of the field to the stream's value at the first cell of row (0,0)
  bool is_written;
};

struct Range {
  int64_t from = 0, to = 1;
  int64_t count() const { return to - from; }
};

struct Sweep {
  std::vector<dpde_variant> code;  // the row itself, and its variants
  int own = 0;  // first of its own uniforms
  std::vector<Stream> streams;
  std::vector<int> grids;
  std::vector<int> sums;  // program sums
  std::vector<HaloFill> then;
  /// 3-D: of each field that is read in planes above, the stream that is first to touch new memory; its row is prefetched.
  std::vector<size_t> leading;
  SweepTuner tuner;
  int64_t first = 0, count = 0;
  Range y, z;
  int threads = 1;
  bool ordered = false;
  int64_t rows() const { return y.count() * z.count(); }
};

struct Operation {
  int kind = DPDE_SWEEP;
  HaloFill fill;
  HaloFold fold;
  FieldReduction reduction;
  Inference inference;
  Sweep sweep;
};

/// What one thread needs to call rows; on a cache line of its own.
struct alignas(64) Caller {
  dpde_row row{};
  std::vector<void*> pointers;  // at the current row: streams, then the fields that are filled with the sweep
  std::vector<void*> starts;    // the same at row (0, 0)
};

/// A sweep of one row of a 1-D grid, in the form that runs fastest. Its pointers in a frame: streams, grids, fields filled.
struct Line {
  dpde_row_fn call;
  dpde_row row;  // complete but for streams and grids
  std::vector<Stream> streams;
  std::vector<int> grids;
  std::vector<HaloFill> then;
  size_t frame_size() const { return streams.size() + grids.size() + then.size(); }
};

int find_name(const char* const* names, int count, std::string_view name) {
  for (int i = 0; i < count; ++i) {
    if (name == names[i]) return i;
  }
  return -1;
}

std::vector<size_t> leading_streams(const dpde_kernel& kernel) {
  std::vector<size_t> leading;
  for (int s = 0; s < kernel.stream_count; ++s) {
    const dpde_stream& stream = kernel.streams[s];
    const auto is_ahead_of = [&](const dpde_stream& other) {
      return std::pair(stream.offset[2], stream.offset[1]) > std::pair(other.offset[2], other.offset[1]);
    };
    const auto same_field = [&](size_t other) { return kernel.streams[other].field == stream.field; };
    const auto found = std::ranges::find_if(leading, same_field);
    if (found == leading.end()) {
      if (stream.offset[2] > 0) leading.push_back(static_cast<size_t>(s));
    } else if (is_ahead_of(kernel.streams[*found])) {
      *found = static_cast<size_t>(s);
    }
  }
  return leading;
}

/// Where fields are larger than the core's own cache, it depends on the machine how a sweep is done best.
SweepTuner make_tuner(const Sweep& sweep, const dpde_layout& layout) {
  const bool is_large = field_bytes(layout) >= least_bytes_for_prefetch;
  const int64_t plane_fields = std::max<int64_t>(1, is_large ? static_cast<int64_t>(sweep.leading.size()) : 0);
  const bool has_tiles = sweep.z.count() > 1 && !sweep.ordered;
  const auto ahead = std::ranges::find_if(sweep.code, [](const dpde_variant& variant) { return variant.ahead != 0 && variant.streams == 0; });
  const bool begins_ahead = is_large && layout.rank > 1 && ahead != sweep.code.end();
  SweepChoice first{begins_ahead ? ahead - sweep.code.begin() : 0, is_large ? 1 : 0, sweep.y.count()};
  if (has_tiles) first.tile = std::max(least_tile, tile_bytes / (layout.stride[1] * real_bytes(layout) * plane_fields));
  std::vector<SweepTuner::Move> moves;
  if (!is_large || sweep.ordered || layout.rank == 1) return {first, {}};
  for (size_t v = 0; v < sweep.code.size(); ++v) {
    const auto number = static_cast<int64_t>(v);
    if (number != first.variant && (sweep.code[v].streams == 0 || sweep.first == 0)) moves.push_back({&SweepChoice::variant, number});
  }
  moves.push_back({&SweepChoice::prefetches, 0});
  if (has_tiles && first.tile / 2 >= least_tile) moves.push_back({&SweepChoice::tile, first.tile / 2});
  if (has_tiles && first.tile < sweep.y.count()) moves.push_back({&SweepChoice::tile, 2 * first.tile});
  return {first, std::move(moves)};
}

Sweep make_sweep(const dpde_program& program, const dpde_operation& operation, const dpde_layout& layout, int threads) {
  const dpde_kernel& kernel = program.kernels[operation.kernel];
  Sweep sweep;
  sweep.code = {{kernel.row, 0, 0}};
  sweep.code.insert(sweep.code.end(), kernel.variants, kernel.variants + kernel.variant_count);
  sweep.own = kernel.own;
  sweep.first = -operation.grow[0];
  sweep.count = layout.cells[0] + 2 * operation.grow[0];
  sweep.y = {-operation.grow[1], layout.cells[1] + operation.grow[1]};
  sweep.z = {-operation.grow[2], layout.cells[2] + operation.grow[2]};
  for (int s = 0; s < kernel.stream_count; ++s) {
    const dpde_stream& stream = kernel.streams[s];
    int64_t delta = sweep.first + stream.offset[0];
    for (int axis = 1; axis < layout.rank; ++axis) delta += stream.offset[axis] * layout.stride[axis];
    sweep.streams.push_back({stream.field, delta * real_bytes(layout), stream.is_written != 0});
  }
  sweep.grids.assign(kernel.grids, kernel.grids + kernel.grid_count);
  sweep.sums.assign(kernel.sums, kernel.sums + kernel.sum_count);
  for (int f = 0; f < operation.then_count; ++f) sweep.then.emplace_back(operation.then[f], layout);
  sweep.ordered = operation.serial != 0;
  sweep.leading = leading_streams(kernel);
  sweep.tuner = make_tuner(sweep, layout);
  const bool worth = sweep.rows() > 1 && sweep.rows() * sweep.count >= least_cells_for_threads;
  sweep.threads = worth && !sweep.ordered ? threads : 1;
  return sweep;
}

bool is_line(const Operation& operation, int rank) {
  if (rank != 1 || operation.kind != DPDE_SWEEP) return false;
  const std::vector<int>& sums = operation.sweep.sums;  // consecutive: rows add to the program's sums themselves
  for (size_t i = 1; i < sums.size(); ++i) {
    if (sums[i] != sums[i - 1] + 1) return false;
  }
  return true;
}

Line make_line(const Sweep& sweep, const dpde_layout& layout, const double* uniforms, double* sums) {
  Line line{sweep.code.front().row, {}, sweep.streams, sweep.grids, sweep.then};
  line.row.uniforms = uniforms;
  line.row.own = uniforms + sweep.own;
  line.row.sums = sweep.sums.empty() ? sums : sums + sweep.sums.front();
  line.row.count = sweep.count;
  line.row.first = sweep.first;
  line.row.layout = &layout;
  return line;
}

void check_fits(const dpde_program& program, const dpde_layout& layout) {
  const auto fail = [&](const std::string& what) { throw Error(ErrorKind::run, fmt::format("program {}: {}", program.name, what)); };
  if (program.version != DPDE_ABI_VERSION) fail(fmt::format("made for version {} of the runtime's tables, this is {}", program.version, DPDE_ABI_VERSION));
  if (program.real != layout.real) fail("its values and the grid's are not of the same precision");
  if (program.rank != layout.rank) fail(fmt::format("has {} axes, the grid has {}", program.rank, layout.rank));
  for (int axis = 0; axis < program.rank; ++axis) {
    if (program.halo[axis] > layout.halo[axis]) {
      fail(fmt::format("needs a halo of {} cells along {}, the grid has {}", program.halo[axis], "xyz"[axis], layout.halo[axis]));
    }
  }
}

}  // namespace

struct Executor::Plan {
  std::vector<HaloFill> prepare;
  std::vector<Line> lines;  // not empty: in place of the operations
  std::vector<Operation> operations;
  std::vector<Network> networks;  // those of the program
  std::vector<Caller> callers;    // one a thread
  std::vector<void*> grids;       // bases of the grids of the sweep that runs
  std::vector<double> row_sums;   // sums of each row of the sweep that runs

  void run_sweep(Sweep& sweep, const Executor& executor, std::vector<double>& sums);
  void run_all_parts(const Sweep& sweep, const Executor& executor);
  void run_rows(const Sweep& sweep, const dpde_variant& code, const dpde_layout& layout, Caller& caller, Range y, int64_t z);
  void run_part(const Sweep& sweep, const dpde_variant& code, const Executor& executor, int part, int parts);
  static const dpde_variant& code_of(const Sweep& sweep, const Executor& executor);
  void bind_grids(const Sweep& sweep, const Executor& executor);
};

Executor::Executor(const dpde_program& program, const dpde_layout& layout, int threads)
    : program_(&program), layout_(std::make_unique<dpde_layout>(layout)), plan_(std::make_unique<Plan>()) {
  check_fits(program, layout);
  fields_.assign(static_cast<size_t>(program.field_count), nullptr);
  params_.assign(static_cast<size_t>(program.param_count), 0.0);
  uniforms_.assign(static_cast<size_t>(program.uniform_count), 0.0);
  sums_.assign(static_cast<size_t>(program.sum_count), 0.0);
  weights_.assign(static_cast<size_t>(program.network_count), dpde_weights{});
  for (int i = 0; i < program.network_count && program.interpret == nullptr; ++i) plan_->networks.emplace_back(*program.networks[i], layout, std::max(threads, 1));
  for (int i = 0; i < program.prepare_count; ++i) plan_->prepare.emplace_back(program.prepare[i], layout);
  size_t pointers = 0, grids = 0, row_sums = 0;
  for (int i = 0; i < program.operation_count; ++i) {
    const dpde_operation& from = program.operations[i];
    Operation operation;
    operation.kind = from.kind;
    if (from.kind == DPDE_FILL) operation.fill = HaloFill(from.fill, layout);
    if (from.kind == DPDE_FOLD) operation.fold = HaloFold(from.fill, from.grow, layout);
    if (from.kind == DPDE_REDUCE) operation.reduction = FieldReduction(from.reduce, layout, std::max(threads, 1));
    if (from.kind == DPDE_NETWORK) operation.inference = Inference(from.inference, *program.networks[from.inference.network]);
    if (from.kind == DPDE_SWEEP) operation.sweep = make_sweep(program, from, layout, std::max(threads, 1));
    const Sweep& sweep = operation.sweep;
    pointers = std::max(pointers, sweep.streams.size() + sweep.then.size());
    grids = std::max(grids, sweep.grids.size());
    row_sums = std::max(row_sums, sweep.sums.size() * static_cast<size_t>(sweep.rows()));
    plan_->operations.push_back(std::move(operation));
  }
  if (program.interpret == nullptr && std::ranges::all_of(plan_->operations, [&](const Operation& operation) { return is_line(operation, layout.rank); })) {
    size_t size = 0;
    for (const Operation& operation : plan_->operations) {
      plan_->lines.push_back(make_line(operation.sweep, *layout_, uniforms_.data(), sums_.data()));
      size += plan_->lines.back().frame_size();
    }
    frame_.assign(size, nullptr);
  }
  plan_->grids.assign(grids, nullptr);
  plan_->row_sums.assign(row_sums, 0.0);
  plan_->callers.resize(static_cast<size_t>(std::max(threads, 1)));
  for (Caller& caller : plan_->callers) {
    caller.pointers.assign(pointers, nullptr);
    caller.starts.assign(pointers, nullptr);
    caller.row.streams = caller.pointers.data();
    caller.row.grids = plan_->grids.data();
    caller.row.uniforms = uniforms_.data();
    caller.row.layout = layout_.get();
  }
}

Executor::~Executor() = default;
Executor::Executor(Executor&&) noexcept = default;
Executor& Executor::operator=(Executor&&) noexcept = default;

int Executor::field_index(std::string_view name) const { return find_name(program_->fields, program_->field_count, name); }
int Executor::param_index(std::string_view name) const { return find_name(program_->params, program_->param_count, name); }
int Executor::sum_index(std::string_view name) const { return find_name(program_->sums, program_->sum_count, name); }

int Executor::network_index(std::string_view name) const {
  for (int i = 0; i < program_->network_count; ++i) {
    if (name == program_->networks[i]->name) return i;
  }
  return -1;
}

void Executor::update_weights() {
  for (size_t i = 0; i < plan_->networks.size(); ++i) {
    plan_->networks[i].set_weights(weights_[i].values);
    plan_->networks[i].set_host(weights_[i].host);
  }
}

Network* Executor::network(int number) { return plan_->networks.empty() ? nullptr : &plan_->networks[static_cast<size_t>(number)]; }

void Executor::compute_uniforms() {
  uniforms_are_stale_ = false;
  if (program_->compute_uniforms != nullptr) program_->compute_uniforms(params_.data(), uniforms_.data());
}

void Executor::prepare() {
  for (size_t i = 0; i < fields_.size(); ++i) {
    if (fields_[i] == nullptr) throw Error(ErrorKind::run, fmt::format("program {}: field {} is not bound", program_->name, program_->fields[i]));
  }
  if (program_->interpret != nullptr) return;  // it fills halos itself
  for (const HaloFill& fill : plan_->prepare) fill.run(fields_.data(), uniforms_.data());
}

void Executor::prepare(int field) {
  if (program_->interpret != nullptr) return;
  for (const HaloFill& fill : plan_->prepare) {
    if (fill.field() == field) fill.run(fields_.data(), uniforms_.data());
  }
}

bool Executor::prepares(int field) const {
  return std::ranges::any_of(plan_->prepare, [&](const HaloFill& fill) { return fill.field() == field; });
}

void Executor::run() {
  const Stopwatch whole(clock_ ? &clock_->all : nullptr);
  if (program_->interpret != nullptr) {
    program_->interpret(program_->context, layout_.get(), fields_.data(), params_.data(), weights_.data(), sums_.data());
    return;
  }
  if (!frame_.empty()) {
    make_frame(frame_.data());
    return run_lines(frame_.data());
  }
  std::fill(sums_.begin(), sums_.end(), 0.0);
  for (Operation& operation : plan_->operations) {
    switch (operation.kind) {
      case DPDE_SWEEP: plan_->run_sweep(operation.sweep, *this, sums_); break;
      case DPDE_FILL: operation.fill.run(fields_.data(), uniforms_.data()); break;
      case DPDE_FOLD: operation.fold.run(fields_.data(), uniforms_.data()); break;
      case DPDE_NETWORK: {
        const Stopwatch part(clock_ ? &clock_->networks : nullptr);
        operation.inference.run(plan_->networks[operation.inference.network()], fields_.data(), weights_[operation.inference.network()]);
        break;
      }
      default: operation.reduction.run(fields_.data());
    }
  }
}

std::string Executor::tuning() const {
  std::string text;
  for (const Operation& operation : plan_->operations) {
    const SweepTuner& tuner = operation.sweep.tuner;
    if (!tuner.is_done()) return "";
    if (tuner.has_choice()) text += tuner.text() + '\n';
  }
  return text;
}

void Executor::set_tuning(std::string_view text) {
  for (Operation& operation : plan_->operations) {
    SweepTuner& tuner = operation.sweep.tuner;
    if (!tuner.has_choice()) continue;
    const size_t end = std::min(text.find('\n'), text.size());
    tuner.set(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

void Executor::make_frame(void** frame) const {
  void* const* fields = fields_.data();
  for (const Line& line : plan_->lines) {
    for (const Stream& stream : line.streams) *frame++ = moved(fields[stream.field], stream.delta, 1);
    for (int grid : line.grids) *frame++ = fields[grid];
    for (const HaloFill& fill : line.then) *frame++ = fields[fill.field()];
  }
}

void Executor::run_frame(void* const* frame) {
  const Stopwatch whole(clock_ ? &clock_->all : nullptr);
  run_lines(frame);
}

void Executor::run_lines(void* const* frame) {
  for (double& sum : sums_) sum = 0;
  for (Line& line : plan_->lines) {
    line.row.streams = frame;
    line.row.grids = frame += line.streams.size();
    line.call(&line.row);
    frame += line.grids.size();
    for (const HaloFill& fill : line.then) fill.run_row(*frame++, line.row.uniforms);
  }
}

void Executor::Plan::bind_grids(const Sweep& sweep, const Executor& executor) {
  for (size_t g = 0; g < sweep.grids.size(); ++g) grids[g] = executor.bound(sweep.grids[g]);
}

void Executor::Plan::run_sweep(Sweep& sweep, const Executor& executor, std::vector<double>& sums) {
  bind_grids(sweep, executor);
  if (sweep.tuner.is_done()) {
    run_all_parts(sweep, executor);
  } else {
    const auto start = std::chrono::steady_clock::now();
    run_all_parts(sweep, executor);
    sweep.tuner.took(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  const size_t count = sweep.sums.size();
  for (size_t i = 0; i < count * static_cast<size_t>(sweep.rows()); ++i) sums[static_cast<size_t>(sweep.sums[i % count])] += row_sums[i];
}

/// The variant that is chosen; the row itself where the host's own memory is not laid out as stores past the caches want it.
const dpde_variant& Executor::Plan::code_of(const Sweep& sweep, const Executor& executor) {
  const dpde_variant& chosen = sweep.code[static_cast<size_t>(sweep.tuner.choice().variant)];
  const auto is_off = [&](const Stream& stream) {
    return stream.is_written && reinterpret_cast<uintptr_t>(moved(executor.bound(stream.field), stream.delta, 1)) % cache_line != 0;
  };
  return chosen.streams != 0 && std::ranges::any_of(sweep.streams, is_off) ? sweep.code.front() : chosen;
}

/// Rows and halos. A row that was written past the caches is not read at once: all its halos are filled at the end.
void Executor::Plan::run_all_parts(const Sweep& sweep, const Executor& executor) {
  const dpde_variant& code = code_of(sweep, executor);
  if (sweep.threads == 1) {
    run_part(sweep, code, executor, 0, 1);
  } else {
#pragma omp parallel num_threads(sweep.threads)
    run_part(sweep, code, executor, omp_get_thread_num(), omp_get_num_threads());
  }
  for (const HaloFill& fill : sweep.then) {
    if (code.streams != 0) {
      fill.run(executor.fields_.data(), executor.uniforms_.data());
      continue;
    }
    void* base = executor.bound(fill.field());
    if (!fill.images_are_direct()) fill.run_y(base, executor.uniforms_.data());
    fill.run_z(base, executor.uniforms_.data());
  }
}

/// The rows of one thread: a contiguous part of z, or of y where z has fewer places than there are threads.
void Executor::Plan::run_part(const Sweep& sweep, const dpde_variant& code, const Executor& executor, int part, int parts) {
  Caller& caller = callers[static_cast<size_t>(part)];
  void** start = caller.starts.data();
  for (const Stream& stream : sweep.streams) *start++ = moved(executor.bound(stream.field), stream.delta, 1);
  for (const HaloFill& fill : sweep.then) *start++ = executor.bound(fill.field());
  caller.row.own = caller.row.uniforms + sweep.own;
  caller.row.count = sweep.count;
  caller.row.first = sweep.first;
  Range y = sweep.y, z = sweep.z;
  Range& split = z.count() >= parts ? z : y;
  const Range whole = split;
  split = {whole.from + whole.count() * part / parts, whole.from + whole.count() * (part + 1) / parts};
  const int64_t rows = sweep.tuner.choice().tile;
  for (int64_t from = y.from; from < y.to; from += rows) {
    const Range tile{from, std::min(from + rows, y.to)};
    for (int64_t place = z.from; place < z.to; ++place) run_rows(sweep, code, *executor.layout_, caller, tile, place);
  }
  if (code.streams != 0) std::atomic_thread_fence(std::memory_order_seq_cst);  // stores past the caches are not ordered
}

/// While a row runs, memory fetches what the hardware does not foresee: in 3-D the next row of the leading plane (measured:
/// 1.25 x at 256^3), in 2-D the beginning of the next row of each stream (1.03 x at 1024^2).
/// g++ takes a function that only prefetches for one without effect and drops its calls unless it is inlined early.
[[gnu::always_inline]] inline void prefetch_next(const Sweep& sweep, void* const* pointers, int64_t stride, int64_t width) {
  for (size_t s : sweep.leading) {
    const char* ahead = moved(pointers[s], stride, 1);
    for (int64_t x = 0; x < sweep.count * width; x += cache_line) __builtin_prefetch(ahead + x);
  }
  if (!sweep.leading.empty()) return;
  for (size_t s = 0; s < sweep.streams.size(); ++s) __builtin_prefetch(moved(pointers[s], stride, 1));
}

/// Every pointer to the next row: on short rows this counts, and g++ -O2 moves one at a time unless it is told.
inline void move_all(void** pointers, size_t count, int64_t bytes) {
  auto* const addresses = reinterpret_cast<uintptr_t*>(pointers);
#pragma omp simd
  for (size_t i = 0; i < count; ++i) addresses[i] += static_cast<uintptr_t>(bytes);
}

/// Rows of one plane, one after the other.
void Executor::Plan::run_rows(const Sweep& sweep, const dpde_variant& code, const dpde_layout& layout, Caller& caller, Range y_range, int64_t z) {
  const size_t streams = sweep.streams.size(), fills = sweep.then.size(), sum_count = sweep.sums.size();
  const int64_t width = real_bytes(layout), stride = layout.stride[1] * width, place = y_range.from * stride + z * layout.stride[2] * width;
  void** pointers = caller.pointers.data();
  for (size_t i = 0; i < streams + fills; ++i) pointers[i] = moved(caller.starts[i], place, 1);
  dpde_row& row = caller.row;
  row.z = z;
  row.sums = row_sums.data() + static_cast<size_t>((z - sweep.z.from) * sweep.y.count() + (y_range.from - sweep.y.from)) * sum_count;
  const bool fills_plane = fills > 0 && z >= 0 && z < layout.cells[2] && code.streams == 0;
  const bool prefetches = sweep.tuner.choice().prefetches != 0;
  for (int64_t y = y_range.from; y < y_range.to; ++y) {
    row.y = y;
    for (size_t i = 0; i < sum_count; ++i) row.sums[i] = 0;
    if (prefetches) prefetch_next(sweep, pointers, stride, width);
    code.row(&row);
    if (fills_plane && y >= 0 && y < layout.cells[1]) {
      for (size_t f = 0; f < fills; ++f) {
        sweep.then[f].run_row(pointers[streams + f], row.uniforms);
        if (sweep.then[f].images_are_direct()) sweep.then[f].run_images(pointers[streams + f], y, row.uniforms);
      }
    }
    move_all(pointers, streams + fills, stride);
    row.sums += sum_count;
  }
}

}  // namespace dpde
