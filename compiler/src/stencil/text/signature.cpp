// SPDX-License-Identifier: Apache-2.0
// Signatures of kernels and programs: fields read and written, params, sums, and the halo that they need.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>

#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stencil {

Statement::Statement() = default;
Statement::Statement(const Statement& other) = default;
Statement::Statement(Statement&& other) noexcept = default;
Statement& Statement::operator=(const Statement& other) = default;
Statement& Statement::operator=(Statement&& other) noexcept = default;
Statement::~Statement() = default;

namespace {

using Names = std::vector<std::string>;

/// Names in the order in which they first appear.
class Distinct {
 public:
  void add(const std::string& name) {
    if (known_.insert(name).second) names_.push_back(name);
  }
  bool contains(const std::string& name) const { return known_.contains(name); }
  Names take() { return std::move(names_); }

 private:
  std::set<std::string> known_;
  Names names_;
};

/// Collects the names in the expressions of a kernel.
class Touched {
 public:
  explicit Touched(int rank) : rank_(rank) {}

  void add(const Expr& e) {
    visit(e, [&](const Expr& part) { add_leaf(part); });
  }
  Distinct params;
  std::vector<Signature::Read> reads;

 private:
  void add_leaf(const Expr& e) {
    if (const Param* p = as<Param>(e)) {
      params.add(p->name);
    } else if (const Access* a = as<Access>(e)) {
      Signature::Read& read = read_of(a->field);
      for (int axis = 0; axis < rank_; ++axis) read.halo[axis] = std::max(read.halo[axis], std::abs(a->offset[axis]));
    } else if (const Interp* i = as<Interp>(e)) {
      Signature::Read& read = read_of(i->field);
      read.interpolated = true;
      for (int axis = 0; axis < rank_; ++axis) read.halo[axis] = std::max(read.halo[axis], reach_of(i->along[axis]));
    }
  }

  Signature::Read& read_of(const std::string& field) {
    const auto [found, is_new] = places_.emplace(field, reads.size());
    if (is_new) reads.push_back({field, {}, false});
    return reads[found->second];
  }

  const int rank_;
  std::map<std::string, std::size_t> places_;  // in reads
};

using Halo = std::array<int, max_rank>;

void widen(Halo& halo, const Halo& by) {
  for (int axis = 0; axis < max_rank; ++axis) halo[axis] = std::max(halo[axis], by[axis]);
}

/// `cells` on each bounded axis of the program, 0 elsewhere.
Halo on_bounded_axes(const Program& program, int cells) {
  Halo halo{};
  for (std::size_t axis = 0; axis < program.axes.size(); ++axis) {
    if (program.axes[axis] == Topology::bounded) halo[axis] = cells;
  }
  return halo;
}

void add_read_halo(std::map<std::string, Halo>& result, const Expr& e, const Halo& grown, const Program& program) {
  if (const Access* a = as<Access>(e)) {
    Halo needed = grown;
    for (int axis = 0; axis < max_rank; ++axis) needed[axis] += std::abs(a->offset[axis]);
    widen(result[a->field], needed);
  } else if (const Interp* i = as<Interp>(e)) {
    widen(result[i->field], on_bounded_axes(program, reach_of(*i, program.axes)));
  }
}

}  // namespace

const Kernel& kernel_of(const Module& module, const Run& run) {
  const Kernel* kernel = module.find_kernel(run.kernel);
  require(kernel != nullptr, "a program runs a kernel of its module");
  return *kernel;
}

const Kernel* Module::find_kernel(const std::string& name) const {
  const auto found = std::find_if(kernels.begin(), kernels.end(), [&](const Kernel& k) { return k.name == name; });
  return found == kernels.end() ? nullptr : &*found;
}

const network::Network* Module::find_network(const std::string& name) const {
  const auto found =
      std::find_if(networks.begin(), networks.end(), [&](const network::Network& n) { return n.name == name; });
  return found == networks.end() ? nullptr : &*found;
}

void add_networks(Module& module, const std::vector<network::Network>& networks) {
  for (const network::Network& network : networks) {
    if (!module.find_network(network.name)) module.networks.push_back(network);
  }
}

const Program* Module::find_program(const std::string& name) const {
  const auto found = std::find_if(programs.begin(), programs.end(), [&](const Program& p) { return p.name == name; });
  return found == programs.end() ? nullptr : &*found;
}

const Signature::Read* Signature::find_read(const std::string& field) const {
  const auto found = std::find_if(reads.begin(), reads.end(), [&](const Read& read) { return read.field == field; });
  return found == reads.end() ? nullptr : &*found;
}

int reach_of(const Interp& i, const std::vector<Topology>& axes) {
  int reach = 0;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis] == Topology::bounded) reach = std::max(reach, reach_of(i.along[axis]));
  }
  return reach;
}

Signature signature(const Kernel& kernel) {
  Touched touched(kernel.rank);
  Distinct writes, updates, sums;
  for (const Let& let : kernel.lets) touched.add(let.value);
  for (const Store& store : kernel.stores) {
    touched.add(store.value);
    (store.accumulate ? updates : writes).add(store.field);
  }
  for (const Sum& sum : kernel.sums) {
    touched.add(sum.value);
    sums.add(sum.name);
  }
  for (const Scatter& scatter : kernel.scatters) {
    for (const Expr& d : scatter.target.displacement) touched.add(d);
    touched.add(scatter.value);
    updates.add(scatter.target.field);
  }
  Signature s;
  s.reads = std::move(touched.reads);
  s.writes = writes.take();
  s.updates = updates.take();
  s.params = touched.params.take();
  s.sums = sums.take();
  return s;
}

Interface interface_of(const Module& module, const Program& program) {
  Distinct inputs, written, params, sums, networks;
  const auto add_input = [&](const std::string& field) {
    if (!written.contains(field)) inputs.add(field);
  };
  for (const Statement& statement : program.body) {
    const Effects e = effects(module, statement);
    std::ranges::for_each(e.reads, add_input);
    const std::set<std::string> writes(e.writes.begin(), e.writes.end());
    for (const std::string& field : e.updates) {
      if (!writes.contains(field)) add_input(field);
    }
    for (const auto& [from, to] : {std::pair{&e.writes, &written},
                                   {&e.updates, &written},
                                   {&e.params, &params},
                                   {&e.sums, &sums},
                                   {&e.networks, &networks}}) {
      for (const std::string& name : *from) to->add(name);
    }
    for (const std::string& field : e.block_locals) {
      if (!inputs.contains(field)) written.add(field);
    }
  }
  return {inputs.take(), written.take(), params.take(), sums.take(), networks.take()};
}

namespace {

/// Accumulates the halo that the statements of a program need.
class RequiredHalo {
 public:
  RequiredHalo(const Module& module, const Program& program) : module_(module), program_(program) {}

  std::map<std::string, Halo> take(const std::vector<Statement>& statements) {
    for_each_statement(statements, [&](const Statement& statement) { add(statement); });
    return std::move(result_);
  }

 private:
  void add(const Statement& statement) {
    match(
        statement, [&](const Fill& fill) { result_[fill.field]; },
        [&](const Fold& fold) { widen(result_[fold.field], on_bounded_axes(program_, fold.grow)); },
        [&](const Reduce& reduce) {
          result_[reduce.field];
          result_[reduce.result];
        },
        [&](const NetworkCall& network_call) {
          for (const std::string& field : fields_read(network_call)) result_[field];
          for (const std::string& field : fields_written(network_call)) result_[field];
        },
        [&](const Transform& transform) {
          for (const Transform::Term& term : transform.terms) result_[term.field];
          result_[transform.result];
        },
        [&](const Run& run) { add_run(run); },
        [&](const Solve& solve) {
          for (const auto* fields : {&solve.rights, &solve.unknowns}) {
            for (const std::string& field : *fields) result_[field];
          }
          for (const std::string& guess : solve.guesses) result_[guess];
          if (solve.preconditioner) add(*solve.preconditioner);
        },
        ignored<Repeat>);
  }

  void add_run(const Run& run) {
    const Kernel& kernel = kernel_of(module_, run);
    const Halo grown = on_bounded_axes(program_, run.grow);
    visit(kernel, [&](const Expr& part) { add_read_halo(result_, part, grown, program_); });
    for (const Store& store : kernel.stores) widen(result_[store.field], grown);
    for (const Scatter& scatter : kernel.scatters)
      widen(result_[scatter.target.field], on_bounded_axes(program_, reach_of(scatter.target, program_.axes)));
  }

  const Module& module_;
  const Program& program_;
  std::map<std::string, Halo> result_;
};

}  // namespace

std::map<std::string, Halo> required_halo(const Module& module, const Program& program) {
  return RequiredHalo(module, program).take(program.body);
}

}  // namespace dpde::stencil
