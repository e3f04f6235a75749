// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/declared.h"

#include <variant>

#include "source/diagnostic.h"
#include "syntax/parser.h"

namespace dpde::driver {

SourceRange place_of(const SourceFile& source, const std::string& scene, const std::string& task) {
  DiagnosticSink unread;  // discarded: the text was compiled before
  SourceRange place;
  for (const ast::Declaration& declaration : ast::parse(source, unread).declarations) {
    const auto* found = std::get_if<ast::Task>(&declaration.kind);
    const auto* alone = std::get_if<ast::Scene>(&declaration.kind);
    if (found && found->name.name == task) return found->name.range;
    if (alone && alone->name.name == scene) place = alone->name.range;
  }
  return place;
}

}  // namespace dpde::driver
