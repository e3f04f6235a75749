// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/draft.h"

#include <fmt/format.h>

namespace dpde::model {

const std::string* Settings::find(const std::string& key) {
  known_.push_back(key);
  const auto found = texts_.find(key);
  return found == texts_.end() ? nullptr : &found->second;
}

bool declare(Draft& draft, const ast::Identifier& name, Role role) {
  if (is_reserved(name.name)) {
    draft.sink.report("reserved-name", name.range, {name.name, std::string(word_for(role))}, "choose another name");
    return false;
  }
  if (const Meaning* first = draft.scope.find(name.name)) {
    report_duplicate(draft, name.name, name.range, first->declared);
    return false;
  }
  draft.scope.declare(name.name, {role, name.range});
  return true;
}

void report_duplicate(Draft& draft, const std::string& what, SourceRange range, SourceRange first) {
  Diagnostic& diagnostic = draft.sink.report("duplicate", range, {what});
  if (first.is_known()) diagnostic.notes.push_back({first, "the first is here"});
}

const Meaning* find_state(Draft& draft, const ast::Identifier& name, const std::string& thing) {
  const Meaning* meaning = draft.scope.find(name.name);
  if (meaning && meaning->role == Role::state) return meaning;
  const std::vector<std::string> fields = draft.scope.names(Role::state);
  if (!meaning) {
    draft.sink.report("unknown-name", name.range, {name.name}, did_you_mean(name.name, fields));
  } else {
    draft.sink.report("not-a-field", name.range, {name.name, std::string(word_for(meaning->role)), thing});
  }
  return nullptr;
}

}  // namespace dpde::model
