// SPDX-License-Identifier: Apache-2.0
// Splits kernels with very many stores. The compile time of a row grows with the square of its number of streams: 200
// fields in one row compile several times as long as in seven rows.
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/passes/work.h"
#include "stencil/walk.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

namespace {

/// Largest number of stores of a kernel that is not split, and of each part. Parts repeat shared reads, a small cost
/// for so many stores.
constexpr std::size_t widest = 48, part_width = 32;

/// Limit of the instructions of all parts relative to the whole kernel: shared lets are computed in each part.
constexpr double most_work = 1.25;

void add_terms(const Expr& e, std::vector<Expr>& terms) {
  const Binary* sum = as<Binary>(e);
  if (sum == nullptr || sum->op != BinaryOp::add) return terms.push_back(e);
  add_terms(sum->left, terms);
  add_terms(sum->right, terms);
}

/// Divides the terms of a sum among the parts, which add to the same number, if it has at least as many terms.
void share_out(const Sum& sum, std::vector<Kernel>& parts) {
  std::vector<Expr> terms;
  add_terms(sum.value, terms);
  if (terms.size() < parts.size()) return parts.back().sums.push_back(sum);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t begin = terms.size() * i / parts.size(), end = terms.size() * (i + 1) / parts.size();
    Expr value = terms[begin];
    for (std::size_t k = begin + 1; k < end; ++k) value = value + terms[k];
    parts[i].sums.push_back({sum.name, value});
  }
}

/// The lets that a part needs, directly or through other lets.
std::vector<Let> lets_of(const Kernel& part, const std::vector<Let>& all) {
  std::set<std::string> used;
  const auto note = [&](const Expr& value) {
    visit(value, [&](const Expr& e) {
      if (const Local* local = as<Local>(e)) used.insert(local->name);
    });
  };
  for (const Store& store : part.stores) note(store.value);
  for (const Sum& sum : part.sums) note(sum.value);
  std::vector<Let> lets;
  for (auto let = all.rbegin(); let != all.rend(); ++let) {
    if (!used.contains(let->name)) continue;
    note(let->value);
    lets.push_back(*let);
  }
  std::ranges::reverse(lets);
  return lets;
}

/// Whether a part reads a field that an earlier part stores: in the whole kernel it would read the value before.
bool read_each_other(const std::vector<Kernel>& parts) {
  std::set<std::string> stored;
  for (const Kernel& part : parts) {
    for (const Signature::Read& read : signature(part).reads) {
      if (stored.contains(read.field)) return true;
    }
    for (const Store& store : part.stores) stored.insert(store.field);
  }
  return false;
}

/// The parts of a kernel; the kernel itself if it has few stores, or if the parts would repeat too much work.
std::vector<Kernel> parts_of(const Kernel& kernel) {
  if (kernel.stores.size() <= widest || !kernel.scatters.empty()) return {kernel};
  const std::size_t count = (kernel.stores.size() + part_width - 1) / part_width;
  std::vector<Kernel> parts(count, Kernel{kernel.name, kernel.rank, {}, {}, {}, {}});
  for (std::size_t i = 0; i < kernel.stores.size(); ++i)
    parts[i * count / kernel.stores.size()].stores.push_back(kernel.stores[i]);
  for (const Sum& sum : kernel.sums) share_out(sum, parts);
  int work = 0;
  for (Kernel& part : parts) {
    part.lets = lets_of(part, kernel.lets);
    work += instructions(part);
  }
  const bool is_worth_it = work <= most_work * instructions(kernel) && !read_each_other(parts);
  return is_worth_it ? parts : std::vector{kernel};
}

using PartsByKernel = std::map<std::string, std::vector<std::string>>;

std::vector<Statement> running_parts(const std::vector<Statement>& statements, const PartsByKernel& parts_by_kernel) {
  return replace_kind<Run>(statements, [&](const Run& run) {
    std::vector<Statement> runs;
    for (const std::string& part : parts_by_kernel.at(run.kernel)) runs.push_back(Run{part, run.grow});
    return runs;
  });
}

}  // namespace

Module split_wide_kernels(const Module& module) {
  Module result = module;
  result.kernels.clear();
  NameSupply names;
  for (const Kernel& kernel : module.kernels) names.reserve(kernel.name);
  PartsByKernel parts_by_kernel;
  for (const Kernel& kernel : module.kernels) {
    std::vector<Kernel> parts = parts_of(kernel);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts.size() > 1) parts[i].name = names.fresh(kernel.name + "_part" + std::to_string(i + 1));
      parts_by_kernel[kernel.name].push_back(parts[i].name);
      result.kernels.push_back(std::move(parts[i]));
    }
  }
  for (Program& program : result.programs) program.body = running_parts(program.body, parts_by_kernel);
  return result;
}

}  // namespace dpde::stencil
