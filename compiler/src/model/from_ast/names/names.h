// SPDX-License-Identifier: Apache-2.0
// What the names of a scene stand for. One name means one thing in a problem.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "source/source_file.h"

namespace dpde::model {

enum class Role { state, coefficient, parameter, datum, let, coordinate, time, constant };

/// "field", "coefficient", ...
std::string_view word_for(Role role);

struct Symbol {
  Role role;
  SourceRange declared;
  int axis = -1;           // of a coordinate
  bool is_vector = false;  // its components are declared as well, as u.x
};

class Scope {
 public:
  /// Knows x, y, z, t and pi.
  Scope();
  const Symbol* find(const std::string& name) const;
  /// The first declaration of a name stays.
  void declare(const std::string& name, Symbol meaning) { meanings_.emplace(name, meaning); }
  void forget(const std::string& name) { meanings_.erase(name); }
  /// That a name was to be declared and could not is told once, not again where it is used.
  void refuse(const std::string& name) { refused_.insert(name); }
  /// Of a component its vector counts.
  bool is_refused(const std::string& name) const;
  std::vector<std::string> names() const;
  std::vector<std::string> names(Role role) const;

 private:
  std::map<std::string, Symbol> meanings_;
  std::set<std::string> refused_;
};

/// Words that the language or the levels below it give a meaning to.
bool is_reserved(const std::string& name);

/// The vector of a component, u of u.x; of other names "".
std::string vector_of(const std::string& name);

/// 0, 1, 2 for x, y, z; -1 for other names.
int axis_of(std::string_view name);
/// "x", "y", "z"
std::string axis_name(int axis);

/// "u" of "dt(u)"; "" of other texts.
std::string rated_field(std::string_view written);
/// u_t of u and "_t", u_t.x of u.x.
std::string name_beside(const std::string& field, const std::string& suffix);
std::string velocity_name(const std::string& field);
/// The state called so in a text: u of "u", u_t of "dt(u)".
std::string state_name(const std::string& written);

/// "did you mean nu?", or what there is to choose from when no name is near.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

/// "1 argument", "2 arguments"
std::string counted(int count, std::string_view what);

}  // namespace dpde::model
