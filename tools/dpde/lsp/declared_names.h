// SPDX-License-Identifier: Apache-2.0
// The names that a file declares, and where each is visible.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "syntax/ast.h"

namespace dpde::lsp {

struct DeclaredName {
  std::string name;   // without the indices of an array
  std::string word;   // field, param, scene, ...
  SourceRange range;  // of the name
  SourceRange line;   // its declaration; for a block the first line
  int block = -1;     // index of the enclosing block's declaration; -1: the name is that of a block
  bool is_array = false;
};

std::vector<DeclaredName> declared_names(const SourceFile& source, const ast::File& file);

/// The blocks visible to a block with these names in its first line: the blocks of the names, for a task its scene, for
/// a scene its models.
std::set<int> blocks_known_to(const ast::File& file, const std::vector<std::string>& names_in_head);

/// The name of a block.
const ast::Identifier* name_of(const ast::Declaration& declaration);

/// The first word of a block.
std::string_view word_of(const ast::Declaration& declaration);

}  // namespace dpde::lsp
