// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/tape_store.h"

#include <algorithm>
#include <functional>

#include "exec/field_solve.h"
#include "exec/inference.h"

namespace dpde {
namespace {

// In the shared cache tapes are always faster. From memory, reading a byte takes as long as 64 products. Convolutions
// of extent 3 have 27 products a byte with 12 channels (32 steps on 128 x 128 took 1.15 times as long with tapes) and
// 72 with 32 channels; with extent 5, 200 (0.75 times as long).
constexpr int64_t most_bytes = int64_t{256} << 20, most_bytes_in_cache = int64_t{8} << 20, least_products_per_byte = 64;

/// A network of a pair of programs, or its solves.
struct StoredPair {
  int64_t runs, bytes;
  bool pays_in_memory;
  std::function<void(const std::shared_ptr<Tapes>&)> connect;
};

void add_networks(const ResolvedSetup& setup, const ProgramPair& of, std::vector<StoredPair>& pairs) {
  Executor &program = of.program, &adjoint = of.adjoint;
  const ProgramIds &own = setup.ids(program.program()), &others = setup.ids(adjoint.program());
  for (int i = 0; i < program.program().network_count; ++i) {
    const int number = others.network(own.networks[static_cast<size_t>(i)]);
    Network *const value = program.network(i), *const other = number < 0 ? nullptr : adjoint.network(number);
    if (value == nullptr || other == nullptr) continue;
    if (applications(adjoint.program(), number, DPDE_NETWORK_ADJOINT) == 0) continue;
    const int64_t bytes = value->tape_bytes(), count = of.runs * applications(program.program(), i, DPDE_NETWORK_VALUE);
    if (bytes == 0 || count == 0) continue;
    const auto connect = [=](const std::shared_ptr<Tapes>& tapes) {
      value->write_tapes(tapes);
      other->read_tapes(tapes);
    };
    pairs.push_back({count, bytes, value->products() >= least_products_per_byte * bytes, connect});
  }
}

/// Adds the solves of an adjoint that repeat a solve of the program: same unknown. All of them share their tapes.
void add_solves(const ResolvedSetup& setup, const ProgramPair& of, std::vector<StoredPair>& pairs) {
  const auto unknown = [&](const Executor& executor, const FieldSolve* solve) {
    return setup.ids(executor.program()).fields[static_cast<size_t>(solve->unknown())];
  };
  std::vector<FieldSolve*> writers, readers;
  const std::vector<FieldSolve*> again = of.adjoint.field_solves();
  int64_t bytes = 0;
  for (FieldSolve* const solve : of.program.field_solves()) {
    const auto same = [&](const FieldSolve* other) { return unknown(of.adjoint, other) == unknown(of.program, solve); };
    const auto reader = std::ranges::find_if(again, same);
    if (reader == again.end()) continue;
    writers.push_back(solve);
    readers.push_back(*reader);
    bytes = std::max(bytes, solve->tape_bytes());
  }
  if (writers.empty()) return;
  const auto connect = [=](const std::shared_ptr<Tapes>& tapes) {
    for (FieldSolve* const solve : writers) solve->write_tapes(tapes);
    for (FieldSolve* const solve : readers) solve->read_tapes(tapes);
  };
  pairs.push_back({of.runs * std::ssize(writers), bytes, true, connect});
}

}  // namespace

void TapeStore::plan(const ResolvedSetup& setup, std::span<const ProgramPair> programs, int64_t left, double most_share,
                     bool is_plan) {
  std::vector<StoredPair> pairs;
  for (const ProgramPair& of : programs) {
    add_networks(setup, of, pairs);
    add_solves(setup, of, pairs);
  }
  double wanted = 0;
  for (const StoredPair& pair : pairs) wanted += static_cast<double>(pair.runs) * static_cast<double>(pair.bytes);
  const bool pays = std::ranges::all_of(pairs, &StoredPair::pays_in_memory);
  const int64_t room = std::clamp<int64_t>(left, 0, pays ? most_bytes : most_bytes_in_cache);
  const double share = std::min(std::min(1.0, static_cast<double>(room) / std::max(wanted, 1.0)), most_share);
  for (const StoredPair& pair : pairs) {
    const auto count = static_cast<int64_t>(share * static_cast<double>(pair.runs));
    if (count == 0) continue;
    bytes_ += pair.bytes * count;
    if (is_plan) continue;
    pair.connect(tapes_.emplace_back(std::make_shared<Tapes>(pair.bytes, count)));
  }
}

void TapeStore::record(bool on) {
  used_ = 0;
  for (const std::shared_ptr<Tapes>& of_pair : tapes_) {
    of_pair->record(on);
    used_ += of_pair->found();
  }
}

}  // namespace dpde
