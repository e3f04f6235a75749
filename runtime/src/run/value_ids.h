// SPDX-License-Identifier: Apache-2.0
// Integer ids for the names of a setup and its programs. Names are looked up once, when a rollout is made; steps,
// adjoints and losses use ids. Inside the runtime only.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/rollout.h"

namespace dpde {

/// Equal for equal names of fields, parameters, sums or networks of any program.
using ValueId = int;
constexpr ValueId no_value = -1;

/// The ids of a program's names, in its order.
struct ProgramIds {
  struct Link {
    int kind;
    ValueId primal;
    int derived;
  };
  std::vector<ValueId> fields, params, sums, networks;
  std::vector<Link> links;

  // Indices in the program; -1: absent.
  int field(ValueId id) const { return place(fields, id); }
  int param(ValueId id) const { return place(params, id); }
  int sum(ValueId id) const { return place(sums, id); }
  int network(ValueId id) const { return place(networks, id); }
  /// Index of its derivative in this program: see find_derived().
  int derived(int kind, ValueId primal) const;

 private:
  static int place(const std::vector<ValueId>& ids, ValueId id);
};

/// Index of each value in a list.
class Places {
 public:
  void add(ValueId id, int place);
  /// -1 if it is not in the list.
  int operator[](ValueId id) const {
    return id < 0 || id >= static_cast<int>(places_.size()) ? -1 : places_[static_cast<std::size_t>(id)];
  }
  bool has(ValueId id) const { return (*this)[id] >= 0; }

 private:
  std::vector<int> places_;
};

class ValueIds {
 public:
  static constexpr ValueId t = 0, dt = 1;
  ValueIds();

  /// Adds the name if it is new.
  ValueId add(std::string_view name);
  /// no_value if the name is unknown.
  ValueId find(std::string_view name) const;
  const std::string& name(ValueId id) const { return names_[static_cast<std::size_t>(id)]; }
  ProgramIds of(const dpde_program& program);

 private:
  std::deque<std::string> names_;  // a deque keeps addresses
  std::map<std::string_view, ValueId> known_;
};

/// A setup with resolved names: programs are bound by ids.
class ResolvedSetup : public RolloutSetup {
 public:
  explicit ResolvedSetup(RolloutSetup from);
  ResolvedSetup(const ResolvedSetup&) = delete;
  ResolvedSetup& operator=(const ResolvedSetup&) = delete;

  struct LossIds {
    ValueId sum = no_value, average = no_value;
    std::vector<ValueId> data;
  };

  const ValueIds& values() const { return values_; }
  /// `program` must be one of the setup.
  const ProgramIds& ids(const dpde_program& program) const { return programs_.at(&program); }
  const LossIds& loss(std::size_t term) const { return losses_[term]; }
  ValueId sought_id(std::size_t number) const { return sought_[number]; }
  ValueId rate_field_id() const { return rate_field_; }

  // Indices in the lists of the setup.
  const Places& fields_at() const { return fields_; }
  const Places& params_at() const { return params_; }
  const Places& control_fields_at() const { return control_fields_; }
  const Places& weights_at() const { return weights_; }
  const Places& sought_at() const { return sought_at_; }
  /// Whether the value is one of `rates`.
  bool is_rate(ValueId id) const { return rates_.has(id); }
  /// Index of each average that losses of averages use.
  const Places& averages_at() const { return averages_; }
  std::size_t average_count() const { return average_count_; }

 private:
  void add(const dpde_program* program);
  /// Releases the memory of fields that no program reads.
  void let_go_of_unread();

  ValueIds values_;
  std::map<const dpde_program*, ProgramIds> programs_;
  std::vector<LossIds> losses_;
  std::vector<ValueId> sought_;
  ValueId rate_field_ = no_value;
  std::size_t average_count_ = 0;
  Places fields_, params_, control_fields_, weights_, sought_at_, rates_, averages_;
};

}  // namespace dpde
