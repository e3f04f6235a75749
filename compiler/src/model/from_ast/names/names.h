// SPDX-License-Identifier: Apache-2.0
// Meanings of the names of a scene. A name has one meaning in a problem.
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
  bool is_vector = false;  // its components are declared as well: u.x
};

class Scope {
 public:
  /// Contains x, y, z, t and pi.
  Scope();
  const Symbol* find(const std::string& name) const;
  /// The first declaration of a name wins.
  void declare(const std::string& name, Symbol meaning) { meanings_.emplace(name, meaning); }
  void forget(const std::string& name) { meanings_.erase(name); }
  /// Records a name whose declaration failed, so that its uses cause no further message.
  void refuse(const std::string& name) { refused_.insert(name); }
  /// A component counts as its vector.
  bool is_refused(const std::string& name) const;
  std::vector<std::string> names() const;
  std::vector<std::string> names(Role role) const;

 private:
  std::map<std::string, Symbol> meanings_;
  std::set<std::string> refused_;
};

/// Words of the language or of the levels below it.
bool is_reserved(const std::string& name);

/// The vector of a component: u for u.x; "" for other names.
std::string vector_of(const std::string& name);

/// 0, 1, 2 for x, y, z; -1 for other names.
int axis_of(std::string_view name);
/// "x", "y", "z"
std::string axis_name(int axis);

/// "u" for "dt(u)"; "" for other texts.
std::string rated_field(std::string_view written);
/// For suffix "_t": u_t for u, u_t.x for u.x.
std::string name_beside(const std::string& field, const std::string& suffix);
std::string velocity_name(const std::string& field);
/// The state written as this text: u for "u", u_t for "dt(u)".
std::string state_name(const std::string& written);

/// "did you mean nu?", or the list of candidates if no name is similar.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

/// "1 argument", "2 arguments"
std::string counted(int count, std::string_view what);

}  // namespace dpde::model
