// SPDX-License-Identifier: Apache-2.0
// What networks and linear solves computed in the steps and losses of a gradient is kept for their adjoints, as far as
// memory goes: of the last runs, which the way back needs first. Steps that are made again fill tapes that are free by
// then.
#include <algorithm>
#include <functional>

#include "field_solve.h"
#include "inference.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

// In the shared cache tapes always pay. From memory they take longer than 64 products a byte: a convolution of 12
// channels and extent 3 has 27 (32 steps on 128 x 128 took 1.15 times as long with tapes), one of 32 channels 72 and,
// of extent 5, 200 (0.75).
constexpr int64_t most_bytes = int64_t{256} << 20, most_bytes_in_cache = int64_t{8} << 20, least_products_per_byte = 64;

/// What a program computes and its adjoint would compute again, and how often the gradient runs it.
struct Pair {
  int64_t runs, bytes;
  bool pays_in_memory;
  std::function<void(const std::shared_ptr<Tapes>&)> connect;
};

void add_networks(Executor& program, Executor& adjoint, int64_t runs, std::vector<Pair>& pairs) {
  for (int i = 0; i < program.program().network_count; ++i) {
    const int number = adjoint.network_index(program.program().networks[i]->name);
    Network *const value = program.network(i), *const other = number < 0 ? nullptr : adjoint.network(number);
    if (value == nullptr || other == nullptr) continue;
    if (applications(adjoint.program(), number, DPDE_NETWORK_ADJOINT) == 0) continue;
    const int64_t bytes = value->tape_bytes(), count = runs * applications(program.program(), i, DPDE_NETWORK_VALUE);
    if (bytes == 0 || count == 0) continue;
    const auto connect = [=](const std::shared_ptr<Tapes>& tapes) {
      value->write_tapes(tapes);
      other->read_tapes(tapes);
    };
    pairs.push_back({count, bytes, value->products() >= least_products_per_byte * bytes, connect});
  }
}

/// Solves of an adjoint whose unknown is one of the program's make it again. All of them share their tapes.
void add_solves(Executor& program, Executor& adjoint, int64_t runs, std::vector<Pair>& pairs) {
  std::vector<FieldSolve*> writers, readers;
  const std::vector<FieldSolve*> again = adjoint.field_solves();
  int64_t bytes = 0;
  for (FieldSolve* const solve : program.field_solves()) {
    const auto same = [&](const FieldSolve* other) { return other->unknown() == solve->unknown(); };
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
  pairs.push_back({runs * std::ssize(writers), bytes, true, connect});
}

void add_pairs(Executor& program, Executor& adjoint, int64_t runs, std::vector<Pair>& pairs) {
  add_networks(program, adjoint, runs, pairs);
  add_solves(program, adjoint, runs, pairs);
}

}  // namespace

/// States come first, since steps cost more than networks and solves: `left` bytes of the budget are there. All pairs
/// get the same share of their runs.
void Rollout::Impl::plan_tapes(int64_t left) {
  if (!setup.checkpoint_folder.empty()) return;         // whose budget is that of a file
  if (setup.trial != nullptr || setup.follows) return;  // how many runs there will be nobody knows
  std::vector<Pair> pairs;
  add_pairs(forward->program.executor, backward->program.executor, last_loss, pairs);
  for (BoundTerm& term : terms) {
    if (term.adjoint)
      add_pairs(term.loss.program.executor, term.adjoint->program.executor,
                std::ssize(setup.losses[static_cast<size_t>(&term - &terms.front())].at_steps), pairs);
  }
  double wanted = 0;
  for (const Pair& pair : pairs) wanted += static_cast<double>(pair.runs) * static_cast<double>(pair.bytes);
  const bool pays = std::ranges::all_of(pairs, &Pair::pays_in_memory);
  double share =
      std::min(1.0, static_cast<double>(std::clamp<int64_t>(left, 0, pays ? most_bytes : most_bytes_in_cache)) /
                        std::max(wanted, 1.0));
  if (setup.slots > 0) share = std::min(share, static_cast<double>(setup.slots) / std::max(last_loss, 1));
  for (const Pair& pair : pairs) {
    const auto count = static_cast<int64_t>(share * static_cast<double>(pair.runs));
    if (count == 0) continue;
    result.tape_bytes += pair.bytes * count;
    if (purpose == Purpose::plan) continue;
    pair.connect(tapes.emplace_back(std::make_shared<Tapes>(pair.bytes, count)));
  }
}

void Rollout::Impl::record_tapes(bool on) {
  result.tapes_used = 0;
  for (const std::shared_ptr<Tapes>& of_pair : tapes) {
    of_pair->record(on);
    result.tapes_used += of_pair->found();
  }
}

}  // namespace dpde
