// SPDX-License-Identifier: Apache-2.0
// Dependence on the unknowns of a task: which values of a run change with them, and which of these are differentiable.
// Conditions, sign and the length of steps pass on changes but no derivative.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "model/model.h"
#include "model/uses.h"

namespace dpde::model {

/// Names in an expression: of fields, parameters and networks.
struct NamesRead {
  std::set<std::string> smooth, any;  // any: all names; smooth: those with a derivative
};
NamesRead names_read(const Expr& e);

/// A formula of a run.
struct Formula {
  std::string makes;  // a state or a coefficient; "": a loss
  const Expr* value;
  UseKind kind;
  bool is_of_loss = false;
  bool is_of_length = false;  // of the length of steps, which has no derivative
};
/// All formulas on which the task's losses can depend, except those of a hand-written step.
void for_each_formula_of_run(const Problem& problem, const std::function<void(const Formula&)>& f);

class Influence {
 public:
  /// Requires problem.task. `program`: names that a hand-written step reads.
  Influence(const Problem& problem, const NamesRead& program);

  /// Indices in task.unknowns.
  using Unknowns = std::set<std::size_t>;
  struct Reach {
    Unknowns smooth, any;
    bool operator==(const Reach&) const = default;
  };
  /// The unknowns that influence a state, coefficient, parameter or network.
  const Reach& on(const std::string& name) const;
  Reach on(const NamesRead& reading) const;
  const Reach& on_losses() const { return losses_; }
  /// Whether a loss can depend on it.
  bool reaches_losses(const std::string& name) const { return wanted_.contains(name); }

 private:
  struct Edge {
    std::string to;
    NamesRead from;
  };
  void add_edges(const Problem& problem, const NamesRead& program);
  void add_edge(const std::string& to, const std::string& from) { edges_.push_back({to, {{from}, {from}}}); }
  void spread();
  void look_back(const NamesRead& losses);

  std::vector<Edge> edges_;
  std::map<std::string, Reach> reached_;
  std::set<std::string> wanted_;
  Reach losses_, none_;
};

}  // namespace dpde::model
