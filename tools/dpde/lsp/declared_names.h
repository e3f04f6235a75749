// SPDX-License-Identifier: Apache-2.0
// The names that a file declares, and which of them are known where.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "syntax/ast.h"

namespace dpde::lsp {

struct DeclaredName {
  std::string name;   // of an array without its indices
  std::string word;   // field, param, scene, ...
  SourceRange range;  // of the name
  SourceRange line;   // of what declares it; of a block its first line
  int block = -1;     // the declaration of the file that it stands in; -1: it is that of a block itself
  bool is_array = false;
};

std::vector<DeclaredName> declared_names(const SourceFile& source, const ast::File& file);

/// The blocks that a block with these names in its first line knows: those of the names, of a task its scene, of a
/// scene its models.
std::set<int> blocks_known_to(const ast::File& file, const std::vector<std::string>& names_in_head);

/// What a block is called.
const ast::Identifier* name_of(const ast::Declaration& declaration);

/// The first word of a block.
std::string_view word_of(const ast::Declaration& declaration);

}  // namespace dpde::lsp
