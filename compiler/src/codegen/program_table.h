// SPDX-License-Identifier: Apache-2.0
// The C structs of kernel_abi.h for the programs of a loop module. ProgramTables owns all strings and arrays. Their
// addresses never change, also when it is moved.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dpde/kernel_abi.h"
#include "loop/loop.h"

namespace dpde::codegen {

/// Code of a row function.
struct RowCode {
  RowCode(dpde_row_fn function = nullptr) : row(function) {}  // NOLINT: a function is code
  dpde_row_fn row;
  std::vector<dpde_variant> variants;
};
/// Returns the code of a loop::Row by name.
using RowResolver = std::function<RowCode(const std::string& row)>;
/// Computes all uniforms of the module (order of Module::uniforms), or only those that depend on a counter. `params`:
/// all parameters, then the counters (order of Module::params and Module::counters).
using ComputeUniforms = void (*)(const double* params, double* uniforms);
using Interpret = void (*)(void* context, const dpde_layout* layout, void* const* fields, const double* params,
                           const dpde_weights* weights, double* sums);

/// See dpde_link. Kinds are DPDE_LINK_FIELD, DPDE_LINK_PARAM, DPDE_LINK_SUM.
struct TableLink {
  int kind;
  std::string primal;
  int derived_kind;
  std::string derived;
};

class ProgramTables {
 public:
  /// An interpreter that needs no code passes {} and nullptr, then calls set_interpreter for each program.
  ProgramTables(const loop::Module& module, const RowResolver& row_code, ComputeUniforms compute_uniforms,
                ComputeUniforms compute_counted = nullptr);
  ~ProgramTables();
  ProgramTables(ProgramTables&&) noexcept;
  ProgramTables& operator=(ProgramTables&&) noexcept;

  /// Returns nullptr if there is no program of this name.
  const dpde_program* find(const std::string& name) const;
  /// Names in the order of the module.
  std::vector<std::string> names() const;
  /// Sets the links of a derivative program. The index is -1 if the program has no such field, param or sum.
  void set_links(const std::string& program, const std::vector<TableLink>& links);
  void set_interpreter(const std::string& program, Interpret interpret, void* context);

 private:
  struct Strings;
  struct Table;
  std::unique_ptr<Strings> strings_;  // parameter names, shared by all tables
  std::vector<std::unique_ptr<Table>> tables_;
};

}  // namespace dpde::codegen
