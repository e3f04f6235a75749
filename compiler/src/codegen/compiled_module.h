// SPDX-License-Identifier: Apache-2.0
// Result of every back end: programs ready to run. Each back end derives a class that also owns the code (the open
// library, the JIT, the interpreter's data). Programs may be called as long as the shared_ptr lives.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "codegen/program_table.h"

namespace dpde::codegen {

class CompiledModule {
 public:
  explicit CompiledModule(ProgramTables tables) : tables_(std::move(tables)) {}
  CompiledModule(const CompiledModule&) = delete;
  CompiledModule& operator=(const CompiledModule&) = delete;
  virtual ~CompiledModule() = default;

  /// Returns nullptr if there is no program of this name.
  const dpde_program* find(const std::string& name) const { return tables_.find(name); }
  std::vector<std::string> names() const { return tables_.names(); }
  void set_links(const std::string& program, const std::vector<TableLink>& links) { tables_.set_links(program, links); }

 protected:
  ProgramTables& tables() { return tables_; }

 private:
  ProgramTables tables_;
};

}  // namespace dpde::codegen
