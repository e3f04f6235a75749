// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <set>
#include <thread>
#include <vector>

#include "dpde/runtime/layout.h"
#include "driver/memory/cpu_time.h"
#include "driver/memory/memory_plan.h"
#include "driver/memory/savings.h"
#include "support/match.h"

namespace dpde::driver {

namespace {

double flops(const loop::Expr& e);

double flops_of_all(const std::vector<loop::Expr>& parts) {
  double total = 0;
  for (const loop::Expr& part : parts) total += flops(part);
  return total;
}

double flops(const loop::Expr& e) {
  return match(
      e->kind, [](const Literal&) { return 0.0; }, [](const loop::Uniform&) { return 0.0; },
      [](const loop::Param&) { return 0.0; }, [](const loop::Counter&) { return 0.0; },
      [](const loop::Load&) { return 0.0; }, [](const loop::Local&) { return 0.0; },
      [](const loop::Inside&) { return 0.0; },
      // Interpolation makes 2^rank - 1 linear combinations, each with two products and a sum.
      [](const loop::Interp& i) { return flops_of_all(i.displacement) + 3.0 * (std::exp2(i.displacement.size()) - 1); },
      [](const loop::Neg& n) { return flops(n.operand); }, [](const loop::Rounded& r) { return flops(r.operand); },
      [](const loop::Binary& b) { return 1 + flops(b.left) + flops(b.right); },
      [](const loop::Call& c) { return 1 + flops_of_all(c.arguments); },
      [](const loop::Select& s) { return 1 + flops(s.condition) + std::max(flops(s.yes), flops(s.no)); });
}

Cost cost_of_row(const loop::Row& row, Precision real) {
  std::set<std::string> read(row.grids.begin(), row.grids.end()), written;
  for (const loop::Stream& stream : row.streams) {
    if (stream.mode != loop::Stream::Mode::out && !stream.is_even) read.insert(stream.field);
    if (stream.mode != loop::Stream::Mode::in) written.insert(stream.field);
  }
  for (const loop::Scatter& scatter : row.scatters)
    written.insert(row.grids[static_cast<std::size_t>(scatter.target.grid)]);
  Cost cost;
  cost.bytes = bytes_of(real) * static_cast<double>(read.size() + written.size());
  for (const loop::Let& let : row.lets) cost.flops += flops(let.value);
  for (const loop::Store& store : row.stores) cost.flops += flops(store.value) + (store.accumulate ? 1 : 0);
  for (const loop::Sum& sum : row.sums) cost.flops += flops(sum.value) + 1;
  for (const loop::Scatter& scatter : row.scatters)
    cost.flops += flops(scatter.value) + flops_of_all(scatter.target.displacement);
  return cost;
}

int convolutions_of(loop::NetworkCall::Mode mode) {
  switch (mode) {
    case loop::NetworkCall::Mode::value: return 1;
    case loop::NetworkCall::Mode::tangent:
    case loop::NetworkCall::Mode::adjoint: return 3;
    case loop::NetworkCall::Mode::second: return 9;
  }
  return 0;
}

/// Number of convolutions, relative to one forward pass. Tangent: two more (by inputs and by weights), adjoint: two
/// more. Adjoint of the tangent: three for each, in addition to those of the tangent.
Cost cost_of_network(const loop::Module& module, const loop::NetworkCall& network_call) {
  const auto network = std::ranges::find(module.networks, network_call.network, &network::Network::name);
  const int passes = convolutions_of(network_call.mode);
  const std::size_t fields = network::fields_read(network_call).size() + network::fields_written(network_call).size();
  return {static_cast<double>(bytes_of(module.real)) * static_cast<double>(fields),
          2.0 * passes * network::multiplications_a_cell(*network)};
}

double copy_once(std::vector<double>& to, const std::vector<double>& from, int threads) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t part = from.size() / static_cast<std::size_t>(threads);
  std::vector<std::jthread> helpers;
  for (int t = 1; t < threads; ++t) {
    helpers.emplace_back([&, t] { std::memcpy(to.data() + t * part, from.data() + t * part, part * sizeof(double)); });
  }
  std::memcpy(to.data(), from.data(), part * sizeof(double));
  helpers.clear();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Cost cost_of_operations(const loop::Module& module, const std::vector<loop::Operation>& operations) {
  Cost total;
  for (const loop::Operation& operation : operations) {
    match(
        operation, ignored<loop::Fill, loop::Fold>,
        [&](const loop::Reduce&) {
          total += {2.0 * static_cast<double>(bytes_of(module.real)), 1};  // reads one field and writes one
        },
        [&](const loop::NetworkCall& network_call) { total += cost_of_network(module, network_call); },
        [&](const loop::Transform& transform) {  // without the grid's part, 5*log2(cells) for each field
          const auto fields = static_cast<double>(transform.terms.size() + 1);
          total += {fields * static_cast<double>(bytes_of(module.real)), 8 * fields};
        },
        [&](const loop::Sweep& sweep) { total += cost_of_row(*module.find_row(sweep.row), module.real); },
        [&](const loop::Solve& solve) {  // one application of the operator; the number of these depends on the grid
          total += cost_of_operations(module, solve.body);
        },
        [&](const loop::Repeat& repeat) {
          const Cost pass = cost_of_operations(module, repeat.body);
          total += {repeat.count * pass.bytes, repeat.count * pass.flops};
        });
  }
  return total;
}

}  // namespace

Cost cost_of(const loop::Module& module, const std::string& program) {
  const auto found = std::ranges::find(module.programs, program, &loop::Program::name);
  return found == module.programs.end() ? Cost{} : cost_of_operations(module, found->body);
}

std::array<std::int64_t, 3> halo_of(const Compiled& compiled) {
  std::array<std::int64_t, 3> halo{};
  for (const loop::Program& program : compiled.loop.programs) {
    for (int a = 0; a < loop::max_rank; ++a) halo[a] = std::max<std::int64_t>(halo[a], program.halo[a]);
  }
  return halo;
}

dpde_layout layout_of(const Compiled& compiled) {
  std::vector<std::int64_t> cells;
  for (const model::Axis& axis : compiled.problem->axes) cells.push_back(axis.cells);
  return make_layout(cells, halo_of(compiled), compiled.real() == Precision::f32 ? DPDE_F32 : DPDE_F64);
}

Memory memory_of(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  const double field = static_cast<double>(field_bytes(layout_of(compiled)));
  const double states = static_cast<double>(problem.states.size());
  Memory memory;
  memory.run = peak_of_run(compiled);
  if (!problem.task) return memory;
  if (problem.substeps.rate && reads_states_back(compiled)) memory.part = field * states;
  for (const model::Coefficient& c : problem.coefficients) {
    if (!c.is_control() || !compiled.activity.fields.contains(c.name)) continue;
    memory.gradient += problem.intervals(c.every) * field * 8 / bytes_of(compiled.real());  // accumulated in f64
  }
  return memory;
}

std::int64_t available_memory() {
  std::int64_t available = std::numeric_limits<std::int64_t>::max();
  std::ifstream meminfo("/proc/meminfo");
  std::string word;
  while (meminfo >> word) {
    std::int64_t kilobytes = 0;
    if (word == "MemAvailable:" && meminfo >> kilobytes) available = kilobytes * 1024;
  }
  std::int64_t limit = 0, used = 0;
  std::ifstream limit_file("/sys/fs/cgroup/memory.max"), used_file("/sys/fs/cgroup/memory.current");
  if (limit_file >> limit && used_file >> used) available = std::min(available, limit - used);
  return available;
}

CopyRate measure_copy(double footprint, int threads) {
  constexpr int trials = 9;
  constexpr double undisturbed = 0.8;  // share of a trial's time in which the thread has the processor
  const std::size_t size = std::max<std::size_t>(static_cast<std::size_t>(footprint / 16), 512) / threads * threads;
  std::vector<double> from(size, 1.0), to(size, 0.0);
  // Small copies are repeated so that each trial is long enough for the clock.
  const int repeats = std::max(1, static_cast<int>(1e6 / static_cast<double>(size)));
  const double bytes = 16.0 * static_cast<double>(size);
  CopyRate rate;
  double waited = 0, worked = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const double before = thread_cpu_seconds();
    const auto start = std::chrono::steady_clock::now();
    for (int r = 0; r < repeats; ++r) {
      std::memcpy(to.data(), from.data(), size * sizeof(double));
      asm volatile("" : : "r"(to.data()) : "memory");
    }
    waited += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double seconds = thread_cpu_seconds() - before;  // CPU time: excludes other processes
    worked += seconds;
    rate.best = std::max(rate.best, bytes * repeats / seconds);
    if (threads > 1 && size >= 65536) rate.best = std::max(rate.best, bytes / copy_once(to, from, threads));
  }
  if (double load = 0; getloadavg(&load, 1) == 1) rate.load = load / std::max(1u, std::thread::hardware_concurrency());
  rate.is_busy = worked < undisturbed * waited || rate.load > 1;  // a short trial may fall into a pause
  return rate;
}

}  // namespace dpde::driver
