// SPDX-License-Identifier: Apache-2.0
// What networks computed in the steps and losses of a gradient is kept for their adjoints, as far as memory goes: of
// the last runs, which the way back needs first. Steps that are made again fill tapes that are free by then.
#include <algorithm>

#include "inference.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

// In the shared cache tapes always pay. From memory they take longer than 64 products a byte: a convolution of 12
// channels and extent 3 has 27 (32 steps on 128 x 128 took 1.15 times as long with tapes), one of 32 channels 72 and,
// of extent 5, 200 (0.75).
constexpr int64_t most_bytes = int64_t{256} << 20, most_bytes_in_cache = int64_t{8} << 20, least_products_per_byte = 64;

/// A program that applies a network, its adjoint, and how often the gradient runs them.
struct Pair {
  Network *value, *adjoint;
  int64_t runs, bytes;
};

void add_pairs(Executor& program, Executor& adjoint, int64_t runs, std::vector<Pair>& pairs) {
  for (int i = 0; i < program.program().network_count; ++i) {
    const int other = adjoint.network_index(program.program().networks[i]->name);
    if (other < 0 || program.network(i) == nullptr || adjoint.network(other) == nullptr) continue;
    if (applications(adjoint.program(), other, DPDE_NETWORK_ADJOINT) == 0) continue;
    const Pair pair{program.network(i), adjoint.network(other),
                    runs * applications(program.program(), i, DPDE_NETWORK_VALUE), program.network(i)->tape_bytes()};
    if (pair.runs > 0 && pair.bytes > 0) pairs.push_back(pair);
  }
}

}  // namespace

/// States come first, since steps cost more than networks: `left` bytes of the budget are there. All pairs get the same
/// share of their runs.
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
  const bool pays = std::ranges::all_of(
      pairs, [](const Pair& pair) { return pair.value->products() >= least_products_per_byte * pair.bytes; });
  double share =
      std::min(1.0, static_cast<double>(std::clamp<int64_t>(left, 0, pays ? most_bytes : most_bytes_in_cache)) /
                        std::max(wanted, 1.0));
  if (setup.slots > 0) share = std::min(share, static_cast<double>(setup.slots) / std::max(last_loss, 1));
  for (const Pair& pair : pairs) {
    const auto count = static_cast<int64_t>(share * static_cast<double>(pair.runs));
    if (count == 0) continue;
    result.tape_bytes += pair.bytes * count;
    if (purpose == Purpose::plan) continue;
    const auto& of_pair = tapes.emplace_back(std::make_shared<Tapes>(pair.bytes, count));
    pair.value->write_tapes(of_pair);
    pair.adjoint->read_tapes(of_pair);
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
