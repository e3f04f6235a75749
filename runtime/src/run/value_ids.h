// SPDX-License-Identifier: Apache-2.0
// Numbers for all that a setup and its programs have names for. They are looked up by their letters once, when a
// rollout is made; what steps, adjoints and losses ask for is asked for by number. Inside the runtime only.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/rollout.h"

namespace dpde {

/// The same for the same name: of a field, a parameter, a sum or a network of any program.
using ValueId = int;
constexpr ValueId no_value = -1;

/// What a program calls by name, in its order.
struct ProgramIds {
  struct Link {
    int kind;
    ValueId primal;
    int derived;
  };
  std::vector<ValueId> fields, params, sums, networks;
  std::vector<Link> links;

  // Indices in the program; -1: it has none.
  int field(ValueId id) const { return place(fields, id); }
  int param(ValueId id) const { return place(params, id); }
  int sum(ValueId id) const { return place(sums, id); }
  int network(ValueId id) const { return place(networks, id); }
  /// Of what became of it in this derivative: see find_derived().
  int derived(int kind, ValueId primal) const;

 private:
  static int place(const std::vector<ValueId>& ids, ValueId id);
};

/// Of a list of values the place of each in it.
class Places {
 public:
  void add(ValueId id, int place);
  /// -1 where it is not in the list.
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

  /// New where the name is.
  ValueId add(std::string_view name);
  /// no_value where nobody has that name.
  ValueId find(std::string_view name) const;
  const std::string& name(ValueId id) const { return names_[static_cast<std::size_t>(id)]; }
  ProgramIds of(const dpde_program& program);

 private:
  std::deque<std::string> names_;  // a deque: they stay where they are
  std::map<std::string_view, ValueId> known_;
};

/// A setup with its names resolved. What is bound by name in a program is bound by these.
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
  /// Of a program of the setup.
  const ProgramIds& ids(const dpde_program& program) const { return programs_.at(&program); }
  const LossIds& loss(std::size_t term) const { return losses_[term]; }
  ValueId sought_id(std::size_t number) const { return sought_[number]; }
  ValueId rate_field_id() const { return rate_field_; }

  // Places in the lists of the setup.
  const Places& fields_at() const { return fields_; }
  const Places& params_at() const { return params_; }
  const Places& control_fields_at() const { return control_fields_; }
  const Places& weights_at() const { return weights_; }
  const Places& sought_at() const { return sought_at_; }
  /// Values of `rates`.
  bool is_rate(ValueId id) const { return rates_.has(id); }
  /// What losses of averages are made of: its number among these.
  const Places& averages_at() const { return averages_; }
  std::size_t average_count() const { return average_count_; }

 private:
  void add(const dpde_program* program);
  /// Of the memory of fields that no program has.
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
